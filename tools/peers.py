#!/usr/bin/env python3
"""tetdb and other meshers on the same surface, one thread each, in turn: speed and quality in one table.

  peers.py SURFACE... [--tetdb PROGRAM] [--meshers tetdb,none,hxt,gmsh,tetgen] [--runs 3] [--subdomains N] [--no-measure] [--json FILE]

SURFACE: a file tetdb reads, or a sample (balls,count=100). `none` and `delaunay` are tetdb with that `--optimize`. Needs numpy,
scipy, meshio, trimesh, and gmsh and tetgen (pip names) for those meshers.

Each run is a process of its own; runs go round and round (a b c a b c), so that a machine that slows down slows all; medians
are printed. CPU seconds are user + system. Those of tetdb are of the whole process, from the surface file to the sealed store
(`--no-verify`; what verification adds is in the column "verify"); those of the others are of the meshing call alone,
without reading or writing. Memory is the peak of the process less what it had before meshing began.
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


def mesh_gmsh(points, triangles, algorithm):
    import gmsh
    part = parts(len(points), triangles)
    gmsh.initialize()
    for option, value in (("General.NumThreads", 1), ("Mesh.MaxNumThreads3D", 1), ("General.Verbosity", 2),
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
    before, cpu = peak_bytes(), time.process_time()
    gmsh.model.mesh.generate(3)
    cpu, peak = time.process_time() - cpu, peak_bytes() - before
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    position = np.zeros((int(tags.max()) + 1, 3))
    position[tags] = xyz.reshape(-1, 3)
    tets = gmsh.model.mesh.getElementsByType(4)[1].reshape(-1, 4).astype(np.int64)
    return position, tets, cpu, peak


def mesh_tetgen(points, triangles):
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
    before, cpu = peak_bytes(), time.process_time()
    # It grows tetrahedra without bound unless told: the volume of a regular one on the surface's median edge.
    edge = np.median(np.linalg.norm(points[triangles[:, 0]] - points[triangles[:, 1]], axis=1))
    nodes, tets = mesher.tetrahedralize(switches=f"pqYQa{2**0.5 / 12 * edge**3:.12g}")[:2]
    cpu, peak = time.process_time() - cpu, peak_bytes() - before
    return np.asarray(nodes, float), np.asarray(tets, np.int64), cpu, peak


def child(mesher, surface, out):
    with np.load(surface) as file:
        points, triangles = file["points"], file["triangles"]
    if mesher in ("hxt", "gmsh"):
        result = mesh_gmsh(points, triangles, 10 if mesher == "hxt" else 1)
    else:
        result = mesh_tetgen(points, triangles)
    position, tets, cpu, peak = result
    if len(tets) == 0:
        sys.exit(f"{mesher} made no tetrahedra")
    if out != "-":
        np.savez(out, points=position, tets=tets)
    print(json.dumps({"tets": len(tets), "cpu": cpu, "peak": peak}))


def run_tetdb(program, surface, optimize, subdomains, directory, keep):
    store = os.path.join(directory, "peer.tetdb")
    shutil.rmtree(store, ignore_errors=True)
    command = [program, "mesh", surface, "-o", store, "--threads", "1", "--no-verify", "--json", "--optimize", optimize]
    if subdomains:
        command += ["--subdomains", str(subdomains)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "verify", store], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    verified = resource.getrusage(resource.RUSAGE_CHILDREN)

    def spent(a, b):
        return b.ru_utime + b.ru_stime - a.ru_utime - a.ru_stime
    if keep:
        subprocess.run([program, "export", store, keep], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    size = sum(os.path.getsize(os.path.join(store, f)) for f in os.listdir(store))
    shutil.rmtree(store)
    return {"tets": told["tets"], "cpu": spent(before, after), "verify": spent(after, verified), "peak": told["peak_bytes"],
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


def compare(surface, args, directory):
    made = os.path.join(directory, "surface.ply")
    if not os.path.exists(surface):
        subprocess.run([args.tetdb, "sample", surface, "-o", made], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        path = made
    elif not surface.endswith((".ply", ".stl", ".off", ".obj")):
        # Formats the others do not read: the same triangles, none of them longer than asked for.
        subprocess.run([args.tetdb, "refine-surface", surface, made, "--hsiz", "1e30"], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        path = made
    else:
        path = surface
    arrays = os.path.join(directory, "surface.npz")
    points, triangles = read_surface(path)
    points, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[triangles].astype(np.int64)
    np.savez(arrays, points=points, triangles=triangles)
    runs, measures = {m: [] for m in args.meshers}, {}
    for turn in range(args.runs):
        for mesher in args.meshers:
            keep = None
            try:
                if mesher in ("tetdb", "none", "delaunay"):
                    keep = os.path.join(directory, "mesh.meshb") if turn == 0 and not args.no_measure else None
                    runs[mesher].append(run_tetdb(args.tetdb, path, "full" if mesher == "tetdb" else mesher, args.subdomains, directory, keep))
                else:
                    keep = os.path.join(directory, "mesh.npz") if turn == 0 and not args.no_measure else None
                    answer = subprocess.run([sys.executable, __file__, "--child", mesher, arrays, keep or "-"], check=True,
                                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=args.timeout).stdout
                    runs[mesher].append(json.loads(answer.decode().splitlines()[-1]))
            except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as failure:
                print(f"# {mesher} on {surface}: {str(failure)[:200]}", file=sys.stderr)
                continue
            if keep:
                measures[mesher] = measure(*read_mesh(keep), len(triangles))
                os.remove(keep)
    print(f"\n{surface}: {len(triangles)} triangles, {args.runs} runs in turn")
    print("| mesher | tets | tets per CPU-second | of HXT's | q in [1,2[ | worst q | unforced: q in [1,2[ | worst | forced | min dihedral | "
          "locally Delaunay | peak bytes/tet | verify, s |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    reference = None
    if runs.get("hxt"):
        reference = median(runs["hxt"], "tets") / median(runs["hxt"], "cpu")
    rows = []
    for mesher in args.meshers:
        if not runs[mesher]:
            print(f"| {mesher} | failed |")
            continue
        m = measures.get(mesher, dict.fromkeys(("q12", "worst", "q12_unforced", "worst_unforced", "forced", "dihedral", "delaunay"), np.nan))
        tets = median(runs[mesher], "tets")
        rate = tets / median(runs[mesher], "cpu")
        share = f"{rate / reference:.2f}" if reference else ""
        verify = f"{median(runs[mesher], 'verify'):.1f}" if "verify" in runs[mesher][0] else ""
        print(f"| {mesher} | {tets:.0f} | {rate:.0f} | {share} | {m['q12']:.3f} % | {m['worst']:.2f} | {m['q12_unforced']:.3f} % | "
              f"{m['worst_unforced']:.2f} | {m['forced']:.2f} % | {m['dihedral']:.1f} | {m['delaunay']:.2f} % | "
              f"{median(runs[mesher], 'peak') / tets:.0f} | {verify} |", flush=True)
        rows.append({"surface": surface, "mesher": mesher, "runs": runs[mesher], "measure": m})
    return rows


def main():
    if len(sys.argv) == 5 and sys.argv[1] == "--child":
        child(*sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surface", nargs="+")
    parser.add_argument("--tetdb", default="tetdb")
    parser.add_argument("--meshers", default="tetdb,hxt,gmsh,tetgen", type=lambda text: text.split(","))
    parser.add_argument("--runs", default=3, type=int)
    parser.add_argument("--subdomains", type=int, help="how many sub-domains tetdb makes; without it, as many as it would")
    parser.add_argument("--no-measure", action="store_true", help="speed only: measuring 10 M tetrahedra takes minutes and 6 GB")
    parser.add_argument("--timeout", default=3600, type=float)
    parser.add_argument("--json")
    args = parser.parse_args()
    rows = []
    for surface in args.surface:
        with tempfile.TemporaryDirectory() as directory:
            rows += compare(surface, args, directory)
    if args.json:
        with open(args.json, "w") as file:
            json.dump(rows, file, indent=1)


if __name__ == "__main__":
    main()
