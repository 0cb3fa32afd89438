#!/usr/bin/env python3
"""Does every export hold as many cells of each kind as the store says?

  counts.py TETDB STORE FOLDER

TETDB: the program. STORE: a store of one sub-domain, best with regions, sheets, edges and points inside. Its exports go to FOLDER and are counted
by meshio, VTK and gmsh: tetrahedra by region, input triangles, embedded edges and points, in the file or in the table beside it. Exit code 0
when all agree, else 1.
"""
import contextlib
import csv
import io
import json
import os
import subprocess
import sys
import warnings

try:
    import meshio
    import numpy as np
    import pyvista
except ImportError as error:
    sys.exit(f"skipped: {error.name} is not installed")

warnings.simplefilter("ignore")
ENDINGS = {"a.vtu": None, "a.vtkhdf": None, "a.msh": None, "b.msh": "msh22", "a.mesh": None, "a.meshb": None, "a.inp": None, "a.ele": None, "a.npy": None}


def beside(path):
    """Edges and points in the table beside a file, if there is one."""
    table = os.path.splitext(path)[0] + "_wires.csv"
    if not os.path.exists(table):
        return {}
    kinds = [row["kind"] for row in csv.DictReader(open(table))]
    return {"edges": kinds.count("edge"), "points": kinds.count("point")}


def by_meshio(path):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        mesh = meshio.read(path)
    count = lambda kind: sum(len(block.data) for block in mesh.cells if block.type == kind)
    found = {"tets": count("tetra")}
    ending = os.path.splitext(path)[1]
    if ending in (".msh", ".mesh", ".meshb"):
        found |= {"triangles": count("triangle"), "edges": count("line")}
    if ending == ".msh":
        found["points"] = count("vertex")
    if ending == ".inp":
        points = [len(rows) for name, rows in mesh.point_sets.items() if name.startswith("points_")]
        found |= {"edges": count("line"), "points": sum(points)}
    return found


def by_vtk(path):
    stem, ending = os.path.splitext(path)
    mesh, skin = pyvista.read(path), pyvista.read(f"{stem}_boundary{ending}")
    regions = np.unique(mesh.cell_data["region"], return_counts=True)
    return {"tets": mesh.n_cells, "triangles": skin.n_cells, "regions": {int(r): int(n) for r, n in zip(*regions)}}


def by_text(path):
    first = lambda ending: int(open(os.path.splitext(path)[0] + ending).readline().split()[0])
    return {"tets": first(".ele"), "triangles": first(".face"), "edges": first(".edge")}


def by_numpy(path):
    load = lambda name: np.load(f"{os.path.splitext(path)[0]}_{name}.npy")
    return {"tets": len(load("tets")), "triangles": len(load("triangles"))}


def by_gmsh(path):
    import gmsh
    gmsh.initialize(["gmsh", "-v", "1"])
    try:
        gmsh.open(path)
        count = lambda kind: len(gmsh.model.mesh.getElementsByType(kind)[0])
        return {"tets": count(4), "triangles": count(2), "edges": count(1)} | ({"points": count(15)} if path.endswith(".msh") else {})
    finally:
        gmsh.finalize()


READERS = {".vtu": (by_meshio, by_vtk), ".vtkhdf": (by_vtk,), ".msh": (by_meshio, by_gmsh), ".mesh": (by_meshio, by_gmsh), ".meshb": (by_meshio,),
           ".inp": (by_meshio,), ".ele": (by_meshio, by_text), ".npy": (by_numpy,)}


def main():
    tetdb, store, folder = sys.argv[1:]
    os.makedirs(folder, exist_ok=True)
    info = json.loads(subprocess.run([tetdb, "info", store, "--json"], capture_output=True, check=True).stdout)
    assert len(info["subdomains"]) == 1, "give a store of one sub-domain"
    want = {"tets": info["tets"], "triangles": info["input_triangles"], "regions": {r["region"]: r["tets"] for r in info["regions"] if r["filled"]},
            "edges": sum(w["edges"] for w in info["wires"]), "points": sum(w["points"] for w in info["wires"])}
    wrong = 0
    for name, kind in ENDINGS.items():
        # Each in a folder of its own, with what is written beside it.
        path = os.path.join(folder, name.replace(".", "_"), name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        subprocess.run([tetdb, "export", "-q", store, path, *(["--format", kind] if kind else [])], check=True)
        for reader in READERS[os.path.splitext(name)[1]]:
            try:
                found = beside(path) | reader(path)
            except ImportError as error:
                print(f"{name}: skipped, {error.name} is not installed")
                continue
            for key, n in found.items():
                if n != want[key]:
                    print(f"{name}: {reader.__name__[3:]} finds {key} = {n}, the store has {want[key]}")
                    wrong += 1
            print(f"{name}: {reader.__name__[3:]} finds {found}")
    sys.exit(1 if wrong else 0)


main()
