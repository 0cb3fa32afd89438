"""Meshes of other packages: every cell becomes a triangle, or is left out with words, or is refused."""

from __future__ import annotations

import pickle
import warnings
from typing import Any

import numpy as np
import pytest

import tetdb

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
HEXAHEDRON = np.array([[0, 4, 6, 2, 1, 5, 7, 3]])
TET = np.array([[3.0, 0, 0], [4, 0, 0], [3, 1, 0], [3, 0, 1]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def quiet(mesh: Any, *words: str) -> tetdb.Surface:
    """The surface of `mesh`, whose notes and warnings have all `words`."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        surface = tetdb.Surface(mesh)
    for word in words:
        assert any(word in note for note in surface.notes), (word, surface.notes)
        assert any(word in str(one.message) for one in said), (word, said)
    assert len(said) == len(words), [str(one.message) for one in said]
    return surface


def volume_of(surface: tetdb.Surface) -> float:
    report = surface.check()
    assert report.ok and report.volume is not None, report.messages
    return report.volume


def test_meshio_polygons_are_cut(recwarn: pytest.WarningsRecorder) -> None:
    meshio = pytest.importorskip("meshio")
    points = np.concatenate([CUBE, TET])
    both = quiet(meshio.Mesh(points, [("quad", QUADS), ("triangle", TRIANGLES + 8)]))
    assert both.n_triangles == 16 and volume_of(both) == pytest.approx(1 + 1 / 6)
    assert any("6 polygons were cut" in note for note in both.notes)
    # A prism of two hexagons and six quadrilaterals.
    turn = np.arange(6) * np.pi / 3
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    prism = np.concatenate([np.insert(ring, 2, z, axis=1) for z in (0.0, 1.0)])
    sides = [[k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6] for k in range(6)]
    surface = quiet(meshio.Mesh(prism, [("polygon", [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11]]), ("quad", sides)]))
    assert surface.n_triangles == 2 * 4 + 12 and volume_of(surface) == pytest.approx(1.5 * 3**0.5)


def test_meshio_other_cells_are_left_out_with_words() -> None:
    meshio = pytest.importorskip("meshio")
    cells = [("triangle", TRIANGLES), ("line", [[0, 1], [1, 2]]), ("vertex", [[0], [1], [2]]), ("tetra", [[0, 1, 2, 3]])]
    surface = quiet(meshio.Mesh(TET, cells), "2 lines", "3 vertex cells", "1 volume cell")
    assert surface.n_triangles == 4
    with pytest.warns(UserWarning, match="boundary|surface cells"):
        again = tetdb.Surface.boundary_of(meshio.Mesh(TET, cells))
    assert volume_of(again) == pytest.approx(1 / 6)
    middles = [(0, 1), (1, 2), (2, 0)]
    curved = np.array([[*t, *(4 + 3 * k + i for i in range(3))] for k, t in enumerate(TRIANGLES)])
    points = np.concatenate([TET, *(TET[[t[i], t[j]]].mean(axis=0, keepdims=True) for t in TRIANGLES for i, j in middles)])
    assert volume_of(quiet(meshio.Mesh(points, [("triangle6", curved)]), "4 cells have nodes on their edges")) == pytest.approx(1 / 6)
    for cells in ([("line", [[0, 1]])], [("vertex", [[0]])], [], [("polyhedron4", [[[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]])]):
        with pytest.raises(tetdb.SurfaceError):
            tetdb.Surface(meshio.Mesh(TET, cells))
    for cells in ([("triangle", [[0, 1, 9]])], [("quad", [[0, 1, 2, -1]])]):
        with pytest.raises(tetdb.SurfaceError, match="cell 0"):
            tetdb.Surface(meshio.Mesh(TET, cells))


@pytest.mark.parametrize(("kind", "cell", "volume"), [
    ("hexahedron", HEXAHEDRON, 1.0), ("wedge", HEXAHEDRON[:, [0, 1, 2, 4, 5, 6]], 0.5),
    ("pyramid", HEXAHEDRON[:, :5], 1 / 3), ("tetra", HEXAHEDRON[:, [0, 1, 2, 4]], 1 / 6),
])  # fmt: skip
def test_volume_cells_give_their_boundary(kind: str, cell: np.ndarray, volume: float) -> None:
    meshio = pytest.importorskip("meshio")
    pyvista = pytest.importorskip("pyvista")
    mesh = meshio.Mesh(CUBE, [(kind, cell)])
    for one in (mesh, pyvista.from_meshio(mesh)):
        surface = tetdb.Surface(one)
        assert volume_of(surface) == pytest.approx(volume)
        assert any("the boundary of 1 volume cell" in note for note in surface.notes), surface.notes


def test_regions_of_volume_cells_stay_apart(tmp_path: Any) -> None:
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.ImageData(dimensions=(4, 4, 4)).cast_to_unstructured_grid()
    assert tetdb.Surface(grid).n_triangles == 108
    middle = (np.abs(grid.cell_centers().points - 1.5) < 0.6).all(axis=1)
    grid.cell_data["region"] = np.where(middle, 7, 3)
    surface = tetdb.Surface(grid)
    assert surface.n_triangles == 108 + 12 and set(surface.labels) == {"region_3", "region_3-region_7"}
    again = pickle.loads(pickle.dumps(surface))
    assert again.notes == surface.notes
    for n, one in enumerate((surface, again)):
        with tetdb.mesh(one, tmp_path / str(n), regions="seeds") as store:
            assert sum(r.volume for r in store.regions if r.filled) == pytest.approx(27)
    with tetdb.mesh(surface, tmp_path / "all", regions="all", hsiz=1.0) as store:
        back = tetdb.Surface(store.to_pyvista())
        assert back.n_triangles == sum(len(store.subdomain(0).facets) for _ in range(1))


def test_files_of_volume_cells_give_their_boundary(tmp_path: Any) -> None:
    meshio = pytest.importorskip("meshio")
    points = np.concatenate([CUBE, CUBE + [1, 0, 0]])
    cells = [("hexahedron", np.concatenate([HEXAHEDRON, HEXAHEDRON + 8])), ("quad", QUADS[:1])]
    mesh = meshio.Mesh(points, cells, cell_data={"medit:ref": [np.array([1, 2]), np.array([5])]})
    mesh.write(tmp_path / "a.mesh")
    with pytest.warns(UserWarning):
        whole = tetdb.Surface.boundary_of(mesh)
    read = tetdb.Surface.boundary_of(tmp_path / "a.mesh")
    for surface in (whole, read):
        assert surface.n_triangles == 20 + 2 and set(surface.labels) == {"ref_1", "ref_2", "ref_1-ref_2"}
    with tetdb.mesh(read, tmp_path / "s", regions="all") as store:
        assert [r.volume for r in store.regions if r.filled] == pytest.approx([1, 1])
        store.export(tmp_path / "b.msh")
        back = tetdb.Surface.boundary_of(tmp_path / "b.msh")
        assert back.n_triangles == 22 and {"ref_1", "ref_2"} <= set("-".join(back.labels).split("-"))


def test_arrays_of_a_store_hold_each_cell_once(tmp_path: Any) -> None:
    sheet = tetdb.Surface([[0.25, 0.25, 0.5], [0.75, 0.25, 0.5], [0.75, 0.75, 0.5]], [[0, 1, 2]])
    well = [[0.1, 0.9, 0.9], [0.1, 0.9, 0.5], [0.2, 0.8, 0.2]], [[0, 1], [1, 2]]
    surface = tetdb.sample("box,h=0.5")
    with tetdb.mesh(surface, tmp_path / "s", embed={"crack": sheet}, embed_edges={"well": well}) as store:
        labels = np.array(store.labels)[store.subdomain(0).facets["label"]]
        assert len(labels) == surface.n_triangles + 1 and list(labels).count("crack") == 1 and "well" not in labels
        assert len(store.merged([0, 0]).tets) == store.n_tets == store.to_pyvista([0, 0, 0]).n_cells
    with pytest.warns(UserWarning, match="embedded edges"):
        surface.embedded_edges(well, "well").write(tmp_path / "a.obj")
    with pytest.warns(UserWarning, match="labels"):
        surface.write(tmp_path / "a.off")


def test_labels_of_meshio_are_kept() -> None:
    meshio = pytest.importorskip("meshio")
    names = np.array(["floor", "a", "a", "b"])
    by_name = meshio.Mesh(TET, [("triangle", TRIANGLES)], cell_data={"label": [names]})
    assert (quiet(by_name).labels == names).all()
    physical = {"gmsh:physical": [np.array([4, 5, 5, 0])]}
    gmsh = meshio.Mesh(TET, [("triangle", TRIANGLES)], cell_data=physical, field_data={"floor": np.array([4, 2]), "rock": np.array([5, 3])})
    assert list(quiet(gmsh).labels) == ["floor", "5", "5", "surface"]
    medit = meshio.Mesh(TET, [("triangle", TRIANGLES[:2]), ("triangle", TRIANGLES[2:])], cell_data={"medit:ref": [np.array([1, 2]), np.array([3, 0])]})
    assert list(quiet(medit).labels) == ["1", "2", "3", "0"]
    sets = meshio.Mesh(TET, [("triangle", TRIANGLES)], cell_sets={"wall": [np.array([1, 2])]})
    assert list(quiet(sets).labels) == ["surface", "wall", "wall", "surface"]


def test_pyvista_cells_of_all_kinds() -> None:
    pyvista = pytest.importorskip("pyvista")
    cube = quiet(pyvista.Cube())
    assert cube.n_triangles == 12 and volume_of(cube) == pytest.approx(1)
    assert volume_of(quiet(pyvista.Dodecahedron())) == pytest.approx(pyvista.Dodecahedron().triangulate().volume, rel=1e-6)
    # One strip around a square tower, two squares, a line and a vertex.
    tower = pyvista.PolyData(CUBE, strips=[10, 0, 1, 4, 5, 6, 7, 2, 3, 0, 1], faces=[4, 0, 4, 6, 2, 4, 1, 3, 7, 5], lines=[2, 0, 7], verts=[1, 0])
    surface = quiet(tower, "1 lines", "1 vertex cells")
    assert surface.n_triangles == 12 and volume_of(surface) == pytest.approx(1)
    grid = pyvista.UnstructuredGrid({pyvista.CellType.QUAD: QUADS[:3], pyvista.CellType.PIXEL: QUADS[3:][:, [0, 1, 3, 2]]}, CUBE)
    assert volume_of(quiet(grid)) == pytest.approx(1)
    assert volume_of(tetdb.Surface(pyvista.ImageData(dimensions=(3, 3, 3)))) == pytest.approx(8)
    with pytest.raises(tetdb.SurfaceError, match="4 points"):
        tetdb.Surface(pyvista.PolyData(TET))
    with pytest.raises(tetdb.SurfaceError):
        tetdb.Surface(pyvista.PolyData())


def test_blocks_are_joined_under_their_names() -> None:
    pyvista = pytest.importorskip("pyvista")
    blocks = pyvista.MultiBlock({"box": pyvista.Cube(), "ball": pyvista.MultiBlock([pyvista.Sphere(center=(3, 0, 0)), None])})
    surface = quiet(blocks)
    assert {name.split(":")[0] for name in surface.labels} == {"box", "ball"}
    assert volume_of(surface) == pytest.approx(1 + pyvista.Sphere().volume)
    with pytest.raises(tetdb.SurfaceError):
        tetdb.Surface(pyvista.MultiBlock())


def test_plain_vtk_objects_are_read() -> None:
    pytest.importorskip("pyvista")
    from vtkmodules.vtkFiltersSources import vtkCubeSource

    source = vtkCubeSource()
    source.Update()
    assert volume_of(quiet(source.GetOutput())) == pytest.approx(1)


def test_trimesh_scenes_are_placed() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    scene = trimesh.Scene()
    scene.add_geometry(box, node_name="left")
    scene.add_geometry(box, node_name="right", transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    surface = quiet(scene)
    assert set(surface.labels) == {"left", "right"} and surface.bounds[1][0] == pytest.approx(5.5)
    assert volume_of(surface) == pytest.approx(2)
    scene.add_geometry(trimesh.PointCloud(np.zeros((3, 3))), node_name="cloud")
    scene.add_geometry(trimesh.load_path(np.array([[0.0, 0, 0], [1, 0, 0]])), node_name="path")
    assert quiet(scene, "3 points", "1 curves").n_triangles == 24
    box.face_attributes["label"] = np.arange(12) % 2
    assert list(tetdb.Surface(box).labels) == ["0", "1"] * 6
    with pytest.raises(tetdb.SurfaceError):
        tetdb.Surface(trimesh.Scene())


def test_masked_arrays_are_not_read_through_their_masks() -> None:
    masked = np.ma.masked_array(TRIANGLES, mask=np.eye(4, 3, dtype=bool))
    with pytest.raises(tetdb.SurfaceError, match="masked"):
        tetdb.Surface(TET, masked)
    with pytest.raises(tetdb.SurfaceError, match="masked"):
        tetdb.Surface(np.ma.masked_array(TET, mask=np.eye(4, 3, dtype=bool)), TRIANGLES)
    assert tetdb.Surface(np.ma.masked_array(TET), TRIANGLES).n_triangles == 4


def names_of(surface: tetdb.Surface) -> dict[str, list[int]]:
    return {name: list(map(int, rows)) for name, rows in surface.groups.items()}


def test_cell_sets_of_meshio_may_overlap() -> None:
    meshio = pytest.importorskip("meshio")
    sets = {"wall": [np.array([0, 1, 2])], "in": [np.array([2, 2, 3])], "wet": [np.array([3])]}
    mesh = meshio.Mesh(TET, [("triangle", TRIANGLES)], cell_sets=sets)
    surface = quiet(mesh)
    assert names_of(surface) == {"wall": [0, 1, 2], "in": [2, 3], "wet": [3]}
    assert list(surface.labels) == ["wall", "wall", "wall+in", "in+wet"]
    assert names_of(pickle.loads(pickle.dumps(surface))) == names_of(surface)
    back = meshio.Mesh(surface.points, [("triangle", surface.triangles)], cell_sets={name: [rows] for name, rows in surface.groups.items()})
    assert names_of(quiet(back)) == names_of(surface)
    # Polygons, in two blocks, with triangles in no set.
    blocks = [("quad", QUADS), ("triangle", TRIANGLES + 8)]
    both = meshio.Mesh(np.vstack([CUBE, TET]), blocks, cell_sets={"a": [np.array([0]), np.array([1])], "b": [np.array([0, 1]), None]})
    assert names_of(quiet(both)) == {"a": [0, 1, 13], "b": [0, 1, 2, 3], "surface": [*range(4, 13), 14, 15]}
    volume = meshio.Mesh(CUBE, [("hexahedron", HEXAHEDRON)], cell_sets={"rock": [np.array([0])], "wet": [np.array([0])]})
    assert set(quiet(volume, "1 volume cells are in several sets").labels) == {"rock"}


def test_labels_may_be_several_names(tmp_path: Any) -> None:
    surface = tetdb.Surface(TET, TRIANGLES, ["wall", ("wall", "in"), ["wall"], {"in", "a+b"}])
    assert list(surface.labels) == ["wall", "wall+in", "wall", 'in+"a+b"']
    with tetdb.mesh(surface, tmp_path / "a.tetdb", hsiz=0.4) as store:
        assert store.labels == ["wall", "in", "wall+in", "a+b", 'in+"a+b"']
        assert store.label_sets == {"wall+in": ["wall", "in"], 'in+"a+b"': ["in", "a+b"]}
        assert len(store.query(labels=["in"])) >= len(store.query(labels=["wall+in"])) > 0
    with pytest.raises(tetdb.SurfaceError, match="one name at least"):
        tetdb.Surface(TET, TRIANGLES, ["wall", (), ["wall"], "in"])
