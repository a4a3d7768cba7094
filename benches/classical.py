"""What is usually done in place of gonogo: three inspectors of OpenCV and NumPy, taught by photos of correct assemblies.

    Templates   one photo; the assembly and then every component searched by rotated and scaled templates (TM_CCOEFF_NORMED)
    Ssim        one photo; the other aligned to it (ECC, homography), structural similarity in the box of every component
    Padim       many photos; per place a Gaussian of gradients and grey values (PaDiM with plain features)

Each scores every component of a photo, higher is worse. None has a threshold of its own: `verdicts` offers one from the scores of
correct photos, and one set after the fact. The boxes of components, which somebody would draw, are taken from a model and
its calibration: what is visible of each component, where it stands in the calibration photo.

Needs opencv-python-headless and numpy.
"""
import math
import re
import time

import cv2
import numpy as np

cv2.setNumThreads(1)


def grey(path):
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise SystemExit(f"cannot read the image {path}")
    return image


# --- Boxes of components in the calibration photo ---------------------------------------------------------------------


def number(text, key):
    return float(re.search(rf"\b{key}: ([-0-9.e]+)", text)[1])


def numbers(text, key):
    found = re.search(rf"\b{key}: (\((?:[^()]|\([^()]*\))*\))", text)[1]
    return [float(v) for v in re.findall(r"-?\d[-0-9.e]*", found)]


class Camera:
    """As `src/runtime/camera.rs` and `pose.rs` have it."""

    def __init__(self, station, installation=None):
        self.position = np.array(numbers(station, "position"))
        self.axes = np.array(numbers(station, "axes")).reshape(3, 3)
        self.focal, self.k1 = number(station, "focal"), number(station, "k1")
        self.k2 = number(station, "k2") if "k2:" in station else 0.0
        self.centre = np.array(numbers(station, "centre"))
        if installation:
            self.install(installation)

    def install(self, text):
        self.position = self.position + numbers(text, "offset")
        turn = np.array(numbers(text, "turn")) @ self.axes
        right, _, forward = (axis + np.cross(turn, axis) for axis in self.axes)
        forward = forward / np.linalg.norm(forward)
        right = right - (right @ forward) * forward
        right = right / np.linalg.norm(right)
        self.axes = np.array([right, np.cross(forward, right), forward])
        self.focal *= 1.0 + number(text, "focal")
        self.k1 += number(text, "k1")

    def stretch(self, point):
        r2 = (point @ point) / self.centre[0] ** 2
        return 1.0 + self.k1 * r2 + self.k2 * r2 * r2

    def project(self, p):
        x, y, z = self.axes @ (p - self.position)
        point = np.array([x, y]) * self.focal / z
        return point * self.stretch(point) + self.centre

    def on_plane(self, pixel, z):
        seen = np.array(pixel) - self.centre
        point = seen
        for _ in range(30):
            point = seen / self.stretch(point)
        ray = np.append(point / self.focal, 1.0) @ self.axes
        return self.position + ray * (z - self.position[2]) / ray[2]


def turned(p, x, y, z, rz):
    c, s = math.cos(rz), math.sin(rz)
    return np.array([c * p[0] - s * p[1] + x, s * p[0] + c * p[1] + y, p[2] + z])


def boxes(model, calibration):
    """By component the box (x0, y0, x1, y1 in px) of what is visible of it in the calibration photo."""
    station, nodes = open(model, encoding="utf-8").read().split("\n nodes: [", 1)
    fit = open(calibration, encoding="utf-8").read().split("references:", 1)[0]
    nominal, real = Camera(station), Camera(station, fit)
    standing = numbers(station, "standing")
    home = [sum(standing[i : i + 2]) / 2 for i in range(0, 8, 2)]
    pose = [number(fit.split("poses:")[1], key) for key in ("x", "y", "z", "rz")]
    found = {}
    for node in re.split(r"\n  \(\n(?=   name:)", nodes)[1:]:
        head = node[:2000]
        x0, y0, x1, y1 = numbers(head, "visible")
        plane = number(head, "plane")

        def carried(corner):
            x, y, z = nominal.on_plane(corner, plane + home[2])
            # Home is not turned where the station is described symmetrically, but it may be.
            c, s = math.cos(home[3]), math.sin(home[3])
            dx, dy = x - home[0], y - home[1]
            return real.project(turned((c * dx + s * dy, -s * dx + c * dy, z - home[2]), *pose))

        corners = np.array([carried(corner) for corner in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
        (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
        found[re.search(r'name: "([^"]+)"', head)[1]] = (left, top, right, bottom)
    return found


def cut(image, box, margin=(0, 0, 0, 0)):
    """The pixels of a box with so much more on each side (left, above, right, below), and its corner."""
    height, width = image.shape[:2]
    x0, y0 = (max(0, int(round(box[i])) - margin[i]) for i in (0, 1))
    x1, y1 = (min(size, int(round(box[i])) + margin[i]) for i, size in ((2, width), (3, height)))
    return image[y0:y1, x0:x1], (x0, y0)


# --- Templates --------------------------------------------------------------------------------------------------------


class Templates:
    """Rotated template search: first the whole assembly from coarse to fine, then every component round its place."""

    name = "rotated templates"
    teachers = 1
    # The station's turns and what the calibration photo may have of them, in steps that move the rim by half a coarse px.
    TURNS = np.arange(-10.0, 10.1, 2.0)
    SCALES = (0.99, 1.0, 1.01)
    LEVELS = 3
    # A component is searched so far round its place (px), and turned and scaled by one step each way; one whose template is larger
    # than this at half the size.
    REACH = 6
    LARGE = 96
    TURN = 1.0
    MARGIN = 4

    def __init__(self, photos, boxes):
        self.golden, self.boxes = photos[0], boxes
        hull = np.array(list(boxes.values()))
        self.hull = np.concatenate([hull[:, :2].min(axis=0), hull[:, 2:].max(axis=0)])
        self.centre = (self.hull[:2] + self.hull[2:]) / 2
        self.milliseconds = {}
        self.made = {}

    def template(self, box, margin, factor, turn, scale):
        """What a box shows, and its corner, in the golden photo turned and scaled about the assembly's middle and reduced;
        made once: teaching would make the whole bank."""
        key = (*np.round(box, 1), factor, round(float(turn), 3), round(scale, 4))
        if key not in self.made:
            matrix = cv2.getRotationMatrix2D(tuple(self.centre), turn, scale)
            golden = cv2.warpAffine(self.golden, matrix, self.golden.shape[::-1], flags=cv2.INTER_LINEAR)
            golden = reduced(golden, factor)
            middle = matrix @ np.array([(box[0] + box[2]) / 2, (box[1] + box[3]) / 2, 1.0])
            half = np.array([box[2] - box[0], box[3] - box[1]]) / 2 + margin
            template, corner = cut(golden, np.array([*(middle - half), *(middle + half)]) / factor)
            self.made[key] = (template.copy(), corner)
        return self.made[key]

    def pose(self, pyramid):
        """Turn, scale and shift (px) of the assembly: its middle, which is there whatever turns and leaves room to move."""
        middle = [*(self.hull[:2] * 0.8 + self.centre * 0.2), *(self.hull[2:] * 0.8 + self.centre * 0.2)]
        candidates = [(turn, scale, None) for turn in self.TURNS for scale in self.SCALES]
        step = self.TURNS[1] - self.TURNS[0]
        for level in range(self.LEVELS, -1, -1):
            found = []
            for turn, scale, near in candidates:
                template, corner = self.template(middle, 0, 2**level, turn, scale)
                reach = None if near is None else 3
                score, shift = best(pyramid[level], template, corner, np.multiply(near or (0, 0), 2), reach)
                found.append((score, turn, scale, shift))
            found.sort(key=lambda f: -f[0])
            step /= 2
            candidates = [(turn + d, scale, shift) for _, turn, scale, shift in found[:2] for d in (-step, 0.0, step)]
        return found[0][1:]

    def scores(self, photo):
        start = time.perf_counter()
        pyramid = [reduced(photo, 2**level) for level in range(self.LEVELS + 1)]
        turn, scale, shift = self.pose(pyramid)
        located = time.perf_counter()
        out = {name: 1.0 - self.component(pyramid, box, turn, scale, shift) for name, box in self.boxes.items()}
        ended = time.perf_counter()
        self.milliseconds = {"assembly": (located - start) * 1e3, "components": (ended - located) * 1e3}
        return out

    def component(self, pyramid, box, turn, scale, shift):
        """The best correlation of a component's template with what lies round its place; of large ones at half the size."""
        level = int(min(box[2] - box[0], box[3] - box[1]) > self.LARGE)
        factor, turn = 2**level, round(turn / self.TURN) * self.TURN
        highest = -1.0
        for d in (-self.TURN, 0.0, self.TURN):
            for s in self.SCALES:
                template, corner = self.template(box, self.MARGIN, factor, turn + d, scale * s)
                score, _ = best(pyramid[level], template, corner, np.divide(shift, factor), self.REACH // factor)
                highest = max(highest, score)
        return highest


def reduced(image, factor):
    size = tuple(int(s / factor) for s in image.shape[::-1])
    return image if factor == 1 else cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def best(image, template, corner, shift, reach):
    """The highest correlation of a template that lies at `corner` plus `shift`, give or take `reach` (anywhere if `None`), and its
    shift."""
    window, origin = image, (0, 0)
    if reach is not None:
        at = np.add(corner, np.round(shift))
        window, origin = cut(image, [*at, *(at + template.shape[::-1])], (reach,) * 4)
    if not template.size or window.shape[0] < template.shape[0] or window.shape[1] < template.shape[1]:
        return -1.0, tuple(shift)
    _, score, _, at = cv2.minMaxLoc(cv2.matchTemplate(window, template, cv2.TM_CCOEFF_NORMED))
    return score, tuple(int(v) for v in np.add(at, origin) - corner)


# --- Alignment, structural similarity, Gaussians per place --------------------------------------------------------------


def aligned(photo, golden):
    """The photo as the golden one lies: affine at a quarter of the size from several turns, then a homography (ECC)."""
    quarter = [cv2.resize(image, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA) for image in (golden, photo)]
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-4)
    best, found = -1.0, np.eye(2, 3, dtype=np.float32)
    middle = (quarter[0].shape[1] / 2, quarter[0].shape[0] / 2)
    for turn in (-6.0, -3.0, 0.0, 3.0, 6.0):
        start = cv2.getRotationMatrix2D(middle, turn, 1.0).astype(np.float32)
        try:
            score, warp = cv2.findTransformECC(quarter[0], quarter[1], start, cv2.MOTION_AFFINE, stop, None, 5)
        except cv2.error:
            continue
        if score > best:
            best, found = score, warp
    warp = np.vstack([found, [0, 0, 1]]).astype(np.float32)
    grow, shrink = np.diag([4, 4, 1]).astype(np.float32), np.diag([0.25, 0.25, 1]).astype(np.float32)
    # Pixel centres lie half a px from the corner at every size.
    half = np.array([[1, 0, 1.5], [0, 1, 1.5], [0, 0, 1]], np.float32)
    warp = (half @ grow @ warp @ shrink @ np.linalg.inv(half)).astype(np.float32)
    try:
        _, warp = cv2.findTransformECC(golden, photo, warp, cv2.MOTION_HOMOGRAPHY, stop, None, 5)
    except cv2.error:
        pass
    return cv2.warpPerspective(photo, warp, golden.shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)


# What is visible of a component, and a band above it in which it would show if it stood too high (px).
ABOVE = (0, 12, 0, 0)


class Ssim:
    """Structural similarity with one golden photo, the mean over each component's box."""

    name = "alignment and SSIM"
    teachers = 1

    def __init__(self, photos, boxes):
        self.golden, self.boxes = photos[0], boxes
        self.milliseconds = {}

    def scores(self, photo):
        start = time.perf_counter()
        moved = aligned(photo, self.golden)
        found = time.perf_counter()
        likeness = similarity(moved, self.golden)
        out = {name: 1.0 - float(cut(likeness, box, ABOVE)[0].mean()) for name, box in self.boxes.items()}
        self.milliseconds = {"alignment": (found - start) * 1e3, "components": (time.perf_counter() - found) * 1e3}
        return out


def similarity(a, b):
    """Wang et al. 2004, with their Gaussian window of 1.5 px."""
    a, b = a.astype(np.float32), b.astype(np.float32)
    mean = lambda image: cv2.GaussianBlur(image, (11, 11), 1.5)
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    ma, mb = mean(a), mean(b)
    va, vb, vab = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    return ((2 * ma * mb + c1) * (2 * vab + c2)) / ((ma * ma + mb * mb + c1) * (va + vb + c2))


class Padim:
    """Per place a Gaussian of simple features over many correct photos (Defard et al. 2021); Mahalanobis distances."""

    name = "Gaussian per place"
    teachers = 9
    STEP = 4

    def __init__(self, photos, boxes):
        self.golden, self.boxes = photos[0], boxes
        self.milliseconds = {}
        seen = np.stack([self.features(photos[0])] + [self.features(aligned(p, photos[0])) for p in photos[1:]])
        self.mean = seen.mean(axis=0)
        rest = seen - self.mean
        pooled = np.einsum("nyxi,nyxj->ij", rest, rest) / rest[..., 0].size
        own = np.einsum("nyxi,nyxj->yxij", rest, rest) / max(len(photos) - 1, 1)
        # A few photos do not fill a covariance: half of it is that of all places.
        self.inverse = np.linalg.inv(0.5 * own + 0.5 * pooled + 1e-3 * np.trace(pooled) / len(pooled) * np.eye(len(pooled)))

    def features(self, image):
        """Grey value, gradients and their scatter at three sizes, every few px."""
        image = image.astype(np.float32)
        maps = []
        for sigma in (1.0, 2.0, 4.0):
            smooth = cv2.GaussianBlur(image, (0, 0), sigma)
            gradient = [cv2.Sobel(smooth, cv2.CV_32F, *d, ksize=3) * sigma / 8 for d in ((1, 0), (0, 1))]
            maps += [smooth, *gradient, cv2.GaussianBlur(np.hypot(*gradient), (0, 0), sigma)]
        return np.stack([m[:: self.STEP, :: self.STEP] for m in maps], axis=-1)

    def scores(self, photo):
        start = time.perf_counter()
        moved = aligned(photo, self.golden)
        found = time.perf_counter()
        rest = self.features(moved) - self.mean
        far = np.sqrt(np.einsum("yxi,yxij,yxj->yx", rest, self.inverse, rest))
        far = cv2.resize(far, moved.shape[::-1], interpolation=cv2.INTER_LINEAR)
        out = {name: float(cut(far, box, ABOVE)[0].max()) for name, box in self.boxes.items()}
        self.milliseconds = {"alignment": (found - start) * 1e3, "components": (time.perf_counter() - found) * 1e3}
        return out


ALL = (Templates, Ssim, Padim)


# --- Verdicts ----------------------------------------------------------------------------------------------------------


def scored(inspector, calibration, goods, faulty, boxes):
    """Scores of every photo by name. Correct photos that teach are left out one by one; `goods` and `faulty` are images by
    name."""
    out = {}
    if inspector.teachers == 1:
        one = inspector([calibration], boxes)
        return {name: one.scores(photo) for name, photo in {**goods, **faulty}.items()}
    for name, photo in goods.items():
        rest = [other for key, other in goods.items() if key != name]
        out[name] = inspector([calibration, *rest][: inspector.teachers + 1], boxes).scores(photo)
    every = inspector([calibration, *goods.values()][: inspector.teachers + 1], boxes)
    out.update({name: every.scores(photo) for name, photo in faulty.items()})
    return out


def verdicts(scores, goods, after_the_fact):
    """By photo the component that is blamed, or `None`. Scores of components are divided by the middle of what correct photos
    show there. The threshold is mean and three standard deviations of the correct photos' scores (of the others, for a
    correct photo), or, after the fact, the worst correct photo."""
    usual = {c: float(np.median([scores[g][c] for g in goods])) or 1.0 for c in next(iter(scores.values()))}
    worst = {photo: max((of[c] / usual[c], c) for c in of) for photo, of in scores.items()}
    out = {}
    for photo, (score, component) in worst.items():
        others = [worst[g][0] for g in goods if g != photo]
        limit = max(worst[g][0] for g in goods) if after_the_fact else np.mean(others) + 3 * np.std(others, ddof=1)
        out[photo] = component if score > limit else None
    return out
