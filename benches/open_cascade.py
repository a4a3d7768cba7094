#!/usr/bin/env python3
"""Times Open CASCADE and gonogo on the reference parts, one after the other, and prints the ratio.

    python benches/open_cascade.py            needs `pip install cadquery-ocp` (Open CASCADE 8) and cargo

Open CASCADE: one boolean with all operands as tools, then faces of one surface merged (its booleans leave them split). The
operands are made beforehand. gonogo: from the features of the part to faces, edges and triangles. Least of many runs each.
"""
import math
import subprocess
import sys
import time

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.collections import List_TopoDS_Shape as ShapeList
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

RUNS = 10


def moved(shape, x=0.0, y=0.0, z=0.0, turn=0.0):
    rotation, translation = gp_Trsf(), gp_Trsf()
    rotation.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), turn)
    translation.SetTranslation(gp_Vec(x, y, z))
    return BRepBuilderAPI_Transform(shape, translation.Multiplied(rotation), True).Shape()


def cylinder(d, h, z=0.0):
    return moved(BRepPrimAPI_MakeCylinder(d / 2, h).Shape(), z=z)


def block(x, y, z):
    return BRepPrimAPI_MakeBox(gp_Pnt(-x / 2, -y / 2, 0), x, y, z).Shape()


def ring(shape, count, radius):
    angles = [2 * math.pi * k / count for k in range(count)]
    return [moved(shape, radius * math.cos(a), radius * math.sin(a), 0, a) for a in angles]


def stack(sizes):
    z, solids = 0.0, []
    for d, h in sizes:
        solids.append(cylinder(d, h, z))
        z += h
    return solids[:1], solids[1:], []


# First solid, what is added, what is cut.
PARTS = {
    "plate": ([cylinder(56, 2)], [], [cylinder(20, 2)] + ring(cylinder(4.5, 2), 3, 18) + ring(block(4, 1.2, 2), 60, 25)),
    "pin": stack([(4, 5), (6, 2), (4, 8), (3, 4)]),
    "pin_equal": stack([(4, 5), (4, 2), (6, 8), (6, 4)]),
    "gear": ([cylinder(50, 6)], ring(block(6, 3, 6), 24, 25), ring(cylinder(6, 6), 4, 15) + [cylinder(10, 6)]),
}
FACES = {"plate": 247, "pin": 9, "pin_equal": 5, "gear": 103}


def combined(operation, shape, tools):
    if not tools:
        return shape
    operation.SetArguments(listed([shape]))
    operation.SetTools(listed(tools))
    operation.Build()
    return operation.Shape()


def listed(shapes):
    found = ShapeList()
    for shape in shapes:
        found.Append(shape)
    return found


def build(first, added, cut):
    shape = combined(BRepAlgoAPI_Fuse(), first[0], added)
    shape = combined(BRepAlgoAPI_Cut(), shape, cut)
    unify = ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    unify.Build()
    return unify.Shape()


def faces(shape):
    found = ShapeMap()
    TopExp.MapShapes_s(shape, TopAbs_FACE, found)
    return found.Extent()


def open_cascade(name):
    least = math.inf
    for _ in range(RUNS):
        started = time.perf_counter()
        shape = build(*PARTS[name])
        least = min(least, time.perf_counter() - started)
    assert faces(shape) == FACES[name], f"{name}: {faces(shape)} faces"
    return least * 1e3


def gonogo():
    command = ["cargo", "bench", "--quiet", "--bench", "kernel"]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return {name: float(least) for name, least, _ in map(str.split, lines)}


def main():
    ours = gonogo()
    print(f"{'part':<10} {'Open CASCADE':>13} {'gonogo':>10} {'ratio':>7}")
    for name, milliseconds in ours.items():
        theirs = open_cascade(name)
        print(f"{name:<10} {theirs:>10.2f} ms {milliseconds:>7.3f} ms {theirs / milliseconds:>6.1f}x")


if __name__ == "__main__":
    sys.exit(main())
