#!/usr/bin/env python3
"""tetdb, TetGen and Gmsh on the same surfaces with sheets, edges and points inside, each by itself: validity and quality in one table.

  embedded.py SHELL.obj [SHEETS.obj] [WIRES.obj] [--tetdb PROGRAM] [--meshers tetdb,tetgen,gmsh,hxt]

Needs numpy, scipy and meshio, and gmsh and tetgen (pip names) for those. Each runs in a process of its own on one thread; CPU seconds as in
peers.py, whose measure of quality this is: *forced* tetrahedra have four vertices of the input, or a triangle of the shell on which none can
have q < 2. TetGen's module takes no edges by themselves and gets those of triangles alone. *Kept*: the triangles of shell and sheets that are
faces of tetrahedra, the edges that are edges of them, the points that are vertices; *positive*: all tetrahedra, by the sign of a double.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

import peers


def read_obj(path):
    points, faces, lines, marks = [], [], [], []
    for line in open(path) if path else ():
        word = line.split()
        if word and word[0] == "v":
            points.append([float(x) for x in word[1:4]])
        elif word and word[0] in "flp":
            corners = [int(v.split("/")[0]) - 1 for v in word[1:]]
            {"f": lambda: faces.append(corners), "l": lambda: lines.extend(zip(corners, corners[1:])), "p": lambda: marks.extend(corners)}[word[0]]()
    shape = lambda rows, n: np.array(rows, np.int64).reshape(-1, n)
    return np.array(points, float).reshape(-1, 3), shape(faces, 3), shape(lines, 2), shape(marks, 1)[:, 0]


def joined(files):
    """One list of points, triangles of the shell, of sheets, edges and points."""
    parts = [read_obj(path) for path in files]
    points, number = np.unique(np.concatenate([p[0] for p in parts]) + 0.0, axis=0, return_inverse=True)
    ends = np.cumsum([0] + [len(p[0]) for p in parts])
    number = number.reshape(-1)
    of = lambda k, what: number[parts[k][what] + ends[k]]
    return points, of(0, 1), of(1, 1), of(2, 2), of(2, 3)


def run_gmsh(points, shell, sheets, edges, marks, algorithm):
    import gmsh
    gmsh.initialize()
    for option, value in (("General.NumThreads", 1), ("General.Verbosity", 2), ("Mesh.Algorithm3D", algorithm)):
        gmsh.option.setNumber(option, value)
    known = np.zeros(len(points), bool)

    def entity(dim, tag, kind, elements):
        gmsh.model.addDiscreteEntity(dim, tag)
        nodes = np.unique(elements)
        nodes = nodes[~known[nodes]]
        known[nodes] = True
        gmsh.model.mesh.addNodes(dim, tag, nodes + 1, points[nodes].ravel())
        gmsh.model.mesh.addElementsByType(tag, kind, [], (elements + 1).ravel())
    part = peers.parts(len(points), shell)
    surfaces = list(range(1, part.max() + 2))
    for tag in surfaces:
        entity(2, tag, 2, shell[part == tag - 1])
    volume = gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(surfaces)])
    gmsh.model.geo.synchronize()
    if len(sheets):
        entity(2, len(surfaces) + 1, 2, sheets)
        gmsh.model.mesh.embed(2, [len(surfaces) + 1], 3, volume)
    if len(edges):
        entity(1, 1, 1, edges)
        gmsh.model.mesh.embed(1, [1], 3, volume)
    for k, v in enumerate(marks):
        entity(0, k + 1, 15, np.array([v]))
    if len(marks):
        gmsh.model.mesh.embed(0, list(range(1, len(marks) + 1)), 3, volume)
    with peers.Clock() as clock:
        gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    position = np.zeros((int(tags.max()) + 1, 3))
    position[tags] = xyz.reshape(-1, 3)
    return position, gmsh.model.mesh.getElementsByType(4)[1].reshape(-1, 4).astype(np.int64), clock


def run_tetgen(points, shell, sheets, edges, marks):
    import tetgen
    triangles = np.concatenate([shell, sheets])
    mesher = tetgen.TetGen(points, triangles.astype(np.int32))
    volume = 2**0.5 / 12 * peers.median_edge(points, triangles)**3
    with peers.Clock() as clock:
        nodes, tets = mesher.tetrahedralize(switches=f"pqYQa{volume:.12g}")[:2]
    return np.asarray(nodes, float), np.asarray(tets, np.int64), clock


def run_tetdb(program, files, folder):
    options = [word for option, path in zip(("--embed", "--embed-edges", "--embed-points"), (files[1], files[2], files[2])) if path
               for word in (option, path)]
    if files[2]:
        _, _, lines, marks = read_obj(files[2])
        options = [w for k in range(0, len(options), 2) for w in options[k:k + 2]
                   if not (options[k] == "--embed-edges" and not len(lines)) and not (options[k] == "--embed-points" and not len(marks))]
    store, out = os.path.join(folder, "s.tetdb"), os.path.join(folder, "s.meshb")
    before = os.times()
    subprocess.run([program, "mesh", files[0], *options, "-o", store, "--threads", "1", "--no-verify", "--quiet"], check=True,
                   stdout=subprocess.DEVNULL)
    after = os.times()
    subprocess.run([program, "export", store, out, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    clock = type("", (), {"cpu": after[2] + after[3] - before[2] - before[3]})
    return *peers.read_mesh(out), clock


def measured(points, tets, given):
    """The measure of peers.py, every vertex of the input taken for one of the surface, and what of the input is there."""
    where, shell, sheets, edges, marks = given
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    six = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a))
    if six.mean() < 0:
        six, tets = -six, tets[:, [0, 2, 1, 3]]
    used = np.unique(tets)
    place = {(points[i] + 0.0).tobytes(): i for i in used}
    number = np.array([place.get(p.tobytes(), -1) for p in where])
    faces = set(peers.keys(np.concatenate([tets[:, f] for f in peers.FACES])).tolist())
    triangles = number[np.concatenate([shell, sheets])]
    kept = sum(k in faces for k in peers.keys(triangles[(triangles >= 0).all(1)]).tolist())
    pairs = np.sort(np.concatenate([tets[:, e] for e in peers.EDGES]), axis=1)
    has = set((pairs[:, 0] * len(points) + pairs[:, 1]).tolist())
    lines = np.sort(number[edges], axis=1)
    kept_edges = sum(int(a >= 0 and a * len(points) + b in has) for a, b in lines.tolist())
    p = points[tets]
    normals = np.stack([np.cross(p[:, f[1]] - p[:, f[0]], p[:, f[2]] - p[:, f[0]]) for f in peers.FACES], 1)
    longest = np.sqrt(np.max([((p[:, i] - p[:, j])**2).sum(1) for i, j in peers.EDGES], axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        q = np.where(six > 0, peers.ALPHA * longest * np.linalg.norm(normals, axis=2).sum(1) / six, np.inf)
    is_input = np.zeros(len(points), bool)
    is_input[number[number >= 0]] = True
    free = ~is_input[tets].all(1)
    return {"tets": len(tets), "negative": int((six <= 0).sum()), "triangles": f"{kept} of {len(triangles)}",
            "edges": f"{kept_edges} of {len(edges)}" if len(edges) else "-",
            "points": f"{int((number[marks] >= 0).sum())} of {len(marks)}" if len(marks) else "-",
            "below 2": 100 * float((q[free] < 2).mean()), "worst": float(q[free].max()), "all": float(q.max())}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shell")
    parser.add_argument("sheets", nargs="?", default="")
    parser.add_argument("wires", nargs="?", default="")
    parser.add_argument("--tetdb", default="tetdb")
    parser.add_argument("--meshers", default="tetdb,tetgen,gmsh,hxt")
    parser.add_argument("--timeout", default=1800, type=float)
    parser.add_argument("--child", help=argparse.SUPPRESS)
    args = parser.parse_args()
    files = [args.shell, args.sheets, args.wires]
    given = joined(files)
    if args.child:
        with tempfile.TemporaryDirectory() as folder:
            if args.child == "tetdb":
                points, tets, clock = run_tetdb(args.tetdb, files, folder)
            elif args.child == "tetgen":
                points, tets, clock = run_tetgen(*given)
            else:
                points, tets, clock = run_gmsh(*given, 10 if args.child == "hxt" else 1)
        print("\n" + json.dumps(measured(points, tets, given) | {"cpu": clock.cpu}))
        return
    print("| mesher | tetrahedra | not positive | triangles kept | edges kept | points kept | unforced q < 2 | worst of them | worst q | CPU s |")
    print("|---" * 10 + "|")
    for mesher in args.meshers.split(","):
        command = [sys.executable, __file__, *files, "--tetdb", args.tetdb, "--child", mesher]
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=args.timeout)
            row = json.loads(done.stdout.decode().splitlines()[-1])
        except subprocess.TimeoutExpired:
            print(f"| {mesher} | not done in {args.timeout:.0f} s |")
            continue
        except (json.JSONDecodeError, IndexError):
            why = (done.stderr or done.stdout).decode(errors="replace").strip().splitlines()
            print(f"| {mesher} | ended with {done.returncode}: {(why or ['nothing said'])[-1][:100]} |")
            continue
        print(f"| {mesher} | {row['tets']} | {row['negative']} | {row['triangles']} | {row['edges']} | {row['points']} | {row['below 2']:.3f} % "
              f"| {row['worst']:.2f} | {row['all']:.2f} | {row['cpu']:.2f} |", flush=True)


if __name__ == "__main__":
    main()
