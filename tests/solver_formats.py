#!/usr/bin/env python3
"""Do the programs that read Exodus II, XDMF, Nastran, Gmsh and VTKHDF files see the store's mesh and its fields?

  solver_formats.py TETDB FOLDER

Meshes a sample of many regions in four sub-domains, adds fields of every type, exports it in each format and reads the files by netCDF4, VTK, meshio,
pyNastran, h5py, gmsh and DOLFINx. All is compared with the arrays of the .npy export, to the bit where the format keeps bits. A program
that is not installed is named and skipped. Exit code 0 when all agree.
"""
import collections
import json
import os
import subprocess
import sys

import numpy as np

from solvers import areas, by, corners_of, volumes

SAMPLE = "sample:balls,count=20,h=0.045"
FIELDS = [("T", "vertices", "x+2*y", "f64"), ("u", "vertices", "-y,x,z*z", "f32"), ("n", "vertices", "0*x+7", "i64"),
          ("s", "tets", "x,y,z,x*y,y*z,x*z", "f64"), ("mark", "tets", "if(quality > 1.5, 1, 0)", "i32"), ("g", "tets", "1,2,3,4,5,6,7,8,x", "f64")]
# Components of a symmetric tensor in its nine.
ROWS = [0, 3, 5, 3, 1, 4, 5, 4, 2]
skipped = []


def run(*words, code=0):
    done = subprocess.run(words, capture_output=True, text=True)
    assert code is None or done.returncode == code, f"{' '.join(words)}: exit {done.returncode}\n{done.stderr}"
    return done.stdout + done.stderr


def make(tetdb, store, subdomains):
    run(tetdb, "mesh", SAMPLE, "-o", store, "--regions", "all", "--subdomains", str(subdomains))
    for name, place, expression, kind in FIELDS:
        run(tetdb, "field", store, "add", name, "--at", place, "--from", expression, "--type", kind)


class Mesh:
    """The store's arrays, as .npy has them, and its names."""

    def __init__(self, tetdb, store, stem):
        run(tetdb, "export", store, stem + ".npy")
        load = lambda name: np.load(f"{stem}_{name}.npy")
        self.points, self.tets, self.region, self.subdomain, self.quality = map(load, ("points", "tets", "region", "subdomain", "quality"))
        self.triangles, self.label = load("triangles"), load("label")
        self.fields = {name: load(name) for name, *_ in FIELDS}
        self.info = json.loads(run(tetdb, "info", store, "--json"))
        self.labels = self.info["labels"]
        self.volume = by(self.region, volumes(self.points, self.tets))
        self.area = by(self.label, areas(self.points, self.triangles))


def near(found, expected, tolerance=1e-9):
    assert set(found) == set(expected), (found, expected)
    assert all(abs(found[key] - value) <= tolerance * abs(value) for key, value in expected.items()), (found, expected)


def components(values):
    return values.reshape(len(values), -1).astype(float)


def check_middles(cells, values, stem):
    """Values at the nodes of tetrahedra of second order, in VTK's order, by name: in the middle of an edge the mean of both ends."""
    assert values, f"{stem} has no values"
    for name, of in values.items():
        for node, (a, b) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)], 4):
            mean = of[cells[:, a]].astype(float) / 2 + of[cells[:, b]].astype(float) / 2
            assert (of[cells[:, node]] == mean.astype(of.dtype)).all(), name
    print(f"{stem}: {sorted(values)} have means in the middles of edges")


# Exodus II.

# Nodes of the sides of a tetrahedron, by the Exodus manual.
SIDES = np.array([[0, 1, 3], [1, 2, 3], [0, 3, 2], [0, 2, 1]])


def exodus_by_netcdf(path, mesh):
    import netCDF4
    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)
        v = file.variables
        text = lambda name: [bytes(row).split(b"\0")[0].decode() for row in v[name][:].reshape(-1, v[name].shape[-1])]
        assert file.data_model == "NETCDF3_64BIT_OFFSET", file.data_model
        assert mesh.info["digest"] in file.title and any(mesh.info["digest"] in line for line in text("info_records"))
        assert any(line.startswith("recipe ") for line in text("info_records"))
        assert (np.column_stack([v["coord" + x][:] for x in "xyz"]) == mesh.points).all()
        assert (v["node_num_map"][:] == np.arange(len(mesh.points)) + 1).all()
        order = v["elem_num_map"][:] - 1
        assert (np.sort(order) == np.arange(len(mesh.tets))).all()
        names, blocks, end = text("name_elem_var"), [], 0
        assert (v["elem_var_tab"][:] == 1).all() and (v["time_whole"][:] == 0).all()
        for b, region in enumerate(v["eb_prop1"][:], 1):
            assert v[f"connect{b}"].elem_type == "TETRA"
            blocks.append(v[f"connect{b}"][:] - 1)
            own = order[end:end + len(blocks[-1])]
            end += len(own)
            assert (mesh.region[own] == region).all() and (np.diff(own) > 0).all()
            values = {name: v[f"vals_elem_var{i}eb{b}"][0] for i, name in enumerate(names, 1)}
            assert (values.pop("subdomain") == mesh.subdomain[own]).all() and (values.pop("quality") == mesh.quality[own]).all()
            expected = {"mark": mesh.fields["mark"][own, None], "s": mesh.fields["s"][own], "g": mesh.fields["g"][own]}
            suffixes = {1: [""], 6: ["_xx", "_yy", "_zz", "_xy", "_yz", "_xz"], 9: ["_" + a + b for a in "xyz" for b in "xyz"]}
            for name, rows in expected.items():
                for k, suffix in enumerate(suffixes[rows.shape[1]]):
                    assert (values.pop(name + suffix) == rows[:, k]).all(), name
            assert not values, values.keys()
        nodes = np.concatenate(blocks)
        assert (nodes == mesh.tets[order]).all()
        found = {name: v[f"vals_nod_var{i}"][0] for i, name in enumerate(text("name_nod_var"), 1)}
        assert (found.pop("T") == mesh.fields["T"]).all() and (found.pop("n") == 7).all()
        for k, name in enumerate(["u_x", "u_y", "u_z"]):
            assert (found.pop(name) == mesh.fields["u"][:, k]).all()
        assert not found, found.keys()
        for i, (name, number) in enumerate(zip(text("ss_names"), v["ss_prop1"][:]), 1):
            assert name == mesh.labels[number - 1]
            sides = nodes[v[f"elem_ss{i}"][:] - 1][np.arange(len(v[f"elem_ss{i}"]))[:, None], SIDES[v[f"side_ss{i}"][:] - 1]]
            expected = mesh.triangles[mesh.label == number - 1]
            key = lambda faces: sorted(map(tuple, np.sort(faces, axis=1).tolist()))
            assert key(sides) == key(expected), name
            a, b, c = (mesh.points[sides[:, k]] for k in range(3))
            inside = mesh.points[nodes[v[f"elem_ss{i}"][:] - 1]].mean(axis=1)
            assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), inside - a) < 0).all(), "a side is not seen from outside"
    print(f"{path}: netCDF4 {netCDF4.__version__} sees {len(nodes)} elements in {len(blocks)} blocks, {i} side sets, {len(names)} element variables")


def exodus_by_vtk(path, mesh):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
    reader = vtk.vtkExodusIIReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    block, side = reader.ELEM_BLOCK, reader.SIDE_SET
    for kind in (block, side):
        for i in range(reader.GetNumberOfObjects(kind)):
            reader.SetObjectStatus(kind, i, 1)
    for kind in (block, reader.NODAL):
        reader.SetAllArrayStatus(kind, 1)
    reader.Update()
    grids = lambda of: [of.GetBlock(i) for i in range(of.GetNumberOfBlocks())]
    elements, sides = (grids(reader.GetOutput())[i] for i in (0, 4))
    volume, names = {}, [reader.GetObjectName(block, i) for i in range(reader.GetNumberOfObjects(block))]
    for i, grid in enumerate(grids(elements)):
        points, cells = vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        # VTK keeps positions of 32 bits.
        volume[reader.GetObjectId(block, i)] = float(volumes(points.astype(float), cells.reshape(grid.GetNumberOfCells(), -1)[:, :4]).sum())
        if mesh is not None:
            assert grid.GetCellData().HasArray("mark") and grid.GetPointData().HasArray("T")
    area = {}
    for i, grid in enumerate(grids(sides)):
        points, cells = vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        area[reader.GetObjectId(side, i) - 1] = float(areas(points.astype(float), cells.reshape(grid.GetNumberOfCells(), -1)[:, :3]).sum())
    print(f"{path}: VTK {vtk.vtkVersion().GetVTKVersion()} sees {len(volume)} blocks ({names[0]} ...) and {len(area)} side sets")
    return volume, area


def check_exodus(tetdb, store, mesh, stem):
    run(tetdb, "export", store, stem + ".exo")
    run(tetdb, "export", store, stem + ".second.e", "--order", "2")
    exodus_by_netcdf(stem + ".exo", mesh)
    for path in (stem + ".exo", stem + ".second.e"):
        volume, area = exodus_by_vtk(path, mesh if path.endswith(".exo") else None)
        near(volume, mesh.volume, 1e-6)
        near(area, mesh.area, 1e-6)
    import meshio
    import netCDF4
    with netCDF4.Dataset(stem + ".second.e") as file:
        points = np.column_stack([file.variables["coord" + x][:].data for x in "xyz"])
        nodes = [file.variables[f"connect{b}"][:].data - 1 for b in range(1, len(mesh.volume) + 1)]
        assert (file.variables["connect1"].elem_type, len(points)) == ("TETRA10", file.variables["node_num_map"][-1])
        names = [bytes(row).split(b"\0")[0].decode() for row in file.variables["name_nod_var"][:].data]
        # Doubles, but no finer than the field's own numbers.
        kind = lambda name: mesh.fields[name.split("_")[0]].dtype
        found = {name: file.variables[f"vals_nod_var{i}"][0].data.astype(kind(name)) for i, name in enumerate(names, 1)}
        assert (found["T"][:len(mesh.points)] == mesh.fields["T"]).all() and "n" not in found
        check_middles(np.concatenate(nodes), found, stem + ".second.e")
    near({0: float(volumes(points, corners_of(points, np.concatenate(nodes))).sum())}, {0: sum(mesh.volume.values())})
    seen = meshio.read(stem + ".exo")
    assert (seen.points == mesh.points).all()
    found = sum(float(volumes(seen.points, block.data).sum()) for block in seen.cells if block.type == "tetra")
    near({0: found}, {0: sum(mesh.volume.values())})
    print(f"{stem}.exo: meshio {meshio.__version__} sees {len(seen.cells)} blocks, {list(seen.point_data)}")
    # One region alone, and one sub-domain.
    run(tetdb, "export", store, stem + ".one.exo", "--region", "1")
    near(exodus_by_vtk(stem + ".one.exo", None)[0], {1: mesh.volume[1]}, 1e-6)
    run(tetdb, "export", store, stem + ".piece.exo", "--subdomain", "1", "--pieces")
    own = mesh.subdomain == 1
    near(exodus_by_vtk(stem + ".piece_00001.exo", None)[0], by(mesh.region[own], volumes(mesh.points, mesh.tets[own])), 1e-6)


# XDMF.

def check_xdmf(tetdb, store, mesh, stem):
    import meshio
    import h5py
    run(tetdb, "export", store, stem + ".xdmf")
    seen, skin = meshio.read(stem + ".xdmf"), meshio.read(stem + "_boundary.xdmf")
    assert (seen.points == mesh.points).all() and (skin.points == mesh.points).all()
    assert (seen.cells_dict["tetra"] == mesh.tets).all() and (skin.cells_dict["triangle"] == mesh.triangles).all()
    for name, expected in {"region": mesh.region, "subdomain": mesh.subdomain, "quality": mesh.quality,
                           "mark": mesh.fields["mark"], "s": mesh.fields["s"], "g": mesh.fields["g"]}.items():
        (found,) = seen.cell_data[name]
        assert found.dtype == expected.dtype and (found == expected).all(), name
    for name in ("T", "u", "n"):
        assert (seen.point_data[name] == mesh.fields[name]).all() and seen.point_data[name].dtype == mesh.fields[name].dtype
    assert (skin.cell_data["label"][0] == mesh.label).all()
    assert {name: tuple(row) for name, row in skin.field_data.items()} == {mesh.labels[i]: (i, 2) for i in np.unique(mesh.label).tolist()}
    print(f"{stem}.xdmf: meshio {meshio.__version__}, h5py {h5py.__version__} see {len(mesh.tets)} tetrahedra, {len(mesh.triangles)} facets, {list(seen.cell_data)}")
    run(tetdb, "export", store, stem + ".second.xdmf", "--order", "2")
    second = meshio.read(stem + ".second.xdmf")
    tets = corners_of(second.points, second.cells_dict["tetra10"])
    near(by(second.cell_data["region"][0], volumes(second.points, tets)), mesh.volume)
    found = {name: values for name, values in second.point_data.items() if name in mesh.fields}
    assert all((values[:len(mesh.points)] == mesh.fields[name]).all() for name, values in found.items()) and "n" not in found
    check_middles(second.cells_dict["tetra10"], found, stem + ".second.xdmf")
    facets = meshio.read(stem + ".second_boundary.xdmf").cells_dict["triangle6"]
    for node, (a, b) in enumerate([(0, 1), (1, 2), (0, 2)], 3):
        assert (second.points[facets[:, node]] == (second.points[facets[:, a]] / 2 + second.points[facets[:, b]] / 2)).all()


def check_xdmf_by_vtk(tetdb, store, mesh, stem):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
    if not hasattr(vtk, "vtkXdmfReader") and not hasattr(vtk, "vtkXdmf3Reader"):
        raise ImportError("this VTK has no reader of XDMF")
    reader = (vtk.vtkXdmf3Reader if hasattr(vtk, "vtkXdmf3Reader") else vtk.vtkXdmfReader)()
    reader.SetFileName(stem + ".xdmf")
    reader.Update()
    grid = reader.GetOutputDataObject(0)
    tets = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
    assert (tets == mesh.tets).all() and (vtk_to_numpy(grid.GetCellData().GetArray("region")) == mesh.region).all()
    print(f"{stem}.xdmf: {reader.GetClassName()} sees {len(tets)} tetrahedra")


# Nastran.

def check_nastran(tetdb, store, mesh, stem):
    import meshio
    run(tetdb, "export", store, stem + ".bdf")
    seen = meshio.read(stem + ".bdf")
    assert np.allclose(seen.points, mesh.points, rtol=1e-11, atol=0)
    assert (seen.cells_dict["tetra"] == mesh.tets).all() and (seen.cells_dict["triangle"] == mesh.triangles).all()
    shell = max(mesh.volume) + 1 + mesh.label
    reference = dict(zip([block.type for block in seen.cells], seen.cell_data["nastran:ref"]))
    print(f"{stem}.bdf: meshio {meshio.__version__} sees {len(mesh.tets)} tetrahedra, {len(mesh.triangles)} triangles")
    run(tetdb, "export", store, stem + ".second.nas", "--order", "2")
    second = meshio.read(stem + ".second.nas")
    ends, middles = second.cells_dict["tetra10"][:, :4], second.cells_dict["tetra10"][:, 4:]
    for node, (a, b) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]):
        middle = second.points[ends[:, a]] / 2 + second.points[ends[:, b]] / 2
        assert np.allclose(second.points[middles[:, node]], middle, rtol=1e-9, atol=1e-13)
    from pyNastran import __version__
    from pyNastran.bdf.bdf import read_bdf
    for path, kind in ((stem + ".bdf", "CTETRA"), (stem + ".second.nas", "CTETRA")):
        deck = read_bdf(path, xref=False, debug=None)
        if path.endswith(".bdf"):
            elements = [deck.elements[i + 1] for i in range(len(mesh.tets))]
            assert (np.array([e.nodes for e in elements]) == mesh.tets + 1).all() and (np.array([e.pid for e in elements]) == mesh.region).all()
            faces = [deck.elements[len(mesh.tets) + i + 1] for i in range(len(mesh.triangles))]
            assert (np.array([e.nodes for e in faces]) == mesh.triangles + 1).all() and (np.array([e.pid for e in faces]) == shell).all()
        kinds = collections.Counter(p.type for p in deck.properties.values())
        assert kinds == {"PSOLID": len(mesh.volume), "PSHELL": len(mesh.area)}, kinds
    text = open(stem + ".bdf").read()
    assert f"$ digest {mesh.info['digest']}\n" in text
    print(f"{stem}.bdf: pyNastran {__version__} sees {len(deck.elements)} elements, {dict(kinds)}")


# Fields of Gmsh.

def check_gmsh(tetdb, store, mesh, stem):
    import gmsh
    gmsh.initialize(["gmsh", "-v", "1"])
    try:
        for options in ([], ["--ascii"]):
            run(tetdb, "export", store, stem + ".msh", *options)
            gmsh.clear()
            gmsh.merge(stem + ".msh")
            found = {}
            for tag in gmsh.view.getTags():
                name = gmsh.option.getString(f"View[{gmsh.view.getIndex(tag)}].Name")
                kind, tags, values, _, _ = gmsh.view.getModelData(tag, 0)
                found[name] = (kind, np.array(tags), np.array([np.array(v) for v in values]))
            assert set(found) == {name for name, *_ in FIELDS}, found.keys()
            for name, place, *_ in FIELDS:
                kind, tags, values = found[name]
                # Triangles are numbered before tetrahedra, those between sub-domains among them.
                expected, first = components(mesh.fields[name]), int(tags.min())
                expected = expected[:, ROWS] if expected.shape[1] == 6 else expected
                assert kind == ("NodeData" if place == "vertices" else "ElementData") and len(tags) == len(expected)
                assert (values == expected[tags.astype(np.int64) - first]).all(), name
        print(f"{stem}.msh: gmsh {gmsh.GMSH_API_VERSION} sees the fields {sorted(found)}")
    finally:
        gmsh.finalize()


def check_round_trips(tetdb, store, mesh, stem):
    """What import reads of .msh and .npy are the same fields; those at tetrahedra have the same digests, for all imports have one order."""
    fields = lambda path: {f["name"]: f for f in json.loads(run(tetdb, "field", path, "list", "--json"))["fields"]}
    store, back = stem + ".alone.tetdb", stem + ".back.tetdb"
    make(tetdb, store, 1)
    # Imports of a mesh share an order, which is not that of the store it was meshed in.
    run(tetdb, "export", store, stem + ".first.npy")
    run("rm", "-rf", store)
    run(tetdb, "import", stem + ".first.npy", "-o", store)
    ours = fields(store)
    run(tetdb, "export", store, stem + ".alone.msh", stem + ".alone.npy")
    of = lambda stem, name: np.load(f"{stem}_{name}.npy")
    place = np.lexsort(of(stem + ".alone", "points").T)
    for ending in ("msh", "npy"):
        run("rm", "-rf", back)
        run(tetdb, "import", f"{stem}.alone.{ending}", "-o", back)
        theirs = fields(back)
        assert set(theirs) == set(ours), theirs.keys()
        keeps = lambda f: ending == "npy" or f["type"] == "f64" and f["components"] != 6
        same = [n for n in ours if ours[n]["at"] == "tets" and keeps(ours[n])]
        assert same and all(ours[n]["digest"] == theirs[n]["digest"] for n in same), {n: (ours[n]["digest"], theirs[n]["digest"]) for n in same}
        # Vertices may have another order in the store: values by position.
        run(tetdb, "export", back, stem + ".back.npy")
        order = np.lexsort(of(stem + ".back", "points").T)
        assert (of(stem + ".back", "points")[order] == of(stem + ".alone", "points")[place]).all()
        for name in ("T", "u", "n"):
            assert (of(stem + ".back", name)[order] == of(stem + ".alone", name)[place]).all(), name
        print(f"{stem}.alone.{ending}: all fields come back, {same} with their digests")


def check_left_out(tetdb, store, mesh, stem):
    """Integers that no double holds are left out, and this is said."""
    np.save(stem + ".big.npy", np.arange(len(mesh.tets)) + 2**53)
    run(tetdb, "field", store, "add", "larger", "--at", "tets", "--from", stem + ".big.npy")
    for ending in ("exo", "msh"):
        said = run(tetdb, "export", store, f"{stem}.big.{ending}")
        assert "is written without larger: doubles do not hold all of these integers" in said, said
    run(tetdb, "field", store, "drop", "larger")


def check_parquet(tetdb, store, mesh, stem):
    import duckdb
    if "feature `parquet`" in run(tetdb, "export", store, stem + ".parquet", code=None):
        raise ImportError("the program is built without Parquet")
    table = lambda pattern: duckdb.sql(f"select * from read_parquet('{pattern}') order by id").fetchnumpy()
    tets, vertices = table(stem + "_?????.parquet"), table(stem + "_?????_vertices.parquet")
    ids = np.load(stem + "_global_id.npy")
    assert (tets["id"] == np.sort(ids)).all() and (tets["mark"] == mesh.fields["mark"][np.argsort(ids)]).all() and tets["mark"].dtype == np.int32
    for k, name in enumerate(["s.xx", "s.yy", "s.zz", "s.xy", "s.yz", "s.xz"]):
        assert (tets[name] == mesh.fields["s"][np.argsort(ids), k]).all()
    ids = np.load(stem + "_vertex_id.npy")
    order = np.argsort(ids)
    place = order[np.searchsorted(ids, vertices["id"], sorter=order)]
    assert (ids[place] == vertices["id"]).all() and (vertices["T"] == mesh.fields["T"][place]).all() and (vertices["u.y"] == mesh.fields["u"][place, 1]).all()
    print(f"{stem}.parquet: DuckDB {duckdb.__version__} sees the fields {sorted(set(tets) - {'id'})[:3]} ...")


# DOLFINx.

def check_vtkhdf_for_dolfinx(tetdb, store, mesh, stem):
    """What `dolfinx.io.vtkhdf.read_mesh` reads of a file, by its source (cpp/dolfinx/io/VTKHDF.h): one partition, and cells of kinds that it knows."""
    import h5py
    for order, n in (("1", 4), ("2", 10)):
        path = f"{stem}.one{order}.vtkhdf"
        run(tetdb, "export", store, path, "--one-partition", "--order", order)
        with h5py.File(path) as file:
            root = file["VTKHDF"]
            assert root.attrs["Type"] == b"UnstructuredGrid" and root.attrs["Version"].tolist() == [2, 0]
            n_cells, (n_points,) = len(mesh.tets), root["NumberOfPoints"][:]
            assert root["NumberOfCells"][:].tolist() == [n_cells] and root["NumberOfConnectivityIds"][:].tolist() == [n * n_cells]
            types = root["Types"]
            # Of version 0.10, kinds of Lagrange alone (cells::get_vtk_cell_type).
            assert types.shape == (n_cells,) and types.dtype == np.uint8 and (types[:] == 71).all()
            offsets = root["Offsets"]
            assert offsets.dtype == np.int64 and (offsets[:] == n * np.arange(n_cells + 1)).all()
            assert root["Points"].shape == (n_points, 3) and root["Points"].dtype == np.float64
            nodes = root["Connectivity"]
            assert nodes.shape == (n * n_cells,) and nodes.dtype == np.int64 and nodes[:].max() == n_points - 1
            for name in ("Types", "Offsets", "Points", "Connectivity", "NumberOfPoints"):
                assert root[name].chunks is None and root[name].id.get_offset() is not None, f"{name} is not one piece of the file"
            if order == "2":
                found = {name: values[:] for name, values in root["PointData"].items() if name in mesh.fields}
                check_middles(nodes[:].reshape(-1, 10), found, path)
    print(f"{stem}.one1.vtkhdf: laid out as DOLFINx reads it, by h5py {h5py.__version__}")


def check_dolfinx(tetdb, store, mesh, stem):
    import dolfinx
    from dolfinx.io import XDMFFile, vtkhdf
    from mpi4py import MPI
    for order in "12":
        seen = vtkhdf.read_mesh(MPI.COMM_WORLD, f"{stem}.one{order}.vtkhdf")
        assert seen.topology.index_map(3).size_global == len(mesh.tets)
        x = seen.geometry.x[seen.geometry.dofmap[:, :4]]
        found = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])).sum() / 6
        near({0: found}, {0: sum(mesh.volume.values())})
    with XDMFFile(MPI.COMM_WORLD, stem + ".xdmf", "r") as file:
        seen = file.read_mesh()
        regions = file.read_meshtags(seen, "mesh")
    near(dict(zip(*(v.tolist() for v in np.unique(regions.values, return_counts=True)))), by(mesh.region, np.ones(len(mesh.tets))))
    seen.topology.create_connectivity(2, 3)
    with XDMFFile(MPI.COMM_WORLD, stem + "_boundary.xdmf", "r") as file:
        labels = file.read_meshtags(seen, "boundary")
    near(dict(zip(*(v.tolist() for v in np.unique(labels.values, return_counts=True)))), by(mesh.label, np.ones(len(mesh.label))))
    print(f"{stem}: DOLFINx {dolfinx.__version__} sees {len(regions.values)} cells and {len(labels.values)} facets with labels")


def main():
    tetdb, folder = sys.argv[1:]
    store, stem = os.path.join(folder, "formats.tetdb"), os.path.join(folder, "formats")
    make(tetdb, store, 4)
    mesh, wrong = Mesh(tetdb, store, stem), 0
    print(f"{store}: {len(mesh.tets)} tetrahedra, {len(mesh.volume)} regions, {len(mesh.area)} labels")
    for check in (check_exodus, check_xdmf, check_xdmf_by_vtk, check_nastran, check_gmsh, check_round_trips, check_left_out, check_parquet,
                  check_vtkhdf_for_dolfinx, check_dolfinx):
        try:
            check(tetdb, store, mesh, stem)
        except ImportError as error:
            skipped.append(f"{check.__name__}: {error}")
        except Exception:
            import traceback
            traceback.print_exc()
            wrong += 1
            print("WRONG:", check.__name__)
    for what in skipped:
        print("skipped:", what)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
