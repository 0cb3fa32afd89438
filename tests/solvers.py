#!/usr/bin/env python3
"""Do the solvers' own readers see the mesh that the store has?

  solvers.py INFO.json NAME.vtkhdf | NAME.vtu | NAME.msh | NAME.inp | NAME.su2 | NAME.mfem | CASE.foam | NAME.ele ...

INFO.json: what `tetdb info --json` printed. A `.vtkhdf` is read by VTK and by h5py, an OpenFOAM case (whole and processors) by a reader of
this file, and by checkMesh where it is installed, `.msh` by gmsh, `.mfem` by PyMFEM (and its parts NAME.000000 .. by MFEM itself where
MFEM_PROGRAM names a build of tests/mfem_parallel.cpp). What has `.only` in its path holds region 1 alone. Counts, volume per region, area per label and the neighbors of
each sub-domain are compared with the store's and with each other. With --require a program that is not installed is a failure; else it
is named and skipped. Exit code 0 when all agree.
"""
import collections
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np

wrong, skipped = 0, []


def complain(text):
    global wrong
    wrong += 1
    print("WRONG:", text)


def same(path, what, found, expected, tolerance=1e-9):
    if isinstance(expected, dict) and not any(isinstance(v, (dict, set)) for v in expected.values()):
        ok = set(found) == set(expected) and all(abs(found[k] - v) <= tolerance * max(abs(v), 1e-300) for k, v in expected.items())
    elif isinstance(expected, float):
        ok = abs(found - expected) <= tolerance * abs(expected)
    else:
        ok = found == expected
    if not ok:
        complain(f"{path}: {what} is {found}, expected {expected}")


def volumes(points, tets):
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    v = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6
    assert v.min() > 0, "a tetrahedron is inverted"
    return v


def areas(points, tris):
    a, b, c = (points[tris[:, i]] for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


VTK_EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
GMSH_EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3)]


def corners_of(points, tets, ends=VTK_EDGES):
    """The corners of tetrahedra; of those of second order also whether quadratics are integrated exactly."""
    if tets.shape[1] == 4:
        return tets
    for node, (a, b) in enumerate(ends, 4):
        assert (points[tets[:, node]] == (points[tets[:, a]] / 2 + points[tets[:, b]] / 2)).all(), f"node {node} is not the middle"
    edges = np.concatenate([np.sort(tets[:, list(e)], axis=1) for e in ends])
    middles = tets[:, 4:].T.ravel()
    pairs = np.unique(np.column_stack([edges, middles]), axis=0)
    assert len(pairs) == len(np.unique(edges, axis=0)) == len(np.unique(middles)), "an edge has two middles"
    volume = volumes(points, tets)
    for i, j in ((0, 0), (0, 1), (1, 2), (2, 2)):
        # By the element: corners weigh -1/20, middles 1/5. By the corners alone, exactly.
        values = (points[:, i] * points[:, j])[tets]
        element = (volume * (values[:, 4:].sum(axis=1) / 5 - values[:, :4].sum(axis=1) / 20)).sum()
        x, y = points[tets[:, :4], i], points[tets[:, :4], j]
        exact = (volume * (x.sum(axis=1) * y.sum(axis=1) + (x * y).sum(axis=1)) / 20).sum()
        assert abs(element - exact) <= 1e-12 * max(abs(exact), volume.sum()), f"a quadratic is integrated to {element}, not {exact}"
    return tets[:, :4]


def by(keys, values):
    keys = np.asarray(keys)
    return {k: float(values[keys == k].sum()) for k in np.unique(keys).tolist()}


def store(info):
    """What the store says of itself."""
    parts = info["subdomains"]
    return {"tets": info["tets"], "parts": len(parts),
            "tets by part": {p["id"]: p["tets"] for p in parts},
            "volume by region": {r["region"]: r["volume"] for r in info["regions"] if r["filled"]},
            "faces between parts": {p["id"]: {n["subdomain"]: n["faces"] for n in p["neighbors"] or []} for p in parts}}


# Areas per label of the first file read are what the others must have.
known_areas = {}


def same_areas(path, found):
    same(path, "area by label", found, known_areas.setdefault("of labels", found), 1e-9)


def check_vtkhdf(path, want):
    import h5py
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    def grids(name):
        reader = vtk.vtkHDFReader()
        reader.SetFileName(name)
        reader.Update()
        data = reader.GetOutputDataObject(0)
        if data.IsA("vtkPartitionedDataSet"):
            return [data.GetPartition(i) for i in range(data.GetNumberOfPartitions())]
        return [data]

    volume, parts = collections.defaultdict(float), {}
    for grid in grids(path):
        points = vtk_to_numpy(grid.GetPoints().GetData())
        n = grid.GetCell(0).GetNumberOfPoints()
        assert grid.GetCellType(0) == (71 if ".one." in path else {4: 10, 10: 24}[n])
        tets = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, n)
        assert (vtk_to_numpy(grid.GetCells().GetOffsetsArray()) == n * np.arange(len(tets) + 1)).all()
        assert len(np.unique(tets)) == len(points), "a point without a tetrahedron"
        tets = corners_of(points, tets)
        data = grid.GetCellData()
        for region, v in by(vtk_to_numpy(data.GetArray("region")), volumes(points, tets)).items():
            volume[region] += v
        ranks, n = np.unique(vtk_to_numpy(data.GetArray("subdomain")), return_counts=True)
        assert len(np.unique(points, axis=0)) == len(points), "a point is there twice"
        assert len(ranks) == 1 or ".one." in path, f"a partition has sub-domains {ranks}"
        parts.update(zip(ranks.tolist(), n.tolist()))
        quality = vtk_to_numpy(data.GetArray("quality"))
        assert quality.min() >= 1 and len(quality) == len(tets)
    if ".one." in path:
        same(path, "partitions", len(grids(path)), 1)
    if "tets by part" in want:
        same(path, "tetrahedra by partition", parts, want["tets by part"])
    same(path, "tetrahedra", sum(parts.values()), want["tets"])
    same(path, "volume by region", dict(volume), want["volume by region"])
    skin = path.replace(".vtkhdf", "_boundary.vtkhdf")
    (grid,) = grids(skin)
    points = vtk_to_numpy(grid.GetPoints().GetData())
    tris = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6 if grid.GetCellType(0) == 22 else 3)[:, :3]
    data = grid.GetCellData()
    names = bytes(vtk_to_numpy(grid.GetFieldData().GetArray("label_names"))).decode().split("\0")
    neighbor, rank = vtk_to_numpy(data.GetArray("neighbor")), vtk_to_numpy(data.GetArray("subdomain"))
    outer = (neighbor < 0)
    labels = vtk_to_numpy(data.GetArray("label"))[outer]
    same_areas(path, {names[l]: a for l, a in by(labels, areas(points, tris[outer])).items()})
    shared = collections.defaultdict(dict)
    for pair, n in collections.Counter(zip(rank[~outer].tolist(), neighbor[~outer].tolist())).items():
        shared[pair[0]][pair[1]] = shared[pair[1]][pair[0]] = n
    if "faces between parts" in want:
        same(path, "faces between parts", dict(shared), {k: v for k, v in want["faces between parts"].items() if v})
    # The same by the HDF5 library, and where the boundary's vertices are in the other file.
    with h5py.File(path) as f, h5py.File(skin) as g:
        f, g = f["VTKHDF"], g["VTKHDF"]
        assert f.attrs["Version"][0] == 2 and f.attrs["Type"] == b"UnstructuredGrid"
        assert f["Points"].shape == (f["NumberOfPoints"][:].sum(), 3)
        assert len(f["Offsets"]) == f["NumberOfCells"][:].sum() + len(f["NumberOfCells"])
        place = g["PointData/mesh_vertex"][:]
        assert (f["Points"][:][place] == g["Points"][:]).all()
    print(f"{path}: VTK {vtk.vtkVersion().GetVTKVersion()} and HDF5 {h5py.version.hdf5_version} see {len(parts)} sub-domains, {sum(parts.values())} tetrahedra")


def check_vtu(path, want):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    points = vtk_to_numpy(grid.GetPoints().GetData())
    n = 10 if grid.GetCellType(0) == 24 else 4
    tets = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, n)
    found = by(vtk_to_numpy(grid.GetCellData().GetArray("region")), volumes(points, corners_of(points, tets)))
    same(path, "volume by region", found, want["volume by region"])
    print(f"{path}: VTK {vtk.vtkVersion().GetVTKVersion()} sees {len(tets)} tetrahedra of {n} nodes")


def check_inp(path, want):
    import meshio
    mesh = meshio.read(path)
    (tets,) = [block.data for block in mesh.cells if block.type.startswith("tetra")]
    found = float(volumes(mesh.points, corners_of(mesh.points, tets)).sum())
    same(path, "volume", found, sum(want["volume by region"].values()))
    print(f"{path}: meshio {meshio.__version__} sees {len(tets)} tetrahedra of {tets.shape[1]} nodes")


def check_su2(path, want):
    """Elements and points as meshio reads them, markers by their names: they cover the boundary of all tetrahedra once, turned outward."""
    import meshio
    mesh = meshio.read(path)
    tets = np.concatenate([block.data for block in mesh.cells if block.type == "tetra"])
    tris = np.concatenate([block.data for block in mesh.cells if block.type == "triangle"])
    same(path, "volume", float(volumes(mesh.points, tets).sum()), sum(want["volume by region"].values()))
    faces = np.concatenate([tets[:, f] for f in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])])
    _, place, n = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    turned = lambda t: sorted(tuple(np.roll(f, -int(np.argmin(f))).tolist()) for f in t)
    same(path, "the boundary, turned outward", turned(tris) == turned(faces[place[n == 1]]), True)
    text = open(path).read()
    names = re.findall(r"MARKER_TAG= (\S+)\nMARKER_ELEMS= (\d+)\n", text)
    same(path, "markers", [len(set(name for name, _ in names)), sum(int(k) for _, k in names)], [len(names), len(tris)])
    print(f"{path}: meshio {meshio.__version__} sees {len(tets)} tetrahedra, {len(tris)} triangles in {len(names)} markers")


def gmsh_file(gmsh, path):
    """Tetrahedra and triangles of a file as gmsh has them: by partition, region and label."""
    gmsh.clear()
    gmsh.merge(path)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags] = np.arange(len(tags))
    points, found, between = xyz.reshape(-1, 3), collections.defaultdict(list), {}
    names = {(d, t): gmsh.model.getPhysicalName(d, t) for d, t in gmsh.model.getPhysicalGroups()}
    for dim, tag in gmsh.model.getEntities():
        if dim < 2 or gmsh.model.getType(dim, tag) == "Ghost volume":
            continue
        groups = gmsh.model.getPhysicalGroupsForEntity(dim, tag).tolist()
        parts = gmsh.model.getPartitions(dim, tag).tolist()
        for kind, ids, nodes in zip(*gmsh.model.mesh.getElements(dim, tag)):
            assert kind in ((2, 9) if dim == 2 else (4, 11)), f"elements of kind {kind}"
            nodes = place[nodes].reshape(-1, {2: 3, 9: 6, 4: 4, 11: 10}[int(kind)])
            if len(parts) == 2:
                assert dim == 2 and not groups
                between[tuple(sorted(p - 1 for p in parts))] = {tuple(sorted(f)) for f in tags[nodes[:, :3]].tolist()}
                found["between"].append((None, None, ids, nodes))
                continue
            assert len(groups) == 1 and len(parts) <= 1
            if dim == 3:
                nodes = corners_of(points, nodes, GMSH_EDGES)
            found[dim].append((parts[0] - 1 if parts else 0, names[dim, groups[0]], ids, nodes))
    return points, tags, found, between


def check_msh(path, want):
    import gmsh
    gmsh.initialize(["gmsh", "-v", "1"])
    try:
        pieces, ghosts, only = path.endswith("_1.msh"), "ghost" in path or "second_1" in path, ".only" in path
        files = [path[:-5] + f"{p + 1}.msh" for p in range(want["parts"])] if pieces else [path]
        parts, volume, area, corners, elements, between = {}, collections.defaultdict(float), collections.defaultdict(float), {}, set(), {}
        seen = {}
        for number, file in enumerate(files):
            points, tags, found, shared = gmsh_file(gmsh, file)
            used = np.unique(np.concatenate([nodes.ravel() for _, _, _, nodes in found[3]]))
            second = any(nodes.shape[1] > 3 for _, _, _, nodes in found[2])
            assert second or len(used) == len(points), "a node without a tetrahedron"
            for part, name, ids, tets in found[3]:
                if pieces and part != number:
                    assert ghosts, "a tetrahedron of another partition"
                    seen.setdefault(number, {}).update(zip(ids.tolist(), np.sort(tags[tets], axis=1).tolist()))
                    continue
                parts[part] = parts.get(part, 0) + len(tets)
                volume[int(name[7:])] += float(volumes(points, tets).sum())
                corners.setdefault(part, []).append(np.sort(tags[tets], axis=1))
                elements.update(ids.tolist())
            for part, name, ids, tris in found[2]:
                area[name] += float(areas(points, tris).sum())
                elements.update(ids.tolist())
            for _, _, ids, _ in found["between"]:
                elements.update(ids.tolist())
            for pair, faces in shared.items():
                assert between.setdefault(pair, faces) == faces, "faces between partitions differ in their files"
        if only:
            same(path, "volume by region", dict(volume), want["volume by region"])
            same(path, "tetrahedra", sum(parts.values()), want["tets"])
            same_areas(path, dict(area))
            print(f"{path}: gmsh sees {sum(parts.values())} tetrahedra of region 1 alone, closed by {sum(area.values()):.6g} of area")
            return
        same(path, "tetrahedra by partition", parts, want["tets by part"])
        same(path, "volume by region", dict(volume), want["volume by region"])
        same_areas(path, dict(area))
        assert min(elements) == 1 and max(elements) == len(elements), "elements are not numbered through"
        # Who neighbors whom: faces that two partitions have.
        faces = {part: {tuple(f) for block in blocks for omit in range(4) for f in np.delete(block, omit, axis=1).tolist()}
                 for part, blocks in corners.items()}
        shared = {a: {b: len(faces[a] & faces[b]) for b in faces if b != a and faces[a] & faces[b]} for a in faces}
        same(path, "faces between parts", shared, want["faces between parts"])
        assert between == {(a, b): faces[a] & faces[b] for a in shared for b in shared[a] if a < b}, "other faces between partitions"
        if ghosts and pieces:
            nodes = {part: np.unique(np.concatenate(blocks)) for part, blocks in corners.items()}
            for part, blocks in corners.items():
                others = np.concatenate([c for p, cs in corners.items() if p != part for c in cs])
                expected = others[np.isin(others, nodes[part]).any(axis=1)]
                got = {tuple(c) for c in seen[part].values()}
                assert got == {tuple(c) for c in expected.tolist()} and len(seen[part]) == len(expected), f"ghosts of partition {part}"
        elif ghosts:
            check_ghosts(gmsh, path, corners)
        order = "second" if second else "first"
        print(f"{path}: gmsh {gmsh.option.getString('General.Version')} sees {len(parts)} partitions, {sum(parts.values())} tetrahedra of {order} order")
    finally:
        gmsh.finalize()


def check_ghosts(gmsh, path, corners):
    """The ghosts of a partition: those that share a vertex with it, found again by hand."""
    nodes = {part: np.unique(np.concatenate(blocks)) for part, blocks in corners.items()}
    owners, elements, vertices = [], [], []
    for dim, tag in gmsh.model.getEntities(3):
        if gmsh.model.getType(dim, tag) != "Ghost volume":
            for ids, corner in zip(*gmsh.model.mesh.getElements(dim, tag)[1:]):
                owners.append(np.full(len(ids), int(gmsh.model.getPartitions(dim, tag)[0]) - 1))
                elements.append(ids)
                vertices.append(corner.reshape(-1, 4))
    owners, elements, vertices = map(np.concatenate, (owners, elements, vertices))
    owner = dict(zip(elements.tolist(), owners.tolist()))
    expected = {part: set(elements[(owners != part) & np.isin(vertices, nodes[part]).any(axis=1)].tolist()) for part in nodes}
    found = collections.defaultdict(set)
    for dim, tag in gmsh.model.getEntities(3):
        ids, of = gmsh.model.mesh.getGhostElements(dim, tag)
        if len(ids):
            parts = gmsh.model.getPartitions(dim, tag).tolist()
            found[parts[0] - 1 if parts else tag].update(ids.tolist())
            assert all(owner[e] == p - 1 for e, p in zip(ids.tolist(), of.tolist())), "a ghost of another partition"
    same(path, "ghost cells by partition", {k: len(v) for k, v in found.items()}, {k: len(v) for k, v in expected.items()})
    assert dict(found) == expected, "other ghost cells"


def mfem_sections(path):
    """An MFEM file by its published format: sections by name, as lines of numbers; the groups of a part behind them."""
    lines = [line for line in open(path).read().split("\n") if line and not line.startswith("#")]
    assert lines[0] == "MFEM mesh v1.3" and lines[-1] == "mfem_mesh_end"
    at = lambda word: lines.index(word)
    def table(word, skip=1):
        n = int(lines[at(word) + 1])
        return np.array([line.split() for line in lines[at(word) + skip + 1:at(word) + skip + 1 + n]], float)
    return lines, table("elements").astype(int), table("boundary").astype(int), table("vertices", 2)


def check_mfem(path, want):
    import mfem.ser as mfem
    mesh = mfem.Mesh(path, 1, 1)
    points = np.array([mesh.GetVertexArray(v) for v in range(mesh.GetNV())])
    tets = np.array([mesh.GetElementVertices(e) for e in range(mesh.GetNE())])
    tris = np.array([mesh.GetBdrElementVertices(e) for e in range(mesh.GetNBE())])
    regions = np.array([mesh.GetAttribute(e) for e in range(mesh.GetNE())])
    labels = np.array([mesh.GetBdrAttribute(e) for e in range(mesh.GetNBE())])
    same(path, "volume by region", by(regions, volumes(points, tets)), want["volume by region"])
    sizes = by(labels, areas(points, tris))
    names = {name: list(mesh.bdr_attribute_sets.GetAttributeSet(name).ToList()) for name in mesh.bdr_attribute_sets.GetAttributeSetNames()}
    same_areas(path, {name: sum(sizes[a] for a in members) for name, members in names.items()})
    print(f"{path}: PyMFEM {mfem.__version__ if hasattr(mfem, '__version__') else ''} sees {len(tets)} tetrahedra, {len(tris)} boundary elements")
    prefix = path[:-5] + "."
    if os.path.exists(prefix + "000000"):
        check_mfem_parts(mfem, path, prefix, want, len(tris))


def check_mfem_parts(mfem, path, prefix, want, n_boundary):
    """The parts read by PyMFEM, less what they share; that by this script: every side lists the same in the same order, and all of it."""
    parts, volume, shared, found = [], collections.defaultdict(float), collections.defaultdict(dict), [{}, {}, {}]
    for rank in range(want["parts"]):
        lines, tets, tris, points = mfem_sections(prefix + f"{rank:06}")
        end = lines.index("mfem_serial_mesh_end")
        with tempfile.NamedTemporaryFile("w", suffix=".mesh") as alone:
            alone.write("\n".join(lines[:end]) + "\nmfem_mesh_end\n")
            alone.flush()
            seen = mfem.Mesh(alone.name, 1, 1)
            assert (seen.GetNE(), seen.GetNBE(), seen.GetNV()) == (len(tets), len(tris), len(points))
        assert (tets[:, 1] == 4).all() and (tris[:, 1] == 2).all()
        for region, v in by(tets[:, 0], volumes(points, tets[:, 2:])).items():
            volume[region] += v
        n_boundary -= len(tris)
        words = " ".join(lines[end + 1:]).split()
        take = lambda n: [int(words.pop(0)) for _ in range(n)]
        def word(expected):
            assert words.pop(0) == expected, expected
            return take(1)[0]
        assert words.pop(0) == "communication_groups"
        groups = [tuple(take(take(1)[0])) for _ in range(word("number_of_groups"))]
        assert groups[0] == (rank,) and len(set(groups)) == len(groups)
        totals = [word(f"total_shared_{what}") for what in ("vertices", "edges", "faces")]
        keys = [tuple(p) for p in points.tolist()]
        for group in groups[1:]:
            for dimension, what in enumerate(("vertices", "edges", "faces")):
                listed = []
                for _ in range(word(f"shared_{what}")):
                    if dimension == 2:
                        assert take(1) == [2]
                    listed.append(tuple(keys[v] for v in take(dimension + 1)))
                shared[group][dimension, rank] = listed
                totals[dimension] -= len(listed)
        assert totals == [0, 0, 0] and words == ["mfem_mesh_end"]
        # All entities of the part, by hand.
        for tet in tets[:, 2:].tolist():
            names = sorted(keys[v] for v in tet)
            for a in range(4):
                found[0].setdefault((names[a],), set()).add(rank)
                for b in range(a):
                    found[1].setdefault((names[b], names[a]), set()).add(rank)
                found[2].setdefault(tuple(names[:a] + names[a + 1:]), set()).add(rank)
        parts.append(len(tets))
    same(prefix, "tetrahedra by part", dict(enumerate(parts)), want["tets by part"])
    same(prefix, "volume by region", dict(volume), want["volume by region"])
    assert n_boundary == 0, "boundary elements are not each in one part"
    n_faces = collections.defaultdict(dict)
    for dimension in range(3):
        expected = collections.defaultdict(set)
        for entity, ranks in found[dimension].items():
            if len(ranks) > 1:
                expected[tuple(sorted(ranks))].add(entity)
        for group, sides in shared.items():
            first = sides[dimension, group[0]]
            assert all(sides[dimension, rank] == first for rank in group), f"group {group} is listed differently"
            listed = {tuple(sorted(entity)) for entity in first}
            assert len(listed) == len(first) and listed == expected.pop(group, set()), f"group {group} lists others of dimension {dimension}"
            if dimension == 2 and first:
                a, b = group
                n_faces[a][b] = n_faces[b][a] = len(first)
        assert not expected, "something shared is not listed"
    same(prefix, "faces between parts", dict(n_faces), {k: v for k, v in want["faces between parts"].items() if v})
    print(f"{prefix}*: {len(parts)} parts of {sum(parts)} tetrahedra, {len(shared)} groups, alike on all sides and complete")
    program = os.environ.get("MFEM_PROGRAM")
    if not program:
        skipped.append("MFEM in parallel: MFEM_PROGRAM names no build of tests/mfem_parallel.cpp")
        return
    run = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-np", str(len(parts)), program, prefix, path]
    out = subprocess.run(run, capture_output=True, text=True, env=FOAM_ENVIRONMENT)
    print(out.stdout.strip())
    if out.returncode:
        complain(f"{' '.join(run)}: {out.stdout[-800:]}{out.stderr[-800:]}")


def check_ele(path, want):
    """Points and tetrahedra read by meshio, which leaves out faces: these as the manual says. TetGen itself keeps nothing of what it reads."""
    import meshio

    mesh = meshio.read(path)
    points, corners = mesh.points, mesh.cells_dict["tetra"]
    same(path, "volume by region", by(mesh.cell_data["tetgen:ref"][0].astype(int), volumes(points, corners)), want["volume by region"])
    tris = np.loadtxt(path[:-4] + ".face", skiprows=1)
    same(path, "areas", sorted(round(a, 9) for a in by(tris[:, 4], areas(points, tris[:, 1:4].astype(int))).values()),
         sorted(round(a, 9) for a in known_areas.get("of labels", {}).values()) or None)
    print(f"{path}: {len(corners)} tetrahedra, read by meshio {meshio.__version__}, faces by a reader of this script's own")


class PolyMesh:
    """An OpenFOAM mesh, read by its published format."""

    def __init__(self, folder):
        self.folder = os.path.join(folder, "constant", "polyMesh")
        self.points = self.numbers("points", float, 3)
        self.owner, self.neighbour = self.numbers("owner", int), self.numbers("neighbour", int)
        self.n_cells = int(max(self.owner.max(), self.neighbour.max(initial=0))) + 1
        self.faces = self.read_faces()
        text = self.body("boundary")[0].decode()
        self.patches = {}
        for name, body in re.findall(r"(\S+)\s*\{([^}]*)\}", text):
            self.patches[name] = dict(re.findall(r"(\w+)\s+([^;]+);", body))
        self.cell_zones, self.face_zones = self.zones("cellZones", "cellLabels"), self.zones("faceZones", "faceLabels")

    def body(self, name):
        data = open(os.path.join(self.folder, name), "rb").read()
        head, rest = data.split(b"}", 1)
        assert head.startswith(b"FoamFile")
        return rest, b"format      binary" in head

    def lists(self, data, binary, kind, width):
        """The lists at the beginning of `data`, one after the other."""
        found, kind8 = [], {int: "<i4", float: "<f8", bool: "u1"}[kind]
        while True:
            match = re.match(rb"\s*(\d+)\s*", data)
            if not match:
                return found, data
            n = int(match[1])
            data = data[match.end():]
            if binary and n:
                assert data[:1] == b"("
                size = n * width * int(kind8[2:] if kind8[0] == "<" else 1)
                found.append(np.frombuffer(data[1:1 + size], kind8))
                assert data[1 + size:2 + size] == b")"
                data = data[2 + size:]
            elif binary:
                found.append(np.array([], kind8))
            else:
                end = re.compile(rb"\n\)|\(\s*\)").search(data).end()
                words = re.sub(rb"[()]", b" ", data[:end]).split()
                found.append(np.array(words, float if kind is float else np.int64))
                data = data[end:]

    def numbers(self, name, kind, width=1):
        data, binary = self.body(name)
        (values,), rest = self.lists(data, binary, kind, width)
        assert not rest.strip(), f"{name}: something follows the list"
        return values.reshape(-1, width) if width > 1 else values

    def read_faces(self):
        data, binary = self.body("faces")
        if not binary:
            (words,), _ = self.lists(data, False, int, 1)
            words = words.reshape(-1, 4)
            assert (words[:, 0] == 3).all()
            return words[:, 1:]
        (offsets, nodes), _ = self.lists(data, True, int, 1)
        assert (offsets == 3 * np.arange(len(offsets))).all()
        return nodes.reshape(-1, 3)

    def zones(self, name, key):
        data, binary = self.body(name)
        found = {}
        for match in re.finditer(rb"(\w+)\n\{\n    type \w+;\n    " + key.encode() + rb" List<label> ", data):
            lists, _ = self.lists(data[match.end():], binary, int, 1)
            found[match[1].decode()] = lists[0]
        return found

    def check(self):
        n_inner, n_cells = len(self.neighbour), self.n_cells
        assert len(self.owner) == len(self.faces)
        low, high = self.owner[:n_inner].astype(np.int64), self.neighbour.astype(np.int64)
        assert (low < high).all(), "an owner is not below its neighbor"
        assert (np.diff(low * n_cells + high) > 0).all(), "faces are not in upper triangular order"
        start = n_inner
        for name, patch in self.patches.items():
            assert int(patch["startFace"]) == start, f"patch {name} begins elsewhere"
            start += int(patch["nFaces"])
        assert start == len(self.faces), "patches do not cover the boundary"
        a, b, c = (self.points[self.faces[:, i]] for i in range(3))
        area, center = np.cross(b - a, c - a) / 2, (a + b + c) / 3
        closed, volume = np.zeros((n_cells, 3)), np.zeros(n_cells)
        for cells, sign in ((self.owner, 1), (self.neighbour, -1)):
            f = slice(len(cells))
            np.add.at(closed, cells, sign * area[f])
            np.add.at(volume, cells, sign * np.einsum("ij,ij->i", area[f], center[f]) / 3)
        assert np.bincount(self.owner, minlength=n_cells).sum() + n_inner == 4 * n_cells
        scale = np.abs(area).max()
        assert np.abs(closed).max() < 1e-12 * scale, "a cell is open"
        assert volume.min() > 0, "a cell is inside out"
        assert sorted(np.concatenate(list(self.cell_zones.values())).tolist()) == list(range(n_cells))
        self.area = np.linalg.norm(area, axis=1)
        return volume

    def patch(self, name):
        start = int(self.patches[name]["startFace"])
        return slice(start, start + int(self.patches[name]["nFaces"]))


def check_foam(path, want):
    case = os.path.dirname(path) or "."
    folders = sorted((f for f in os.listdir(case) if re.fullmatch(r"processor\d+", f)), key=lambda f: int(f[9:]))
    whole = PolyMesh(case) if os.path.isdir(os.path.join(case, "constant", "polyMesh")) else None
    ranks = [PolyMesh(os.path.join(case, f)) for f in folders]

    def of_regions(meshes):
        found = collections.defaultdict(float)
        for mesh in meshes:
            volume = mesh.check()
            for name, cells in mesh.cell_zones.items():
                found[int(name[7:])] += float(volume[cells].sum())
        return dict(found)

    def of_labels(meshes):
        found = collections.defaultdict(float)
        for mesh in meshes:
            for name, patch in mesh.patches.items():
                if patch["type"] == "patch":
                    found[name] += float(mesh.area[mesh.patch(name)].sum())
        return dict(found)

    sees = []
    for meshes in filter(None, ([whole] if whole else [], ranks)):
        same(path, "cells", sum(m.n_cells for m in meshes), want["tets"])
        same(path, "volume by region", of_regions(meshes), want["volume by region"])
        same(path, "area of patches", sum(of_labels(meshes).values()), known_areas.setdefault("of the boundary", sum(of_labels(meshes).values())))
        same(path, "area by patch", of_labels(meshes), known_areas.setdefault("of patches", of_labels(meshes)))
    if ranks:
        same(path, "cells by processor", {i: m.n_cells for i, m in enumerate(ranks)}, want["tets by part"])
    for here, mesh in enumerate(ranks):
        shared = {}
        assert len(set(map(tuple, (list(k) for k in [[n for n, p in m.patches.items() if p["type"] == "patch"] for m in ranks])))) == 1
        for name, patch in mesh.patches.items():
            if patch["type"] != "processor":
                continue
            there = int(patch["neighbProcNo"])
            other = ranks[there]
            mine, theirs = mesh.patch(name), other.patch(f"procBoundary{there}to{here}")
            shared[there] = mine.stop - mine.start
            a, b = mesh.points[mesh.faces[mine]], other.points[other.faces[theirs]]
            assert (a == b[:, [0, 2, 1]]).all(), f"{name}: faces differ on both sides"
        same(path, f"faces between {here} and others", shared, want["faces between parts"][here])
    if whole:
        for mesh in ranks:
            points, cells = mesh.numbers("pointProcAddressing", int), mesh.numbers("cellProcAddressing", int)
            faces, patches = mesh.numbers("faceProcAddressing", int), mesh.numbers("boundaryProcAddressing", int)
            assert (whole.points[points] == mesh.points).all(), "pointProcAddressing"
            back = faces < 0
            f = np.abs(faces) - 1
            seen = np.sort(points[mesh.faces], axis=1)
            assert (seen == np.sort(whole.faces[f], axis=1)).all(), "faceProcAddressing"
            assert (np.where(back, whole.neighbour[np.minimum(f, len(whole.neighbour) - 1)], whole.owner[f]) == cells[mesh.owner]).all(), "cellProcAddressing"
            assert [list(whole.patches).index(n) if p["type"] == "patch" else -1 for n, p in mesh.patches.items()] == patches.tolist()
        if ranks:
            sees.append("addressing right")
    print(f"{path}: {'whole' if whole else 'no whole'}, {len(ranks)} processors, ordered, closed, alike on both sides {sees}")
    run_openfoam(case, whole, ranks)


HEAD = "FoamFile { version 2.0; format ascii; class %s; object %s; }\n"
SYSTEM = {
    "controlDict": "application laplacianFoam; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1;"
                   "writeControl timeStep; writeInterval 1; writeFormat ascii; writePrecision 14;",
    "fvSchemes": "ddtSchemes { default steadyState; } gradSchemes { default Gauss linear; } divSchemes { default none; }"
                 "laplacianSchemes { default Gauss linear corrected; } interpolationSchemes { default linear; }"
                 "snGradSchemes { default corrected; } fluxRequired { default no; T; }",
    "fvSolution": "solvers { T { solver PCG; preconditioner DIC; tolerance 1e-13; relTol 0; maxIter 5000; } } SIMPLE { nNonOrthogonalCorrectors 3; }",
    "decomposeParDict": "numberOfSubdomains %d; method simple; simpleCoeffs { n (%d 1 1); delta 0.001; }",
}
# Debian's programs look for their settings by a variable that nothing sets.
FOAM_ENVIRONMENT = {"WM_PROJECT_DIR": "/usr/share/openfoam", "OMPI_MCA_plm_rsh_agent": "/bin/false", **os.environ}


def foam(case, *command, n=0):
    """Runs a program of OpenFOAM; its output, or None when it failed."""
    run = [command[0], "-case", case, *command[1:]]
    if n:
        run = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-np", str(n), *run, "-parallel"]
    out = subprocess.run(run, capture_output=True, text=True, env=FOAM_ENVIRONMENT)
    text = out.stdout + out.stderr
    if out.returncode or "FOAM FATAL" in text:
        complain(f"{' '.join(run)}: {text[-1500:]}")
        return None
    return text


def write_dictionary(path, name, body, kind="dictionary"):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write(HEAD % (kind, name) + body + "\n")


def run_openfoam(case, whole, ranks):
    n = len(ranks)
    for program in ("checkMesh", "laplacianFoam", "reconstructPar", "mpirun"):
        if not shutil.which(program):
            skipped.append(f"OpenFOAM: {program} is not installed")
            return
    for name, body in SYSTEM.items():
        body = body % (n, n) if "%d" in body else body
        write_dictionary(os.path.join(case, "system", name), name, body)
    for processes in ([0] if whole else []) + ([n] if n else []):
        text = foam(case, "checkMesh", "-constant", n=processes)
        if text is None:
            continue
        build = re.search(r"Build\s*:\s*(\S+)", text)
        if "Mesh OK." in text:
            print(f"{case}: checkMesh {build and build[1]}, {processes or 1} processes: Mesh OK")
        else:
            complain(f"{case}: checkMesh: {text[-2500:]}")
    if whole and n:
        compare_solutions(case, whole, ranks)


def compare_solutions(case, whole, ranks):
    """A Laplace problem whose temperature on the boundary is x + 2y - z, solved on the whole and on all processors, then put together again."""
    n = len(ranks)
    roots = [(case, whole)] + [(os.path.join(case, f"processor{i}"), mesh) for i, mesh in enumerate(ranks)]
    for root, mesh in roots:
        patches = ""
        for name, patch in mesh.patches.items():
            if patch["type"] == "processor":
                # What stands in the cells behind at first.
                patches += f"{name} {{ type processor; value uniform 0; }}\n"
                continue
            centers = mesh.points[mesh.faces[mesh.patch(name)]].mean(axis=1)
            values = " ".join(f"{v:.15g}" for v in centers @ [1, 2, -1])
            patches += f"{name} {{ type fixedValue; value nonuniform List<scalar> {len(centers)} ({values}); }}\n"
        body = f"dimensions [0 0 0 1 0 0 0]; internalField uniform 0; boundaryField {{ {patches} }}"
        write_dictionary(os.path.join(root, "0", "T"), "T", body, "volScalarField")
    properties = os.path.join(case, "constant", "transportProperties")
    write_dictionary(properties, "transportProperties", "DT DT [0 2 -1 0 0 0 0] 1;")

    def solution():
        text = open(os.path.join(case, "1", "T")).read()
        return np.array(re.search(r"nonuniform List<scalar>\s*\d+\s*\(([^)]*)\)", text)[1].split(), float)

    if foam(case, "laplacianFoam") is None:
        return
    serial = solution()
    shutil.rmtree(os.path.join(case, "1"))
    if foam(case, "laplacianFoam", n=n) is None or foam(case, "reconstructPar") is None:
        return
    parallel = solution()
    apart = float(np.abs(serial - parallel).max())
    print(f"{case}: laplacianFoam on {n} processes, reconstructed, differs by {apart:.1e} from that on one; values {serial.min():.3f} to {serial.max():.3f}")
    if len(serial) != whole.n_cells or not apart < 1e-8 or not np.ptp(serial) > 0.1:
        complain(f"{case}: the parallel solution is another")


def of_first_region(info):
    """What a file of region 1 alone has."""
    (row,) = [r for r in info["regions"] if r["region"] == 1]
    return {"tets": row["tets"], "parts": 1, "volume by region": {1: row["volume"]}}


def main():
    global known_areas
    arguments = [a for a in sys.argv[1:] if a != "--require"]
    info, *files = arguments
    info = json.load(open(info))
    areas_of = {False: known_areas, True: {}}
    for path in files:
        ending, is_only = os.path.splitext(path)[1][1:], ".only" in path
        want, known_areas = (of_first_region if is_only else store)(info), areas_of[is_only]
        try:
            globals()["check_" + ending](path, want)
        except ImportError as error:
            skipped.append(f"{path}: {error}")
        except Exception as error:  # what a reader says against a file is a finding
            import traceback
            traceback.print_exc()
            complain(f"{path}: {error!r}")
    for what in skipped:
        print("skipped:", what)
    sys.exit(1 if wrong or (skipped and "--require" in sys.argv) else 0)


if __name__ == "__main__":
    main()
