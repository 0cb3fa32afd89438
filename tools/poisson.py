#!/usr/bin/env python3
"""Can one compute with the mesh? Poisson's equation with linear elements, and the iterations that conjugate gradients take.

    tools/poisson.py PROGRAM SURFACE... [--meshers hxt] [--seconds-max 120]

-Δu = 1 inside, u = 0 on the surface; conjugate gradients with the diagonal as preconditioner until the residual has fallen by 1e-8. Flat tetrahedra
make the matrix badly conditioned, which the diagonal mends only in part: so the number of iterations, beside that on another mesher's mesh of the same
surface, says what its worst elements cost. A cell: unknowns, iterations, greatest u. Other meshers' surfaces must be complete, as in `elements.py`.
"""
import argparse
import os
import subprocess
import tempfile

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

import elements
import peers

ITERATIONS_MAX = 100_000


def stiffness(points, tets):
    """The matrix of linear elements and the right side for a source of 1, over all vertices."""
    p = points[tets]
    edges = p[:, 1:] - p[:, :1]
    six = np.linalg.det(edges)
    # Gradients of the barycentric coordinates: rows of the inverse, and the first so that their sum is zero.
    inverse = np.stack([np.cross(edges[:, (i + 1) % 3], edges[:, (i + 2) % 3]) for i in range(3)], 1) / six[:, None, None]
    gradients = np.concatenate([-inverse.sum(1, keepdims=True), inverse], 1)
    local = np.einsum("tid,tjd->tij", gradients, gradients) * (np.abs(six) / 6)[:, None, None]
    rows, columns = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, (1, 4)).ravel()
    matrix = scipy.sparse.csr_matrix((local.ravel(), (rows, columns)), shape=(len(points),) * 2)
    right = np.zeros(len(points))
    np.add.at(right, tets, (np.abs(six) / 24)[:, None])
    return matrix, right


def hull_vertices(tets):
    """Vertices of faces that one tetrahedron has."""
    faces = np.sort(tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    found, count = np.unique(faces, axis=0, return_counts=True)
    return np.unique(found[count == 1])


def solve(points, tets):
    """Unknowns, iterations (None where they did not end) and the greatest value."""
    used, number = np.unique(tets, return_inverse=True)
    points, tets = points[used], number.reshape(-1, 4)
    matrix, right = stiffness(points, tets)
    inside = np.setdiff1d(np.arange(len(points)), hull_vertices(tets))
    if not len(inside):
        return 0, 0, 0.0
    matrix, right = matrix[inside][:, inside], right[inside]
    diagonal = scipy.sparse.diags(1 / matrix.diagonal())
    n_iterations = [0]

    def count(_):
        n_iterations[0] += 1

    u, failed = scipy.sparse.linalg.cg(matrix, right, rtol=1e-8, maxiter=ITERATIONS_MAX, M=diagonal, callback=count)
    return len(inside), None if failed else n_iterations[0], float(u.max())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("surface", nargs="+")
    parser.add_argument("--meshers", default="hxt", type=lambda text: [m for m in text.split(",") if m])
    parser.add_argument("--seconds-max", default=120, type=float)
    args = parser.parse_args()
    print("| surface | tetdb | " + " | ".join(args.meshers) + " |\n" + "|---" * (2 + len(args.meshers)) + "|", flush=True)
    for surface in args.surface:
        cells = []
        with tempfile.TemporaryDirectory() as directory:
            path = peers.surface_file(args.program, surface, directory)
            points, triangles = peers.read_surface(path)
            points, number = np.unique(points, axis=0, return_inverse=True)
            arrays = os.path.join(directory, "surface.npz")
            np.savez(arrays, points=points, triangles=number.reshape(-1)[triangles].astype(np.int64))
            for mesher in ["tetdb", *args.meshers]:
                try:
                    if mesher == "tetdb":
                        found = elements.run_program(args.program, path, directory, args.seconds_max)
                    else:
                        found = elements.run_peer(mesher, arrays, directory, args.seconds_max)
                    n, iterations, most = solve(*found[:2])
                    cells.append(f"{n}, {'not ended' if iterations is None else iterations}, {most:.4g}")
                except subprocess.TimeoutExpired:
                    cells.append(f"> {args.seconds_max:g} s")
                except (subprocess.CalledProcessError, OSError, ValueError) as failure:
                    cells.append(f"failed ({type(failure).__name__})")
        print(f"| {os.path.basename(surface)} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
