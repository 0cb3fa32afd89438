#!/usr/bin/env python3
"""The elements of meshes of surfaces, before and after and beside other meshers: numbers, worst q, worst excess, angles.

    tools/elements.py OLD NEW SURFACE... [--meshers hxt,gmsh,tetgen] [--seconds-max 120]

OLD and NEW are programs, `-` for none. A surface is a file or `sample:SPEC`. Every mesh is measured by the same code, that of `peers.py`. *Excess* is q over
the least q that any tetrahedron on the same input triangles can have, found here by search on grids: on its own, so that the program's search is checked by
another. Two triangles that meet at a sharp edge force more than each alone; that is left out here, so excess is not below the program's.

Other meshers count where every input triangle is a face of their mesh and nothing was added on the surface ("!" otherwise). *Below*: tetrahedra with a q
below their bound by more than 1 in 1000; there must be none.
"""
import argparse
import os
import resource
import subprocess
import tempfile

import numpy as np

import peers

# Where the search for the best apex begins, in longest edges: along the longest edge, away from it, up.
START, HALF = np.array([0.5, 0.2, 0.6]), 1.0
GRID = np.stack(np.meshgrid(*[np.linspace(-1, 1, 3)] * 3), -1).reshape(-1, 3)


def quality(p):
    """q of tetrahedra (…, 4, 3), infinite where the volume is not positive."""
    u, v, w = (p[..., k, :] - p[..., 0, :] for k in (1, 2, 3))
    areas = sum(np.linalg.norm(np.cross(a, b), axis=-1) for a, b in ((v, w), (w, u), (u, v), (v - u, w - u)))
    longest = np.sqrt(np.max([(e**2).sum(-1) for e in (u, v, w, v - u, w - u, w - v)], axis=0))
    six = np.einsum("...i,...i", u, np.cross(v, w))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(six > 0, peers.ALPHA * longest * areas / six, np.inf)


def inner_radius(corners):
    """Radius of the inscribed circle over the longest edge."""
    a, b, c = (corners[:, k] for k in range(3))
    lengths = np.stack([np.linalg.norm(x - y, axis=1) for x, y in ((a, b), (b, c), (c, a))])
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / lengths.sum(0) / lengths.max(0)


def quality_above(base, apex):
    """q with apexes (n, k, 3) over triangles (n, 3, 2) of longest edge 1: the inradius is three volumes over the sum of the areas."""
    longest, areas = np.ones(apex.shape[:2]), 0.0
    for k in range(3):
        a, b = base[:, None, k], base[:, None, (k + 1) % 3]
        edge, to = b - a, apex[..., :2] - a
        longest = np.maximum(longest, (to**2).sum(-1) + apex[..., 2]**2)
        away = edge[..., 0] * to[..., 1] - edge[..., 1] * to[..., 0]
        areas = areas + np.sqrt(away**2 + (edge**2).sum(-1) * apex[..., 2]**2)
    double = np.abs(base[:, 1, 0] * base[:, 2, 1])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        q = peers.ALPHA * np.sqrt(longest) * (areas + double) / (double * apex[..., 2])
    return np.where(np.isfinite(q), q, np.inf)


def face_least(corners):
    """The least q of tetrahedra on triangles (n, 3, 3): a grid of apexes, moved to its best and made finer again and again."""
    least = np.empty(len(corners))
    for s in range(0, len(corners), 4096):
        p = corners[s:s + 4096]
        lengths = np.stack([np.linalg.norm(p[:, (k + 1) % 3] - p[:, k], axis=1) for k in range(3)], 1)
        turn = lengths.argmax(1)
        a, b, c = (p[np.arange(len(p)), (turn + k) % 3] for k in range(3))
        longest = lengths.max(1, keepdims=True)
        u, v = (b - a) / longest, (c - a) / longest
        x = np.einsum("ij,ij->i", u, v)
        y = np.linalg.norm(np.cross(u, v), axis=1)
        corners_2d = np.zeros((len(p), 3, 2))
        corners_2d[:, 1, 0], corners_2d[:, 2, 0], corners_2d[:, 2, 1] = 1, x, y
        at, half, best = np.repeat(START[None], len(p), 0), np.full(len(p), HALF), np.full(len(p), np.inf)
        rows = np.arange(len(p))
        for _ in range(56):
            apex = at[:, None] + half[:, None, None] * GRID
            apex[..., 2] = np.abs(apex[..., 2])
            q = quality_above(corners_2d, apex)
            k = q.argmin(1)
            better = q[rows, k] < best
            at[better], best[better] = apex[rows, k][better], q[rows, k][better]
            half *= np.where(better, 0.9, 0.65)
        least[s:s + 4096] = best
    return least


def elements(points, tets, surface_points, triangles):
    """What the table shows of a mesh, and how many tetrahedra are below their bound."""
    table = peers.measure(points, tets, len(triangles))
    a, b, c, d = (points[tets[:1000, k]] for k in range(4))
    if np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)).mean() < 0:
        tets = tets[:, [0, 2, 1, 3]]
    # One number for each position: vertices are those of the surface, whatever their order.
    _, number = np.unique(np.concatenate([surface_points, points]), axis=0, return_inverse=True)
    number = number.reshape(-1)
    wanted = np.unique(peers.keys(number[:len(surface_points)][triangles]))
    own = number[len(surface_points):]
    keys = np.stack([peers.keys(own[tets[:, f]]) for f in peers.FACES], 1)
    on_surface = np.isin(keys, wanted)
    complete = len(np.unique(keys[on_surface])) == len(wanted) and table["hull_faces"] <= len(wanted)
    q = quality(points[tets])
    floor = np.zeros(on_surface.shape)
    for i, f in enumerate(peers.FACES):
        with np.errstate(divide="ignore"):
            floor[:, i] = np.where(on_surface[:, i], peers.ALPHA / inner_radius(points[tets[:, f]]), 0)
    # The least q of a face is between its floor and 1.42 times that: the search is for those where it matters.
    bound = np.maximum(floor.max(1), 1.0)
    t, i = np.nonzero(on_surface & ((q[:, None] < 1.42 * floor) | (q[:, None] > 2)) & np.isfinite(floor) & (1.42 * floor >= bound[:, None]))
    least = face_least(points[tets[t[:, None], peers.FACES[i]]]) if len(t) else np.empty(0)
    np.maximum.at(bound, t, least)
    excess = np.where(np.isfinite(bound), q / bound, 1.0)
    return {"n": len(tets), "good": 100 * float((q < 2).mean()), "poor": int((q >= 10).sum()), "worst": float(q.max()), "excess": float(excess.max()),
            "over": 100 * float((excess > 2).mean()), "dihedral": table["dihedral"], "complete": complete, "below": int((excess < 0.999).sum())}


def run_program(program, surface, directory, seconds_max):
    store, mesh = os.path.join(directory, "a.tetdb"), os.path.join(directory, "a.meshb")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "mesh", surface, "-o", store, "--threads", "1", "--no-verify", "--json"], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, timeout=seconds_max)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "export", store, mesh], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return *peers.read_mesh(mesh), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run_peer(mesher, arrays, directory, seconds_max):
    out = os.path.join(directory, "peer.npz")
    answer = peers.run_other(mesher, arrays, out, 1, 1.0, seconds_max)
    with np.load(out) as file:
        return file["points"], file["tets"], answer["cpu"]


def compare(surface, args):
    """One row: a cell for each mesher."""
    with tempfile.TemporaryDirectory() as directory:
        program = args.new if args.new != "-" else args.old
        path = peers.surface_file(program, surface, directory)
        points, triangles = peers.read_surface(path)
        points, number = np.unique(points, axis=0, return_inverse=True)
        triangles = number.reshape(-1)[triangles].astype(np.int64)
        arrays = os.path.join(directory, "surface.npz")
        np.savez(arrays, points=points, triangles=triangles)
        cells = {}
        for name, mesher in [("old", args.old), ("new", args.new)] + [(m, m) for m in args.meshers]:
            if mesher == "-":
                continue
            try:
                with tempfile.TemporaryDirectory() as own:
                    if name in ("old", "new"):
                        found = run_program(mesher, path, own, args.seconds_max)
                    else:
                        found = run_peer(mesher, arrays, own, args.seconds_max)
                    cells[name] = elements(*found[:2], points, triangles) | {"seconds": found[2]}
            except subprocess.TimeoutExpired:
                cells[name] = f"> {args.seconds_max:g} s"
            except (subprocess.CalledProcessError, OSError, ValueError) as failure:
                cells[name] = f"failed ({type(failure).__name__})"
        return cells


def show(cell):
    if isinstance(cell, str):
        return cell
    return (f"{'' if cell['complete'] else '! '}{cell['n']}, {cell['good']:.1f} %, {cell['poor']}, {cell['worst']:.3g}, {cell['excess']:.3g}, "
            f"{cell['over']:.2f} %, {cell['dihedral']:.2g}°, {cell['seconds']:.1f} s")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("surface", nargs="+")
    parser.add_argument("--meshers", default="hxt,gmsh,tetgen", type=lambda text: [m for m in text.split(",") if m])
    parser.add_argument("--seconds-max", default=120, type=float)
    args = parser.parse_args()
    names = [n for n, m in (("old", args.old), ("new", args.new)) if m != "-"] + args.meshers
    print("Each cell: tetrahedra, q < 2, number of q >= 10, worst q, worst excess, excess > 2, least dihedral angle, CPU seconds.\n")
    print("| surface | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 1))
    below, ratios = dict.fromkeys(names, 0), []
    for surface in args.surface:
        cells = compare(surface, args)
        print(f"| {os.path.basename(surface)} | " + " | ".join(show(cells.get(n, "")) for n in names) + " |", flush=True)
        measured = {n: c for n, c in cells.items() if isinstance(c, dict)}
        for n, c in measured.items():
            below[n] += c["below"]
        others = [c["worst"] for n, c in measured.items() if n not in ("old", "new") and c["complete"]]
        if others and "new" in measured:
            ratios.append(measured["new"]["worst"] / min(others))
    print("\nTetrahedra below their bound: " + ", ".join(f"{n} {k}" for n, k in below.items()) + ".")
    if ratios:
        ratios = np.array(ratios)
        print(f"Worst q of new over that of the best other mesher, {len(ratios)} surfaces: at most 1 on {(ratios <= 1.0001).sum()}, "
              f"above 1.5 on {(ratios > 1.5).sum()}, {ratios.max():.3g} at most.")


if __name__ == "__main__":
    main()
