#!/usr/bin/env python3
"""An adaptive loop around a solver: solve, keep the solution as a field, adapt the mesh to it.

  adaptive.py TETDB FOLDER [--problem layer|corner] [--h 0.08] [--rounds 3] [--factor 2] [--estimate hessian]

TETDB: the program. FOLDER: gets the stores. Poisson's equation with linear elements and a known solution on the whole boundary: `layer` is
exp(-x/0.1) in the unit cube, `corner` is r^(2/3) sin(2/3 t) in an L-shaped prism, singular at its inner edge. Surface triangles stay when a
mesh is adapted, so those at the layer or the edge are made fine before. Beside it the problem is solved on uniform meshes. Prints
tetrahedra, errors in the norms of L2 and H1, and the slope of the latter: H1 error ~ n^-slope. Exit code 0 if the last adapted error is
below that of a uniform mesh of as many tetrahedra.
"""
import argparse
import itertools
import pathlib
import subprocess
import sys

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import cg

LAYER = 0.1
# Points of a tetrahedron at which polynomials of degree 3 are integrated exactly, with their weights.
POINTS = np.vstack([np.full(4, 0.25), np.full((4, 4), 1 / 6) + np.eye(4) / 3])
WEIGHTS = np.array([-0.8, 0.45, 0.45, 0.45, 0.45])


def layer(p):
    u = np.exp(-p[..., 0] / LAYER)
    zero = np.zeros_like(u)
    return u, np.stack([-u / LAYER, zero, zero], -1), -u / LAYER**2


def corner(p):
    x, y = p[..., 0], p[..., 1]
    r, t = np.hypot(x, y), np.arctan2(y, x) % (2 * np.pi)
    r = np.maximum(r, 1e-300)
    u = r ** (2 / 3) * np.sin(2 / 3 * t)
    slope = 2 / 3 * r ** (-1 / 3)
    gradient = np.stack([-slope * np.sin(t / 3), slope * np.cos(t / 3), np.zeros_like(u)], -1)
    return u, gradient, np.zeros_like(u)


def prism(path):
    """An L-shaped prism: the square around the origin without its quadrant x > 0, y < 0."""
    outline = np.array([(0, 0), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0)])
    n = len(outline)
    caps = [(0, 2, 1), (0, 3, 2), (0, 4, 3), (0, 5, 4), (0, 6, 5), (0, 7, 6)]
    faces = [*caps, *((a + n, c + n, b + n) for a, b, c in caps)]
    for i, j in ((i, (i + 1) % n) for i in range(n)):
        faces += [(i, j, j + n), (i, j + n, i + n)]
    # Clockwise outline: all triangles look inwards until they are turned.
    points = [(*p, z) for z in (0.0, 0.5) for p in outline]
    lines = ["OFF", f"{len(points)} {len(faces)} 0", *(" ".join(map(str, p)) for p in points)]
    path.write_text("\n".join([*lines, *(f"3 {a} {c} {b}" for a, b, c in faces)]) + "\n")


def solve(points, tets, wall, problem):
    """The solution at the points, and its errors in the norms of L2 and H1."""
    corners = points[tets]
    edges = corners[:, 1:] - corners[:, :1]
    volumes = np.linalg.det(edges) / 6
    slopes = np.linalg.inv(edges)
    slopes = np.concatenate([-slopes.sum(axis=2, keepdims=True), slopes], axis=2)
    local = np.einsum("tia,tib,t->tab", slopes, slopes, volumes)
    n = len(points)
    rows, columns = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, 4).ravel()
    stiffness = coo_matrix((local.ravel(), (rows, columns)), (n, n)).tocsr()
    at = np.einsum("qa,tai->tqi", POINTS, corners)
    exact, gradients, sources = problem(at)
    load = np.einsum("q,t,tq,qa->ta", WEIGHTS, volumes, sources, POINTS)
    right = np.bincount(tets.ravel(), load.ravel(), n)
    u = np.where(wall, problem(points)[0], 0.0)
    inner = np.flatnonzero(~wall)
    matrix = stiffness[inner]
    scale = coo_matrix((1 / stiffness.diagonal()[inner], (range(len(inner)), range(len(inner)))))
    u[inner], failed = cg(matrix[:, inner], right[inner] - matrix @ u, rtol=1e-9, M=scale)
    assert not failed
    values = np.einsum("qa,ta->tq", POINTS, u[tets]) - exact
    slope = np.einsum("tia,ta->ti", slopes, u[tets])[:, None] - gradients
    integral = lambda square: float(np.sqrt(np.einsum("q,t,tq->", WEIGHTS, volumes, square)))
    return u, integral(values**2), integral((slope**2).sum(-1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tetdb")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--problem", choices=["layer", "corner"], default="layer")
    parser.add_argument("--h", type=float, default=0.08)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--factor", type=float, default=2.0)
    parser.add_argument("--estimate", choices=["hessian", "jump"], default="hessian")
    args = parser.parse_args()
    problem, h = globals()[args.problem], args.h
    fine = h * args.factor ** (-args.rounds / 3) / 2
    near = {
        "layer": ["--size-box", f"-1,-1,-1,{LAYER / 2},2,2,{fine}"],
        "corner": ["--size-cylinder", f"0,0,-1,0,0,2,{h / 4},{fine / 4}"],
    }[args.problem]

    def run(*words):
        done = subprocess.run([args.tetdb, *map(str, words)], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(map(str, words))}\n{done.stderr}")

    def made(name, h, sizes):
        """A store with edges of h on the surface and inside, shorter where sizes say so."""
        surface = args.folder / f"{name}.off"
        match args.problem:
            case "layer":
                run("sample", "box,h=1", "-o", surface)
            case "corner":
                prism(surface)
        store = args.folder / f"{name}.tetdb"
        run("mesh", surface, "-o", store, "--hsiz", h, *sizes, "--refine-surface", "--no-verify")
        return store

    def solved(store):
        run("export", store, args.folder / "m.npy")
        points, tets = (np.load(args.folder / f"m_{name}.npy") for name in ("points", "tets"))
        faces = np.sort(tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
        faces, times = np.unique(faces, axis=0, return_counts=True)
        wall = np.zeros(len(points), bool)
        wall[faces[times == 1]] = True
        return len(tets), *solve(points, tets, wall, problem)

    def said(what, n, errors, before):
        slope = f"{np.log(before[2] / errors[1]) / np.log(n / before[0]):.2f}" if before else ""
        print(f"| {what} | {n:,} | {errors[0]:.2e} | {errors[1]:.3e} | {slope} |", flush=True)
        return n, *errors

    print("| mesh | tetrahedra | L2 error | H1 error | slope |\n|---|---|---|---|---|")
    uniform = []
    for i in range(args.rounds + 1):
        store = made(f"uniform{i}", h * args.factor ** (-i / 3), [])
        n, _, *errors = solved(store)
        uniform.append(said("uniform", n, errors, uniform[-1] if uniform else None))
    store = made("adapted", h, [*near, "--hgrad", "1.5"])
    last = None
    for i in itertools.count():
        n, u, *errors = solved(store)
        last = said("adapted", n, errors, last)
        if i == args.rounds:
            break
        np.save(args.folder / "u.npy", u)
        if i:
            run("field", store, "drop", "u")
        run("field", store, "add", "u", "--at", "vertices", "--from", args.folder / "u.npy")
        wanted = int(uniform[0][0] * args.factor ** (i + 1))
        run("adapt", store, "--field", "u", "--tets", wanted, "--estimate", args.estimate, "--no-verify")
    # Between two uniform meshes the error is a power of their numbers.
    logs = np.log(np.array(uniform))
    as_many = np.exp(np.interp(np.log(last[0]), logs[:, 0], logs[:, 2]))
    print(f"H1 error of a uniform mesh of as many tetrahedra: {as_many:.3e}")
    return 0 if last[2] < as_many else 1


if __name__ == "__main__":
    sys.exit(main())
