#!/usr/bin/env python3
"""Computes `src/kernel/refine/pattern.bin`: points of a cube that repeats in all directions, without a bad tetrahedron between them.

    python3 tools/pattern.py src/kernel/refine/pattern.bin [--points 4096] [--seed 7] [--start FILE]

Random points are smoothed towards an optimal Delaunay triangulation (L. Chen and M. Holst, 2011): 1.3 % of the tetrahedra are left with
q >= 2. Then, as long as there are any, one vertex each of a dozen of them is displaced at random and everything is smoothed for a few
rounds; what leaves more of them than before is taken back. After each round points nearer to each other than 1/sqrt(2) of a length,
with a hundredth to spare, are pushed apart: no vertex of a mesh is to be nearer. Written are three 16-bit numbers for each point, in units of 1/65536 of the side.
Takes ten minutes; another version of Qhull may give another pattern, as good. Needs numpy and scipy.
"""
import argparse

import numpy as np
from scipy.spatial import Delaunay, cKDTree

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def mesh(points, width):
    """Points with those around them, which point each is, and each tetrahedron of one period once."""
    n = len(points)
    positions, numbers = [points], [np.arange(n)]
    for shift in np.ndindex(3, 3, 3):
        if shift != (1, 1, 1):
            moved = points + np.array(shift) - 1
            near = ((moved > -width) & (moved < 1 + width)).all(1)
            positions.append(moved[near])
            numbers.append(np.flatnonzero(near))
    positions, numbers = np.concatenate(positions), np.concatenate(numbers)
    tets = Delaunay(positions).simplices
    first = tets[np.arange(len(tets)), numbers[tets].argmin(1)]
    return positions, numbers, tets[first < n]

# Least distance of points whose mean spacing is that of a mesh with edges of length 1, 13.2 of which make the side of 4096 points.
LEAST = 1.01 * 0.5**0.5 / 13.2 * 16


def spread(points):
    """Points pushed apart until none is too near to another."""
    least = LEAST * len(points) ** (-1 / 3)
    for _ in range(200):
        pairs = cKDTree(points, boxsize=1).query_pairs(least, output_type="ndarray")
        if not len(pairs):
            break
        apart = points[pairs[:, 1]] - points[pairs[:, 0]]
        apart -= np.round(apart)
        length = np.linalg.norm(apart, axis=1)[:, None]
        push = apart / length * (1.002 * least - length) / 2
        move = np.zeros_like(points)
        np.add.at(move, pairs[:, 0], -push)
        np.add.at(move, pairs[:, 1], push)
        points = (points + move) % 1.0
    return points


def smooth(points, step):
    """Points one round later, and the quality and vertices of the tetrahedra before."""
    n, length = len(points), len(points) ** (-1 / 3)
    positions, numbers, tets = mesh(points, 2.2 * length)
    x = positions[tets]
    u, v, w = (x[:, k] - x[:, 0] for k in (1, 2, 3))
    vw, wu, uv = np.cross(v, w), np.cross(w, u), np.cross(u, v)
    det = np.einsum("ij,ij->i", u, vw)
    volume = np.abs(det) / 6
    longest = np.linalg.norm(x[:, EDGES[:, 0]] - x[:, EDGES[:, 1]], axis=2).max(1)
    area = sum(np.linalg.norm(np.cross(x[:, b] - x[:, a], x[:, c] - x[:, a]), axis=1) / 2 for a, b, c in FACES)
    quality = np.sqrt(6) / 12 * longest * area / (3 * volume + 1e-300)
    squares = [(e**2).sum(1)[:, None] for e in (u, v, w)]
    center = (vw * squares[0] + wu * squares[1] + uv * squares[2]) * (np.sign(det) / 12)[:, None]
    sums, weights = np.zeros((n, 3)), np.zeros(n)
    for k in range(4):
        vertex = numbers[tets[:, k]]
        np.add.at(sums, vertex, center + (x[:, 0] - x[:, k]) * volume[:, None])
        np.add.at(weights, vertex, volume)
    move = sums / weights[:, None]
    size = np.linalg.norm(move, axis=1)
    move *= np.minimum(1, 0.3 * length / np.maximum(size, 1e-300))[:, None]
    return (points + step * move) % 1.0, quality, numbers[tets]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--points", type=int, default=4096)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--start", help="a pattern to begin with in place of random points")
    args = parser.parse_args()
    random = np.random.default_rng(args.seed)
    if args.start:
        best = np.fromfile(args.start, "<u2").reshape(-1, 3) / 65536
    else:
        best = random.random((args.points, 3))
        for _ in range(60):
            best = smooth(best, 1)[0]
    best = spread(best)
    _, quality, tets = smooth(best, 0)
    while (bad := np.flatnonzero(quality >= 2)).size:
        print(f"{bad.size} of {len(tets)} tetrahedra are bad", flush=True)
        points = best.copy()
        vertices = np.unique(tets[random.permutation(bad)[:12]][:, random.integers(0, 4)])
        points[vertices] += random.normal(0, 0.2 * args.points ** (-1 / 3), (len(vertices), 3))
        for _ in range(random.integers(3, 8)):
            points = spread(smooth(points, 1)[0])
        _, after, tets_after = smooth(points, 0)
        if (after >= 2).sum() <= bad.size:
            best, quality, tets = points, after, tets_after
    (np.round(best * 65536).astype(np.int64) % 65536).astype("<u2").tofile(args.out)


if __name__ == "__main__":
    main()
