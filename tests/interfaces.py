#!/usr/bin/env python3
"""Are the faces between sub-domains locally Delaunay?

  interfaces.py WHOLE.vtu [--near-max SHARE]

WHOLE.vtu: the export of a mesh in several sub-domains made with `--optimize none`. Each face between two of them is tested from both sides: the vertex
beyond it must not lie inside the sphere of the tetrahedron before it. Doubles with an error bound decide, rationals where they cannot. Faces are *near* when a
vertex of their two tetrahedra, or one of its neighbors, is on the surface. Exit code 0 when no other face fails, and at most SHARE (1e-4) of the near ones.
"""
import argparse
import sys
import xml.etree.ElementTree  # noqa: F401  (pyvista loads it late)
from fractions import Fraction

import numpy as np

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
# Of the determinant below, relative to the sum of the sizes of its terms; far above 2^-53 times its number of roundings.
BOUND = 1e-14


def exact(corners, beyond):
    rows = [[Fraction(float(x)) - Fraction(float(y)) for x, y in zip(c, beyond)] for c in corners]
    rows = [r + [sum(x * x for x in r)] for r in rows]

    def det(m):
        if len(m) == 1:
            return m[0][0]
        return sum((-1) ** j * m[0][j] * det([r[:j] + r[j + 1:] for r in m[1:]]) for j in range(len(m)))
    return det(rows)


def inside(points, tets, beyond):
    """Which `beyond` lie in the sphere of their tetrahedron (positive volume)."""
    rows = points[tets] - points[beyond][:, None]
    lifted = np.concatenate([rows, (rows**2).sum(2, keepdims=True)], 2)
    value = np.linalg.det(lifted)
    size = np.prod(np.abs(lifted).sum(2), 1)
    found = value < 0
    unsure = np.flatnonzero(np.abs(value) <= BOUND * size)
    for i in unsure:
        found[i] = exact(points[tets[i]], points[beyond[i]]) < 0
    return found, len(unsure)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("whole")
    parser.add_argument("--near-max", type=float, default=1e-4)
    args = parser.parse_args()
    import pyvista
    grid = pyvista.read(args.whole)
    skin = pyvista.read(args.whole[:-4] + "_boundary.vtu")
    points, tets = np.asarray(grid.points, float), grid.cells_dict[10].astype(np.int64)
    part = np.asarray(grid.cell_data["subdomain"])
    # One known case decides what sign means inside: the centroid of a tetrahedron.
    trial, _ = inside(np.vstack([points[tets[0]], points[tets[0]].mean(0)]), np.array([[0, 1, 2, 3]]), np.array([4]))
    flip = not trial[0]
    near = np.zeros(len(points), bool)
    near[skin.point_data["mesh_vertex"]] = True
    near[np.unique(tets[near[tets].any(1)])] = True
    faces = np.sort(tets[:, FACES].reshape(-1, 3), 1)
    order = np.lexsort(faces.T)
    same = (faces[order[1:]] == faces[order[:-1]]).all(1)
    a, b = order[:-1][same], order[1:][same]
    between = part[a // 4] != part[b // 4]
    a, b = a[between], b[between]
    bad, unsure = np.zeros(len(a), bool), 0
    for before, behind in ((a, b), (b, a)):
        found, n = inside(points, tets[before // 4], tets[behind // 4, behind % 4])
        bad |= ~found if flip else found
        unsure += n
    close = near[tets[a // 4]].any(1) | near[tets[b // 4]].any(1)
    far_bad, near_bad = int((bad & ~close).sum()), int((bad & close).sum())
    print(f"{len(a)} faces between sub-domains, {int(close.sum())} of them near the surface: {far_bad} not locally Delaunay elsewhere, "
          f"{near_bad} near it; {unsure} decided by rationals")
    sys.exit(int(len(a) == 0 or far_bad > 0 or near_bad > args.near_max * max(1, int(close.sum()))))


if __name__ == "__main__":
    main()
