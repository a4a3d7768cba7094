#!/usr/bin/env python3
"""What each part of the method is worth: gonogo compiled and judged without it, on held-out renders and on photos.

    python tools/ablation/ablation.py                                    station C of the pattern wheel, photos that ship with it
    python tools/ablation/ablation.py --set B=spec.gng:B:photos:B_calibration.png --set …
    python tools/ablation/ablation.py --row everything --row tails       only these rows: labels, or names of single switches
    python tools/ablation/ablation.py --list

A copy of the tree is made in the scratch folder, the edits of switches.toml are made in it, each behind a switch, and it is built
once. Then each row compiles the specs of all sets with its switches thrown (from the same rendered shots, which are kept), judges
the photos of each with each of its calibration photos, and counts by the labels. The rows of `benches/classical.py` follow: they
judge the same photos and are given what gonogo does not need, scores of correct photos to set a threshold by.

--set NAME=SPEC:STATION:FOLDER:CALIBRATION[+CALIBRATION…]   STATION may be empty
Labels: FOLDER/labels.json (photo: station, defect or null), FOLDER/labels.txt (`photo: good` or `photo: component, fault`), or
photos named NNN_1011.jpg, a digit for each of the components named by --numbered (a missing one is 0).

Prints a Markdown table; SCRATCH/ablation.tsv has a line for each row and set. Needs Python 3.11, cargo, and for the classical rows
opencv-python-headless.
"""
import argparse
import collections
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# All that a shot depends on beside its spec.
RENDERER = ["assembly", "design", "render", "scene", "solid", "syntax", "view", "cache", "rng.rs", "units.rs", "variation.rs"]
RENDERER += [f"train/{name}.rs" for name in ("kept", "plan", "shots", "synthesise", "exposing")]
RENDERER += [f"runtime/{name}.rs" for name in ("camera", "grid", "pose", "math")]
SHIPPED = "C=specs/pattern_wheel.gng:C:specs/pattern_wheel/photos:C_calibration.png"


class Set:
    """A station and its labelled photos."""

    def __init__(self, text, numbered):
        self.name, rest = text.split("=", 1)
        spec, self.station, folder, calibrations = rest.split(":")
        self.spec, self.folder = Path(spec).resolve(), Path(folder).resolve()
        self.calibrations = [self.folder / name for name in calibrations.split("+")]
        self.labels = labels(self.folder, self.station, numbered)

    def photos(self, calibration):
        return [path for path in sorted(self.folder.iterdir()) if path.stem in self.labels and path != calibration]


def labels(folder, station, numbered):
    """By stem of the photo the set of faulty components, empty for a correct assembly."""
    if (folder / "labels.json").exists():
        table = json.loads((folder / "labels.json").read_text())
        own = {name: of for name, of in table.items() if of.get("station", station) == station or not station}
        return {name: {plain(of["defect"]["part"])} if of["defect"] else set() for name, of in own.items()}
    if (folder / "labels.txt").exists():
        found = {}
        for line in (folder / "labels.txt").read_text().splitlines():
            photo, _, truth = line.split("#")[0].strip().partition(": ")
            if photo:
                found[Path(photo).stem] = set() if truth == "good" else {plain(truth.split(", ")[0])}
        return found
    stems = [path.stem for path in folder.iterdir() if re.fullmatch(r"\d+_[01]+", path.stem)]
    digits = lambda stem: enumerate(stem.split("_")[1])
    return {stem: {plain(numbered.format(i + 1)) for i, digit in digits(stem) if digit == "0"} for stem in stems}


def plain(component):
    """`pin[2]` and `pin_2` are the same."""
    return re.sub(r"\[(\d+)\]", r"_\1", component)


class Count(collections.Counter):
    """False rejects, escapes, photos that could not be judged and wrongly named components, of how many."""

    def see(self, faulty, verdict, blamed):
        self["faulty" if faulty else "good"] += 1
        if verdict == "cannot-inspect":
            self["cannot"] += 1
        elif verdict == "no-go" and not faulty:
            self["reject"] += 1
        elif verdict == "go" and faulty:
            self["escape"] += 1
        elif verdict == "no-go" and not faulty & {plain(name) for name in blamed}:
            self["wrong"] += 1

    def cells(self):
        rates = [(self["reject"], self["good"]), (self["escape"], self["faulty"])]
        return [*(f"{events} of {trials}" for events, trials in rates), str(self["cannot"]), str(self["wrong"])]


# --- The tree with switches -------------------------------------------------------------------------------------------


def build(scratch, table, cargo_args):
    """The program with switches."""
    tree = scratch / "tree"
    made = {path: path.read_bytes() for path in sources()}
    for edit in table["always"] + table["change"]:
        path = ROOT / edit["file"]
        text = made[path].decode()
        if text.count(edit["old"]) != 1:
            sys.exit(f"{edit['file']} has not exactly one\n{edit['old']}")
        made[path] = text.replace(edit["old"], edit["new"]).encode()
    for path, content in made.items():
        copy = tree / path.relative_to(ROOT)
        # A file that does not change keeps its time, so that a second build is short.
        if not copy.exists() or copy.read_bytes() != content:
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(content)
    for path in tree.rglob("src/**/*.rs"):
        if ROOT / path.relative_to(tree) not in made:
            path.unlink()
    target = Path(os.environ.get("CARGO_TARGET_DIR", scratch / "target"))
    command = ["cargo", "build", "--release", "--bin", "gonogo", "--manifest-path", tree / "Cargo.toml", *cargo_args]
    subprocess.run([*map(str, command), "--target-dir", str(target)], check=True)
    program = scratch / "gonogo"
    shutil.copy2(target / "release/gonogo", program)
    return program


def sources():
    """All that cargo reads, and what the sources include."""
    folders = [ROOT / name for name in ("src", "specs", "grammar", "editors", "include", "benches")]
    files = [path for folder in folders for path in folder.rglob("*") if path.is_file()]
    return [*files, *(ROOT / name for name in ("Cargo.toml", "Cargo.lock"))]


def renderer():
    """A digest of what renders: shots of another one are not found."""
    digest = hashlib.sha256()
    for name in RENDERER:
        path = ROOT / "src" / name
        for source in sorted(path.rglob("*.rs")) if path.is_dir() else [path]:
            digest.update(source.read_bytes())
    return digest.hexdigest()


def run(program, arguments, without, ok=(0, 1)):
    environment = {**os.environ, "GONOGO_WITHOUT": ",".join(without)}
    environment.setdefault("GONOGO_RENDERER", renderer())
    done = subprocess.run([str(program), *map(str, arguments)], env=environment, capture_output=True, text=True)
    if done.returncode not in ok:
        sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr.strip()[-2000:]}")
    return done


# --- A row ---------------------------------------------------------------------------------------------------------------


def model_of(scratch, row):
    return lambda of: scratch / f"{row}.{of.name}.model.ron"


def compile_row(program, scratch, row, without, of):
    """The model of a set without something."""
    model = model_of(scratch, row)(of)
    station = ["--station", of.station] if of.station else []
    run(program, ["compile", of.spec, *station, "-o", model], without)
    if not model.exists():
        sys.exit(f"{of.spec} does not compile without {', '.join(without)}")
    return model


def held_out(model):
    """False rejects and escapes of held-out renders, with numbers of trials."""
    head = model.read_text()
    rate = lambda name: re.search(rf"\b{name}: \(\s*events: (\d+),\s*trials: (\d+)", head[head.index(" promise:") :])
    return [tuple(map(int, rate(name).groups())) for name in ("false_reject", "escape")]


def judge(program, scratch, row, without, of, model):
    """Counts over all photos, once for each calibration photo."""
    count, stored = Count(), []
    for number, photo in enumerate(of.calibrations):
        calibration = scratch / f"{row}.{of.name}.{number}.calibration.ron"
        calibration.unlink(missing_ok=True)
        refused = run(program, ["calibrate", model, photo, "-o", calibration], without)
        photos = of.photos(photo)
        if not calibration.exists():
            print(f"{row}, {of.name}: {photo.name} is refused: {refused.stderr.strip()}", file=sys.stderr)
            for path in photos:
                count.see(of.labels[path.stem], "cannot-inspect", [])
            continue
        done = run(program, ["inspect", model, "--calibration", calibration, "--format", "json", *photos], without, (0, 1, 2))
        for verdict in map(json.loads, done.stdout.splitlines()):
            blamed = [finding[key] for finding in verdict["findings"] for key in ("component", "error_tree")]
            count.see(of.labels[Path(verdict["photo"]).stem], verdict["verdict"], blamed)
            stored.append(verdict)
    (scratch / f"{row}.{of.name}.json").write_text("\n".join(map(json.dumps, stored)))
    return count


def classical_rows(scratch, sets):
    """What OpenCV makes of the same photos: by label the count of each set."""
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(ROOT / "benches"))
    import classical

    rows = collections.defaultdict(dict)
    for of in sets:
        counts = collections.defaultdict(Count)
        for number, photo in enumerate(of.calibrations):
            boxes = classical.boxes(model_of(scratch, "everything")(of), scratch / f"everything.{of.name}.{number}.calibration.ron")
            images = {path.stem: classical.grey(path) for path in of.photos(photo)}
            goods = {name: image for name, image in images.items() if not of.labels[name]}
            faulty = {name: image for name, image in images.items() if of.labels[name]}
            for inspector in classical.ALL:
                if len(goods) < 3:
                    continue
                scores = classical.scored(inspector, classical.grey(photo), goods, faulty, boxes)
                for after in (False, True):
                    how = "best threshold after the fact" if after else "threshold from the correct photos"
                    taught = min(inspector.teachers, len(goods) if inspector.teachers > 1 else 1)
                    label = f"{inspector.name} ({taught} photo{'s'[: taught > 1]}, {how})"
                    for name, blamed in classical.verdicts(scores, list(goods), after).items():
                        counts[label].see(of.labels[name], "no-go" if blamed else "go", [blamed] if blamed else [])
        for label, count in counts.items():
            rows[label][of.name] = count
    return rows


# --- The table -------------------------------------------------------------------------------------------------------------


def table_line(cells):
    return "| " + " | ".join(cells) + " |"


def summed(counts):
    total = Count()
    for count in counts:
        total.update(count)
    return total


def chosen(table, wanted):
    """The rows asked for: by label, or by the name of a switch that is thrown alone; everything is always the first."""
    rows = table["row"]
    if not wanted:
        return rows
    fits = lambda row: row["label"] in wanted or (len(row["without"]) == 1 and row["without"][0] in wanted) or not row["without"]
    return [row for row in rows if fits(row)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--set", action="append", metavar="NAME=SPEC:STATION:FOLDER:CALIBRATION")
    parser.add_argument("--row", action="append", metavar="LABEL")
    parser.add_argument("--list", action="store_true", help="say what can be taken out and end")
    parser.add_argument("--numbered", default="screw[{}]", help="component of the n-th digit in a photo's name")
    parser.add_argument("--scratch", type=Path, default=ROOT / "target/ablation")
    parser.add_argument("--program", type=Path, help="a program with switches that was built before")
    parser.add_argument("--no-classical", action="store_true", help="leave out OpenCV's rows")
    parser.add_argument("--cargo", action="append", default=[], help="more arguments for cargo build")
    args = parser.parse_args()
    table = tomllib.loads((HERE / "switches.toml").read_text())
    if args.list:
        print("\n".join(f"{switch['name']:<12} {switch['takes']}: {switch['why']}" for switch in table["switch"]))
        return
    scratch = args.scratch.resolve()
    scratch.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("GONOGO_CACHE_DIR", str(scratch / "cache"))
    os.chdir(ROOT)
    sets = [Set(text, args.numbered) for text in args.set or [SHIPPED]]
    program = args.program or build(scratch, table, args.cargo)
    details = (scratch / "ablation.tsv").open("a", encoding="utf-8")
    heads = ["", "held-out false rejects", "held-out escapes", "photos: false rejects", "escapes", "cannot inspect", "wrong component"]
    print(table_line(heads) + "\n" + table_line(["---"] * len(heads)), flush=True)
    rate = lambda events, trials: f"{events} of {trials}"
    for row in chosen(table, args.row):
        rates, counts = [], []
        key = "+".join(row["without"]) or "everything"
        for of in sets:
            model = compile_row(program, scratch, key, row["without"], of)
            rates.append(held_out(model))
            counts.append(judge(program, scratch, key, row["without"], of, model))
            promised = [rate(*of_set) for of_set in rates[-1]]
            print("\t".join([row["label"], of.name, *promised, *counts[-1].cells()]), file=details, flush=True)
        promised = [rate(*map(sum, zip(*of_sets))) for of_sets in zip(*rates)]
        print(table_line([row["label"], *promised, *summed(counts).cells()]), flush=True)
    if not args.no_classical:
        for label, counts in classical_rows(scratch, sets).items():
            for name, count in counts.items():
                print("\t".join([label, name, "", "", *count.cells()]), file=details, flush=True)
            print(table_line([label, "–", "–", *summed(counts.values()).cells()]), flush=True)


if __name__ == "__main__":
    main()
