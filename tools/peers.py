#!/usr/bin/env python3
"""tetdb and other meshers on the same surface, in turn: speed and quality in one table.

  peers.py SURFACE... [--tetdb PROGRAM] [--meshers tetdb,none,hxt,gmsh,tetgen] [--runs 3] [--threads 1,2] [--equal] [--subdomains N]
           [--no-measure] [--json FILE]

SURFACE: a file tetdb reads, or a sample (balls,count=100). `none` and `delaunay` are tetdb with that `--optimize`. Needs numpy,
scipy, meshio, trimesh, and gmsh and tetgen (pip names) for those meshers.

With --equal the others get a greatest length with which they make as many tetrahedra as tetdb, within 5 % (TetGen a greatest volume);
found by trial, which is not timed. Without it each does what it does by
itself, and rates flatter whoever makes more tetrahedra.

Each run is a process of its own; runs go round and round (a b c a b c), so that a machine that slows down slows all; medians
are printed. CPU seconds are user + system. What is timed:
  tetdb       the whole process: surface file read and validated, sizes, prediction, mesh, optimization, sealed store on disk
              (`--no-verify`; what verification adds is in the column "verify")
  hxt, gmsh   the call that meshes volumes alone: surface in memory already, no validation, result in memory
  tetgen      the call `tetrahedralize` alone, likewise; it knows one thread only
Memory is the peak of the process less what it had before meshing began.
All meshers keep the surface: no vertex is added on it. HXT and Gmsh get each connected part as a discrete surface of its own.

Every mesh is measured by the same code: q = (sqrt(6)/12) * longest edge / inradius. *Forced* tetrahedra have a triangle of the
surface on which no tetrahedron can have q < 2, or have four vertices on the surface. A face is locally Delaunay unless the
vertex beyond it is inside the sphere by more than rounding.
"""
import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
ALPHA = 6**0.5 / 12
BLOCK = 1 << 19
# Counts are equal when they differ by no more than this share; trials before a mesher is given up.
EQUAL = 0.05
TRIALS = 7


def peak_bytes():
    """Most memory this process ever held; what getrusage tells begins with that of the process that started it."""
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmHWM"))


def parts(n, triangles):
    """Number of the connected part of each triangle."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    a, b = np.concatenate([triangles[:, :2], triangles[:, 1:]]).T
    _, part = connected_components(coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(n, n)), directed=False)
    return np.unique(part[triangles[:, 0]], return_inverse=True)[1]


class Clock:
    """CPU and clock seconds, and the memory that came on top, of a `with` block."""

    def __enter__(self):
        self.before, self.cpu, self.wall = peak_bytes(), time.process_time(), time.perf_counter()
        return self

    def __exit__(self, *_):
        self.cpu, self.wall = time.process_time() - self.cpu, time.perf_counter() - self.wall
        self.peak = peak_bytes() - self.before


def median_edge(points, triangles):
    return float(np.median(np.linalg.norm(points[triangles[:, 0]] - points[triangles[:, 1]], axis=1)))


def mesh_gmsh(points, triangles, algorithm, threads, scale):
    import gmsh
    part = parts(len(points), triangles)
    gmsh.initialize()
    for option, value in (("General.NumThreads", threads), ("Mesh.MaxNumThreads3D", threads), ("General.Verbosity", 2),
                          ("Mesh.Algorithm3D", algorithm)):
        gmsh.option.setNumber(option, value)
    surfaces = list(range(1, part.max() + 2))
    for tag in surfaces:
        own = triangles[part == tag - 1]
        nodes = np.unique(own)
        gmsh.model.addDiscreteEntity(2, tag)
        gmsh.model.mesh.addNodes(2, tag, nodes + 1, points[nodes].ravel())
        gmsh.model.mesh.addElementsByType(tag, 2, [], (own + 1).ravel())
    loop = gmsh.model.geo.addSurfaceLoop(surfaces)
    gmsh.model.geo.addVolume([loop])
    gmsh.model.geo.synchronize()
    if scale:
        gmsh.option.setNumber("Mesh.MeshSizeMax", scale * median_edge(points, triangles))
    with Clock() as clock:
        gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    position = np.zeros((int(tags.max()) + 1, 3))
    position[tags] = xyz.reshape(-1, 3)
    tets = gmsh.model.mesh.getElementsByType(4)[1].reshape(-1, 4).astype(np.int64)
    return position, tets, clock


def mesh_tetgen(points, triangles, scale):
    import tetgen
    # A point inside each hollow part: all parts but the one with the largest box are hollow.
    part = parts(len(points), triangles)
    order = np.argsort(part, kind="stable")
    starts = np.searchsorted(part[order], np.arange(part.max() + 1))
    corners = points[triangles[order]]
    low = np.minimum.reduceat(corners.min(1), starts)
    high = np.maximum.reduceat(corners.max(1), starts)
    outer = int(np.argmax(np.prod(high - low, axis=1)))
    mesher = tetgen.TetGen(points, triangles.astype(np.int32))
    for k in range(part.max() + 1):
        if k != outer:
            mesher.add_hole(((low[k] + high[k]) / 2).tolist())
    # It grows tetrahedra without bound unless told: the volume of a regular one on the surface's median edge.
    volume = 2**0.5 / 12 * ((scale or 1.0) * median_edge(points, triangles))**3
    with Clock() as clock:
        nodes, tets = mesher.tetrahedralize(switches=f"pqYQa{volume:.12g}")[:2]
    return np.asarray(nodes, float), np.asarray(tets, np.int64), clock


def child(mesher, surface, out, threads, scale):
    with np.load(surface) as file:
        points, triangles = file["points"], file["triangles"]
    threads, scale = int(threads), float(scale)
    if mesher in ("hxt", "gmsh"):
        position, tets, clock = mesh_gmsh(points, triangles, 10 if mesher == "hxt" else 1, threads, scale)
    else:
        position, tets, clock = mesh_tetgen(points, triangles, scale)
    if len(tets) == 0:
        sys.exit(f"{mesher} made no tetrahedra")
    if out != "-":
        np.savez(out, points=position, tets=tets)
    print(json.dumps({"tets": len(tets), "cpu": clock.cpu, "wall": clock.wall, "peak": clock.peak}))


def run_other(mesher, arrays, keep, threads, scale, timeout):
    command = [sys.executable, __file__, "--child", mesher, arrays, keep or "-", str(threads), repr(scale)]
    answer = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=timeout).stdout
    return json.loads(answer.decode().splitlines()[-1])


def scale_for(mesher, arrays, wanted, timeout):
    """The share of the median edge, as a greatest length, with which a mesher makes `wanted` tetrahedra: by the secant rule on logarithms."""
    known = []
    at = 0.0
    for _ in range(TRIALS):
        n = run_other(mesher, arrays, None, 1, float(np.exp(at)), timeout)["tets"]
        known.append((at, np.log(n / wanted)))
        if abs(n / wanted - 1) <= EQUAL / 2:
            break
        slope = -3.0
        if len(known) > 1:
            # Lengths above those of the surface change little.
            slope = np.clip((known[-1][1] - known[-2][1]) / (known[-1][0] - known[-2][0]), -4.0, -1.0)
        at -= known[-1][1] / slope
    return float(np.exp(min(known, key=lambda trial: abs(trial[1]))[0]))


def run_tetdb(program, surface, optimize, subdomains, threads, directory, keep):
    store = os.path.join(directory, "peer.tetdb")
    shutil.rmtree(store, ignore_errors=True)
    command = [program, "mesh", surface, "-o", store, "--threads", str(threads), "--no-verify", "--json", "--optimize", optimize]
    if subdomains:
        command += ["--subdomains", str(subdomains)]
    before, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    told = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout)
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - wall
    subprocess.run([program, "verify", store], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    verified = resource.getrusage(resource.RUSAGE_CHILDREN)

    def spent(a, b):
        return b.ru_utime + b.ru_stime - a.ru_utime - a.ru_stime
    if keep:
        subprocess.run([program, "export", store, keep], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    size = sum(os.path.getsize(os.path.join(store, f)) for f in os.listdir(store))
    shutil.rmtree(store)
    return {"tets": told["tets"], "cpu": spent(before, after), "wall": wall, "verify": spent(after, verified), "peak": told["peak_bytes"],
            "disk": size, "digest": told["digest"]}


def read_surface(path):
    """Points and triangles of a surface file."""
    import trimesh
    mesh = trimesh.load(path, process=False, maintain_order=True, force="mesh", skip_materials=True)
    return np.asarray(mesh.vertices, float) + 0.0, np.asarray(mesh.faces)


def read_mesh(path):
    """Points and tetrahedra of a MEDIT file of ours, or of an .npz file."""
    if path.endswith(".npz"):
        with np.load(path) as file:
            return file["points"], file["tets"]
    import meshio
    mesh = meshio.read(path)
    return np.asarray(mesh.points, float), np.concatenate([c.data for c in mesh.cells if c.type == "tetra"]).astype(np.int64)


def keys(faces):
    """A 64-bit mix of each row of three vertices, whatever their order."""
    faces = np.sort(faces, axis=1).astype(np.uint64)
    mixed = np.zeros(len(faces), np.uint64)
    for k in range(3):
        mixed = (mixed ^ faces[:, k]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def face_forces(points, triangles):
    """Whether the circle inscribed in a triangle is too small for any tetrahedron on it to have q < 2."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    lengths = np.stack([np.linalg.norm(x - y, axis=1) for x, y in ((a, b), (b, c), (c, a))])
    radius = np.linalg.norm(np.cross(b - a, c - a), axis=1) / lengths.sum(0)
    return ALPHA * lengths.max(0) >= 2 * radius


def measure(points, tets, n_surface):
    """Quality of a mesh; the vertices of its boundary faces are those of the surface."""
    n = len(tets)
    a, b, c, d = (points[tets[:1000, k]] for k in range(4))
    if np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)).mean() < 0:
        tets = tets[:, [0, 2, 1, 3]]
    key = np.concatenate([keys(tets[:, FACES[k]]) for k in range(4)])
    order = np.argsort(key, kind="stable")
    key = key[order]
    equal = key[1:] == key[:-1]
    alone = np.ones(len(key), bool)
    alone[1:] &= ~equal
    alone[:-1] &= ~equal
    hull = order[alone]
    first, second = order[:-1][equal], order[1:][equal]
    del key, alone, equal, order
    hull_faces = tets[(hull % n)[:, None], FACES[hull // n]]
    on_surface = np.zeros(len(points), bool)
    on_surface[hull_faces.ravel()] = True
    forced = on_surface[tets].all(1)
    forced[(hull % n)[face_forces(points, hull_faces)]] = True
    q, dihedral, delaunay, negative = np.empty(n), 180.0, 0, 0
    for s in range(0, n, BLOCK):
        t = tets[s:s + BLOCK]
        p = points[t]
        normals = np.stack([np.cross(p[:, f[1]] - p[:, f[0]], p[:, f[2]] - p[:, f[0]]) for f in FACES], 1)
        areas = np.linalg.norm(normals, axis=2)
        six = -np.einsum("ij,ij->i", p[:, 0] - p[:, 1], normals[:, 0])
        longest = np.sqrt(np.max([((p[:, i] - p[:, j])**2).sum(1) for i, j in EDGES], axis=0))
        negative += int((six <= 0).sum())
        with np.errstate(divide="ignore", invalid="ignore"):
            q[s:s + BLOCK] = np.where(six > 0, ALPHA * longest * areas.sum(1) / six, np.inf)
            normals /= areas[:, :, None]
        cosine = np.max([-np.einsum("ij,ij->i", normals[:, i], normals[:, j]) for i, j in EDGES], axis=0)
        dihedral = min(dihedral, float(np.degrees(np.arccos(np.clip(np.nanmax(cosine), -1, 1)))))
    for s in range(0, len(first), BLOCK):
        f, g = first[s:s + BLOCK], second[s:s + BLOCK]
        apex = points[tets[g % n, g // n]]
        x = points[tets[f % n]] - apex[:, None]
        squares = (x**2).sum(2)
        terms = np.stack([squares[:, i] * np.einsum("ij,ij->i", x[:, o[0]], np.cross(x[:, o[1]], x[:, o[2]]))
                          for i, o in enumerate(FACES)], 1)
        # Each term is a square times the volume of the other three as seen from the apex; positive: the apex is inside.
        det = terms.sum(1)
        bound = 1e-13 * squares.max(1)**2.5
        delaunay += int((det <= bound).sum())
    inner = ~forced
    return {"tets": n, "vertices": int(len(np.unique(tets))), "negative": negative,
            "hull_faces": int(len(hull)), "surface_triangles": n_surface,
            "q12": 100 * float((q < 2).mean()), "worst": float(q.max()),
            "forced": 100 * float(forced.mean()), "q12_unforced": 100 * float((q[inner] < 2).mean()) if inner.any() else 100.0,
            "worst_unforced": float(q[inner].max()) if inner.any() else 0.0,
            "dihedral": dihedral, "delaunay": 100 * delaunay / max(1, len(first))}


def median(runs, key):
    return float(np.median([r[key] for r in runs]))


def surface_file(program, surface, directory):
    """A file of the surface, or of the sample, that all meshers read: its own, or the same triangles in another format."""
    if os.path.exists(surface) and surface.endswith((".ply", ".stl", ".off", ".obj")):
        return surface
    made = os.path.join(directory, "surface.ply")
    command = ["check", surface, "--repair", "--write", made] if os.path.exists(surface) else ["sample", surface, "-o", made]
    subprocess.run([program, *command, "-q"], check=True, stdout=subprocess.DEVNULL)
    return made


def compare(surface, args, directory):
    path = surface_file(args.tetdb, surface, directory)
    arrays = os.path.join(directory, "surface.npz")
    points, triangles = read_surface(path)
    points, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[triangles].astype(np.int64)
    np.savez(arrays, points=points, triangles=triangles)
    # A mesher and its number of threads; more threads make another mesh only with HXT, and no better one.
    kinds = [(m, n) for m in args.meshers for n in args.threads if n == args.threads[0] or m not in ("gmsh", "tetgen")]
    runs, measures, scales = {k: [] for k in kinds}, {}, {}
    for turn in range(args.runs):
        for mesher, threads in kinds:
            kind = (mesher, threads)
            measured = turn == 0 and threads == args.threads[0] and not args.no_measure
            keep = None
            try:
                if mesher in ("tetdb", "none", "delaunay"):
                    keep = os.path.join(directory, "mesh.meshb") if measured else None
                    optimize = "full" if mesher == "tetdb" else mesher
                    runs[kind].append(run_tetdb(args.tetdb, path, optimize, args.subdomains, threads, directory, keep))
                else:
                    if args.equal and mesher not in scales:
                        wanted = runs["tetdb", args.threads[0]][0]["tets"]
                        scales[mesher] = scale_for(mesher, arrays, wanted, args.timeout)
                    keep = os.path.join(directory, "mesh.npz") if measured else None
                    runs[kind].append(run_other(mesher, arrays, keep, threads, scales.get(mesher, 0.0), args.timeout))
            except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as failure:
                print(f"# {mesher} on {surface}: {str(failure)[:200]}", file=sys.stderr)
                continue
            if keep:
                measures[mesher] = measure(*read_mesh(keep), len(triangles))
                os.remove(keep)
    return print_table(surface, len(triangles), kinds, runs, measures, scales, args)


def print_table(surface, n_triangles, kinds, runs, measures, scales, args):
    print(f"\n{surface}: {n_triangles} triangles, {args.runs} runs in turn, " +
          ("as many tetrahedra each" if args.equal else "each as by itself"))
    print("| mesher, threads | tets | CPU s | s | tets per CPU-second | of HXT's | one thread's s / s | q in [1,2[ | worst q | "
          "unforced: q in [1,2[ | worst | forced | min dihedral | locally Delaunay | peak bytes/tet | verify, s |")
    print("|---" * 16 + "|")
    rows = []
    for mesher, threads in kinds:
        own = runs[mesher, threads]
        if not own:
            print(f"| {mesher}, {threads} | failed |")
            continue
        tets, cpu, wall = (median(own, key) for key in ("tets", "cpu", "wall"))
        share = faster = ""
        if runs.get(("hxt", threads)):
            hxt = runs["hxt", threads]
            share = f"{tets / cpu * median(hxt, 'cpu') / median(hxt, 'tets'):.2f}"
        first = runs[mesher, args.threads[0]]
        if threads != args.threads[0] and first:
            faster = f"{median(first, 'wall') / wall:.2f}"
        verify = f"{median(own, 'verify'):.1f}" if "verify" in own[0] else ""
        wanted = runs.get(("tetdb", args.threads[0])) if args.equal else None
        unequal = " (not equal)" if wanted and abs(tets / wanted[0]["tets"] - 1) > EQUAL else ""
        quality = [""] * 7
        if threads == args.threads[0] and mesher in measures:
            m = measures[mesher]
            quality = [f"{m['q12']:.3f} %", f"{m['worst']:.2f}", f"{m['q12_unforced']:.3f} %", f"{m['worst_unforced']:.2f}",
                       f"{m['forced']:.2f} %", f"{m['dihedral']:.1f}", f"{m['delaunay']:.2f} %"]
        cells = [f"{mesher}, {threads}", f"{tets:.0f}{unequal}", f"{cpu:.2f}", f"{wall:.2f}", f"{tets / cpu:.0f}", share, faster,
                 *quality, f"{median(own, 'peak') / tets:.0f}", verify]
        print("| " + " | ".join(cells) + " |", flush=True)
        rows.append({"surface": surface, "mesher": mesher, "threads": threads, "scale": scales.get(mesher), "runs": own,
                     "measure": measures.get(mesher)})
    return rows


def main():
    if len(sys.argv) == 7 and sys.argv[1] == "--child":
        child(*sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surface", nargs="+")
    parser.add_argument("--tetdb", default="tetdb")
    parser.add_argument("--meshers", default="tetdb,hxt,gmsh,tetgen", type=lambda text: text.split(","))
    parser.add_argument("--runs", default=3, type=int)
    parser.add_argument("--threads", default="1", type=lambda text: [int(n) for n in text.split(",")], help="numbers of threads to run with")
    parser.add_argument("--equal", action="store_true", help="give the others lengths with which they make as many tetrahedra as tetdb")
    parser.add_argument("--subdomains", type=int, help="how many sub-domains tetdb makes; without it, as many as it would")
    parser.add_argument("--no-measure", action="store_true", help="speed only: measuring 10 M tetrahedra takes minutes and 6 GB")
    parser.add_argument("--timeout", default=3600, type=float)
    parser.add_argument("--json")
    args = parser.parse_args()
    if args.equal and args.meshers[0] != "tetdb":
        parser.error("--equal needs tetdb as the first mesher")
    print((__doc__ or "").split("What is timed:\n")[1].split("Memory is")[0].rstrip())
    rows = []
    for surface in args.surface:
        with tempfile.TemporaryDirectory() as directory:
            rows += compare(surface, args, directory)
    if args.json:
        with open(args.json, "w") as file:
            json.dump(rows, file, indent=1)


if __name__ == "__main__":
    main()
