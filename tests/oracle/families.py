"""Random parts by family. Sizes and places come from few values, so that faces coincide all the time.

In: a random generator. Out: features. Whether a part makes sense is found out later, by those who evaluate it.
"""

from math import cos, radians, sin, sqrt

from csg import (
    THROUGH,
    Arc,
    Box,
    Circle,
    Cone,
    Cylinder,
    Feature,
    Grid,
    Group,
    Line,
    Outline,
    Part,
    Prism,
    Revolve,
    Sphere,
    Torus,
)

NICE = (15, 30, 45, 60)


class Draft:
    """A part in the making: its features, the heights that occur in it, and its outer size."""

    def __init__(self, rng, family):
        self.rng, self.part, self.levels, self.size = rng, Part(family), [0.0], 0.0

    def one(self, *items):
        return self.rng.choice(items)

    def chance(self, p):
        return self.rng.random() < p

    def angle(self):
        """A nice one, or any with two decimals; either sign."""
        a = self.one(*NICE) if self.chance(0.6) else round(self.rng.uniform(3, 87), 2)
        return a if self.chance(0.5) else -a

    def put(self, op, shape, at=(0, 0, 0), turn=(0, 0, 0), count=1, pattern=None):
        name = f"{op[0]}{len(self.part.features)}"
        self.part.features.append(Feature(op, name, shape, tuple(at), tuple(turn), count, pattern))
        return self.part.features[-1]

    def top(self):
        return max(self.levels)

    def level(self):
        return self.one(*self.levels)

    def grid(self):
        return self.one(0, 0, 4, -4, 5, -5, 8, -8, 10, -10)

    def rise(self, h):
        """The level h above the highest one."""
        z = self.top()
        self.levels.append(z + h)
        return z

    def body(self, shapes=("round", "square")):
        h = self.one(4, 5, 8, 10)
        self.levels.append(float(h))
        if self.one(*shapes) == "round":
            self.size = self.one(16, 20, 24, 30)
            return self.put("add", Cylinder(self.size, h))
        x, y = self.one(20, 24, 30), self.one(16, 20, 24)
        self.size = min(x, y)
        return self.put("add", Box(x, y, h))

    def depth(self):
        """Height of a cut and the z it stands on: through, or from one level to another, or from the top down."""
        if self.chance(0.4):
            return THROUGH, 0
        if self.chance(0.5) and len(self.levels) > 2:
            a, b = sorted(self.rng.sample(sorted(set(self.levels)), 2))
            return b - a, a
        h = self.one(2, 3, 4, 5)
        return h, self.top() - h


# --- What features people put on parts with parallel axes --------------------------------------------------------------


def stacked(d):
    h = d.one(2, 3, 4, 5)
    size = d.one(d.size, d.size, 6, 8, 10, 12, 16)
    shape = Cylinder(size, h) if d.chance(0.7) else Box(size, d.one(size, 6, 10), h)
    d.put("add", shape, (d.one(0, 0, 0, 4, -5), 0, d.rise(h)))


def beside(d):
    """At the height of what is there, over the edge of it."""
    a, b = 0.0, d.top() if d.chance(0.6) else d.levels[1]
    at = (d.one(8, 10, -10, 12), d.one(0, 0, 4, -5), a)
    shape = Cylinder(d.one(6, 8, 10, 12), b - a) if d.chance(0.5) else Box(d.one(6, 8, 10), d.one(6, 8, 10), b - a)
    d.put("add", shape, at, (0, 0, d.angle() if d.chance(0.4) else 0))


def teeth(d):
    n = d.one(3, 4, 6, 8, 12, 16)
    op = d.one("add", "cut", "cut")
    h, z = (d.levels[1], 0) if op == "add" else d.depth()
    tooth = Box(d.one(3, 4, 6), d.one(1.2, 2, 3), h)
    if d.chance(0.3):
        tooth = Cylinder(d.one(2, 3, 4), h)
    d.put(op, tooth, (0, 0, z), count=n, pattern=Circle(d.size / 2, d.one(0, 0, 10, 15)))


def bore(d):
    h, z = d.depth()
    d.put("cut", Cylinder(d.one(4, 6, 8, 10), h), (d.one(0, 0, 0, 4, -5), d.one(0, 0, 5), z))


def holes(d):
    h, z = d.depth()
    shape = Cylinder(d.one(2, 3, 4), h)
    if d.chance(0.5):
        d.put("cut", shape, (0, 0, z), count=d.one(3, 4, 6), pattern=Circle(d.one(5, 8, 10), d.one(0, 30, 45)))
    elif d.chance(0.5):
        d.put("cut", shape, (-6, d.grid(), z), count=d.one(2, 3, 4), pattern=Line(d.one(4, 6), d.one(0, 0, 30)))
    else:
        d.put("cut", shape, (0, 0, z), count=4, pattern=Grid(2, d.one(8, 10, 12), d.one(8, 10)))


def slot(d):
    h, z = d.depth()
    x, y = d.one(6, 8, 10, 40), d.one(2, 3, 4)
    d.put("cut", Box(x, y, h), (d.grid(), d.grid(), z), (0, 0, d.one(0, 0, 90, d.angle())))


def obround(d):
    """A slot with round ends: walls tangent to them."""
    h, z = d.depth()
    w, pitch = d.one(3, 4, 5), d.one(6, 8)
    y = d.one(0, 0, 4, -5)
    d.put("cut", Box(pitch, w, h), (0, y, z))
    d.put("cut", Cylinder(w, h), (-pitch / 2, y, z), count=2, pattern=Line(pitch))


def lug(d):
    """An ear with a round end of its own width, and a hole in it."""
    w, reach, h = d.one(6, 8), d.one(12, 14, 16), d.levels[1]
    turn = (0, 0, d.one(0, 0, 90, 30, d.angle()))
    (c, s) = (cos(radians(turn[2])), sin(radians(turn[2])))
    d.put("add", Box(reach, w, h), (c * reach / 2, s * reach / 2, 0), turn)
    d.put("add", Cylinder(w, h), (c * reach, s * reach, 0))
    if d.chance(0.7):
        d.put("cut", Cylinder(d.one(3, 4), d.one(h, THROUGH)), (c * reach, s * reach, 0))


def flat(d):
    """A flat milled on the side, over the whole height or down to a level."""
    h, z = d.depth()
    d.put("cut", Box(40, 10, h), (0, d.one(5, 8, 10, 12) + 5, z), (0, 0, 0))


def trimmed(d):
    size = d.one(d.size, d.size - 2, 18, 20)
    shape = Cylinder(size, d.top()) if d.chance(0.5) else Box(size, d.one(16, 20), d.top())
    d.put("keep", shape, (0, 0, 0), (0, 0, d.one(0, 0, 30, 45, d.angle())))


def refill(d):
    """A plug of the size of a hole, or a smaller one."""
    cuts = [f for f in d.part.features if f.op == "cut" and isinstance(f.shape, (Box, Cylinder)) and not f.pattern]
    if cuts:
        f = d.one(*cuts)
        h = d.one(2, 3)
        shape = Box(f.shape.x, f.shape.y, h) if isinstance(f.shape, Box) else Cylinder(f.shape.d, h)
        d.put("add", shape, (f.at[0], f.at[1], 0 if f.at[2] == 0 else f.at[2]), f.turn)


CLASSIC = (stacked, stacked, beside, teeth, bore, bore, holes, holes, slot, slot, obround, lug, flat, trimmed, refill)


def several(d, kinds, low, high):
    for _ in range(d.rng.randint(low, high)):
        d.one(*kinds)(d)
    return d.part


def classic(rng):
    d = Draft(rng, "a")
    d.body()
    return several(d, CLASSIC, 1, 6)


# --- Cones and spheres on the axes of cylinders ------------------------------------------------------------------------


def countersunk(d):
    """A pattern of holes, each with a countersink flush with the top."""
    n, r, hole, head, deep = d.one(3, 4), d.one(5, 6), d.one(2, 3), d.one(4, 5), d.one(1, 2)
    z = d.levels[1]
    d.put("cut", Cylinder(hole, d.one(z, THROUGH)), count=n, pattern=Circle(r))
    d.put("cut", Cone(d.one(hole, hole, 0, 1), head, deep), (0, 0, z - deep), count=n, pattern=Circle(r))


def drilled(d):
    """A blind hole with the point of the drill."""
    w, deep, z = d.one(3, 4, 6), d.one(2, 3), d.top()
    d.put("cut", Cylinder(w, deep), (0, 0, z - deep))
    d.put("cut", Cone(0, w, 1), (0, 0, z - deep - 1))


def chamfered(d):
    h, a = d.one(1, 2, 3), d.size
    b = d.one(a - 2, a - 4, a / 2, 0, a + 2)
    d.put("add", Cone(a, b, h), (0, 0, d.rise(h)))
    d.size = b if b else d.size


def tapered(d):
    """Kept within a cone that starts at the rim of the foot."""
    d.put("keep", Cone(d.size, d.one(d.size - 4, d.size / 2, d.size + 4), d.top()))


def domed(d):
    size = d.one(d.size, d.size, 10, 8)
    d.put("add", Sphere(size), (0, 0, d.top()))
    if d.chance(0.5):
        d.levels.append(d.top() + size / 2)


def dimpled(d):
    d.put("cut", Sphere(d.one(4, 6, 8, 10)), (0, 0, d.one(d.top(), d.top(), d.top() + 2, d.level())))


def shaft_step(d):
    h = d.one(2, 3, 4, 5)
    size = d.one(d.size, 8, 10, 12, 16)
    d.put("add", Cylinder(size, h), (0, 0, d.rise(h)))
    d.size = size


def central_bore(d):
    h, z = d.depth()
    d.put("cut", Cylinder(d.one(3, 4, 6, 8), h), (0, 0, z))


def turned_groove(d):
    """A ring cut round the shaft between two levels: a disc less the core it leaves."""
    z = d.one(*d.levels[1:]) - 2
    d.put("keep", Cylinder(d.one(d.size, 30, 24), 2 * d.top() + 20), (0, 0, -10))
    d.put("cut", Cone(d.one(6, 8), d.one(0, 2, 4), 2), (0, 0, z))


COAXIAL = (countersunk, drilled, chamfered, chamfered, tapered, domed, dimpled, shaft_step, shaft_step, central_bore, turned_groove)


def ball(d):
    """A ball with flats and coaxial bores."""
    size = d.one(16, 20)
    d.put("add", Sphere(size))
    for _ in range(d.rng.randint(1, 3)):
        kind = d.rng.randrange(4)
        if kind == 0:
            d.put("cut", Cylinder(d.one(4, 6, 8, 12), THROUGH), turn=d.one((0, 0, 0), (90, 0, 0), (0, 90, 0)))
        elif kind == 1:
            d.put("cut", Box(40, 40, 10), (0, 0, d.one(4, 5, 6)), (0, 0, 0))
        elif kind == 2:
            d.put("keep", Box(d.one(12, 14, 16, 40), d.one(12, 14), d.one(16, 20)), (0, 0, d.one(-8, -10)))
        else:
            d.put("add", Cylinder(d.one(6, 8, 12), d.one(10, 12)), (0, 0, 0))
    return d.part


def coaxial(rng):
    d = Draft(rng, "b")
    if d.chance(0.2):
        return ball(d)
    d.body(("round",))
    return several(d, COAXIAL, 1, 5)


# --- Oblique planes and cylinders --------------------------------------------------------------------------------------


def oblique(rng):
    d = Draft(rng, "c")
    d.body()
    axis = d.one((1, 0), (0, 1))
    tilt = d.angle()
    lean = (axis[0] * tilt, axis[1] * tilt, 0)

    def cut_off(d):
        a = d.angle()
        turn = d.one((a, 0, 0), (0, a, 0), (a, d.angle(), 0), (0, a, d.one(0, 90, 45)))
        at = (d.one(0, 0, 5, -5, 8), d.one(0, 0, 4), d.one(d.top(), d.top() - 1, d.top() + 2))
        d.put("cut", Box(60, 60, 40), at, turn)

    def oblique_hole(d):
        d.put("cut", Cylinder(d.one(3, 4, 5), THROUGH), (d.one(0, 0, 4, -6), d.one(0, 0, 5, -5), d.one(0, d.top())), lean)

    def oblique_holes(d):
        d.put("cut", Cylinder(d.one(2, 3), THROUGH), (-5, d.one(0, 4), 0), lean, d.one(2, 3), Line(d.one(4, 5)))

    def oblique_slot(d):
        turn = d.one(lean, (d.angle(), 0, 0), (d.angle(), d.angle(), d.angle()))
        d.put("cut", Box(d.one(3, 4), d.one(4, 6, 30), d.one(THROUGH, 20)), (d.grid(), d.one(0, 4), 0), turn)

    def boss(d):
        """A pin that leans, sunk into the body, its end square or flush with the ground."""
        d.put("add", Cylinder(d.one(4, 5, 6), d.one(12, 15)), (d.one(0, 4, -4), 0, d.one(1, 2)), lean)

    def wedge(d):
        a = d.one(15, 30, 45)
        d.put("add", Box(d.one(8, 10), d.one(6, 8, 10), d.one(8, 10)), (d.one(0, 4), d.one(0, 5), d.top() - 2), (a, 0, 0))

    def pattern(d):
        n = d.one(3, 4, 6)
        d.put("cut", Box(d.one(4, 6), 2, 10), (0, 0, d.top() - 2), (0, d.one(30, 45, 20), 0), n, Circle(d.size / 2 - 1))

    return several(d, (cut_off, cut_off, oblique_hole, oblique_holes, oblique_slot, boss, wedge, pattern), 1, 3)


# --- Cross-drilled -----------------------------------------------------------------------------------------------------


def cross_drilled(rng):
    d = Draft(rng, "d")
    axes = ((0, 0, 0), (90, 0, 0), (0, 90, 0))
    h = d.one(16, 20)
    kind = d.rng.randrange(4)
    z = h / 2
    if kind == 0:
        d.put("add", Box(20, d.one(16, 20), h))
    elif kind == 1:
        d.put("add", Cylinder(d.one(12, 16, 20), h))
    elif kind == 2:
        size = d.one(8, 10, 12)
        d.put("add", Cylinder(size, h))
        d.put("add", Cylinder(d.one(size, size, size - 2, 6), d.one(16, 20, 24)), (0, d.one(10, 12, 0), z), (90, 0, 0))
    else:
        d.put("add", Cylinder(d.one(16, 20), h))
        d.put("cut", Cylinder(d.one(8, 10, 12), d.one(h, THROUGH)))
    width = d.one(4, 5, 6)
    for _ in range(d.rng.randint(1, 3)):
        w = width if d.chance(0.4) else d.one(2, 3, 4, 6, 8)
        at = (d.one(0, 0, 0, 1, 3), d.one(0, 0, 0, 2), z if d.chance(0.7) else d.one(4, 5, 6))
        turn = d.one(*axes)
        if d.chance(0.25):
            turn = d.one((45, 0, 0), (0, 30, 0), (60, 0, 0), (d.angle(), d.angle(), 0))
        count, pattern = (1, None)
        if d.chance(0.2):
            count, pattern = d.one(2, 3, 4), Circle(d.one(5, 8), d.one(0, 45))
            turn = (0, 90, 0)
        op = "cut" if d.chance(0.85) else "add"
        deep = d.one(THROUGH, THROUGH, 8, 10, 12) if op == "cut" else d.one(10, 12, 14)
        d.put(op, Cylinder(w, deep), at if pattern is None else (0, 0, at[2]), turn, count, pattern)
    return d.part


# --- Cones and spheres off the axis ------------------------------------------------------------------------------------


def off_axis(rng):
    d = Draft(rng, "e")
    kind = d.rng.randrange(6)
    h = d.one(8, 10, 12)
    d.levels.append(float(h))
    if kind == 0:
        d.size = 16
        d.put("add", Cone(d.one(16, 20), d.one(6, 8, 10, 0), h))
    elif kind == 1:
        d.size = 16
        d.put("add", Sphere(d.one(16, 20)), (0, 0, d.one(0, 5, 6)))
    elif kind == 2:
        d.size = 20
        d.put("add", Box(24, 20, h))
    elif kind == 3:
        d.size = 16
        d.put("add", Cylinder(d.one(16, 20), h))
    elif kind == 4:
        d.size = 12
        d.put("add", Sphere(12))
        d.put("add", Sphere(d.one(8, 10, 12)), (d.one(5, 6, 8), d.one(0, 3), d.one(0, 2)))
    else:
        d.size = 16
        d.put("add", Cone(20, 20 - h, h))
        d.put("add", Cone(12, 4, 6), (d.one(4, 5), 0, h - d.one(2, 4)))

    def side_hole(d):
        d.put("cut", Cylinder(d.one(2, 3, 4), d.one(THROUGH, 6)), (d.one(0, 3, 4), d.one(0, 2), d.one(2, 3, 4)), d.one((0, 0, 0), (90, 0, 0), (0, 90, 0), (45, 0, 0), (d.angle(), 0, 0)))

    def plane_cut(d):
        d.put("cut", Box(40, 40, 20), (0, 0, d.one(4, 5, 6)), d.one((0, 0, 0), (d.angle(), 0, 0), (0, d.one(30, 45), 0)))

    def side_plane(d):
        d.put("cut", Box(10, 40, THROUGH), (d.one(4, 5, 6, 8) + 5, 0, 0), (0, 0, d.one(0, 90, 45, d.angle())))

    def sink(d):
        z = d.levels[1]
        at = (d.one(0, 4, 5, 8), d.one(0, 4), z - 2)
        d.put("cut", Cylinder(3, d.one(THROUGH, 4)), at if d.chance(0.3) else (at[0], at[1], z - 4))
        d.put("cut", Cone(d.one(3, 1, 0), d.one(6, 7), 2), at)

    def leaning_cone(d):
        d.put("cut", Cone(d.one(0, 2), d.one(6, 8), d.one(8, 10)), (d.one(0, 3), 0, d.one(0, 2)), d.one((30, 0, 0), (90, 0, 0), (0, d.angle(), 0)))

    def pocket(d):
        d.put("cut", Sphere(d.one(4, 6, 8)), (d.one(0, 3, 5, 6), d.one(0, 2, 4), d.one(h, h, h - 1, 4)))

    def pockets(d):
        d.put("cut", Sphere(d.one(3, 4)), (0, 0, d.one(h, 4)), count=d.one(3, 4), pattern=Circle(d.one(4, 5, 6, 8)))

    def knob(d):
        d.put("add", Sphere(d.one(4, 6)), (d.one(4, 6, 8), d.one(0, 3), d.one(h, 4)))

    def slotted(d):
        d.put("cut", Box(40, d.one(2, 3), d.one(4, 20)), (0, d.one(0, 2), d.one(3, 4)), (d.one(0, 0, 20), 0, d.one(0, 45)))

    return several(d, (side_hole, side_hole, plane_cut, side_plane, sink, leaning_cone, pocket, pockets, knob, slotted), 1, 3)


# --- Tori --------------------------------------------------------------------------------------------------------------


def tori(rng):
    d = Draft(rng, "f")
    kind = d.rng.randrange(6)
    if kind == 0:
        ring, tube = d.one(16, 20, 24), d.one(4, 6)
        d.size = ring
        d.put("add", Torus(ring, tube))
        d.levels = [-tube / 2, tube / 2]
    elif kind == 1:
        d.size, h = d.one(12, 16, 20), d.one(10, 12)
        d.put("add", Cylinder(d.size, h))
        d.levels = [0.0, float(h)]
        for k in range(d.one(1, 2)):
            d.put("cut", Torus(d.size + d.one(0, 0, 1, 2), d.one(3, 4)), (0, 0, d.one(4, 5, 6) if k == 0 else h))
    elif kind == 2:
        # A fillet round the foot of a boss: a collar less the ring.
        foot, r = d.one(8, 10), d.one(1, 2)
        d.size = 24
        d.put("add", Cylinder(foot + 2 * r, r), (0, 0, 4))
        d.put("cut", Torus(foot + 2 * r, 2 * r), (0, 0, 4 + r))
        d.put("add", Cylinder(foot, d.one(8, 10)), (0, 0, 4))
        d.put("add", d.one(Cylinder(24, 4), Box(24, 20, 4)))
        d.levels = [0.0, 4.0]
    elif kind == 3:
        # A plate with a rounded rim, flush with the ring's crown.
        d.size, t = d.one(16, 20), d.one(4, 6)
        d.put("add", Cylinder(d.size, t), (0, 0, -t / 2))
        d.put("add", Torus(d.size, t))
        d.levels = [-t / 2, t / 2]
    elif kind == 4:
        d.size = 20
        d.put("add", Box(24, 24, 6))
        d.put("cut", Torus(d.one(12, 14, 16), d.one(2, 3, 4)), (0, 0, d.one(6, 6, 5)))
        d.levels = [0.0, 6.0]
    else:
        d.size = 12
        d.put("add", Sphere(16))
        d.put("cut", Torus(d.one(16, 12, 14), d.one(4, 5)), (0, 0, d.one(0, 0, 3)))
        d.levels = [-8.0, 8.0]

    def bored(d):
        d.put("cut", Cylinder(d.one(4, 6, d.size), THROUGH), (d.one(0, 0, 0, 2), 0, 0))

    def halved(d):
        d.put("cut", Box(40, 40, 40), d.one((20, 0, -20), (0, 20, -20), (0, 0, 0), (0, 0, d.one(*d.levels) - 1)))

    def leaning(d):
        d.put("cut", Box(40, 40, 40), (d.one(0, 2), 0, d.one(1, 3)), d.one((20, 0, 0), (0, 30, 0), (d.angle(), 0, 0)))

    def radial(d):
        d.put("cut", Cylinder(d.one(2, 3), 40), (0, 0, d.one(0, d.levels[-1] / 2)), (0, 90, d.one(0, 45)))

    def drilled_ring(d):
        d.put("cut", Cylinder(d.one(2, 3), THROUGH), count=d.one(3, 4), pattern=Circle(d.size / 2))

    def hub(d):
        d.put("add", Cylinder(d.one(6, d.size), d.levels[-1] - d.levels[0]), (0, 0, d.levels[0]))

    def slots(d):
        d.put("cut", Box(8, 2, d.one(THROUGH, 4)), count=d.one(3, 4), pattern=Circle(d.size / 2))

    def groove(d):
        d.put("cut", Torus(d.size, d.one(1, 2)), (0, 0, d.one(*d.levels)))

    def quarter(d):
        d.put("keep", Box(30, 30, 40), (15, d.one(15, 0), -20))

    return several(d, (bored, bored, halved, leaning, radial, drilled_ring, hub, slots, groove, quarter), 0, 2)


# --- Prisms and revolves -----------------------------------------------------------------------------------------------


def rectangle(d, x, y):
    """Centred, with some of its corners broken."""
    points = [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)]
    if d.chance(0.5):
        points = points[::-1]
    size = d.one(1, 2, 3, 4)
    kind = d.one("round", "round", "chamfer")
    broken = {i: (kind, size) for i in range(4) if d.chance(0.8)}
    return Outline(points, [None] * 4, broken)


def angle_profile(d, x, y):
    """L-shaped, with a fillet in the corner."""
    t = d.one(4, 5)
    points = [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, -y / 2 + t), (-x / 2 + t, -y / 2 + t), (-x / 2 + t, y / 2), (-x / 2, y / 2)]
    broken = {}
    if d.chance(0.7):
        broken[3] = ("round", d.one(1, 2, 3))
    if d.chance(0.4):
        broken[0] = (d.one("round", "chamfer"), d.one(2, 3))
    return Outline(points, [None] * 6, broken)


def obround_outline(d, x, y):
    """Two lines and two half circles."""
    r, a = y / 2, x / 2 - y / 2
    return Outline([(-a, -r), (a, -r), (a, r), (-a, r)], [None, Arc(r), None, Arc(r)])


def keyhole(d, x, y):
    """A long arc on a neck: 3, 4, 5 makes the numbers whole."""
    k = d.one(1, 2) if x > 12 else 1
    w, h, r = 3 * k, 4 * k, 5 * k
    return Outline([(-w, -h - 4), (w, -h - 4), (w, -h), (-w, -h)], [None, None, Arc(r, True, True), None])


def notched(d, x, y):
    """A rectangle with a round notch or nose on one side."""
    w = d.one(2, 3)
    arc = Arc(d.one(w, w + 1), d.chance(0.5))
    points = [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, -w), (x / 2, w), (x / 2, y / 2), (-x / 2, y / 2)]
    return Outline(points, [None, None, arc, None, None, None])


def hexagon(d, x, y):
    r = y / sqrt(3)
    points = [(r * cos(radians(60 * k)), r * sin(radians(60 * k))) for k in range(6)]
    return Outline(points, [None] * 6)


def half_round(d, x, y):
    """A flat and an arc."""
    r = d.one(x / 2, x / 2, 5 * x / 8)
    return Outline([(-x / 2, 0), (x / 2, 0)], [None, Arc(r, True, d.chance(0.3) and r > x / 2)])


def triangle(d, x, y):
    points = [(-x / 2, -y / 2), (x / 2, -y / 2), (d.one(-x / 2, 0, 4), y / 2)]
    broken = {i: ("round", d.one(1, 2)) for i in range(3) if d.chance(0.5)}
    return Outline(points, [None] * 3, broken)


OUTLINES = (rectangle, rectangle, angle_profile, obround_outline, keyhole, notched, hexagon, half_round, triangle)


def prism_body(d):
    h = d.one(4, 6, 8)
    x, y = d.one(20, 24), d.one(12, 16)
    d.levels.append(float(h))
    d.size = y
    d.put("add", Prism(d.one(*OUTLINES)(d, x, y), h))


def prism_cut(d):
    h, z = d.depth()
    outline = d.one(*OUTLINES)(d, d.one(8, 10), d.one(4, 6))
    d.put("cut", Prism(outline, h), (d.one(0, 0, 4, -5), d.one(0, 0, 4), z), (0, 0, d.one(0, 0, 90, d.angle())))


def prism_boss(d):
    h = d.one(2, 3, 4)
    outline = d.one(*OUTLINES)(d, d.one(8, 10, 20), d.one(6, 8, 12))
    d.put("add", Prism(outline, h), (d.one(0, 0, 4), 0, d.rise(h)))


def prism_across(d):
    """Through the body from the side."""
    outline = d.one(*OUTLINES)(d, d.one(6, 8), d.one(2, 4))
    d.put("cut", Prism(outline, THROUGH), (0, 0, d.one(d.top(), d.top() / 2, 3)), d.one((90, 0, 0), (90, 0, 90), (90, 0, d.angle())))


def prism_kept(d):
    h = d.top()
    d.put("keep", Prism(d.one(rectangle, obround_outline, hexagon)(d, d.one(18, 20), d.one(12, 14)), h))


def shaft_outline(d):
    a, b, h, k = d.one(8, 10), d.one(4, 5), d.one(5, 6), d.one(12, 14)
    broken = {}
    for i, kinds in ((1, ("chamfer", "round")), (3, ("round",)), (4, ("chamfer", "round"))):
        if d.chance(0.7):
            broken[i] = (d.one(*kinds), 1)
    return Outline([(0, 0), (a, 0), (a, h), (b, h), (b, k), (0, k)], [None] * 6, broken), a, k


def ring_outline(d):
    a, b, h = d.one(4, 5, 6), d.one(9, 10), d.one(4, 6)
    broken = {i: (d.one("round", "round", "chamfer"), d.one(1, 1.5)) for i in range(4) if d.chance(0.6)}
    return Outline([(a, 0), (b, 0), (b, h), (a, h)], [None] * 4, broken), b, h


def ball_end(d):
    r, h = d.one(6, 8), d.one(6, 8)
    return Outline([(0, 0), (r, 0), (r, h), (0, h + r)], [None, None, Arc(r), None]), r, h


def grooved(d):
    a, h, w = d.one(8, 10), d.one(10, 12), d.one(1, 2)
    z = d.one(4, 5)
    arc = Arc(d.one(w, w, w + 1), d.chance(0.3))
    return Outline([(0, 0), (a, 0), (a, z - w), (a, z + w), (a, h), (0, h)], [None, None, arc, None, None, None]), a, h


def pulley(d):
    a, b, h = 10, d.one(6, 7), d.one(8, 10)
    broken = {i: ("round", 1) for i in (3, 4) if d.chance(0.6)}
    return Outline([(3, 0), (a, 0), (a, 2), (b, 4), (b, h - 4), (a, h - 2), (a, h), (3, h)], [None] * 8, broken), a, h


def waisted(d):
    """A concave or convex flank: 5, 12, 13 makes the numbers whole."""
    arc = Arc(13, d.chance(0.5))
    return Outline([(0, 0), (8, 0), (8, 10), (0, 10)], [None, arc, None, None]), 8, 10


def revolve_body(d):
    outline, a, h = d.one(shaft_outline, shaft_outline, ring_outline, ball_end, grooved, pulley, waisted)(d)
    d.size = 2 * a
    d.levels.append(float(h))
    d.put("add", Revolve(outline))


def keyway(d):
    d.put("cut", Box(8, d.one(2, 3), d.one(THROUGH, 4)), (d.size / 2, 0, 0), (0, 0, d.one(0, 0, 45)))


def revolve_cut(d):
    outline, _, _ = d.one(ring_outline, ball_end, shaft_outline)(d)
    d.put("cut", Revolve(outline), (0, 0, d.one(d.top() - 3, d.top() - 4)))


def drilled_across(d):
    d.put("cut", Cylinder(d.one(2, 3, 4), THROUGH), (0, 0, d.one(3, 4, d.top() / 2)), (0, 90, d.one(0, 45)))


def outlined(rng):
    d = Draft(rng, "g")
    if d.chance(0.5):
        prism_body(d)
        return several(d, (prism_cut, prism_cut, prism_boss, prism_across, prism_kept, holes, bore, slot, flat), 0, 3)
    revolve_body(d)
    return several(d, (keyway, revolve_cut, drilled_across, central_bore, holes, slot, flat, teeth), 0, 2)


# --- Groups ------------------------------------------------------------------------------------------------------------


def bushing(d, h, name):
    """A tube, perhaps with a slot."""
    size = d.one(6, 8)
    features = [Feature("add", f"{name}a", Cylinder(size, h)), Feature("cut", f"{name}b", Cylinder(d.one(3, 4), d.one(h, THROUGH)))]
    if d.chance(0.4):
        features.append(Feature("cut", f"{name}c", Box(size, d.one(1, 2), d.one(THROUGH, 2))))
    return Group(features)


def socket(d, h, name):
    """A pocket with something left standing in it, flush with its mouth."""
    features = [Feature("add", f"{name}a", d.one(Box(8, 6, h), Cylinder(8, h))), Feature("cut", f"{name}b", d.one(Cylinder(3, h), Box(2, 2, h)))]
    return Group(features)


def clipped(d, h, name):
    """A box within a cylinder."""
    return Group([Feature("add", f"{name}a", Cylinder(8, h)), Feature("keep", f"{name}b", Box(d.one(6, 8), d.one(5, 6), h), turn=(0, 0, d.one(0, 30)))])


def nested(d, h, name):
    inner = d.one(bushing, clipped)(d, h, f"{name}i")
    return Group([Feature("add", f"{name}a", Box(8, 8, d.one(2, h))), Feature(d.one("add", "cut"), f"{name}b", inner, (d.one(0, 2), 0, 0), (0, 0, d.one(0, 45)))])


def grouped(rng):
    d = Draft(rng, "h")
    d.body()
    for k in range(d.rng.randint(1, 3)):
        op = d.one("add", "cut", "cut", "add", "keep")
        if op == "keep":
            outer = Group([Feature("add", f"k{k}a", Cylinder(d.size + 4, 40)), Feature("cut", f"k{k}b", Box(4, d.one(4, 40), 40), (d.size / 2, 0, 0))])
            d.put("keep", outer, (0, 0, -10), (0, 0, d.one(0, 45, d.angle())))
            continue
        h = d.one(3, 4, 5)
        z = d.top() if op == "add" else d.top() - d.one(2, h)
        if op == "add" and d.chance(0.4):
            z = 0
        shape = (bushing if op == "add" else socket)(d, h, f"g{k}") if d.chance(0.5) else d.one(clipped, nested, socket)(d, h, f"g{k}")
        turn = (0, 0, d.one(0, 0, 30, 45))
        if d.chance(0.25):
            turn = (d.one(90, 30, 180, d.angle()), 0, d.one(0, 90))
        if d.chance(0.5):
            d.put(op, shape, (0, 0, z), turn, d.one(2, 3, 4), Circle(d.one(6, 8, d.size / 2), d.one(0, 45)))
        else:
            d.put(op, shape, (d.one(0, 4, -5), d.one(0, 4), z), turn)
        if op == "add":
            d.levels.append(float(z + h))
    if d.chance(0.5):
        d.one(bore, holes, flat, slot)(d)
    return d.part


FAMILIES = {"a": classic, "b": coaxial, "c": oblique, "d": cross_drilled, "e": off_axis, "f": tori, "g": outlined, "h": grouped}
