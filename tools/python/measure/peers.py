"""Wheels of other meshers beside this one's, each run in a process of its own: seconds of all its threads, tetrahedra, quality, peak memory, exit.

    python peers.py FOLDER [MESHER...]        # prints a Markdown table, of all meshers by default

Each gets the same surface, and one of the same with a spike through it.
"""

import json
import os
import resource
import subprocess
import sys
import time

import numpy as np

SURFACES = ["balls,count=20,h=0.05", "knot,h=0.05", "box,h=0.03"]
MESHERS = ["tetdb", "tetgen", "gmsh", "pytetwild"]
# Of the clock: fTetWild takes minutes where the others take seconds.
SECONDS_MAX = 1800


def quality(points, tets):
    """q = sqrt(6)/12 longest edge / inradius of each tetrahedron."""
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    areas = sum(np.linalg.norm(np.cross(q - p, r - p), axis=1) for p, q, r in ((a, b, c), (a, b, d), (a, c, d), (b, c, d)))
    volumes = np.abs(np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)))
    longest = np.max([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (a, c), (a, d), (b, c), (b, d), (c, d))], axis=0)
    with np.errstate(divide="ignore"):
        return np.sqrt(6) / 12 * longest * areas / volumes


def mesh(name, points, triangles):
    if name == "tetdb":
        import tetdb

        return tetdb.tetrahedralize(points, triangles)
    if name == "tetgen":
        import tetgen

        found = tetgen.TetGen(points, triangles).tetrahedralize(plc=True, quality=True, nobisect=True)
        return found[0], found[1]
    if name == "pytetwild":
        import pytetwild

        return pytetwild.tetrahedralize(points, triangles)
    import gmsh

    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    surface = gmsh.model.addDiscreteEntity(2)
    gmsh.model.mesh.addNodes(2, surface, np.arange(1, len(points) + 1), points.ravel())
    gmsh.model.mesh.addElementsByType(surface, 2, [], (triangles + 1).ravel())
    gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([surface])])
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, np.int64)
    number[tags.astype(int)] = np.arange(len(tags))
    _, nodes = gmsh.model.mesh.getElementsByType(4)
    return xyz.reshape(-1, 3), number[nodes.astype(int)].reshape(-1, 4)


def one(name, file):
    data = np.load(file)
    start = time.process_time()
    points, tets = mesh(name, data["points"], data["triangles"])
    seconds = time.process_time() - start
    if not len(tets):
        raise RuntimeError("no tetrahedra, no error")
    q = quality(np.asarray(points, float), np.asarray(tets))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    kept = len(np.unique(np.concatenate([np.asarray(points), data["points"]]).round(12), axis=0)) == len(np.unique(np.asarray(points).round(12), axis=0))
    said = {"s": seconds, "tets": len(tets), "mean": float(q[np.isfinite(q)].mean()), "bad": int((q > 3).sum()), "worst": float(q.max()), "mib": peak, "kept": bool(kept)}
    print(json.dumps(said))


def main(folder, *meshers):
    import tetdb

    print("| surface | mesher | CPU s | tetrahedra | mean q | q > 3 | worst q | peak MiB | input vertices kept | surface with a spike through it |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for spec in SURFACES:
        surface = tetdb.sample(spec)
        points, triangles = surface.points, surface.triangles
        used, numbers = np.unique(triangles, return_inverse=True)
        points, triangles = points[used], numbers.reshape(-1, 3).astype(np.int32)
        spoiled = points.copy()
        at = triangles[len(triangles) // 2]
        # A spike from there through the surface at its first point.
        first = points[triangles[0][0]]
        spoiled[at[0]] = first + 0.1 * (first - points[at[0]])
        files = [os.path.join(folder, name) for name in ("good.npz", "bad.npz")]
        for file, xyz in zip(files, (points, spoiled)):
            np.savez(file, points=xyz, triangles=triangles)
        for name in meshers or MESHERS:
            done = []
            for file in files:
                words = [sys.executable, os.path.abspath(__file__), "--one", name, file]
                try:
                    done.append(subprocess.run(words, capture_output=True, text=True, check=False, timeout=SECONDS_MAX))
                except subprocess.TimeoutExpired:
                    done.append(None)
            good, bad = done
            try:
                d = json.loads(good.stdout.splitlines()[-1])
                cells = f"{d['s']:.1f} | {d['tets']} | {d['mean']:.2f} | {d['bad']} | {d['worst']:.3g} | {d['mib']:.0f} | {'yes' if d['kept'] else 'no'}"
            except (AttributeError, IndexError, ValueError):
                cells = "fails: " + (f"{SECONDS_MAX} s" if good is None else (good.stderr.strip().splitlines() or [str(good.returncode)])[-1][:80]) + " | | | | | |"
            if bad is None:
                what = f"not done after {SECONDS_MAX} s"
            elif bad.returncode < 0:
                what = f"ends the process (signal {-bad.returncode})"
            elif bad.returncode:
                what = (bad.stderr.strip().splitlines() or ["exit " + str(bad.returncode)])[-1][:90].replace("|", "/")
            else:
                what = f"returns {json.loads(bad.stdout.splitlines()[-1])['tets']} tetrahedra"
            print(f"| {spec} | {name} | {cells} | {what} |", flush=True)


if __name__ == "__main__":
    one(*sys.argv[2:]) if sys.argv[1] == "--one" else main(*sys.argv[1:])
