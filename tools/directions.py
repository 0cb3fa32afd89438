#!/usr/bin/env python3
"""Have the edges of a mesh preferred directions?

    python3 tools/directions.py MESH.vtu...

Edges farther than two tetrahedra from the surface are counted in 256 bins of equal area over the half sphere. Printed: the coefficient
of variation of the bins and what chance alone would make of it, the fullest bin over the mean; and, over cells five median edges wide,
the median of the variance of 48 bins over their mean: 1 where directions are independent, about 100 in a lattice. Needs numpy and meshio.
"""
import sys

import meshio
import numpy as np

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def inner_edges(path):
    mesh = meshio.read(path)
    points = np.asarray(mesh.points, float)
    tets = np.concatenate([c.data for c in mesh.cells if c.type == "tetra"]).astype(np.int64)
    edges = np.unique(np.sort(tets[:, EDGES].reshape(-1, 2), axis=1), axis=0)
    faces, sides = np.unique(np.sort(tets[:, FACES].reshape(-1, 3), axis=1), axis=0, return_counts=True)
    near = np.zeros(len(points), bool)
    near[faces[sides == 1].ravel()] = True
    for _ in range(2):
        near[edges[near[edges].any(1)].ravel()] = True
    return points, edges[~near[edges].any(1)]


def bins(directions, rows, columns):
    up = directions * np.where(directions[:, 2:] < 0, -1, 1)
    row = np.minimum((up[:, 2] * rows).astype(int), rows - 1)
    column = (np.arctan2(up[:, 1], up[:, 0]) / (2 * np.pi) % 1 * columns).astype(int) % columns
    return np.bincount(row * columns + column, minlength=rows * columns)


def main():
    for path in sys.argv[1:]:
        points, edges = inner_edges(path)
        directions = points[edges[:, 1]] - points[edges[:, 0]]
        length = np.linalg.norm(directions, axis=1)
        directions /= length[:, None]
        counts = bins(directions, 8, 32)
        x, y, z = (points[edges].mean(1) / (5 * np.median(length))).astype(int).T
        order = np.argsort((x * 4096 + y) * 4096 + z, kind="stable")
        _, starts = np.unique(((x * 4096 + y) * 4096 + z)[order], return_index=True)
        local = [bins(directions[cell], 4, 12) for cell in np.split(order, starts[1:]) if len(cell) > 300]
        print(f"{path}: {len(edges)} edges, variation {counts.std() / counts.mean():.4f}, chance {counts.mean() ** -0.5:.4f}, "
              f"fullest {counts.max() / counts.mean():.2f}; locally {np.median([c.var() / c.mean() for c in local]):.2f} in {len(local)} cells")


if __name__ == "__main__":
    main()
