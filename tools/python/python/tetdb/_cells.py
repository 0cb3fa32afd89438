"""Meshes of other packages as cells: which are the surface, which are left out, which are refused."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import SurfaceError, needed

__all__ = ["Cells", "of_mesh", "words_of"]

_ALL, _NONE = -1, 0
_SHAPES: dict[int, tuple[int, int]] = {
    0: (0, _NONE), 1: (0, _NONE), 2: (0, _NONE), 3: (1, _NONE), 4: (1, _NONE), 21: (1, _NONE), 35: (1, _NONE), 68: (1, _NONE), 75: (1, _NONE),
    5: (2, 3), 6: (2, _ALL), 7: (2, _ALL), 8: (2, 4), 9: (2, 4), 10: (3, 4), 11: (3, 8), 12: (3, 8), 13: (3, 6), 14: (3, 5),
    22: (2, 3), 34: (2, 3), 69: (2, 3), 76: (2, 3), 23: (2, 4), 28: (2, 4), 30: (2, 4), 70: (2, 4), 77: (2, 4),
    24: (3, 4), 71: (3, 4), 78: (3, 4), 27: (3, 5), 37: (3, 5), 74: (3, 5), 81: (3, 5),
    26: (3, 6), 31: (3, 6), 32: (3, 6), 73: (3, 6), 80: (3, 6), 25: (3, 8), 29: (3, 8), 33: (3, 8), 72: (3, 8), 79: (3, 8),
}  # fmt: skip
"""By the number VTK gives a kind of cell: its dimension, and how many of its nodes are corners."""
_TABLE = np.array([_SHAPES.get(kind, (_ALL, _NONE)) for kind in range(256)])
_CURVED = 20
"""Kinds above have nodes beside their corners."""
_STRIP, _PIXEL, _VOXEL = 6, 8, 11
_MESHIO = {
    "vertex": 1, "poly_vertex": 2, "line": 3, "poly_line": 4, "triangle": 5, "triangle_strip": 6, "polygon": 7, "pixel": 8, "quad": 9,
    "tetra": 10, "voxel": 11, "hexahedron": 12, "wedge": 13, "pyramid": 14, "vtk_lagrange_curve": 68, "vtk_lagrange_triangle": 69,
    "vtk_lagrange_quadrilateral": 70, "vtk_lagrange_tetrahedron": 71, "vtk_lagrange_hexahedron": 72, "vtk_lagrange_wedge": 73,
    "vtk_lagrange_pyramid": 74,
}  # fmt: skip
_MESHIO_CURVED = {3: 21, 5: 22, 9: 23, 10: 24, 12: 25, 13: 26, 14: 27}
_LABELS = {"label": "", "gmsh:physical": "", "medit:ref": ""}
_REGIONS = {"label": "", "gmsh:physical": "volume_", "medit:ref": "ref_", "region": "region_"}
"""Arrays that name cells, the first that is there, and what is put before their numbers."""

TOGETHER = "\x1f"
"""Stands between the names of the groups of a cell that is in several."""

Ints = npt.NDArray[np.int64]
Words = npt.NDArray[np.str_]


@dataclass
class Cells:
    """Polygons, or volume cells whose boundary is the surface; labels for each, and notes on what was left out."""

    points: Any
    counts: Ints
    corners: Ints
    labels: Words | None
    is_volume: bool
    notes: list[str] = field(default_factory=list)


@dataclass
class _Mesh:
    """All cells in order: kinds as VTK numbers them, nodes one cell after the other; `named` gives names by dimension."""

    points: Any
    kinds: Ints
    counts: Ints
    nodes: Ints
    named: Callable[[int], Words | None]
    notes: list[str] = field(default_factory=list)


def of_mesh(mesh: Any, volume_only: bool = False) -> Cells:
    """What of a mesh of meshio, PyVista, VTK or trimesh is a surface."""
    return _surface_of(_read(mesh), volume_only)


def words_of(labels: Any, n: int, what: str = "labels") -> Words:
    """`n` labels as text."""
    if isinstance(labels, (list, tuple)) and any(isinstance(one, (list, tuple, set, frozenset)) for one in labels):
        groups = [sorted(map(str, one)) if isinstance(one, (set, frozenset)) else list(map(str, one)) if isinstance(one, (list, tuple)) else [str(one)] for one in labels]
        if [] in groups:
            raise SurfaceError("count-mismatch", "expected one name at least", f"{what}[{groups.index([])}]")
        labels = [TOGETHER.join(one) for one in groups]
    each = np.asarray(labels)
    if each.dtype.kind == "f" and (each == np.trunc(each)).all():
        each = each.astype(np.int64)
    if each.shape != (n,) or each.dtype.kind not in "UiuO":
        raise SurfaceError("count-mismatch", f"expected one label for each of {n} cells, found {each.dtype} {each.shape}", what)
    return each.astype(np.str_)


def _read(mesh: Any) -> _Mesh:
    """Told by its attributes, so that no package is imported that is not there."""
    if hasattr(mesh, "IsA") and not hasattr(mesh, "cast_to_unstructured_grid") and not hasattr(mesh, "n_blocks"):
        mesh = needed("pyvista").wrap(mesh)
    if hasattr(mesh, "n_blocks"):
        blocks = ((str(name or k), mesh[k]) for k, name in enumerate(mesh.keys()))
        return _joined([(name, _read(block)) for name, block in blocks if block is not None])
    if hasattr(mesh, "cast_to_unstructured_grid"):
        return _of_grid(mesh if hasattr(mesh, "celltypes") else mesh.cast_to_unstructured_grid())
    if hasattr(mesh, "cells_dict") and hasattr(mesh, "points"):
        return _of_meshio(mesh)
    if hasattr(mesh, "geometry") and hasattr(mesh, "graph"):
        return _joined(list(_of_scene(mesh)))
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return _of_trimesh(mesh)
    raise SurfaceError("unsupported-content", f"{type(mesh).__name__} is no surface", "points", "give points and triangles, a mesh of PyVista, trimesh or meshio, or paths")


def _of_meshio(mesh: Any) -> _Mesh:
    kinds, counts, nodes = [], [], []
    for k, block in enumerate(mesh.cells):
        base = block.type.lower()
        kind, is_curved = _MESHIO.get(base), False
        if kind is None:
            base = re.sub(r"\d+$", "", base)
            kind, is_curved = _MESHIO.get(base), base != "polygon"
        if is_curved:
            kind = _MESHIO_CURVED.get(kind or 0)
        if kind is None:
            raise SurfaceError("unsupported-content", f"cells of the type {block.type} cannot be read", f"cells[{k}]", "convert them to triangles or polygons")
        data = block.data
        if isinstance(data, np.ndarray) and data.ndim == 2:
            counts.append(np.full(len(data), data.shape[1]))
            nodes.append(data.reshape(-1))
        else:
            counts.append(np.array([len(row) for row in data], np.int64))
            nodes += [np.asarray(row) for row in data]
        kinds.append(np.full(len(data), kind))
    sizes = [len(block.data) for block in mesh.cells]

    def named(dimension: int) -> Words | None:
        found = _named(mesh.cell_data, _LABELS if dimension == 2 else _REGIONS, np.concatenate, mesh.field_data, dimension)
        sets = {name: rows for name, rows in (mesh.cell_sets or {}).items() if not name.startswith("gmsh:")}
        if not sets or "label" in mesh.cell_data:
            return found
        words = np.full(sum(sizes), "", object) if found is None else found.astype(object)
        dimensions = _TABLE[whole.kinds, 0]
        taken, n_more = np.zeros(len(words), bool), 0
        for name, rows in sets.items():
            for start, row in zip(np.cumsum([0, *sizes]), rows):
                at = np.unique(start + np.asarray(row if row is not None else [], np.int64))
                both = at[taken[at]]
                words[at[~taken[at]]] = name
                taken[at] = True
                is_face = dimensions[both] == 2
                words[both[is_face]] += TOGETHER + name
                n_more += int((dimensions[both] == 3).sum())
        if n_more and dimension == 3:
            whole.notes.append(f"{n_more} volume cells are in several sets and have the name of the first")
        return words.astype(np.str_)

    whole = _Mesh(mesh.points, _flat(kinds), _flat(counts), _flat(nodes), named)
    return whole


def _of_grid(grid: Any) -> _Mesh:
    offsets = np.asarray(grid.cell_offsets if hasattr(grid, "cell_offsets") else grid.offset, np.int64)
    kinds, nodes = np.asarray(grid.celltypes, np.int64), np.asarray(grid.cell_connectivity, np.int64)
    found = _Mesh(grid.points, kinds, np.diff(offsets), nodes, lambda dimension: _named(grid.cell_data, _LABELS if dimension == 2 else _REGIONS))
    if "vtkGhostType" in grid.cell_data:
        kept = np.asarray(grid.cell_data["vtkGhostType"]) == 0
        if not kept.all():
            whole = found.named
            found = _chosen(found, kept)
            found.named = lambda dimension: None if (names := whole(dimension)) is None else names[kept]
            found.notes.append(f"{(~kept).sum()} ghost or hidden cells were left out")
    return found


def _of_trimesh(mesh: Any) -> _Mesh:
    faces = np.asarray(mesh.faces)
    if faces.ndim != 2 or faces.shape[1] not in (3, 4) or faces.dtype.kind not in "iu":
        raise SurfaceError("unsupported-content", f"expected integers (m, 3), found {faces.dtype} {faces.shape}", "faces")
    n, width = faces.shape
    attributes = getattr(mesh, "face_attributes", None) or {}
    return _Mesh(mesh.vertices, np.full(n, 5 if width == 3 else 9), np.full(n, width), faces.reshape(-1).astype(np.int64), lambda _: _named(attributes, _LABELS))


def _of_scene(scene: Any) -> Iterator[tuple[str, _Mesh]]:
    for node in scene.graph.nodes_geometry:
        placed, name = scene.graph[node]
        part = scene.geometry[name]
        if not hasattr(part, "faces"):
            words = f"{node}: {len(part.entities)} curves were left out" if hasattr(part, "entities") else f"{node}: {len(part.vertices)} points were left out"
            none = np.empty(0, np.int64)
            yield node, _Mesh(np.empty((0, 3)), none, none, none, lambda _: None, [words])
            continue
        mesh = _of_trimesh(part)
        if not np.array_equal(placed, np.eye(4)):
            mesh.points = np.asarray(mesh.points) @ placed[:3, :3].T + placed[:3, 3]
        yield node, mesh


def _joined(parts: list[tuple[str, _Mesh]]) -> _Mesh:
    """Parts as one mesh: a cell without a name of its own has that of its part."""
    if not parts:
        raise SurfaceError("empty-surface", "there is no mesh in it", "points")
    names, meshes = [name for name, _ in parts], [mesh for _, mesh in parts]
    starts = np.cumsum([0] + [len(mesh.points) for mesh in meshes])

    def named(dimension: int) -> Words:
        words = []
        for name, mesh in zip(names, meshes):
            own = mesh.named(dimension)
            each = [name] * len(mesh.kinds) if own is None else [f"{name}:{word}" if word else name for word in own]
            words.append(np.array(each, dtype=np.str_))
        return np.concatenate(words)

    return _Mesh(
        np.concatenate([np.asarray(mesh.points) for mesh in meshes]),
        _flat([mesh.kinds for mesh in meshes]),
        _flat([mesh.counts for mesh in meshes]),
        _flat([mesh.nodes + start for start, mesh in zip(starts, meshes)]),
        named,
        [note for mesh in meshes for note in mesh.notes],
    )


def _named(
    data: Any,
    arrays: dict[str, str],
    joined: Callable[[Any], Any] = np.asarray,
    field_data: Any = None,
    dimension: int = 2,
) -> Words | None:
    """The first of `arrays` in `data`, as names: text as it is, numbers by `field_data` or behind what stands before them."""
    name = next((name for name in arrays if name in data), None)
    if name is None:
        return None
    values = joined(data[name])
    words = words_of(values, len(values), name)
    if name == "gmsh:physical":
        known = {str(int(row[0])): text for text, row in (field_data or {}).items() if len(row) == 2 and int(row[1]) == dimension}
        known["0"] = ""
    else:
        known = {"0": ""} if name == "medit:ref" and dimension == 3 else {}
    each, codes = np.unique(words, return_inverse=True)
    numbers = np.asarray(values).dtype.kind in "iuf"
    return np.array([known.get(str(w), arrays[name] + str(w) if numbers else str(w)) for w in each], dtype=np.str_)[codes]


def _flat(arrays: Sequence[npt.NDArray[Any]]) -> Ints:
    return np.concatenate([np.empty(0, np.int64), *arrays]).astype(np.int64)


def _chosen(mesh: _Mesh, kept: npt.NDArray[np.bool_]) -> _Mesh:
    """Some cells alone; names are not chosen."""
    return _Mesh(mesh.points, mesh.kinds[kept], mesh.counts[kept], mesh.nodes[np.repeat(kept, mesh.counts)], mesh.named, list(mesh.notes))


def _surface_of(mesh: _Mesh, volume_only: bool) -> Cells:
    dimensions = _TABLE[mesh.kinds, 0]
    unknown = np.flatnonzero(dimensions < 0)
    if unknown.size:
        at = int(unknown[0])
        raise SurfaceError("unsupported-content", f"cells of VTK's type {mesh.kinds[at]} cannot be read", f"cell {at}", "convert them to triangles or polygons")
    numbers = [int((dimensions == d).sum()) for d in range(4)]
    dimension = 3 if volume_only or not numbers[2] else 2
    names = mesh.named(dimension) if numbers[dimension] else None
    notes = list(mesh.notes)
    if not numbers[dimension]:
        there = ", ".join(f"{n} {word}" for n, word in zip(numbers, ("points", "lines", "surface cells", "volume cells")) if n)
        wanted = "volume cells" if volume_only else "surface or volume cells"
        raise SurfaceError("empty-surface", f"the mesh has no {wanted}" + (f", only {there}" if there else ""), "points", "; ".join(notes) or "give a mesh with triangles")
    for d, what in enumerate(("vertex cells", "lines", "surface cells", "volume cells")):
        if d != dimension and numbers[d]:
            notes.append(f"{numbers[d]} {what} were left out; " + ("only the volume cells are read" if dimension == 3 else "only the surface is read"))
    kept = dimensions == dimension
    mesh = _chosen(mesh, kept)
    names = None if names is None else names[kept]
    if (curved := int((mesh.kinds > _CURVED).sum())):
        notes.append(f"{curved} cells have nodes on their edges; they were taken by their corners alone, as flat")
    mesh, names = _without_strips(mesh, names)
    if names is not None:
        names = np.where(names == "", "" if dimension == 3 else "surface", names)
    corners = _TABLE[mesh.kinds, 1]
    corners = np.where(corners == _ALL, mesh.counts, corners)
    bad = np.flatnonzero((corners > mesh.counts) | (corners < 3))
    if bad.size:
        raise SurfaceError("unsupported-content", f"a cell has {mesh.counts[bad[0]]} corners", f"cell {bad[0]}", "remove it, or give all its corners")
    starts = np.cumsum(mesh.counts) - mesh.counts
    first = np.cumsum(corners) - corners
    nodes = mesh.nodes[np.repeat(starts - first, corners) + np.arange(corners.sum())]
    for of_kind, swapped in ((_PIXEL, (2,)), (_VOXEL, (2, 6))):
        for k in swapped:
            pair = first[mesh.kinds == of_kind] + k
            nodes[pair], nodes[pair + 1] = nodes[pair + 1].copy(), nodes[pair].copy()
    return Cells(mesh.points, corners, nodes, names, dimension == 3, notes)


def _without_strips(mesh: _Mesh, names: Words | None) -> tuple[_Mesh, Words | None]:
    """Strips of triangles as triangles."""
    if not (mesh.kinds == _STRIP).any():
        return mesh, names
    cells, kinds, of = [], [], []
    for i, (kind, nodes) in enumerate(zip(mesh.kinds, np.split(mesh.nodes, np.cumsum(mesh.counts)[:-1]))):
        if kind == _STRIP:
            parts = [nodes[[k + k % 2, k + 1 - k % 2, k + 2]] for k in range(len(nodes) - 2)]
        else:
            parts = [nodes]
        cells += parts
        kinds += [5 if kind == _STRIP else kind] * len(parts)
        of += [i] * len(parts)
    counts = np.array([len(cell) for cell in cells], np.int64)
    return _Mesh(mesh.points, np.array(kinds, np.int64), counts, _flat(cells), mesh.named, mesh.notes), None if names is None else names[of]
