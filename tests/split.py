#!/usr/bin/env python3
"""Are sheets slits in what --split-sheets writes?

  split.py TETDB FOLDER

Meshes boxes with sheets in FOLDER, exports each as it is and split, as .npy, and checks: with every double put back the two are the same; the
doubles are those that the geometry says; each triangle of a sheet stands twice, with a tetrahedron of its own side each; across a sheet no
two tetrahedra share a face. Then heat flows through a box that a sheet cuts in two, whose resistance makes the temperature jump: the error
against the exact solution must fall with the square of the edge length. Exit code 0 when all of it holds.
"""
import collections
import os
import subprocess
import sys

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

TETDB, FOLDER = sys.argv[1:3]


def grid(origin, u, v, n):
    """Corners of the 2 n n triangles of a parallelogram."""
    at = lambda i, j: np.array(origin) + np.array(u) * i / n + np.array(v) * j / n
    for i in range(n):
        for j in range(n):
            yield at(i, j), at(i + 1, j), at(i + 1, j + 1)
            yield at(i, j), at(i + 1, j + 1), at(i, j + 1)


def write_obj(path, triangles):
    numbers = {}
    faces = [[numbers.setdefault(tuple(np.round(p, 12).tolist()), len(numbers) + 1) for p in t] for t in triangles]
    with open(path, "w") as file:
        file.writelines("v %r %r %r\n" % p for p in numbers)
        file.writelines("f %d %d %d\n" % tuple(f) for f in faces)
    return {p for t in triangles for p in (tuple(np.round(q, 12).tolist()) for q in t)}


def box(n):
    x, y, z = np.eye(3)
    for o, u, v in (((0, 0, 0), y, x), ((0, 0, 1), x, y), ((0, 0, 0), x, z), ((0, 1, 0), z, x), ((0, 0, 0), z, y), ((1, 0, 0), y, z)):
        yield from grid(o, u, v, n)


def tetdb(*words):
    subprocess.run([TETDB, "--quiet", *words], check=True, stdout=subprocess.DEVNULL)


class Mesh:
    def __init__(self, name):
        load = lambda column: np.load(os.path.join(FOLDER, f"{name}_{column}.npy"))
        self.points, self.tets, self.triangles = load("points"), load("tets").astype(np.int64), load("triangles").astype(np.int64)
        self.input, self.ids = load("input_id"), load("vertex_id")


def exports(name, n, sheets, subdomains):
    """The mesh as it is, and split with its pairs."""
    path = lambda ending: os.path.join(FOLDER, name + ending)
    write_obj(path(".obj"), list(box(n)))
    write_obj(path("_sheets.obj"), [t for sheet in sheets for t in sheet])
    tetdb("mesh", path(".obj"), "--embed", path("_sheets.obj"), "-o", path(".tetdb"), "--subdomains", str(subdomains))
    tetdb("export", path(".tetdb"), path("_one.npy"))
    tetdb("export", path(".tetdb"), path("_two.npy"), "--split-sheets")
    pairs = np.loadtxt(path("_two_pairs.csv"), delimiter=",", skiprows=1, dtype=np.int64, ndmin=2)
    return Mesh(name + "_one"), Mesh(name + "_two"), pairs


def check(name, n, sheets, copies, subdomains=1):
    """`copies`: how often vertices at these points stand."""
    one, two, pairs = exports(name, n, sheets, subdomains)
    parts = len(np.unique(np.load(os.path.join(FOLDER, f"{name}_two_subdomain.npy"))))
    assert parts == subdomains, f"{parts} sub-domains"
    original = np.arange(len(two.points))
    original[pairs[:, 1]] = pairs[:, 0]
    assert (pairs[:, 1] == len(one.points) + np.arange(len(pairs))).all() and (pairs[:, 0] < len(one.points)).all()
    assert (two.points == one.points[original]).all() and (two.ids == one.ids[original]).all()
    assert (original[two.tets] == one.tets).all(), "tetrahedra differ by more than doubles"
    found = collections.Counter(tuple(np.round(p, 12).tolist()) for p in one.points[pairs[:, 0]])
    assert {p: c + 1 for p, c in found.items()} == copies, f"{len(found)} points have doubles, expected {len(copies)}"
    # Faces of tetrahedra: the boundary, as often as it is listed and nothing else, has one.
    faces = lambda tets: np.sort(np.concatenate([np.delete(tets, k, axis=1) for k in range(4)]), axis=1)
    n_sides = collections.Counter(map(tuple, faces(two.tets).tolist()))
    n_listed = collections.Counter(map(tuple, np.sort(two.triangles, axis=1).tolist()))
    n_sheet = sum(len(list(s)) for s in sheets)
    assert len(two.triangles) == len(one.triangles) + n_sheet and collections.Counter(two.input.tolist()).most_common(n_sheet)[-1][1] == 2
    free = {f for f, listed in n_listed.items() if listed == 2}
    assert all(n_sides[f] == (2 if f in free else 1) for f in n_listed), "a triangle has not its own tetrahedron"
    assert {f for f, sides in n_sides.items() if sides == 1} == set(n_listed) - free
    used = np.unique(two.tets)
    assert len(used) == len(two.points)
    print(f"{name}: {len(two.tets)} tetrahedra in {subdomains} sub-domains, {len(pairs)} doubles, {len(free)} triangles with free edges only")


def interior(sheet_n, origin, u, v):
    return {tuple(np.round(np.array(origin) + np.array(u) * i / sheet_n + np.array(v) * j / sheet_n, 12).tolist())
            for i in range(1, sheet_n) for j in range(1, sheet_n)}


def heat(n, conductance=2.0):
    """Error of the temperature in the mean square, and how far it jumps, where a sheet with this conductance lies at z = 1/2."""
    _, mesh, pairs = exports(f"heat{n}", n, [list(grid((0, 0, .5), (1, 0, 0), (0, 1, 0), n))], 1)
    assert len(pairs) == (n + 1) ** 2, "the box is not cut in two"
    corners = mesh.points[mesh.tets]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.linalg.det(edges) / 6
    inner = np.linalg.inv(edges).transpose(0, 2, 1)
    gradients = np.concatenate([-inner.sum(1, keepdims=True), inner], 1)
    local = np.einsum("nik,njk,n->nij", gradients, gradients, volume)
    size = (len(mesh.points),) * 2
    rows = lambda elements, k: (np.repeat(elements, k, 1).ravel(), np.tile(elements, (1, k)).ravel())
    matrix = sp.csr_matrix((local.ravel(), rows(mesh.tets, 4)), shape=size)
    order = np.argsort(mesh.input, kind="stable")
    twice = np.flatnonzero(mesh.input[order][1:] == mesh.input[order][:-1])
    front, back = mesh.triangles[order[twice]], mesh.triangles[order[twice + 1]]
    a, b, c = (mesh.points[front[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    mass = conductance * area[:, None, None] * (np.ones((3, 3)) + np.eye(3)) / 12
    jump = np.concatenate([front, back], axis=1)
    signs = np.array([1, 1, 1, -1, -1, -1])
    blocks = np.tile(mass, (1, 2, 2)) * signs[:, None] * signs
    matrix = matrix + sp.csr_matrix((blocks.ravel(), rows(jump, 6)), shape=size)
    # u = cos(pi x) g(z), g'' = pi^2 g, g(0) = 0, g(1) = 1, the flux conductance * jump.
    s, h, pi = np.sinh(np.pi / 2), np.cosh(np.pi / 2), np.pi
    c = (-pi * s - conductance * (h + s * s / h)) / (pi * h + 2 * conductance * s)
    a = -s / h - c
    x, _, z = mesh.points.T
    above = np.zeros(len(z), bool)
    above[np.unique(mesh.tets[corners[:, :, 2].mean(1) > .5])] = True
    exact = np.cos(pi * x) * np.where(above, np.cosh(pi * (1 - z)) + c * np.sinh(pi * (1 - z)), a * np.sinh(pi * z))
    given = (z == 0) | (z == 1)
    values = np.where(given, exact, 0)
    free = ~given
    values[free] = sp.linalg.spsolve(matrix[free][:, free].tocsc(), -matrix[free][:, given] @ values[given])
    squares = ((values - exact) ** 2)[mesh.tets].mean(1)
    return float(np.sqrt((volume * squares).sum())), float(np.ptp(exact[np.abs(z - .5) < 1e-9]))


def main():
    os.makedirs(FOLDER, exist_ok=True)
    flat = lambda n: list(grid((.25, .25, .5), (.5, 0, 0), (0, .5, 0), n))
    upright = lambda n: list(grid((.5, .25, .25), (0, .5, 0), (0, 0, .5), n))
    # Several sub-domains only where there is something to cut.
    for n, subdomains in ((8, 1), (20, 3)):
        inside = interior(n, (.25, .25, .5), (.5, 0, 0), (0, .5, 0))
        check(f"flat{subdomains}", n, [flat(n)], dict.fromkeys(inside, 2), subdomains)
        # Two that cross: four sides where both go on.
        crossing = dict.fromkeys(inside | interior(n, (.5, .25, .25), (0, .5, 0), (0, 0, .5)), 2)
        crossing.update({(.5, round(.25 + .5 * j / n, 12), .5): 4 for j in range(1, n)})
        check(f"cross{subdomains}", n, [flat(n), upright(n)], crossing, subdomains)
    # One that cuts the box in two: its rim has doubles too.
    rim = {tuple(np.round((i / 8, j / 8, .5), 12).tolist()): 2 for i in range(9) for j in range(9)}
    check("through", 8, [list(grid((0, 0, .5), (1, 0, 0), (0, 1, 0), 8))], rim)
    (coarse, jump), (fine, _) = heat(8), heat(16)
    print(f"heat through a sheet: jump up to {jump:.3f}, errors {coarse:.2e} and {fine:.2e} at half the edges: {coarse / fine:.2f} times less")
    assert coarse / fine > 3.3 and fine < .01 * jump


main()
