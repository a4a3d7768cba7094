#!/usr/bin/env python3
"""Reads STEP files with Open CASCADE and compares what it finds with what gonogo says of the same solids.

    gonogo compile SPEC --emit brep,step -o out/NAME.model.ron ...   writes out/NAME.brep.ron and out/NAME.parts/*.step
    python tests/oracle/step.py FIGURES.json                          compares; exit code 1 on any difference

FIGURES.json is a list of objects, one a file:

    {"file": "plate.step", "volume": 3626.27, "area": 5436.6, "solids": 1,
     "faces": {"plane": 242, "cylinder": 5, "cone": 0, "sphere": 0, "torus": 0}}

`cargo test --test exchange -- --ignored` writes such a list and the files for a collection of solids to
`target/step-oracle`. The files are looked for beside the list. Needs `pip install cadquery-ocp` (Open CASCADE 8); the
project's own tests do without.
"""
import json
import pathlib
import sys
from collections import Counter

from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.GeomAbs import GeomAbs_SurfaceType as Kind
from OCP.IFSelect import IFSelect_RetDone
from OCP.Message import Message, Message_Gravity
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap

# Largest relative difference of volume and area, and largest gap (mm) that Open CASCADE may have to bridge.
RELATIVE = 1e-6
GAP = 2e-4
# Open CASCADE integrates to this (relative).
PRECISION = 1e-9
KINDS = {
    Kind.GeomAbs_Plane: "plane",
    Kind.GeomAbs_Cylinder: "cylinder",
    Kind.GeomAbs_Cone: "cone",
    Kind.GeomAbs_Sphere: "sphere",
    Kind.GeomAbs_Torus: "torus",
}


def distinct(shape, kind):
    found = ShapeMap()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(i) for i in range(1, found.Extent() + 1)]


def occurrences(shape, kind):
    """Every solid as often as it is placed."""
    from OCP.TopExp import TopExp_Explorer

    explorer, count = TopExp_Explorer(shape, kind), 0
    while explorer.More():
        count += 1
        explorer.Next()
    return count


def read(path):
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise SystemExit(f"{path}: not readable")
    reader.TransferRoots()
    return reader.OneShape()


def figures(shape):
    volume, area = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume, PRECISION)
    BRepGProp.SurfaceProperties_s(shape, area, PRECISION)
    faces = Counter()
    for face in distinct(shape, TopAbs_FACE):
        faces[KINDS.get(BRepAdaptor_Surface(TopoDS.Face(face)).GetType(), "other")] += 1
    edges = [BRep_Tool.Tolerance_s(TopoDS.Edge(e)) for e in distinct(shape, TopAbs_EDGE)]
    return {
        "valid": BRepCheck_Analyzer(shape).IsValid(),
        "solids": occurrences(shape, TopAbs_SOLID),
        "volume": volume.Mass(),
        "area": area.Mass(),
        "faces": dict(faces),
        "gap": max(edges, default=0.0),
    }


def complaints(expected, found):
    if not found["valid"]:
        yield "not valid"
    if found["solids"] != expected["solids"]:
        yield f"{found['solids']} solids, expected {expected['solids']}"
    for name in ("volume", "area"):
        error = found[name] / expected[name] - 1
        if not abs(error) <= RELATIVE:
            yield f"{name} {found[name]:.9g}, expected {expected[name]:.9g} ({error:+.1e})"
    counts = {k: n for k, n in expected["faces"].items() if n}
    if counts != found["faces"]:
        yield f"faces {found['faces']}, expected {counts}"
    if found["gap"] > GAP:
        yield f"edges lie {found['gap']:.1e} mm off their faces"


def main(lists):
    Message.DefaultMessenger_s().Printers().Clear()
    bad = total = 0
    for name in map(pathlib.Path, lists):
        for expected in json.loads(name.read_text()):
            total += 1
            found = figures(read(name.parent / expected["file"]))
            wrong = list(complaints(expected, found))
            bad += bool(wrong)
            verdict = "; ".join(wrong) or "ok"
            print(f"{expected['file']}: {verdict} (V {found['volume']:.6f}, A {found['area']:.6f}, gap {found['gap']:.0e})")
    print(f"{total - bad} of {total} agree")
    return 1 if bad or not total else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
