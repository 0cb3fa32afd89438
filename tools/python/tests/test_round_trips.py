"""Surfaces come from other packages and meshes go to them, with labels and regions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tetdb

SURFACE = tetdb.sample("balls,count=2")


def test_pyvista_there_and_back(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    poly = pyvista.PolyData.from_regular_faces(SURFACE.points, SURFACE.triangles)
    poly.cell_data["label"] = SURFACE.labels
    surface = tetdb.Surface(poly)
    assert (surface.labels == SURFACE.labels).all()
    with tetdb.mesh(poly, tmp_path / "s", regions="all") as store:
        assert store.digest == tetdb.mesh(SURFACE, tmp_path / "t", regions="all").digest
        grid = store.to_pyvista()
        assert grid.n_cells == store.n_tets and set(grid.cell_data["region"]) == {r.region for r in store.regions if r.filled}
        assert grid.volume == pytest.approx(1.0)
        assert store.to_pyvista(0).n_cells == store.n_tets
    assert tetdb.Surface(pyvista.Cube().triangulate().clean()).check().ok


def test_trimesh_in(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=2)
    with tetdb.mesh(ball, tmp_path / "s", hsiz=0.4) as store:
        assert store.subdomains[0].volume == pytest.approx(ball.volume)
        with pytest.raises(tetdb.SurfaceError):
            ball.update_faces(np.arange(len(ball.faces)) > 0)
            tetdb.mesh(ball, tmp_path / "t")


def test_gmsh_arrays_there_and_back(tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
        gmsh.model.mesh.generate(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(2)
        number = np.zeros(int(tags.max()) + 1, np.int64)
        number[tags.astype(int)] = np.arange(len(tags))
        triangles = number[nodes.astype(int)].reshape(-1, 3)
        with tetdb.mesh(tetdb.Surface(coordinates.reshape(-1, 3), triangles), tmp_path / "s") as store:
            assert store.subdomains[0].volume == pytest.approx(1.0)
            mesh = store.merged()
            gmsh.clear()
            volume = gmsh.model.addDiscreteEntity(3)
            names = np.arange(1, len(mesh.points) + 1)
            gmsh.model.mesh.addNodes(3, volume, names, mesh.points.ravel())
            gmsh.model.mesh.addElementsByType(volume, 4, [], (mesh.tets + 1).ravel())
            found = gmsh.model.mesh.getElementQualities(gmsh.model.mesh.getElements(3)[1][0], "volume")
            assert len(found) == store.n_tets and min(found) > 0
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("ending", ["vtu", "mesh", "msh"])
def test_meshio_reads_what_is_exported_and_gives_surfaces(ending: str, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    with tetdb.mesh(SURFACE, tmp_path / "s", regions="all") as store:
        [first, *_] = store.export(tmp_path / f"mesh.{ending}")
        read = meshio.read(first)
        tets = read.cells_dict["tetra"]
        mesh = store.merged()
        assert len(tets) == store.n_tets

        def corners(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
            return np.sort(np.sort(points[tets].sum(axis=2), axis=1), axis=0)

        assert np.allclose(corners(read.points, tets), corners(mesh.points, mesh.tets), rtol=0, atol=1e-12)
    meshio.write_points_cells(tmp_path / "s.stl", SURFACE.points, [("triangle", SURFACE.triangles)])
    assert tetdb.Surface(meshio.read(tmp_path / "s.stl")).n_triangles == SURFACE.n_triangles


@pytest.mark.parametrize(
    ("name", "words", "options"),
    [
        ("a.msh", ["--order", "2", "--ghosts", "--ascii"], {"order": 2, "ghosts": True, "ascii": True}),
        ("a.vtkhdf", ["--region", "2"], {"regions": 2}),
        ("a.mesh", ["--pieces", "--subdomain", "1"], {"pieces": True, "subdomains": [1]}),
        ("a.vtu", ["--interfaces"], {"content": "interfaces"}),
        ("a.npy", ["--split-sheets"], {"split_sheets": True}),
    ],
)
def test_exports_are_those_of_the_program(
    name: str, words: list[str], options: dict[str, Any], parts: tetdb.Store, run: Callable[..., str], tmp_path: Path
) -> None:
    for folder in ("program", "module"):
        (tmp_path / folder).mkdir()
    run("export", parts.path, f"program/{name}", *words)
    written = parts.export(tmp_path / "module" / name, **options)
    assert written and len(list((tmp_path / "program").iterdir())) == len(written)
    for file in map(Path, written):
        assert file.read_bytes() == (tmp_path / "program" / file.name).read_bytes()
