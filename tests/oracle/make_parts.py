#!/usr/bin/env python3
"""Makes parts.txt: random parts with the figures that Open CASCADE finds for them. See README.md.

A part is kept only where three readings agree: the solid made operation by operation in the part's own frame, the
solid made copy by copy in a turned frame, and the volume of the points that the features hold.
"""

import argparse
import random
import sys
import time

import numpy as np

import figures
import touching
from csg import frame
from families import FAMILIES

SEED = 20260
# Parts per family.
WANTED = {"a": 80, "b": 55, "c": 55, "d": 55, "e": 50, "f": 50, "g": 50, "h": 35}
# Share of the parts that keep their own frame.
UNPOSED = 0.25
# Parts per family that are to be refused, and the diagnostics.
REFUSED = {"empty": 1, "pieces": 2, "touching": 2}
CODES = {"empty": "E0401", "pieces": "E0405", "touching": "E0407"}
# Points of the volume estimate.
POINTS = 1 << 21
# Relative agreement asked of the estimate, and of the two solids.
ESTIMATE, TWICE = 6e-4, 2e-8
# Edges shorter than this mean features that miss each other by next to nothing: that is another test, mm.
SHORT = 0.02


def lattice(n):
    """Points of the unit cube, three rows: Kronecker's sequence with Roberts' generalised golden ratio."""
    g = 1.2207440846057596
    k = np.arange(1, n + 1, dtype=np.float64)
    return np.stack([(0.5 + k / g**i) % 1.0 for i in (1, 2, 3)])


CUBE = lattice(POINTS)


def estimate(part, low, high):
    """Volume of the part by counting points, and its standard error for points thrown at random."""
    low, size = np.array(low)[:, None], (np.array(high) - np.array(low))[:, None]
    held = 0
    for i in range(0, POINTS, 1 << 16):
        held += int(part.holds(low + size * CUBE[:, i : i + (1 << 16)]).sum())
    return held / POINTS * float(np.prod(size))


def pose(rng):
    at = [round(rng.uniform(-40, 40), 4) for _ in range(3)]
    turn = [round(rng.uniform(-170, 170), 4), round(rng.uniform(-80, 80), 4), round(rng.uniform(-170, 170), 4)]
    return tuple(at), tuple(turn)


def judge(part, placed):
    """Figures, or the reason why there are none."""
    shape = part.occ()
    first = figures.measure(shape)
    if first.solids == 0:
        return None, "empty"
    if first.solids > 1:
        return first, "unsure: pieces touch" if touching.line(part) or touching.faces(shape) else "pieces"
    if not first.valid or first.ragged or set(first.faces) - set(figures.KINDS):
        return None, f"unsure {first}"
    if first.shortest < SHORT:
        return None, f"short {first.shortest:.1e}"
    second = figures.measure(part.occ(placed, one_by_one=True))
    if not (second.valid and first.same_as(second, TWICE)):
        return None, f"differs {first} {second}"
    counted = estimate(part, *figures.bounds(shape))
    if abs(counted - first.volume) > ESTIMATE * first.volume:
        return None, f"estimate {counted / first.volume - 1:.1e} {first}"
    if touching.line(part):
        return first, "touching"
    if touching.faces(shape):
        return None, "unsure: faces touch"
    return first, None


def line(f):
    kinds = " ".join(f"{f.faces[k]} {k}" for k in figures.KINDS if k in f.faces)
    return f"= volume {f.volume:.12g} area {f.area:.12g} faces {kinds} edges {f.edges} corners {f.corners}"


def write(out, part, index, expected):
    print(f"\npart {part.family}{index}", file=out)
    if part.pose:
        (at, turn) = part.pose
        print("at (" + ", ".join(map(str, at)) + ") turn (" + ", ".join(map(str, turn)) + ")", file=out)
    print(part.text(), file=out)
    print(expected, file=out, flush=True)


def make(family, wanted, out, log):
    kept, index = 0, 0
    refused = dict(REFUSED)
    while kept < wanted and index < 60 * wanted:
        index += 1
        rng = random.Random(f"{SEED}-{family}-{index}")
        part = FAMILIES[family](rng)
        placed = pose(rng)
        part.pose = placed if rng.random() >= UNPOSED else None
        began = time.time()
        try:
            result, why = judge(part, frame(*placed))
        except Exception as error:  # Open CASCADE throws many kinds.
            result, why = None, f"fails {error!r}"
        print(f"{family}{index} {why or 'kept'} {time.time() - began:.1f} s", file=log, flush=True)
        if why is None:
            write(out, part, index, line(result))
            kept += 1
        elif refused.get(why, 0) and len(part.features) > 1:
            refused[why] -= 1
            touches = f"{line(result)} or " if why == "touching" else "= "
            write(out, part, index, touches + CODES[why])


def main():
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("families", nargs="*", default=list(WANTED))
    ask.add_argument("--count", type=int, help="parts per family instead of the usual number")
    given = ask.parse_args()
    for family in given.families:
        make(family, given.count or WANTED[family], sys.stdout, sys.stderr)


if __name__ == "__main__":
    main()
