#!/usr/bin/env python3
"""Are sheets slits in what --split-sheets writes?

  split.py TETDB FOLDER [N]

Meshes boxes with sheets in FOLDER, exports each as it is and split, as .npy, and checks: with every double put back the two are the same; the
doubles are those that the geometry says; each triangle of a sheet stands twice, with a tetrahedron of its own side each; across a sheet no
two tetrahedra share a face. Then heat flows through a box that a sheet cuts in two, whose resistance makes the temperature jump: with linear
elements of scikit-fem the error against the exact solution must fall with the square of the edge length, from 1/N to 1/4N. Exit code 0 when all of it holds.
"""
import collections
import os
import subprocess
import sys

import numpy as np
import scipy.sparse as sp
import skfem
import skfem.models.poisson

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
    # u = cos(pi x) g(z), g'' = pi^2 g, g(0) = 0, g(1) = 1, the flux conductance * jump.
    s, h, pi = np.sinh(np.pi / 2), np.cosh(np.pi / 2), np.pi
    c = (-pi * s - conductance * (h + s * s / h)) / (pi * h + 2 * conductance * s)
    a = -s / h - c

    def exact(x, z, is_above):
        return np.cos(pi * x) * np.where(is_above, np.cosh(pi * (1 - z)) + c * np.sinh(pi * (1 - z)), a * np.sinh(pi * z))
    both = skfem.MeshTet(mesh.points.T, mesh.tets.T)
    basis = skfem.Basis(both, skfem.ElementTetP1())
    sheet = both.facets_satisfying(lambda x: np.abs(x[2] - .5) < 1e-9, boundaries_only=True)
    middles = both.p[2][both.t].mean(axis=0)
    below = sheet[middles[both.f2t[0, sheet]] < .5]
    assert 2 * len(below) == len(sheet), "a sheet has not two sides"
    # The jump at a vertex below is the difference to its double.
    partner = np.arange(len(mesh.points))
    partner[pairs[:, 0]], partner[pairs[:, 1]] = pairs[:, 1], pairs[:, 0]
    vertices = np.unique(both.facets[:, below])
    jump = sp.coo_matrix((np.repeat([1., -1.], len(vertices)),
                          (np.tile(vertices, 2), np.concatenate([vertices, partner[vertices]]))), shape=(len(partner),) * 2).tocsr()
    mass = skfem.models.poisson.mass.assemble(skfem.FacetBasis(both, skfem.ElementTetP1(), facets=below))
    matrix = skfem.models.poisson.laplace.assemble(basis) + conductance * jump.T @ mass @ jump
    x, _, z = both.p
    given = np.flatnonzero((z == 0) | (z == 1))
    start = np.zeros(len(z))
    start[given] = exact(x[given], z[given], z[given] > .5)
    found = skfem.solve(*skfem.condense(matrix, x=start, D=given), solver=skfem.solver_iter_pcg(rtol=1e-12))
    square = skfem.Functional(lambda w: (w.u - exact(w.x[0], w.x[2], w.x[2] > .5)) ** 2)
    error = np.sqrt(square.assemble(basis, u=basis.interpolate(found)))
    return float(error), float(np.ptp(exact(x, np.full_like(x, .5), True) - exact(x, np.full_like(x, .5), False)) / 2)


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
    n = int(sys.argv[3]) if len(sys.argv) > 3 else 6
    solved = [heat(n * 2 ** i) for i in range(3)]
    errors, jump = [error for error, _ in solved], solved[0][1]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    print(f"heat through a sheet: jump up to {jump:.3f}, errors", *(f"{e:.2e}" for e in errors), "at halves of the edges, order", *(f"{o:.2f}" for o in orders))
    assert (orders > 1.7).all() and errors[-1] < .01 * jump


main()
