#!/usr/bin/env python3
"""Periodic pairs: does Gmsh read those of .msh, does MFEM join them, and does a periodic problem converge?

  periodic.py TETDB FOLDER

Meshes a box that is periodic in three directions and a sector of a cylinder. Pairs in .msh, of first and second order, are compared with
pairs found here by comparing all vertices. Poisson's equation with a periodic solution is solved with linear elements on two meshes; the
error must fall as h². MFEM joins the vertices of NAME_periodic.csv; every face must then be of two tetrahedra. What is not installed is skipped.
Exit code 0 when all agree, else 1.
"""
import csv
import subprocess
import sys
from pathlib import Path

try:
    import numpy as np
    import scipy.sparse as sparse
    import scipy.sparse.linalg as linalg
except ImportError:
    sys.exit("skipped: numpy or scipy is not installed")

TETDB, FOLDER = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
PAIRS = ["x-low=x-high", "y-low=y-high", "z-low=z-high"]


def tetdb(*words):
    subprocess.run([TETDB, *map(str, words), "--quiet"], check=True, cwd=FOLDER)


def mesh_box(name, h, subdomains):
    words = [w for pair in PAIRS for w in ("--periodic", pair)]
    tetdb("mesh", f"sample:box,x=1,y=0.75,z=1.25,h={h}", "-o", f"{name}.tetdb", "--hsiz", h, "--subdomains", subdomains, *words)


def sector():
    """A ring of square section over 50 degrees, its ends alike, as an .obj with groups; the axis is z."""
    n, turns = 3, 6
    ring = [(1 + i / n, j / n) for i in range(n + 1) for j in range(n + 1)]
    at = lambda k, i, j: k * (n + 1) ** 2 + i * (n + 1) + j + 1
    points = [(r * np.cos(a), r * np.sin(a), z) for k in range(turns + 1) for a in [np.radians(50 * k / turns)] for r, z in ring]
    quads = {"start": [], "end": [], "side": []}
    for i in range(n):
        for j in range(n):
            for k, name in ((0, "start"), (turns, "end")):
                quad = [at(k, i, j), at(k, i + 1, j), at(k, i + 1, j + 1), at(k, i, j + 1)]
                quads[name].append(quad if k == 0 else quad[:1] + quad[:0:-1])
    for k in range(turns):
        for i in range(n):
            quads["side"] += [[at(k, i, 0), at(k, i + 1, 0), at(k + 1, i + 1, 0), at(k + 1, i, 0)],
                              [at(k, i, n), at(k, i + 1, n), at(k + 1, i + 1, n), at(k + 1, i, n)],
                              [at(k, 0, i), at(k, 0, i + 1), at(k + 1, 0, i + 1), at(k + 1, 0, i)],
                              [at(k, n, i), at(k, n, i + 1), at(k + 1, n, i + 1), at(k + 1, n, i)]]
    with open(FOLDER / "sector.obj", "w") as out:
        out.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in (map(float, p) for p in points))
        for name, all_quads in quads.items():
            out.write(f"g {name}\n")
            for a, b, c, d in all_quads:
                out.write(f"f {a} {b} {c}\nf {a} {c} {d}\n")
    tetdb("mesh", "sector.obj", "-o", "sector.tetdb", "--periodic", "start=end")


def by_force(points, is_on, move):
    """Pairs of the vertices on a face and their partners, comparing all with all."""
    ids = np.array(sorted(points))
    all_points = np.array([points[i] for i in ids])
    pairs = set()
    for i, p in zip(ids, all_points):
        if is_on(p):
            far = np.linalg.norm(all_points - move(p), axis=1)
            assert far.min() < 1e-12
            pairs.add((int(ids[far.argmin()]), int(i)))
    return pairs


def check_gmsh(file, faces):
    """faces: for each moved surface its name, whether a point is on its master, and the motion."""
    import gmsh
    gmsh.initialize(["-v", "1"])
    gmsh.open(str(FOLDER / file))
    points = dict(zip(*(lambda tags, x: (map(int, tags), x.reshape(-1, 3)))(*gmsh.model.mesh.getNodes()[:2])))
    names = {gmsh.model.getPhysicalName(2, tag): tag for _, tag in gmsh.model.getPhysicalGroups(2)}
    for name, master, is_on, move in faces:
        found, nodes, masters, affine = gmsh.model.mesh.getPeriodicNodes(2, names[name], True)
        assert found == names[master], (file, name, found)
        assert set(zip(map(int, nodes), map(int, masters))) == by_force(points, is_on, move), (file, name)
        matrix = np.array(affine).reshape(4, 4)
        moved = [matrix @ [*points[int(m)], 1] for m in masters]
        assert np.allclose(np.array(moved)[:, :3], [points[int(n)] for n in nodes], rtol=0, atol=1e-12), (file, name)
    gmsh.finalize()
    print(f"{file}: Gmsh reads the pairs of {len(faces)} surfaces")


def exact(p):
    return np.sin(2 * np.pi * p[:, 0]) * np.cos(2 * np.pi * p[:, 1] / 0.75) + np.cos(4 * np.pi * p[:, 2] / 1.25)


def source(p):
    a, b = np.sin(2 * np.pi * p[:, 0]) * np.cos(2 * np.pi * p[:, 1] / 0.75), np.cos(4 * np.pi * p[:, 2] / 1.25)
    return 4 * np.pi ** 2 * (1 + 1 / 0.75 ** 2) * a + (4 * np.pi / 1.25) ** 2 * b + a + b


def error(name):
    """Solves -Δu + u = f with all sides joined, and returns the error in L2 over the volume."""
    tetdb("export", f"{name}.tetdb", f"{name}.npy")
    points, tets, pairs, least = (np.load(FOLDER / f"{name}_{what}.npy") for what in ("points", "tets", "periodic", "periodic_least"))
    one = np.arange(len(points))
    one[pairs] = least[:, None]
    # What is joined is joined over edges and corners too: eight corners are one.
    box = points.max(axis=0) - points.min(axis=0)
    wrapped = np.round(np.mod(points / box + 1e-9, 1), 7)
    assert len(np.unique(one)) == len(np.unique(wrapped, axis=0)), "vertices that lie at one place are not one"
    assert (one[one] == one).all() and np.allclose(wrapped[one], wrapped)
    corners = points[tets]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.linalg.det(edges) / 6
    gradients = np.linalg.inv(edges).transpose(0, 2, 1)
    gradients = np.concatenate([-gradients.sum(axis=1, keepdims=True), gradients], axis=1)
    stiff = np.einsum("tia,tja,t->tij", gradients, gradients, volume)
    mass = volume[:, None, None] * (np.ones((4, 4)) + np.eye(4)) / 20
    nodes = one[tets]
    rows, columns = (np.broadcast_to(n, stiff.shape).ravel() for n in (nodes[:, :, None], nodes[:, None, :]))
    matrix = lambda values: sparse.csr_matrix((values.ravel(), (rows, columns)), shape=(len(points),) * 2)
    free = np.unique(nodes)
    system, m = matrix(stiff + mass)[free][:, free], matrix(mass)[free][:, free]
    u = linalg.spsolve(system.tocsc(), m @ source(points[free]))
    off = u - exact(points[free])
    return float(np.sqrt(off @ (m @ off)))


def check_mfem(name):
    import mfem.ser as mfem
    tetdb("export", f"{name}.tetdb", f"{name}.mfem")
    mesh = mfem.Mesh(str(FOLDER / f"{name}.mfem"))
    joined = list(range(mesh.GetNV()))
    with open(FOLDER / f"{name}_periodic.csv") as lines:
        for row in csv.DictReader(lines):
            joined[int(row["vertex"])] = joined[int(row["partner"])] = int(row["least"])
    periodic = mfem.Mesh.MakePeriodic(mesh, joined)
    assert periodic.GetNE() == mesh.GetNE()
    # Without a boundary, each of the four faces of a tetrahedron belongs to two.
    assert periodic.GetNFaces() == 2 * periodic.GetNE() < mesh.GetNFaces()
    print(f"{name}.mfem: MFEM joins the pairs")


def main():
    mesh_box("coarse", 0.16, 1)
    mesh_box("fine", 0.08, 2)
    sector()
    move = lambda axis, side: lambda p: p + side * np.eye(3)[axis]
    sides = [1, 0.75, 1.25]
    boxes = [(f"{'xyz'[a]}-high", f"{'xyz'[a]}-low", lambda p, a=a: p[a] == 0, move(a, sides[a])) for a in range(3)]
    a = np.radians(50)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    ends = [("end", "start", lambda p: abs(p[1]) < 1e-12, lambda p: turn @ p)]
    try:
        for words in ([], ["--order", 2], ["--ascii"]):
            for name, faces in (("coarse", boxes), ("fine", boxes), ("sector", ends)):
                file = f"{name}{''.join(map(str, words))}.msh"
                tetdb("export", f"{name}.tetdb", file, *words)
                check_gmsh(file, faces)
    except ImportError:
        print("skipped: gmsh is not installed")
    coarse, fine = error("coarse"), error("fine")
    print(f"periodic Poisson problem: errors {coarse:.3e} and {fine:.3e}")
    assert fine < coarse / 3, "half the length has not about a quarter of the error"
    try:
        check_mfem("fine")
    except ImportError:
        print("skipped: mfem is not installed")


if __name__ == "__main__":
    main()
