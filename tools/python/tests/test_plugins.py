"""Packages that find tetdb by themselves, or after one import."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tetdb


def is_same_mesh(store: tetdb.Store, other: tetdb.Store) -> bool:
    """Whether both have the same tetrahedra in the same regions, in whatever order."""

    def rows(one: tetdb.Store) -> set[tuple[bytes, int]]:
        mesh = one.merged()
        corners = np.sort(mesh.points[mesh.tets].view("f8,f8,f8")[..., 0], axis=1)
        return {(row.tobytes(), int(region)) for row, region in zip(corners, mesh.regions)}

    return rows(store) == rows(other)


def test_pyvista_reads_stores(parts: tetdb.Store) -> None:
    pyvista = pytest.importorskip("pyvista", minversion="0.48")
    grid = pyvista.read(parts.path)
    assert grid.n_cells == parts.n_tets
    assert set(np.unique(grid.cell_data["subdomain"])) == {0, 1}
    assert grid.volume == pytest.approx(1.0)
    quality = [parts.subdomain(rank).quality for rank in (0, 1)]
    assert np.array_equal(grid.cell_data["quality"], np.concatenate(quality))
    assert np.array_equal(pyvista.read(parts.path, subdomain=1).cell_data["quality"], quality[1])
    with pytest.raises(FileNotFoundError):
        pyvista.read(str(Path(parts.path).parent / "none.tetdb"))


def test_pyvista_writes_stores(parts: tetdb.Store, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista", minversion="0.48")
    grid = pyvista.read(parts.path)
    grid.save(str(tmp_path / "again.tetdb"))
    with tetdb.open(tmp_path / "again.tetdb") as store:
        assert is_same_mesh(store, parts)
        assert [part.n_tets for part in store.subdomains] == [part.n_tets for part in parts.subdomains]
    with pytest.raises(tetdb.TetdbError) as refused:
        pyvista.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid().save(str(tmp_path / "cubes.tetdb"))
    assert refused.value.code == "unsupported-content" and not (tmp_path / "cubes.tetdb").exists()


def test_pyvista_surfaces_are_meshed(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista", minversion="0.48")
    ball = pyvista.Icosphere(nsub=2)
    assert ball.tetdb.check().ok
    grid = ball.tetdb.tetrahedralize(hsiz=0.2)
    assert grid.volume == pytest.approx(ball.volume) and set(grid.celltypes) == {pyvista.CellType.TETRA}
    with ball.tetdb.mesh(tmp_path / "ball.tetdb", hsiz=0.2) as store:
        assert store.n_tets == grid.n_cells
    with pytest.raises(tetdb.SurfaceError):
        pyvista.Plane().triangulate().tetdb.tetrahedralize()


def test_meshio_reads_stores(parts: tetdb.Store) -> None:
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("tetdb.meshio")
    mesh = meshio.read(parts.path)
    merged = parts.merged()
    assert np.array_equal(mesh.cells_dict["tetra"], merged.tets) and np.array_equal(mesh.points, merged.points)
    assert np.array_equal(mesh.cell_data["region"][0], merged.regions)


def test_meshio_writes_stores(parts: tetdb.Store, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("tetdb.meshio")
    meshio.read(parts.path).write(tmp_path / "again.tetdb")
    with tetdb.open(tmp_path / "again.tetdb") as store:
        assert is_same_mesh(store, parts) and len(store.subdomains) == len(parts.subdomains)
