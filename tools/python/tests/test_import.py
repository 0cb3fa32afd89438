"""Meshes of other programs become stores."""

import pathlib

import numpy as np
import pytest
import tetdb

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]], float)
TETS = np.array([[0, 1, 2, 3], [0, 2, 1, 4]])


def test_arrays_come_back(tmp_path: pathlib.Path) -> None:
    with tetdb.import_mesh((POINTS, TETS, [1, 2]), tmp_path / "a.tetdb") as store:
        assert store.n_tets == 2
        assert store.is_verified


def test_bad_arrays_are_refused(tmp_path: pathlib.Path) -> None:
    bad = [
        (POINTS, [[0, 1, 2, 2]], "bad-mesh"),
        (POINTS, [[0, 1, 2, 9]], "index-out-of-range"),
        (POINTS, [[0, 1, 2, 3], [0, 1, 2, 4]], "bad-mesh"),
        (POINTS * np.nan, TETS, "not-a-number"),
        (POINTS, TETS[:, :3], "unexpected-text"),
    ]
    for points, tets, code in bad:
        with pytest.raises(tetdb.TetdbError) as refused:
            tetdb.import_mesh((points, tets), tmp_path / "a.tetdb")
        assert refused.value.code == code
    assert list(tmp_path.iterdir()) == []


def test_exports_come_back(tmp_path: pathlib.Path) -> None:
    with tetdb.mesh(tetdb.sample("box,h=0.3"), tmp_path / "a.tetdb") as store:
        digest = store.digest
        store.export(tmp_path / "a.msh")
    with tetdb.import_mesh(tmp_path / "a.msh", tmp_path / "b.tetdb") as store:
        assert store.digest == digest


@pytest.mark.parametrize("name", ["a.vtu", "a.msh", "a.inp"])
def test_meshio_files_are_read(tmp_path: pathlib.Path, name: str) -> None:
    meshio = pytest.importorskip("meshio", reason="meshio writes the files")
    # Without a format, `.msh` is that of ANSYS.
    kind = "gmsh" if name.endswith(".msh") else None
    meshio.write(tmp_path / name, meshio.Mesh(POINTS, [("tetra", TETS)]), file_format=kind)
    with tetdb.import_mesh(tmp_path / name, tmp_path / "a.tetdb") as store:
        assert store.n_tets == 2


@pytest.mark.parametrize(("version", "binary"), [(2.2, 0), (2.2, 1), (4.0, 0), (4.1, 0), (4.1, 1)])
def test_gmsh_files_are_read(tmp_path: pathlib.Path, version: float, binary: int) -> None:
    gmsh = pytest.importorskip("gmsh", reason="gmsh writes the files")
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addSphere(0, 0, 0, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(3)
        _, tags, _ = gmsh.model.mesh.getElements(3)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(tmp_path / "a.msh"))
    finally:
        gmsh.finalize()
    with tetdb.import_mesh(tmp_path / "a.msh", tmp_path / "a.tetdb", subdomains=2) as store:
        assert store.n_tets == len(tags[0])


def test_values_come_back(tmp_path: pathlib.Path) -> None:
    with tetdb.mesh(tetdb.sample("box,h=0.3"), tmp_path / "m.tetdb") as store:
        store.export(tmp_path / "m.msh")
    # All imports of a mesh have one order, which is not that in which it was meshed.
    with tetdb.import_mesh(tmp_path / "m.msh", tmp_path / "a.tetdb") as store:
        store.fields["T"] = np.arange(float(store.n_tets))
        values = store.fields["T"].array()
        store.export(tmp_path / "a.vtu")
    with tetdb.import_mesh(tmp_path / "a.vtu", tmp_path / "b.tetdb") as store:
        assert np.array_equal(store.fields["T"].array(), values)
    with tetdb.import_mesh(tmp_path / "a.vtu", tmp_path / "c.tetdb", fields=False) as store:
        assert list(store.fields) == []


def test_tetgen_meshes_are_read(tmp_path: pathlib.Path) -> None:
    tetgen = pytest.importorskip("tetgen", reason="tetgen makes the mesh")
    pyvista = pytest.importorskip("pyvista", reason="pyvista writes the file")
    grid = tetgen.TetGen(pyvista.Sphere())
    grid.tetrahedralize(order=1)
    grid.grid.save(tmp_path / "a.vtu")
    with tetdb.import_mesh(tmp_path / "a.vtu", tmp_path / "a.tetdb") as store:
        assert store.n_tets == grid.grid.n_cells
