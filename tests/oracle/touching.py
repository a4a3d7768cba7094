"""Whether a part touches itself along a line, so that its boundary is no manifold.

Two tests that miss different things: probing round the lines in which cylinders touch cylinders and planes, and Open
CASCADE's search for faces that meet where they share no edge.
"""

import numpy as np
from OCP.BOPAlgo import BOPAlgo_ArgumentAnalyzer

import figures
from csg import FAR, Box, Cylinder, Group, Prism

# Radius of the probing circle in mm, points on it, and places along the line.
AROUND, POINTS, PLACES = 0.05, 8192, 23
SAME = 1e-7


def faces(shape):
    check = BOPAlgo_ArgumentAnalyzer()
    check.SetShape1(figures.unify(shape))
    check.SelfInterMode = True
    check.Perform()
    return check.HasFaulty()


def line(part):
    rounds, flats = surfaces(part.features, np.eye(4))
    lines = [l for i, a in enumerate(rounds) for b in rounds[:i] for l in between(a, b)]
    lines += [l for a in rounds for n, d in flats for l in against(a, n, d)]
    return any(pinched(part, *l) for l in lines)


def surfaces(features, m):
    """Cylinders (a point, the axis, the radius, the reach) and planes (normal, distance) of the features."""
    rounds, flats = [], []
    for f in features:
        for frame in f.frames():
            w = m @ frame
            x, y, z, o = w[:3, 0], w[:3, 1], w[:3, 2], w[:3, 3]
            s = f.shape
            if isinstance(s, Group):
                more = surfaces(s.features, w)
                rounds, flats = rounds + more[0], flats + more[1]
            elif isinstance(s, Cylinder):
                rounds.append((o, z, s.d / 2, (-FAR, FAR) if s.h == "through" else (0.0, s.h)))
            elif isinstance(s, Box):
                flats += [(n * k, n @ o * k + d / 2) for n, d in ((x, s.x), (y, s.y)) for k in (1, -1)]
                flats += [] if s.z == "through" else [(z, z @ o), (z, z @ o + s.z)]
            elif isinstance(s, Prism):
                for a, b, arc in s.outline.sides():
                    if arc is None:
                        t = np.array([b[0] - a[0], b[1] - a[1]])
                        n = (x * t[1] - y * t[0]) / np.hypot(*t)
                        flats.append((n, n @ (o + x * a[0] + y * a[1])))
    return rounds, flats


def between(a, b):
    """The line in which two parallel cylinders touch: a point, the axis, the reach."""
    (p, n, r, reach), (q, m, s, other) = a, b
    if np.linalg.norm(np.cross(n, m)) > SAME:
        return
    off = (q - p) - n * (n @ (q - p))
    d = np.linalg.norm(off)
    if d > SAME and min(abs(d - r - s), abs(d - abs(r - s))) < SAME:
        side = 1.0 if abs(d - r - s) < SAME or r > s else -1.0
        yield p + off / d * r * side, n, reach


def against(a, n, d):
    """The lines in which a cylinder touches a plane."""
    p, axis, r, reach = a
    if abs(axis @ n) < SAME and abs(abs(n @ p - d) - r) < SAME:
        yield p + n * (d - n @ p), axis, reach


def pinched(part, at, along, reach):
    """Whether going round the line once changes between material and air more than twice, anywhere along it."""
    u = np.cross(along, [1, 0, 0] if abs(along[0]) < 0.7 else [0, 1, 0])
    u /= np.linalg.norm(u)
    v = np.cross(along, u)
    t = (np.arange(POINTS) + 0.37) * 2 * np.pi / POINTS
    ring = AROUND * (u[:, None] * np.cos(t) + v[:, None] * np.sin(t))
    low, high = max(reach[0], -60.0), min(reach[1], 60.0)
    for k in range(PLACES):
        z = low + (high - low) * (k + 0.41) / PLACES
        inside = part.holds((at + along * z)[:, None] + ring)
        if np.count_nonzero(inside != np.roll(inside, 1)) > 2:
            return True
    return False
