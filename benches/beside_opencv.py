#!/usr/bin/env python3
"""Times gonogo by part beside OpenCV's rotated template search: the same photos in turn, on one core, with both verdicts.

    python benches/beside_opencv.py GONOGO MODEL [CALIBRATION_PHOTO [FOLDER]]      needs `pip install opencv-python-headless`

Without more than the model: the photos of the pattern wheel that ship, station C. Each round judges every photo once with
gonogo, which goes on running with its model loaded, and then with OpenCV; the first round is not counted. OpenCV's templates are
cut from the calibration photo and turned beforehand; its threshold is the best there is for these photos, set after the fact.
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ONE = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM", "RAYON_NUM_THREADS")}
os.environ.update(ONE)
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

sys.dont_write_bytecode = True

import time

import classical

ROUNDS = 7
FOLDER = Path(__file__).resolve().parents[1] / "specs/pattern_wheel/photos"


class Gonogo:
    """One process that judges photo after photo."""

    def __init__(self, program, model, calibration):
        arguments = ["inspect", model, "-", "--calibration", calibration, "--format", "json"]
        arguments += ["--timings", "--message-format", "json"]
        self.process = subprocess.Popen([program, *map(str, arguments)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def judge(self, photo):
        """The verdict, and milliseconds by part."""
        self.process.stdin.write(f"{photo}\n")
        self.process.stdin.flush()
        verdict, timings = (json.loads(self.process.stdout.readline()) for _ in range(2))
        parts = {part["part"]: part["milliseconds"] for part in timings["timings"]["parts"]}
        return verdict, {**parts, "total": timings["timings"]["total"]}

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def opencv(search, photo):
    start = time.perf_counter()
    image = classical.grey(photo)
    decoded = time.perf_counter()
    scores = search.scores(image)
    parts = {"decode": (decoded - start) * 1e3, **search.milliseconds, "total": (time.perf_counter() - start) * 1e3}
    return scores, parts


def table(name, rounds):
    print(f"\n{name:<24} {'least':>9} {'median':>9} {'most':>9}   share")
    whole = sum(parts["total"] for parts in rounds)
    for part in rounds[0]:
        own = [parts[part] for parts in rounds]
        share = 100 * sum(own) / whole
        print(f"{part:<24} {min(own):>9.2f} {statistics.median(own):>9.2f} {max(own):>9.2f} ms {share:>3.0f} %")


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    program, model, *rest = sys.argv[1:]
    teacher = Path(rest[0]) if rest else FOLDER / "C_calibration.png"
    folder = Path(rest[1]) if rest[1:] else teacher.parent
    photos = [path for path in sorted(folder.glob("*.png")) if path.resolve() != teacher.resolve()]
    with tempfile.TemporaryDirectory() as scratch:
        calibration = Path(scratch) / "calibration.ron"
        subprocess.run([program, "calibrate", model, str(teacher), "-o", str(calibration)], check=True)
        boxes = classical.boxes(model, calibration)
        search = classical.Templates([classical.grey(teacher)], boxes)
        gonogo = Gonogo(program, model, calibration)
        ours, theirs, verdicts, scores = [], [], {}, {}
        for counts in range(ROUNDS + 1):
            for photo in photos:
                verdict, times = gonogo.judge(photo)
                found, other = opencv(search, photo)
                verdicts[photo.stem], scores[photo.stem] = verdict, found
                if counts:
                    ours.append(times)
                    theirs.append(other)
        gonogo.end()
    print(f"{len(photos)} photos, {ROUNDS} times each in turn, one core, {len(boxes)} components")
    table("gonogo", ours)
    table(f"OpenCV {classical.cv2.__version__}, {search.name}", theirs)
    goods = [name for name in scores if "good" in name]
    print(f"\n{'photo':<16} {'gonogo':<40} OpenCV")
    blamed = classical.verdicts(scores, goods, after_the_fact=True) if goods else {}
    for name, verdict in verdicts.items():
        print(f"{name:<16} {verdict['reason'] or verdict['verdict']:<40} {blamed.get(name) or 'go'}")


if __name__ == "__main__":
    sys.exit(main())
