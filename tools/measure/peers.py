#!/usr/bin/env python3
"""tetdb beside other meshers, and beside an older tetdb: one table for each question.

  peers.py speed    SURFACE... [--equal] [--runs 3] [--threads 1,2]    tetrahedra per CPU second, memory, quality
  peers.py elements SURFACE... [--old PROGRAM]                         number of bad tetrahedra, worst q, worst excess
  peers.py embedded SHELL.obj [SHEETS.obj] [WIRES.obj]                 sheets, edges and points inside: what is kept
  peers.py versions OLD SURFACE...                                     two builds of tetdb: counts, bad tetrahedra, seconds
  peers.py python   [SURFACE...]                                       Python modules, also with a surface that crosses itself
  peers.py poisson  SURFACE...                                         iterations of conjugate gradients on each mesh

SURFACE is a file that tetdb reads, or a sample (balls,count=100). Each sub-command has its own --help.

  peers.py speed balls,count=1000 --equal --runs 1 --meshers tetdb,hxt --tetdb target/release/tetdb
  peers.py elements part.stl --meshers hxt,gmsh,tetgen --seconds-max 45
  peers.py versions old/tetdb part.stl "sample:box,h=0.1 --hmax 0.05"

Needs numpy, scipy, meshio, trimesh, and the packages of the other meshers: gmsh (for hxt and gmsh), tetgen, pytetwild. `meshers.py` says
what is timed, `quality.py` how every mesh is measured. Each run is a process of its own. A mesh marked "!" lacks an input triangle, or has
another one on its hull.
"""
import argparse
import json
import os
import statistics
import sys
import tempfile
import time

import numpy as np

import meshers
import quality

OURS = {"tetdb": "full", "none": "none", "delaunay": "delaunay"}


def median(runs, key):
    return float(np.median([r[key] for r in runs]))


def load(surface, args, directory):
    """The surface as a file for tetdb, as arrays for the others, and its points and triangles."""
    path, arrays = meshers.surface_file(args.tetdb, surface, directory), os.path.join(directory, "surface.npz")
    points, triangles = meshers.read_surface(path)
    np.savez(arrays, points=points, triangles=triangles)
    return path, arrays, points, triangles


def meshes(path, arrays, args, directory, scale=1.0, old=None):
    """(name, mesh and seconds) by tetdb on one thread, the older one if there is one, and the others; a failure in words instead."""
    programs = ([("old", old)] if old else []) + [("tetdb", args.tetdb)]
    for name, program in programs + [(m, None) for m in args.meshers]:
        out = os.path.join(directory, "mesh.meshb" if program else "mesh.npz")
        try:
            if program:
                run = meshers.run_tetdb(program, [path, "--threads", "1"], directory, out, timeout=args.seconds_max)
            else:
                run = meshers.run_other(name, arrays, out, 1, scale, args.seconds_max)
            yield name, (*meshers.read_mesh(out), run["cpu"])
        except meshers.FAILURES as failure:
            yield name, meshers.why(failure)


def speed(args):
    """With --equal the others get a greatest length with which they generate as many tetrahedra as tetdb, within 5 % (TetGen a greatest
    volume); found by trial, which is not timed. Without it each uses its defaults, and rates flatter whoever generates more tetrahedra.
    Runs take turns (a b c a b c), so that a slower machine slows all; medians are printed. Memory is the peak of the process less what it
    held before meshing. `none` and `delaunay` are tetdb with that --optimize; `hxt-file` and `gmsh-file` are whole commands, file to file."""
    if args.equal and args.meshers[0] != "tetdb":
        sys.exit("--equal needs tetdb as the first mesher")
    rows = []
    for surface in args.surface:
        with tempfile.TemporaryDirectory() as directory:
            rows += speed_of(surface, args, directory)
    if args.json:
        with open(args.json, "w") as file:
            json.dump(rows, file, indent=1)


def speed_of(surface, args, directory):
    path, arrays, _, triangles = load(surface, args, directory)
    # More threads generate another mesh only with HXT, and no better one.
    kinds = [(m, n) for m in args.meshers for n in args.threads if n == args.threads[0] or m not in ("gmsh", "tetgen")]
    runs, measures, scales = {k: [] for k in kinds}, {}, {}
    more = ["--subdomains", str(args.subdomains)] if args.subdomains else []
    for turn in range(args.runs):
        for mesher, threads in kinds:
            keep = None
            if turn == 0 and threads == args.threads[0] and not args.no_measure and not mesher.endswith("-file"):
                keep = os.path.join(directory, "mesh.meshb" if mesher in OURS else "mesh.npz")
            try:
                if mesher in OURS:
                    words = [path, "--threads", str(threads), "--optimize", OURS[mesher], *more]
                    run = meshers.run_tetdb(args.tetdb, words, directory, keep, True, args.timeout)
                else:
                    if args.equal and mesher not in scales:
                        wanted = runs["tetdb", args.threads[0]][0]["tets"]
                        alike = scales.get(mesher.removesuffix("-file"))
                        scales[mesher] = alike or meshers.scale_for(mesher, arrays, wanted, args.timeout)
                    run = meshers.run_other(mesher, arrays, keep, threads, scales.get(mesher, 0.0), args.timeout)
                runs[mesher, threads].append(run)
            except meshers.FAILURES as failure:
                print(f"# {mesher} on {surface}: {meshers.why(failure)}", file=sys.stderr)
                continue
            if keep:
                measures[mesher] = quality.measure(*meshers.read_mesh(keep), len(triangles))
                os.remove(keep)
    return print_speed(surface, len(triangles), kinds, runs, measures, scales, args)


def print_speed(surface, n_triangles, kinds, runs, measures, scales, args):
    print(f"\n{surface}: {n_triangles} triangles, {args.runs} runs in turn, " + ("equal counts" if args.equal else "defaults of each"))
    print("| mesher, threads | tets | CPU s | s | tets per CPU second | over HXT's | one thread's s / s | q in [1,2[ | worst q | "
          "unforced: q in [1,2[ | worst | forced | least dihedral | locally Delaunay | peak bytes/tet | verify, s |")
    print("|---" * 16 + "|")
    rows = []
    for mesher, threads in kinds:
        own = runs[mesher, threads]
        if not own:
            print(f"| {mesher}, {threads} | failed |")
            continue
        tets, cpu, wall = (median(own, key) for key in ("tets", "cpu", "wall"))
        hxt, first = runs.get(("hxt", threads)), runs[mesher, args.threads[0]]
        share = f"{tets / cpu * median(hxt, 'cpu') / median(hxt, 'tets'):.2f}" if hxt else ""
        faster = f"{median(first, 'wall') / wall:.2f}" if threads != args.threads[0] and first else ""
        wanted = runs.get(("tetdb", args.threads[0])) if args.equal else None
        unequal = " (not equal)" if wanted and abs(tets / wanted[0]["tets"] - 1) > meshers.EQUAL else ""
        shown = [""] * 7
        if threads == args.threads[0] and mesher in measures:
            m = measures[mesher]
            shown = [f"{m['q12']:.3f} %", f"{m['worst']:.2f}", f"{m['q12_unforced']:.3f} %", f"{m['worst_unforced']:.2f}",
                     f"{m['forced']:.2f} %", f"{m['dihedral']:.1f}", f"{m['delaunay']:.2f} %"]
        cells = [f"{mesher}, {threads}", f"{tets:.0f}{unequal}", f"{cpu:.2f}", f"{wall:.2f}", f"{tets / cpu:.0f}", share, faster, *shown,
                 f"{median(own, 'peak') / tets:.0f}", f"{median(own, 'verify'):.1f}" if "verify" in own[0] else ""]
        print("| " + " | ".join(cells) + " |", flush=True)
        for run in own:
            run.pop("parts", None)
        rows.append({"surface": surface, "mesher": mesher, "threads": threads, "scale": scales.get(mesher), "runs": own,
                     "measure": measures.get(mesher)})
    return rows


def elements(args):
    """Each cell: tetrahedra, q < 2, number of q >= 10, worst q, worst excess, share of excess > 2, least dihedral angle, CPU seconds.
    *Below*: tetrahedra with a q below their bound by more than 1 in 1000; there must be none."""
    names = (["old"] if args.old else []) + ["tetdb"] + args.meshers
    print("| surface | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 1))
    below, ratios = dict.fromkeys(names, 0), []
    for surface in args.surface:
        with tempfile.TemporaryDirectory() as directory:
            path, arrays, points, triangles = load(surface, args, directory)
            cells, worst = [], {}
            for name, mesh in meshes(path, arrays, args, directory, old=args.old):
                if isinstance(mesh, str):
                    cells.append(mesh)
                    continue
                m = quality.measure_elements(*mesh[:2], points, triangles)
                below[name] += m["below"]
                if m["complete"] or name in ("old", "tetdb"):
                    worst[name] = m["worst"]
                cells.append(f"{'' if m['complete'] else '! '}{m['n']}, {m['good']:.1f} %, {m['poor']}, {m['worst']:.3g}, {m['excess']:.3g}, "
                             f"{m['over']:.2f} %, {m['dihedral']:.2g}°, {mesh[2]:.1f} s")
        print(f"| {os.path.basename(surface)} | " + " | ".join(cells) + " |", flush=True)
        others = [q for name, q in worst.items() if name not in ("old", "tetdb")]
        if others and "tetdb" in worst:
            ratios.append(worst["tetdb"] / min(others))
    print("\nTetrahedra below their bound: " + ", ".join(f"{n} {k}" for n, k in below.items()) + ".")
    if ratios:
        ratios = np.array(ratios)
        print(f"Worst q over that of the best other complete mesh, {len(ratios)} surfaces: at most 1 on {(ratios <= 1.0001).sum()}, "
              f"above 1.5 on {(ratios > 1.5).sum()}, {ratios.max():.3g} at most.")


def read_obj(path):
    """Points, triangles, edges and points by themselves of a Wavefront file; none of each for an empty path."""
    points, faces, lines, marks = [], [], [], []
    for line in open(path) if path else ():
        word = line.split()
        if word and word[0] == "v":
            points.append([float(x) for x in word[1:4]])
        elif word and word[0] in "flp":
            corners = [int(v.split("/")[0]) - 1 for v in word[1:]]
            if word[0] == "f":
                faces.append(corners)
            elif word[0] == "l":
                lines.extend(zip(corners, corners[1:]))
            else:
                marks.extend(corners)
    return [np.array(points, float).reshape(-1, 3)] + [np.array(rows, np.int64).reshape(-1, n) for rows, n in ((faces, 3), (lines, 2), (marks, 1))]


def embedded(args):
    """Kept: triangles of shell and sheets that are faces, edges that are edges, points that are vertices of the mesh. Unforced tetrahedra
    have a vertex that is not of the input. TetGen's module takes no edges by themselves, only those of triangles."""
    files = [args.shell, args.sheets, args.wires]
    parts = [read_obj(path) for path in files]
    points, number = np.unique(np.concatenate([p[0] for p in parts]) + 0.0, axis=0, return_inverse=True)
    starts = np.cumsum([0] + [len(p[0]) for p in parts])
    shell, sheets, edges, marks = (number.reshape(-1)[parts[k][what] + starts[k]] for k, what in ((0, 1), (1, 1), (2, 2), (2, 3)))
    args.tetdb_words = [args.shell]
    for option, path, has in (("--embed", args.sheets, sheets), ("--embed-edges", args.wires, edges), ("--embed-points", args.wires, marks)):
        args.tetdb_words += [option, path] if len(has) else []
    print("| mesher | tetrahedra | not positive | triangles kept | edges kept | points kept | unforced q < 2 | worst of them | worst q | CPU s |")
    print("|---" * 10 + "|")
    for mesher in args.meshers:
        with tempfile.TemporaryDirectory() as directory:
            arrays = os.path.join(directory, "input.npz")
            np.savez(arrays, points=points, triangles=shell, sheets=sheets, edges=edges, marks=marks.reshape(-1))
            try:
                if mesher == "tetdb":
                    out = os.path.join(directory, "mesh.meshb")
                    run = meshers.run_tetdb(args.tetdb, [*args.tetdb_words, "--threads", "1"], directory, out, timeout=args.timeout)
                else:
                    out = os.path.join(directory, "mesh.npz")
                    run = meshers.run_other(mesher, arrays, out, timeout=args.timeout)
            except meshers.FAILURES as failure:
                print(f"| {mesher} | {meshers.why(failure)} |", flush=True)
                continue
            m = quality.measure_embedded(*meshers.read_mesh(out), points, np.concatenate([shell, sheets]), edges, marks.reshape(-1))
        print(f"| {mesher} | {m['tets']} | {m['negative']} | {' | '.join(m['kept'])} | {m['below 2']:.3f} % | {m['worst']:.2f} | {m['all']:.2f} | "
              f"{run['cpu']:.2f} |", flush=True)


def versions(args):
    """Each cell: tetrahedra, share of q < 2, number of q >= 10, worst q, seconds on one thread, from the store's own summary. A surface may
    have options of `tetdb mesh` behind it. Exit code 1 when the newer build has more tetrahedra of q >= 10 somewhere."""
    print("| surface | old | new | count | q >= 10 |\n|---|---|---|---|---|")
    ratios = []
    for surface in args.surface:
        cells, found = [], []
        for program in (args.old, args.tetdb):
            file, *words = surface.split()
            file = file if os.path.exists(file) or file.startswith("sample:") else f"sample:{file}"
            try:
                with tempfile.TemporaryDirectory() as directory:
                    words = [file, *words, *args.mesh.split(), "--threads", "1"]
                    begun = time.monotonic()
                    run = meshers.run_tetdb(program, words, directory, timeout=args.seconds_max)
                    seconds = time.monotonic() - begun
            except meshers.FAILURES as failure:
                cells.append(meshers.why(failure))
                continue
            bins = np.sum([part["quality"]["bins"] for part in run["parts"]], axis=0)
            worst = max(part["quality"]["worst"] for part in run["parts"])
            found.append((run["tets"], bins[-1]))
            cells.append(f"{run['tets']:,}, {100 * bins[0] / bins.sum():.1f} %, {bins[-1]:,}, {worst:.3g}, {seconds:.1f} s")
        ratio = ["", ""]
        if len(found) == 2:
            (n_old, bad_old), (n_new, bad_new) = found
            ratio = [f"{n_new / n_old:.3f}", f"{bad_new / bad_old:.3f}" if bad_old else ("-" if not bad_new else "more")]
            ratios += [bad_new / bad_old if bad_old else 1 + bad_new]
        print(f"| {os.path.basename(surface)} | " + " | ".join(cells + ratio) + " |", flush=True)
    if ratios:
        print(f"\nNumber of q >= 10: {statistics.median(ratios):.3f} times in the median of {len(ratios)}, {max(ratios):.3f} at most.")
    return int(any(ratio > 1 for ratio in ratios))


def spiked(points, triangles):
    """The same surface with one vertex moved through the surface."""
    moved = points.copy()
    at, first = triangles[len(triangles) // 2][0], points[triangles[0][0]]
    moved[at] = first + 0.1 * (first - points[at])
    return moved


def python(args):
    """Arrays in, arrays out, sizes by each one's defaults (TetGen with a greatest volume, as in `speed`). `module` is tetdb's Python package, which has to be installed. The last column
    is the same surface with a spike through it."""
    print("| surface | mesher | CPU s | tetrahedra | mean q | q > 3 | worst q | peak MiB | input vertices kept | with a spike through it |")
    print("|---" * 10 + "|")
    for surface in args.surface or ["balls,count=20,h=0.05", "knot,h=0.05", "box,h=0.03"]:
        with tempfile.TemporaryDirectory() as directory:
            _, arrays, points, triangles = load(surface, args, directory)
            bad, out = os.path.join(directory, "bad.npz"), os.path.join(directory, "mesh.npz")
            np.savez(bad, points=spiked(points, triangles), triangles=triangles)
            for mesher in args.meshers:
                try:
                    run = meshers.run_other(mesher, arrays, out, timeout=args.timeout)
                    nodes, tets = meshers.read_mesh(out)
                    q, _ = quality.qualities(nodes, quality.oriented(nodes, tets))
                    kept = np.isin(*quality.place_numbers(points, nodes)).all()
                    cells = (f"{run['cpu']:.1f} | {len(tets)} | {q[np.isfinite(q)].mean():.2f} | {(q > 3).sum()} | {q.max():.3g} | "
                             f"{run['peak'] / 2**20:.0f} | {'yes' if kept else 'no'}")
                except meshers.FAILURES as failure:
                    cells = meshers.why(failure) + " |" * 6
                try:
                    outcome = f"returns {meshers.run_other(mesher, bad, None, timeout=args.timeout)['tets']} tetrahedra"
                except meshers.FAILURES as failure:
                    outcome = meshers.why(failure)
                print(f"| {surface} | {mesher} | {cells} | {outcome} |", flush=True)


def poisson(args):
    """-Δu = 1 inside, u = 0 on the surface. Each cell: unknowns, iterations until the residual has fallen by 1e-8, greatest u. Flat
    tetrahedra make the matrix badly conditioned, so the iterations say what a mesh's worst elements cost."""
    from poisson import solve
    print("| surface | tetdb | " + " | ".join(args.meshers) + " |\n" + "|---" * (2 + len(args.meshers)) + "|", flush=True)
    for surface in args.surface:
        cells = []
        with tempfile.TemporaryDirectory() as directory:
            path, arrays, _, _ = load(surface, args, directory)
            for _, mesh in meshes(path, arrays, args, directory):
                if not isinstance(mesh, str):
                    n, iterations, most = solve(*mesh[:2])
                    mesh = f"{n}, {'not ended' if iterations is None else iterations}, {most:.4g}"
                cells.append(mesh)
        print(f"| {os.path.basename(surface)} | " + " | ".join(cells) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def names(text):
        return [m for m in text.split(",") if m]

    def command(function, others):
        sub = commands.add_parser(function.__name__, description=function.__doc__)
        sub.set_defaults(run=function)
        sub.add_argument("--tetdb", default="tetdb", help="the program [default: tetdb]")
        if others is not None:
            sub.add_argument("--meshers", default=others, type=names, help=f"[default: {others}]")
        return sub

    sub = command(speed, "tetdb,hxt,gmsh,tetgen")
    sub.add_argument("surface", nargs="+")
    sub.add_argument("--runs", default=3, type=int)
    sub.add_argument("--threads", default="1", type=lambda text: [int(n) for n in text.split(",")], help="numbers of threads to run with")
    sub.add_argument("--equal", action="store_true", help="give the others lengths with which they generate as many tetrahedra as tetdb")
    sub.add_argument("--subdomains", type=int, help="number of sub-domains [default: tetdb's own choice]")
    sub.add_argument("--no-measure", action="store_true", help="speed only: measuring 10 M tetrahedra takes minutes and 6 GB")
    sub.add_argument("--timeout", default=3600, type=float)
    sub.add_argument("--json", metavar="FILE")
    for function, others in ((elements, "hxt,gmsh,tetgen"), (poisson, "hxt")):
        sub = command(function, others)
        sub.add_argument("surface", nargs="+")
        sub.add_argument("--seconds-max", default=120, type=float)
        if function is elements:
            sub.add_argument("--old", metavar="PROGRAM", help="an older tetdb, as one more column")
    sub = command(embedded, "tetdb,tetgen,gmsh,hxt")
    sub.add_argument("shell")
    sub.add_argument("sheets", nargs="?", default="")
    sub.add_argument("wires", nargs="?", default="", help="edges and points by themselves")
    sub.add_argument("--timeout", default=1800, type=float)
    sub = command(versions, None)
    sub.add_argument("old")
    sub.add_argument("surface", nargs="+")
    sub.add_argument("--mesh", default="--regions all", help="words for `tetdb mesh` [default: --regions all]")
    sub.add_argument("--seconds-max", type=float, default=600)
    sub = command(python, "module,tetgen,gmsh,pytetwild")
    sub.add_argument("surface", nargs="*")
    sub.add_argument("--timeout", default=1800, type=float)
    args = parser.parse_args()
    sys.exit(args.run(args))


if __name__ == "__main__":
    main()
