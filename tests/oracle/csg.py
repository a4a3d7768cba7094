"""A part as a list of features: its text in the gonogo language, its points, and its solid in Open CASCADE.

In: features as `families.py` draws them. Out: three independent readings of the same part. Lengths in mm, angles in
degrees as in the text. Nothing here draws random numbers or judges a result.
"""

from dataclasses import dataclass, field
from math import acos, atan2, ceil, cos, hypot, pi, radians, sin, sqrt, tan

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.collections import List_TopoDS_Shape
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

# Reach of `through` on either side, mm: far beyond every part made here.
FAR = 400.0
THROUGH = "through"
ORIGIN, UP = gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)


def num(v):
    """The shortest text that reads back as the same number."""
    v = float(v)
    return str(int(v)) if v == int(v) and abs(v) < 1e15 else repr(v)


def point(p):
    return "(" + ", ".join(num(v) for v in p) + ")"


def rotation(rx, ry, rz):
    """Rz · Ry · Rx, angles in degrees."""
    (a, b, c) = (radians(v) for v in (rx, ry, rz))
    x = np.array([[1, 0, 0], [0, cos(a), -sin(a)], [0, sin(a), cos(a)]])
    y = np.array([[cos(b), 0, sin(b)], [0, 1, 0], [-sin(b), 0, cos(b)]])
    z = np.array([[cos(c), -sin(c), 0], [sin(c), cos(c), 0], [0, 0, 1]])
    return z @ y @ x


def frame(at=(0, 0, 0), turn=(0, 0, 0)):
    """Homogeneous transform T(at) · R(turn)."""
    m = np.eye(4)
    m[:3, :3] = rotation(*turn)
    m[:3, 3] = at
    return m


def moved(shape, m):
    t = gp_Trsf()
    t.SetValues(*(float(v) for v in m[:3].flat))
    return BRepBuilderAPI_Transform(shape, t, True).Shape()


def shapes(items):
    out = List_TopoDS_Shape()
    for item in items:
        out.Append(item)
    return out


def boolean(kind, arguments, tools):
    """One n-ary boolean; raises where Open CASCADE reports errors."""
    b = kind()
    b.SetArguments(shapes(arguments))
    b.SetTools(shapes(tools))
    b.Build()
    if not b.IsDone():
        raise ValueError("boolean failed")
    return b.Shape()


def stretch(h):
    """Low and high end along z."""
    return (-FAR, FAR) if h == THROUGH else (0.0, h)


def height(h):
    return h if h == THROUGH else num(h)


@dataclass
class Box:
    x: float
    y: float
    z: object

    def text(self):
        return f"box(x = {num(self.x)}, y = {num(self.y)}, z = {height(self.z)})"

    def occ(self):
        a, b = stretch(self.z)
        corner = gp_Pnt(-self.x / 2, -self.y / 2, a)
        return BRepPrimAPI_MakeBox(corner, self.x, self.y, b - a).Shape()

    def holds(self, x, y, z):
        a, b = stretch(self.z)
        return (abs(x) < self.x / 2) & (abs(y) < self.y / 2) & (z > a) & (z < b)


@dataclass
class Cylinder:
    d: float
    h: object

    def text(self):
        return f"cylinder(d = {num(self.d)}, h = {height(self.h)})"

    def occ(self):
        a, b = stretch(self.h)
        return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, a), UP), self.d / 2, b - a).Shape()

    def holds(self, x, y, z):
        a, b = stretch(self.h)
        return (x * x + y * y < self.d**2 / 4) & (z > a) & (z < b)


@dataclass
class Cone:
    d1: float
    d2: float
    h: float

    def text(self):
        return f"cone(d1 = {num(self.d1)}, d2 = {num(self.d2)}, h = {num(self.h)})"

    def occ(self):
        return BRepPrimAPI_MakeCone(gp_Ax2(ORIGIN, UP), self.d1 / 2, self.d2 / 2, self.h).Shape()

    def holds(self, x, y, z):
        r = (self.d1 + (self.d2 - self.d1) * z / self.h) / 2
        return (x * x + y * y < r * r) & (z > 0) & (z < self.h)


@dataclass
class Sphere:
    d: float

    def text(self):
        return f"sphere(d = {num(self.d)})"

    def occ(self):
        return BRepPrimAPI_MakeSphere(gp_Ax2(ORIGIN, UP), self.d / 2).Shape()

    def holds(self, x, y, z):
        return x * x + y * y + z * z < self.d**2 / 4


@dataclass
class Torus:
    d: float
    tube: float

    def text(self):
        return f"torus(d = {num(self.d)}, tube = {num(self.tube)})"

    def occ(self):
        return BRepPrimAPI_MakeTorus(gp_Ax2(ORIGIN, UP), self.d / 2, self.tube / 2).Shape()

    def holds(self, x, y, z):
        r = np.sqrt(x * x + y * y) - self.d / 2
        return r * r + z * z < self.tube**2 / 4


@dataclass
class Arc:
    """A side that bends: counter-clockwise when `left`, more than half a turn when `long`."""

    radius: float
    left: bool = True
    long: bool = False


@dataclass
class Outline:
    """A closed outline: its corners, for each side (to the next corner, the last to the first) an arc or `None`, and
    for some corners (by index) how they are broken: `("round", radius)` or `("chamfer", distance)`."""

    points: list
    arcs: list
    broken: dict = field(default_factory=dict)

    def text(self, name):
        n = len(self.points)
        lines = [f"outline {name} {{", f"from {point(self.points[0])}{self.corner(0)}"]
        for i, arc in enumerate(self.arcs):
            end = f"to {point(self.points[(i + 1) % n])}"
            last = "" if i == n - 1 else self.corner(i + 1)
            if arc:
                hand = ("left" if arc.left else "right") + (" long" if arc.long else "")
                lines.append(f"arc {end} radius {num(arc.radius)} {hand}{last}")
            elif i < n - 1:
                lines.append(f"line {end}{last}")
        return "\n".join([*lines, "}"])

    def corner(self, i):
        return f" {self.broken[i][0]} {num(self.broken[i][1])}" if i in self.broken else ""

    def sides(self):
        """Start, end and arc of every stretch, broken corners included."""
        n = len(self.points)
        out = []
        for i in range(n):
            start, end = self.leave(i), self.reach((i + 1) % n)
            out.append((start, end, self.arcs[i]))
            if (i + 1) % n in self.broken:
                out.append((end, self.leave((i + 1) % n), self.fillet((i + 1) % n)))
        return out

    def leave(self, i):
        """Where the boundary goes on behind corner i."""
        return self.along(i, (i + 1) % len(self.points))

    def reach(self, i):
        """Where the boundary ends before corner i."""
        return self.along(i, i - 1)

    def along(self, i, towards):
        if i not in self.broken:
            return self.points[i]
        (x, y), (a, b) = self.points[i], self.points[towards]
        d, back = hypot(a - x, b - y), self.setback(i)
        return (x + (a - x) * back / d, y + (b - y) * back / d)

    def turning(self, i):
        """Angle between the sides at corner i, and whether the boundary turns left there."""
        (p, q, r) = (self.points[i - 1], self.points[i], self.points[(i + 1) % len(self.points)])
        (u, v) = ((p[0] - q[0], p[1] - q[1]), (r[0] - q[0], r[1] - q[1]))
        angle = acos((u[0] * v[0] + u[1] * v[1]) / (hypot(*u) * hypot(*v)))
        return angle, u[0] * v[1] - u[1] * v[0] < 0

    def setback(self, i):
        kind, size = self.broken[i]
        return size if kind == "chamfer" else size / tan(self.turning(i)[0] / 2)

    def fillet(self, i):
        kind, size = self.broken[i]
        return None if kind == "chamfer" else Arc(size, self.turning(i)[1])

    def holds(self, u, v):
        """Even-odd rule; an arc adds the segment between it and its chord."""
        inside = np.zeros(u.shape, bool)
        for (a, b), (c, d), arc in self.sides():
            crosses = (b > v) != (d > v)
            if b != d:
                inside ^= crosses & (u < a + (v - b) * (c - a) / (d - b))
            if arc:
                inside ^= in_segment(u, v, (a, b), (c, d), arc)
        return inside

    def wire(self, lift):
        """The outline as a wire; `lift` places a point of its plane in space."""
        make = BRepBuilderAPI_MakeWire()
        for p, q, arc in self.sides():
            if arc is None:
                make.Add(BRepBuilderAPI_MakeEdge(lift(*p), lift(*q)).Edge())
                continue
            (cx, cy) = centre(p, q, arc)
            (start, sweep) = sweep_of(p, q, arc)
            mid = (cx + arc.radius * cos(start + sweep / 2), cy + arc.radius * sin(start + sweep / 2))
            curve = GC_MakeArcOfCircle(lift(*p), lift(*mid), lift(*q)).Value()
            make.Add(BRepBuilderAPI_MakeEdge(curve).Edge())
        return make.Wire()


def centre(p, q, arc):
    """Centre of the arc from p to q."""
    (dx, dy) = (q[0] - p[0], q[1] - p[1])
    chord = hypot(dx, dy)
    off = sqrt(max(arc.radius**2 - chord**2 / 4, 0.0))
    side = 1.0 if arc.left != arc.long else -1.0
    return ((p[0] + q[0]) / 2 - side * off * dy / chord, (p[1] + q[1]) / 2 + side * off * dx / chord)


def sweep_of(p, q, arc):
    """Angle of p seen from the centre, and the signed angle from there to q."""
    (cx, cy) = centre(p, q, arc)
    (a, b) = (atan2(p[1] - cy, p[0] - cx), atan2(q[1] - cy, q[0] - cx))
    sweep = (b - a) % (2 * pi)
    return (a, sweep if arc.left else sweep - 2 * pi)


def in_segment(u, v, p, q, arc):
    """Between the arc and its chord."""
    (cx, cy) = centre(p, q, arc)
    within = (u - cx) ** 2 + (v - cy) ** 2 < arc.radius**2
    right = (q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0]) < 0
    return within & (right if arc.left else ~right)


@dataclass
class Prism:
    outline: Outline
    h: object
    name: str = ""

    def text(self):
        return f"prism(outline = {self.name}, h = {height(self.h)})"

    def occ(self):
        a, b = stretch(self.h)
        wire = self.outline.wire(lambda x, y: gp_Pnt(x, y, a))
        return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire).Face(), gp_Vec(0, 0, b - a)).Shape()

    def holds(self, x, y, z):
        a, b = stretch(self.h)
        return self.outline.holds(x, y) & (z > a) & (z < b)


@dataclass
class Revolve:
    outline: Outline
    name: str = ""

    def text(self):
        return f"revolve(outline = {self.name})"

    def occ(self):
        wire = self.outline.wire(lambda r, z: gp_Pnt(r, 0, z))
        return BRepPrimAPI_MakeRevol(BRepBuilderAPI_MakeFace(wire).Face(), gp_Ax1(ORIGIN, UP)).Shape()

    def holds(self, x, y, z):
        return self.outline.holds(np.sqrt(x * x + y * y), z)


@dataclass
class Group:
    """Features folded among themselves."""

    features: list

    def occ(self):
        return fold(self.features, np.eye(4), False)

    def holds(self, x, y, z):
        return hold(self.features, np.stack([x, y, z]))


def hold(features, p):
    """Which of the points (columns of p) the features leave material at."""
    inside = np.zeros(p.shape[1], bool)
    for f in features:
        within = f.holds(p)
        inside = {"add": inside | within, "cut": inside & ~within, "keep": inside & within}[f.op]
    return inside


def fold(features, pose, one_by_one):
    result = None
    for f in features:
        copies = [moved(f.shape.occ(), pose @ m) for m in f.frames()]
        result = combine(f.op, result, copies[::-1] if one_by_one else copies, one_by_one)
    return result


@dataclass
class Circle:
    r: float
    first: float = 0.0
    step: float = None

    def text(self):
        more = f", from = {num(self.first)} deg" if self.first else ""
        more += f", step = {num(self.step)} deg" if self.step is not None else ""
        return f"circle(r = {num(self.r)}{more})"

    def frames(self, n):
        step = 360.0 / n if self.step is None else self.step
        turns = [self.first + step * k for k in range(n)]
        return [frame((self.r * cos(radians(a)), self.r * sin(radians(a)), 0), (0, 0, a)) for a in turns]


@dataclass
class Line:
    pitch: float
    angle: float = 0.0

    def text(self):
        more = f", angle = {num(self.angle)} deg" if self.angle else ""
        return f"line(pitch = {num(self.pitch)}{more})"

    def frames(self, n):
        (c, s) = (cos(radians(self.angle)), sin(radians(self.angle)))
        return [frame((self.pitch * k * c, self.pitch * k * s, 0)) for k in range(n)]


@dataclass
class Grid:
    columns: int
    x: float
    y: float

    def text(self):
        return f"grid(columns = {self.columns}, x = {num(self.x)}, y = {num(self.y)})"

    def frames(self, n):
        rows = ceil(n / self.columns)

        def place(i):
            across = i % self.columns - (self.columns - 1) / 2
            down = i // self.columns - (rows - 1) / 2
            return frame((self.x * across, -self.y * down, 0))

        return [place(i) for i in range(n)]


@dataclass
class Feature:
    op: str
    name: str
    shape: object
    at: tuple = (0, 0, 0)
    turn: tuple = (0, 0, 0)
    count: int = 1
    pattern: object = None

    def text(self):
        times = f"{self.count}x " if self.pattern else ""
        group = isinstance(self.shape, Group)
        out = f"{self.op} {self.name} = {times}{'group' if group else self.shape.text()}"
        out += f" at {point(self.at)}" if any(self.at) else ""
        out += f" turn {point(self.turn)}" if any(self.turn) else ""
        out += f" on {self.pattern.text()}" if self.pattern else ""
        return "\n".join([out + " {", *(f.text() for f in self.shape.features), "}"]) if group else out

    def outlines(self):
        """Text of the outlines it needs, whose names are told to their shapes."""
        if isinstance(self.shape, Group):
            return [text for f in self.shape.features for text in f.outlines()]
        if isinstance(self.shape, (Prism, Revolve)):
            self.shape.name = f"{self.name}_outline"
            return [self.shape.outline.text(self.shape.name)]
        return []

    def frames(self):
        """T(at) · T(offset) · Rz(angle) · R(turn): a pattern is centred on `at`."""
        own = frame(turn=self.turn)
        places = self.pattern.frames(self.count) if self.pattern else [np.eye(4)]
        return [frame(self.at) @ place @ own for place in places]

    def holds(self, p):
        """Which of the points (columns of p) lie in one of the copies."""
        inside = np.zeros(p.shape[1], bool)
        for m in self.frames():
            inside |= self.shape.holds(*(m[:3, :3].T @ (p - m[:3, 3:])))
        return inside


@dataclass
class Part:
    family: str
    features: list = field(default_factory=list)
    pose: tuple = None

    def text(self):
        """Outlines, then features, one a line."""
        outlines = [text for f in self.features for text in f.outlines()]
        return "\n".join([*outlines, *(f.text() for f in self.features)])

    def holds(self, p):
        return hold(self.features, p)

    def occ(self, pose=None, one_by_one=False):
        """The solid before faces are merged. One by one: each copy is an operation of its own, last copy first."""
        return fold(self.features, np.eye(4) if pose is None else pose, one_by_one)


def combine(op, result, copies, one_by_one):
    if op == "keep" and len(copies) > 1:
        copies = [boolean(BRepAlgoAPI_Fuse, copies[:1], copies[1:])]
    if op == "add":
        copies = copies if result is None else [result, *copies]
        if len(copies) == 1:
            return copies[0]
        if not one_by_one:
            return boolean(BRepAlgoAPI_Fuse, copies[:1], copies[1:])
        (result, copies) = (copies[0], copies[1:])
    kind = {"add": BRepAlgoAPI_Fuse, "cut": BRepAlgoAPI_Cut, "keep": BRepAlgoAPI_Common}[op]
    if not one_by_one:
        return boolean(kind, [result], copies)
    for copy in copies:
        result = boolean(kind, [result], [copy])
    return result
