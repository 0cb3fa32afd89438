"""Remeshes surfaces, meshes both, and prints a table.

Distances are sampled by VTK, independently of tetdb: points on one surface, distance to the other.

    python tools/measure/remesh_surfaces.py --tetdb target/release/tetdb part.stl other.stl
"""

import argparse
import json
import pathlib
import re
import subprocess
import tempfile
import time

import numpy as np
import pyvista
import trimesh


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr else words)
    return done.stdout


def farthest(a, b, n):
    """Greatest distance from points on a to b, as sampled."""
    points, _ = trimesh.sample.sample_surface(a, n, seed=1)
    points = np.vstack([points, a.vertices])
    faces = np.hstack([np.full((len(b.faces), 1), 3), b.faces])
    _, near = pyvista.PolyData(b.vertices, faces.ravel()).find_closest_cell(points, return_closest_point=True)
    return float(np.linalg.norm(near - points, axis=1).max())


def smallest_angle(mesh):
    return float(np.degrees(mesh.face_angles.min()))


def quality(tetdb, store):
    text = run(tetdb, "info", store)
    tets = int(re.search(r"(\d+) tetrahedra", text)[1])
    worst = float(re.search(r"worst ([\d.e+]+)", text)[1])
    row = re.search(r"^ *1 to 2 +([\d.]+) %", text, re.M)
    return tets, float(row[1]) if row else 0.0, worst


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--tetdb", default="tetdb")
    parser.add_argument("--mesher", help="another program for the tetrahedra")
    parser.add_argument("--tolerance", default="0.05%")
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("files", nargs="+")
    args = parser.parse_args()
    mesher = args.mesher or args.tetdb
    print("| surface | triangles | after | s | angle | after | tolerance | old to new | new to old | tets exact | q<2 | worst | tets | q<2 | worst |")
    print("|" + "---|" * 15)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for file in args.files:
            try:
                one = row(args, mesher, folder, file)
            except (RuntimeError, ValueError) as e:
                one = f"| {pathlib.Path(file).name} | {e} |"
            print(one, flush=True)


def row(args, mesher, folder, file):
    old, new = folder / "old.off", folder / "new.off"
    old.unlink(missing_ok=True)
    run(args.tetdb, "check", file, "--repair", "--write", old)
    since = time.time()
    command = [args.tetdb, "remesh-surface", old, new, "--tolerance", args.tolerance, "--json", "--force"]
    report = json.loads(run(*command))["report"]
    seconds = time.time() - since
    a, b = (trimesh.load(p, process=False) for p in (old, new))
    away = [farthest(a, b, args.samples), farthest(b, a, args.samples)] if args.samples else [0, 0]
    cells = []
    for surface in (old, new):
        store = folder / "s.tetdb"
        run(mesher, "mesh", surface, "-o", store, "--force", "--json")
        cells += ["%d" % quality(mesher, store)[0], "%.2f %%" % quality(mesher, store)[1], "%.3g" % quality(mesher, store)[2]]
    bound = report["distance_bound"]
    first = [pathlib.Path(file).name, len(a.faces), len(b.faces), "%.1f" % seconds]
    first += ["%.3g" % smallest_angle(a), "%.3g" % smallest_angle(b), "%.3g" % bound]
    first += ["%.1f %%" % (100 * d / bound) for d in away]
    return "| " + " | ".join(str(c) for c in first + cells) + " |"


if __name__ == "__main__":
    main()
