"""Runs tetdb and other meshers on one surface, each in a process of its own; shared by the scripts beside it.

Every run gives points, tetrahedra and CPU seconds. What is timed:
  tetdb       the whole process: surface file read and validated, sizes, estimate, mesh, optimization, sealed store on disk (`--no-verify`)
  hxt, gmsh   the call that meshes volumes alone: surface in memory already, no validation, result in memory
  hxt-file, gmsh-file   the whole process: file of the surface read, meshed, file of the mesh written, both binary .msh
  tetgen      the call `tetrahedralize` alone, likewise; it has one thread only
  pytetwild   the call `tetrahedralize` alone; it keeps the surface within a tolerance, not its triangles
  module      tetdb's Python module, arrays in and arrays out, the store's verification included
All but pytetwild keep the surface: no vertex is added on it. HXT and Gmsh get each connected part as a discrete surface of its own.
"""
import json
import os
import resource
import shutil
import subprocess
import sys
import time

import numpy as np

# Counts are equal when they differ by no more than this share; trials before a mesher is given up.
EQUAL = 0.05
TRIALS = 7
# Gmsh's numbers.
ALGORITHMS = {"hxt": 10, "gmsh": 1}


def peak_bytes():
    """Most memory this process ever held; getrusage also counts what the parent process held when it started this one."""
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmHWM"))


class Clock:
    """CPU and clock seconds, and the memory that came on top, of a `with` block."""

    def __enter__(self):
        self.before, self.cpu, self.wall = peak_bytes(), time.process_time(), time.perf_counter()
        return self

    def __exit__(self, *_):
        self.cpu, self.wall = time.process_time() - self.cpu, time.perf_counter() - self.wall
        self.peak = peak_bytes() - self.before


def connected_parts(n, triangles):
    """Number of the connected part of each triangle."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    a, b = np.concatenate([triangles[:, :2], triangles[:, 1:]]).T
    _, part = connected_components(coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(n, n)), directed=False)
    return np.unique(part[triangles[:, 0]], return_inverse=True)[1]


def median_edge(points, triangles):
    return float(np.median(np.linalg.norm(points[triangles[:, 0]] - points[triangles[:, 1]], axis=1)))


def start_gmsh(algorithm, threads):
    import gmsh
    gmsh.initialize(interruptible=False)
    for option, value in (("General.NumThreads", threads), ("Mesh.MaxNumThreads3D", threads), ("General.Verbosity", 2),
                          ("General.Terminal", 0), ("Mesh.Algorithm3D", algorithm)):
        gmsh.option.setNumber(option, value)


def add_parts(points, triangles):
    """A discrete surface for each connected part: HXT takes no surface of several. Their number, and what adds an entity."""
    import gmsh
    part = connected_parts(len(points), triangles)
    known = np.zeros(len(points), bool)

    def entity(dim, tag, kind, elements):
        gmsh.model.addDiscreteEntity(dim, tag)
        nodes = np.unique(elements)
        nodes = nodes[~known[nodes]]
        known[nodes] = True
        gmsh.model.mesh.addNodes(dim, tag, nodes + 1, points[nodes].ravel())
        gmsh.model.mesh.addElementsByType(tag, kind, [], (elements + 1).ravel())
    for tag in range(1, part.max() + 2):
        entity(2, tag, 2, triangles[part == tag - 1])
    return part.max() + 1, entity


def add_volume(surfaces):
    import gmsh
    volume = gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(surfaces)])
    gmsh.model.geo.synchronize()
    return volume


def mesh_gmsh(given, algorithm, threads, scale):
    import gmsh
    points, triangles = given["points"], given["triangles"]
    start_gmsh(algorithm, threads)
    n_surfaces, entity = add_parts(points, triangles)
    volume = add_volume(range(1, n_surfaces + 1))
    sheets, edges, marks = (given.get(k, np.empty(0)) for k in ("sheets", "edges", "marks"))
    if len(sheets):
        entity(2, n_surfaces + 1, 2, sheets)
        gmsh.model.mesh.embed(2, [n_surfaces + 1], 3, volume)
    if len(edges):
        entity(1, 1, 1, edges)
        gmsh.model.mesh.embed(1, [1], 3, volume)
    for k, v in enumerate(marks):
        entity(0, k + 1, 15, np.array([v]))
    if len(marks):
        gmsh.model.mesh.embed(0, list(range(1, len(marks) + 1)), 3, volume)
    if scale:
        gmsh.option.setNumber("Mesh.MeshSizeMax", scale * median_edge(points, triangles))
    with Clock() as clock:
        gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    position = np.zeros((int(tags.max()) + 1, 3))
    position[tags] = xyz.reshape(-1, 3)
    return position, gmsh.model.mesh.getElementsByType(4)[1].reshape(-1, 4).astype(np.int64), clock


def mesh_gmsh_file(given, algorithm, threads, scale, directory):
    """From file to file. Writing the file of the surface, an entity for each connected part, is not counted."""
    import gmsh
    path, out = os.path.join(directory, "surface.msh"), os.path.join(directory, "mesh.msh")
    points, triangles = given["points"], given["triangles"]
    start_gmsh(algorithm, threads)
    add_parts(points, triangles)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(path)
    gmsh.finalize()
    with Clock() as clock:
        start_gmsh(algorithm, threads)
        gmsh.merge(path)
        add_volume([tag for _, tag in gmsh.model.getEntities(2)])
        if scale:
            gmsh.option.setNumber("Mesh.MeshSizeMax", scale * median_edge(points, triangles))
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.model.mesh.generate(3)
        gmsh.write(out)
    return len(gmsh.model.mesh.getElementsByType(4)[0]), clock


def mesh_tetgen(given, scale):
    import tetgen
    points, triangles = given["points"], given["triangles"]
    sheets = given.get("sheets", np.empty((0, 3), np.int64))
    everything = np.concatenate([triangles, sheets])
    mesher = tetgen.TetGen(points, everything.astype(np.int32))
    # A point inside each hollow part: all parts but the one with the largest box are hollow.
    part = connected_parts(len(points), triangles)
    order = np.argsort(part, kind="stable")
    starts = np.searchsorted(part[order], np.arange(part.max() + 1))
    corners = points[triangles[order]]
    low = np.minimum.reduceat(corners.min(1), starts)
    high = np.maximum.reduceat(corners.max(1), starts)
    outer = int(np.argmax(np.prod(high - low, axis=1)))
    for k in range(part.max() + 1):
        if k != outer:
            mesher.add_hole(((low[k] + high[k]) / 2).tolist())
    # Without a bound its tetrahedra grow without limit: the volume of a regular one on the surface's median edge.
    volume = 2**0.5 / 12 * ((scale or 1.0) * median_edge(points, everything))**3
    with Clock() as clock:
        nodes, tets = mesher.tetrahedralize(switches=f"pqYQa{volume:.12g}")[:2]
    return np.asarray(nodes, float), np.asarray(tets, np.int64), clock


def mesh_module(name, given):
    points, triangles = given["points"], given["triangles"].astype(np.int32)
    module = __import__("tetdb" if name == "module" else name)
    with Clock() as clock:
        nodes, tets = module.tetrahedralize(points, triangles)[:2]
    return np.asarray(nodes, float), np.asarray(tets, np.int64), clock


def child(mesher, arrays, out, threads, scale):
    """The process of one run of another mesher: prints a line of JSON, keeps the mesh in `out`."""
    with np.load(arrays) as file:
        given = dict(file)
    threads, scale = int(threads), float(scale)
    if mesher.endswith("-file"):
        n_tets, clock = mesh_gmsh_file(given, ALGORITHMS[mesher.removesuffix("-file")], threads, scale, os.path.dirname(arrays))
        print("\n" + json.dumps({"tets": n_tets, "cpu": clock.cpu, "wall": clock.wall, "peak": clock.peak}))
        return
    if mesher in ALGORITHMS:
        points, tets, clock = mesh_gmsh(given, ALGORITHMS[mesher], threads, scale)
    elif mesher == "tetgen":
        points, tets, clock = mesh_tetgen(given, scale)
    else:
        points, tets, clock = mesh_module(mesher, given)
    if len(tets) == 0:
        sys.exit(f"{mesher} generated no tetrahedra")
    if out != "-":
        np.savez(out, points=points, tets=tets)
    print("\n" + json.dumps({"tets": len(tets), "cpu": clock.cpu, "wall": clock.wall, "peak": clock.peak}))


def run_other(mesher, arrays, keep, threads=1, scale=0.0, timeout=3600):
    command = [sys.executable, __file__, mesher, arrays, keep or "-", str(threads), repr(scale)]
    done = subprocess.run(command, check=True, capture_output=True, timeout=timeout)
    return json.loads(done.stdout.decode().splitlines()[-1])


def why(failure):
    """The last words of a mesher that failed, or how it ended."""
    if isinstance(failure, subprocess.TimeoutExpired):
        return f"> {failure.timeout:g} s"
    if isinstance(failure, subprocess.CalledProcessError):
        if failure.returncode < 0:
            return f"ends the process (signal {-failure.returncode})"
        said = (failure.stderr or b"").decode(errors="replace").strip().splitlines()
        return ("failed: " + (said or [f"exit {failure.returncode}"])[-1][:90]).replace("|", "/")
    return f"failed ({type(failure).__name__})"


FAILURES = (subprocess.CalledProcessError, subprocess.TimeoutExpired, OSError, ValueError)


def scale_for(mesher, arrays, wanted, timeout):
    """The share of the median edge, as a greatest length, with which a mesher generates `wanted` tetrahedra: the secant rule on logarithms."""
    known, at = [], 0.0
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


def run_tetdb(program, words, directory, keep=None, verify=False, timeout=3600):
    """One run of `tetdb mesh` with these words; the mesh is exported to `keep`."""
    store = os.path.join(directory, "peer.tetdb")
    shutil.rmtree(store, ignore_errors=True)
    command = [program, "mesh", *words, "-o", store, "--no-verify", "--json"]
    before, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    info = json.loads(subprocess.run(command, check=True, capture_output=True, timeout=timeout).stdout)
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - wall
    result = {"tets": info["tets"], "cpu": spent(before, after), "wall": wall, "peak": info["peak_bytes"], "disk": info["bytes"],
              "digest": info["digest"], "parts": info["subdomains"]}
    if verify:
        subprocess.run([program, "verify", store], check=True, capture_output=True)
        result["verify"] = spent(after, resource.getrusage(resource.RUSAGE_CHILDREN))
    if keep:
        subprocess.run([program, "export", store, keep], check=True, capture_output=True)
    shutil.rmtree(store)
    return result


def spent(a, b):
    return b.ru_utime + b.ru_stime - a.ru_utime - a.ru_stime


def surface_file(program, surface, directory):
    """A file of the surface, or of the sample, that all meshers read: its own, or the same triangles in another format."""
    if os.path.exists(surface) and surface.endswith((".ply", ".stl", ".off", ".obj")):
        return surface
    path = os.path.join(directory, "surface.ply")
    command = ["check", surface, "--repair", "--write", path] if os.path.exists(surface) else ["sample", surface.removeprefix("sample:"), "-o", path]
    subprocess.run([program, *command, "-q"], check=True, stdout=subprocess.DEVNULL)
    return path


def read_surface(path):
    """Points, each once, and triangles of a surface file."""
    import trimesh
    mesh = trimesh.load(path, process=False, maintain_order=True, force="mesh", skip_materials=True)
    points, number = np.unique(np.asarray(mesh.vertices, float) + 0.0, axis=0, return_inverse=True)
    return points, number.reshape(-1)[np.asarray(mesh.faces)].astype(np.int64)


def read_mesh(path):
    """Points and tetrahedra of a MEDIT file of tetdb, or of an .npz file."""
    if path.endswith(".npz"):
        with np.load(path) as file:
            return file["points"], file["tets"]
    import meshio
    mesh = meshio.read(path)
    return np.asarray(mesh.points, float), np.concatenate([c.data for c in mesh.cells if c.type == "tetra"]).astype(np.int64)


if __name__ == "__main__":
    child(*sys.argv[1:])
