"""What Open CASCADE says of a solid: volume, area, faces by kind of surface, edges and corners.

Faces that lie on one surface and share an edge count as one face, whether or not Open CASCADE has merged them; edges
that continue each other between the same two faces count as one edge. So seams, split faces and split edges, which
depend on how a solid was made, do not count.
"""

from collections import Counter
from dataclasses import dataclass

from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.gp import gp_Pnt, gp_Vec
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap

KINDS = ("plane", "cylinder", "cone", "sphere", "torus")
# Surfaces whose parameters differ by less are one, mm and rad.
SAME = 1e-6
# Edges that meet at more than this angle do not continue each other, rad: a traced curve may bend a little at a joint.
KINK = 0.02
# Relative accuracy asked of the adaptive integration over each face.
INTEGRATION = 1e-10


@dataclass
class Figures:
    volume: float
    area: float
    solids: int
    shells: int
    valid: bool
    faces: dict
    edges: int
    corners: int
    # Two more than this many faces meet in an edge, or an edge has one face only.
    ragged: int
    # Faces as counted by ShapeUpgrade_UnifySameDomain.
    unified: int
    shortest: float

    def same_as(self, other, tolerance):
        near = all(abs(a - b) <= tolerance * abs(a) for a, b in ((self.volume, other.volume), (self.area, other.area)))
        counts = (self.faces, self.edges, self.corners, self.solids, self.shells)
        return near and counts == (other.faces, other.edges, other.corners, other.solids, other.shells)


def sub(shape, kind):
    found = ShapeMap()
    TopExp.MapShapes_s(shape, kind, found)
    return found


def listed(found):
    return [found.FindKey(i) for i in range(1, found.Extent() + 1)]


def unify(shape):
    u = ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    u.Build()
    return u.Shape()


def measure(shape):
    shape = unify(shape)
    volume, area = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume, INTEGRATION, False, False)
    BRepGProp.SurfaceProperties_s(shape, area, INTEGRATION, False)
    solids, shells = (sub(shape, kind).Extent() for kind in (TopAbs_SOLID, TopAbs_SHELL))
    topology = Topology(shape)
    return Figures(
        volume.Mass(), area.Mass(), solids, shells, BRepCheck_Analyzer(shape).IsValid(), topology.faces(),
        *topology.edges_and_corners(), topology.ragged, topology.count, topology.shortest,
    )


def bounds(shape):
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    low, high = box.CornerMin(), box.CornerMax()
    return (low.X(), low.Y(), low.Z()), (high.X(), high.Y(), high.Z())


class Topology:
    """Faces joined over the edges that they share, and the graph of the edges that are left."""

    def __init__(self, shape):
        faces, edges = sub(shape, TopAbs_FACE), sub(shape, TopAbs_EDGE)
        self.count = faces.Extent()
        self.surfaces = [describe(TopoDS.Face(f)) for f in listed(faces)]
        self.parent = list(range(self.count))
        self.edges = [e for e in listed(edges) if not BRep_Tool.Degenerated_s(TopoDS.Edge(e))]
        self.beside = [[] for _ in self.edges]
        known = ShapeMap()
        for e in self.edges:
            known.Add(e)
        for i in range(self.count):
            for k in boundary(faces.FindKey(i + 1), known):
                self.beside[k].append(i)
        used = [k for k, b in enumerate(self.beside) if b]
        self.edges, self.beside = ([items[k] for k in used] for items in (self.edges, self.beside))
        self.ragged = sum(len(b) != 2 for b in self.beside)
        self.shortest = min((length(e) for e in self.edges), default=0.0)
        for b in self.beside:
            if len(b) == 2 and same(self.surfaces[b[0]], self.surfaces[b[1]]):
                self.parent[self.root(b[0])] = self.root(b[1])

    def root(self, i):
        while self.parent[i] != i:
            i = self.parent[i]
        return i

    def faces(self):
        return dict(Counter(self.surfaces[i][0] for i in range(self.count) if self.root(i) == i))

    def edges_and_corners(self):
        """Edges between different faces, chained through vertices where nothing else happens."""
        kept = [(e, frozenset(self.root(i) for i in b)) for e, b in zip(self.edges, self.beside)]
        kept = [(e, b) for e, b in kept if len(b) > 1]
        vertices, ends = ShapeMap(), {}
        for k, (e, _) in enumerate(kept):
            a, b = TopExp.FirstVertex_s(TopoDS.Edge(e)), TopExp.LastVertex_s(TopoDS.Edge(e))
            for v in (a, b):
                ends.setdefault(vertices.Add(v), []).append((k, tangent(TopoDS.Edge(e), v)))
        chain = list(range(len(kept)))

        def root(k):
            while chain[k] != k:
                k = chain[k]
            return k

        corners = 0
        for at in ends.values():
            (k, t), (m, u) = at[0], at[-1]
            if len(at) == 2 and kept[k][1] == kept[m][1] and norm(cross(t, u)) < KINK:
                chain[root(k)] = root(m)
            else:
                corners += 1
        return len({root(k) for k in range(len(kept))}), corners


def boundary(face, known):
    """Indices of the edges round a face, twice for a seam; not those that lie inside it."""
    walk = TopExp_Explorer(face, TopAbs_EDGE)
    while walk.More():
        edge = walk.Current()
        if edge.Orientation() in (TopAbs_FORWARD, TopAbs_REVERSED) and known.Contains(edge):
            yield known.FindIndex(edge) - 1
        walk.Next()


def tangent(edge, vertex):
    """Direction of the edge at one of its ends."""
    p, d = gp_Pnt(), gp_Vec()
    BRepAdaptor_Curve(edge).D1(BRep_Tool.Parameter_s(vertex, edge), p, d)
    return xyz(d.Normalized())


def length(edge):
    p = GProp_GProps()
    BRepGProp.LinearProperties_s(edge, p)
    return p.Mass()


def describe(face):
    """Kind of surface and its parameters: two faces of one surface have the same ones."""
    a = BRepAdaptor_Surface(face)
    kind = str(a.GetType()).split("GeomAbs_")[-1].split(":")[0].rstrip(">").strip().lower()
    if kind == "plane":
        p = a.Plane()
        n = xyz(p.Axis().Direction())
        return kind, n, dot(n, xyz(p.Location()))
    if kind == "cylinder":
        c = a.Cylinder()
        return kind, xyz(c.Axis().Direction()), xyz(c.Axis().Location()), c.Radius()
    if kind == "cone":
        c = a.Cone()
        return kind, xyz(c.Axis().Direction()), xyz(c.Apex()), abs(c.SemiAngle())
    if kind == "sphere":
        s = a.Sphere()
        return kind, xyz(s.Location()), s.Radius()
    if kind == "torus":
        t = a.Torus()
        return kind, xyz(t.Axis().Direction()), xyz(t.Location()), t.MajorRadius(), t.MinorRadius()
    return kind, id(face)


def same(s, t):
    if s[0] != t[0]:
        return False
    kind = s[0]
    if kind == "plane":
        sign = 1.0 if dot(s[1], t[1]) > 0 else -1.0
        return parallel(s[1], t[1]) and abs(s[2] - sign * t[2]) < SAME
    if kind == "cylinder":
        off = cross(s[1], minus(s[2], t[2]))
        return parallel(s[1], t[1]) and norm(off) < SAME and abs(s[3] - t[3]) < SAME
    if kind == "cone":
        return parallel(s[1], t[1]) and norm(minus(s[2], t[2])) < SAME and abs(s[3] - t[3]) < SAME
    if kind == "sphere":
        return norm(minus(s[1], t[1])) < SAME and abs(s[2] - t[2]) < SAME
    if kind == "torus":
        near = norm(minus(s[2], t[2])) < SAME and abs(s[3] - t[3]) < SAME and abs(s[4] - t[4]) < SAME
        return parallel(s[1], t[1]) and near
    return False


def xyz(p):
    return (p.X(), p.Y(), p.Z())


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a):
    return dot(a, a) ** 0.5


def parallel(a, b):
    return norm(cross(a, b)) < SAME
