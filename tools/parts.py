#!/usr/bin/env python3
"""Parts as CAD kernels write them, for tries of the mesher: STL files of random parts.

    pip install cadquery
    python3 tools/parts.py FOLDER FROM TO     # one part for each seed: KIND_SEED.stl

Kinds: plates with holes, engraved letters, gears, shells, turned profiles, pipes, lofts, perforated plates,
crossing cylinders, springs, chamfered boxes; tolerances from 0.003 to 1. Some pipes cross themselves: these are to be refused.
"""

import math
import random
import sys

import cadquery as cq


def plate(r):
    w, h, t = r.uniform(20, 120), r.uniform(20, 80), r.uniform(0.5, 8)
    holes = [(r.uniform(-w * 0.4, w * 0.4), r.uniform(-h * 0.4, h * 0.4)) for _ in range(r.randint(2, 9))]
    part = cq.Workplane().box(w, h, t).faces(">Z").workplane().pushPoints(holes).hole(r.uniform(1, 6))
    return part.edges("|Z").fillet(min(w, h) * 0.1) if r.random() < 0.5 else part


def letters(r):
    text = "".join(r.choice("ABCDEGKMPQRSWX2345689&@") for _ in range(r.randint(2, 6)))
    part = cq.Workplane().box(70, 20, r.uniform(2, 5))
    return part.faces(">Z").workplane().text(text, 12, r.choice([-1, 1]) * r.uniform(0.2, 1.5))


def gear(r):
    n, radius = r.randint(9, 40), r.uniform(10, 40)
    tooth = radius * (1 + r.uniform(0.08, 0.2))
    points = []
    for i in range(n):
        for part, q in ((0, radius), (0.25, tooth), (0.5, tooth), (0.75, radius)):
            a = 2 * math.pi * (i + part) / n
            points.append((q * math.cos(a), q * math.sin(a)))
    wheel = cq.Workplane().polyline(points).close().extrude(r.uniform(2, 10)).faces(">Z").workplane().hole(radius * 0.3)
    return wheel.faces(">Z").workplane().polarArray(radius * 0.6, 0, 360, r.randint(3, 9)).hole(radius * 0.1)


def shell(r):
    part = cq.Workplane().box(r.uniform(20, 60), r.uniform(20, 60), r.uniform(10, 30)).edges("|Z").fillet(3)
    return part.faces(">Z").shell(-r.uniform(0.3, 2))


def turned(r):
    points, z = [(2, 0)], 0
    for _ in range(r.randint(4, 12)):
        x = r.uniform(4, 15)
        points.append((x, z))
        z += r.uniform(0.2, 6)
        points.append((x, z))
    return cq.Workplane("XZ").polyline([*points, (2, z)]).close().revolve(360, (0, 0, 0), (0, 1, 0))


def pipe(r):
    points = [(0, 0, 0)]
    points += [(10 * (i + 1), r.uniform(-10, 10), r.uniform(-10, 10)) for i in range(r.randint(2, 5))]
    return cq.Workplane("YZ").circle(3).circle(r.uniform(2, 2.8)).sweep(cq.Workplane().spline(points))


def loft(r):
    part = cq.Workplane().rect(r.uniform(5, 20), r.uniform(5, 20)).workplane(offset=r.uniform(5, 20))
    return part.circle(r.uniform(2, 8)).loft().faces(">Z").workplane().circle(1.5).extrude(r.uniform(1, 10))


def grid(r):
    n, m = r.randint(3, 12), r.randint(3, 10)
    part = cq.Workplane().box(5 * n + 5, 5 * m + 5, r.uniform(0.3, 4))
    return part.faces(">Z").workplane().rarray(5, 5, n, m).hole(r.uniform(1, 4.6))


def cross(r):
    part = cq.Workplane().cylinder(40, 5)
    for _ in range(r.randint(2, 6)):
        place = cq.Workplane("XZ").workplane(offset=-20).center(r.uniform(-2, 2), r.uniform(-15, 15))
        part = part.union(place.circle(r.uniform(1, 4.9)).extrude(40))
    return part.cut(cq.Workplane().cylinder(60, r.uniform(1, 3)))


def spring(r):
    path = cq.Wire.makeHelix(r.uniform(3, 6), r.uniform(10, 30), 8)
    return cq.Workplane("XZ").center(8, 0).circle(r.uniform(0.5, 1.2)).sweep(cq.Workplane(path), isFrenet=True)


def chamfered(r):
    part = cq.Workplane().box(30, 20, 10).faces(">Z").workplane().rect(20, 10).cutBlind(-r.uniform(1, 9))
    part = part.edges("|X").chamfer(r.uniform(0.1, 1))
    return part.faces(">X").workplane().hole(2).faces(">Y").workplane().hole(r.uniform(1, 3))


KINDS = [plate, letters, gear, shell, turned, pipe, loft, grid, cross, spring, chamfered]


def main():
    folder, first, last = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    for seed in range(first, last):
        r = random.Random(seed)
        kind = KINDS[seed % len(KINDS)]
        part = kind(r)
        tolerances = {"tolerance": 10 ** r.uniform(-2.5, 0), "angularTolerance": r.uniform(0.08, 0.6)}
        cq.exporters.export(part, f"{folder}/{kind.__name__}_{seed}.stl", **tolerances)


if __name__ == "__main__":
    main()
