"""New meshes, and those that were interrupted."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native, _options
from ._options import Progress, Seeds
from ._sizes import Length, Size
from ._store import Store
from ._surface import Surface

__all__ = ["Comparison", "compare", "import_mesh", "mesh", "open", "resume", "tetrahedralize"]


def mesh(
    surface: Any,
    path: str | os.PathLike[str],
    *,
    hsiz: Length | None = None,
    hmin: Length | None = None,
    hmax: Length | None = None,
    hgrad: float | None = None,
    size: Size | Iterable[Size] | None = None,
    regions: str | None = None,
    seeds: Seeds | None = None,
    holes: npt.ArrayLike | None = None,
    embed: Mapping[str, Any] | None = None,
    embed_edges: Mapping[str, Any] | None = None,
    embed_points: Mapping[str, Any] | None = None,
    snap_embedded: Length | None = None,
    embed_outside: str = "error",
    refine_surface: bool = False,
    optimize: str = "full",
    subdomains: int | None = None,
    memory: int | str | None = None,
    threads: int | None = None,
    progress: bool | Progress | None = None,
    existing: str = "keep",
    keep_coarse: bool = True,
    verify: bool = True,
) -> Store:
    """Meshes a surface into a new store and opens it.

    The mesh depends on the surface and on the options above `memory` alone. Ctrl-C, or an exception of `progress`, ends the run soon
    and leaves a store that :func:`resume` goes on with.

    Parameters
    ----------
    surface : Surface, or what :class:`Surface` takes
        What is meshed; its triangles all stay.
    path : path
        Folder of the store.
    hsiz, hmin, hmax : float or str, optional
        Wanted, least and greatest edge length inside: in the surface's units, or ``"2%"`` of the diagonal of its box.
    hgrad : float, optional
        Greatest ratio of neighboring edge lengths. Default: 1.3.
    size : Box, Sphere, Cylinder, InRegion, NearLabel, Field, Function, callable, str, path, or a list of them, optional
        Where edges are shorter. Of everything that applies the least length counts. A callable takes points (k, 3) and returns lengths
        (k,); it is asked once, on a regular grid (see :class:`Function`), and what it said is kept in the store.
    regions : {"parity", "all", "outer", "by-orientation", "seeds", "all-but-holes"}, optional
        Which enclosed regions are filled. Default: ``"seeds"`` where there are seeds or holes, otherwise what the surface's files say
        of regions and holes, otherwise ``"parity"``.
    seeds : dict or array, optional
        Points inside regions, by the names these get; or (k, 3) without names.
    holes : (k, 3) array, optional
        Points inside regions that stay empty.
    embed : dict, optional
        Sheets inside, by name, see :meth:`Surface.embedded`.
    embed_edges, embed_points : dict, optional
        Edges and points inside, by name: files or arrays, see :meth:`Surface.embedded_edges` and :meth:`Surface.embedded_points`.
    snap_embedded : float or str, optional
        Moves embedded points and ends of embedded edges that are nearer than this onto the surface or a sheet, and divides its triangles
        there. A length, or ``"1%"`` of the diagonal.
    embed_outside : {"error", "skip"}
        Whether embedded points and edges outside the filled regions are refused, or left out with a note.
    refine_surface : bool
        Whether the surface's triangles are divided first where embedded points lie on them, and until their edges are as short as
        the wanted lengths; no point moves.
    optimize : {"full", "delaunay", "none"}
        How far tetrahedra are improved.
    subdomains : int, optional
        How many. Default: one for each ten million tetrahedra.
    memory : int or str, optional
        Bytes the run may hold, or text such as ``"8GiB"``. Default: 60 % of what is free.
    threads : int, optional
        Default: one per core.
    progress : bool or callable, optional
        True prints; a callable takes an :class:`Event`, on the calling thread, twenty times a second at most.
    existing : {"keep", "replace"}
        The finished mesh of the same surface and options is returned as it is; anything else at `path` is refused, or replaced.
    keep_coarse : bool
        Whether sub-domains can be meshed again.
    verify : bool
        Whether the finished mesh is verified by exact predicates.

    Returns
    -------
    Store

    Raises
    ------
    SurfaceError
        A surface with defects, before anything is written.
    OutOfMemory, NoRoom
        Memory or disk is not expected to hold the mesh.
    KeyboardInterrupt
        After Ctrl-C.
    TetdbError
        Everything else; `code`, `where` and `help` say what.

    Examples
    --------
    >>> import tetdb, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with tetdb.mesh(tetdb.sample("box,h=0.5"), folder + "/box.tetdb", hsiz="20%") as store:
    ...         store.n_tets > 0, store.is_verified
    (True, True)
    """
    where = _create(
        surface, path, False, hsiz=hsiz, hmin=hmin, hmax=hmax, hgrad=hgrad, size=size, regions=regions, seeds=seeds, holes=holes,
        embed=embed, embed_edges=embed_edges, embed_points=embed_points, snap_embedded=snap_embedded, embed_outside=embed_outside, refine_surface=refine_surface, optimize=optimize, subdomains=subdomains, memory=memory, threads=threads,
        progress=progress, existing=existing, keep_coarse=keep_coarse, verify=verify,
    )  # fmt: skip
    return Store(where, memory=memory, threads=threads)


def _create(
    surface: Any,
    path: str | os.PathLike[str],
    coarse_only: bool,
    *,
    embed: Mapping[str, Any] | None = None,
    embed_edges: Mapping[str, Any] | None = None,
    embed_points: Mapping[str, Any] | None = None,
    snap_embedded: Length | None = None,
    memory: int | str | None = None,
    threads: int | None = None,
    progress: bool | Progress | None = None,
    existing: str = "keep",
    verify: bool = True,
    **shape: Any,
) -> str:
    """Meshes, or with `coarse_only` begins; where the store is."""
    given = surface if isinstance(surface, Surface) else Surface(surface)
    for word, by_name in (("embed", embed), ("embed_edges", embed_edges), ("embed_points", embed_points)):
        if by_name is not None and not isinstance(by_name, Mapping):
            raise _options.usage(f"{by_name!r}: expected what is inside by name", word)
    divide = bool(shape.get("refine_surface"))
    for name, sheet in (embed or {}).items():
        given = given.embedded(sheet, name)
    for name, edges in (embed_edges or {}).items():
        given = given.embedded_edges(edges, name, divide, snap_embedded)
    for name, points in (embed_points or {}).items():
        given = given.embedded_points(points, name, divide, snap_embedded)
    job = _options.job(given.bounds, **shape)
    settings = _options.settings(memory, threads)
    replace = _options.one_of(existing, ("keep", "replace"), "existing") == "replace"
    listener = _options.listener(progress)
    where = _path(path)
    if listener:
        for note in given.notes:
            listener("note", note, 0, None, "")
    _native.mesh(given._inner, where, job, settings, replace, bool(verify), coarse_only, listener)
    return where


def import_mesh(
    mesh: Any,
    path: str | os.PathLike[str],
    *,
    subdomains: int | None = None,
    part_field: str | None = None,
    region_field: str | None = None,
    fields: bool = True,
    memory: int | str | None = None,
    threads: int | None = None,
    progress: bool | Progress | None = None,
    existing: str = "keep",
    verify: bool = True,
) -> Store:
    """Takes over a tetrahedral mesh of another program into a new store and opens it.

    No vertex moves, and every tetrahedron stays.

    Parameters
    ----------
    mesh : path, or tuple of arrays
        A file that ``tetdb import`` reads; or points (n, 3) and tetrahedra (m, 4), and if wanted a whole number for the region of each.
    path : path
        Folder of the store.
    subdomains : int, optional
        Number of sub-domains. Default: one for every ten million tetrahedra.
    part_field, region_field : str, optional
        Arrays of the file's cells that give sub-domains and regions.
    fields : bool
        Whether arrays of values become fields of the store.
    memory, threads, progress, existing, verify
        As for :func:`mesh`; a store that is there is replaced or refused.

    Raises
    ------
    SurfaceError
        A file that cannot be read, or a mesh that is not one of positive tetrahedra that share whole faces.

    Examples
    --------
    >>> import tetdb, tempfile
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with tetdb.import_mesh((points, [[0, 1, 2, 3]]), folder + "/one.tetdb") as store:
    ...         store.n_tets
    1
    """
    where, settings = _path(path), _options.settings(memory, threads)
    replace = _options.one_of(existing, ("keep", "replace"), "existing") == "replace"
    how = (subdomains, part_field, region_field, bool(fields))
    listener = _options.listener(progress)
    if isinstance(mesh, (str, os.PathLike)):
        _native.import_mesh(_path(mesh), where, how, settings, replace, bool(verify), listener)
        return Store(where, memory=memory, threads=threads)
    if not isinstance(mesh, (tuple, list)) or len(mesh) not in (2, 3):
        raise _options.usage("expected a path, or points and tetrahedra as arrays", "mesh")
    with tempfile.TemporaryDirectory() as folder:
        for name, array, kind in zip(
            ("points", "tets", "region"), mesh, (np.float64, np.int64, np.int64)
        ):
            given = np.asarray(array)
            if kind is np.int64 and not np.issubdtype(given.dtype, np.integer):
                raise _options.usage(f"{name}: expected whole numbers, found {given.dtype}", "mesh")
            np.save(os.path.join(folder, f"arrays_{name}.npy"), np.ascontiguousarray(given, kind))
        file = os.path.join(folder, "arrays.npy")
        _native.import_mesh(file, where, how, settings, replace, bool(verify), listener)
    return Store(where, memory=memory, threads=threads)


def resume(
    path: str | os.PathLike[str],
    *,
    memory: int | str | None = None,
    threads: int | None = None,
    progress: bool | Progress | None = None,
) -> Store:
    """Goes on with an interrupted run, verifies and opens the store: the mesh of a run that was never interrupted."""
    where, settings = _path(path), _options.settings(memory, threads)
    _native.resume(where, settings, _options.listener(progress))
    return Store(where, memory=memory, threads=threads)


def open(
    path: str | os.PathLike[str],
    *,
    memory: int | str | None = None,
    threads: int | None = None,
    version: str | None = None,
) -> Store:
    """Opens a finished store, as it was in `version` if that is given."""
    return Store(_path(path), memory=memory, threads=threads, version=version)


def tetrahedralize(
    points: Any, triangles: npt.ArrayLike | None = None, **options: Any
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
    """Points (n, 3) and tetrahedra (m, 4) of a mesh that fits into memory; its store is temporary.

    Parameters
    ----------
    points, triangles
        As of :class:`Surface`.
    **options
        As of :func:`mesh`.

    Examples
    --------
    >>> import tetdb
    >>> s = tetdb.sample("box,h=0.5")
    >>> points, tets = tetdb.tetrahedralize(s.points, s.triangles, hsiz=0.3)
    >>> points.shape[1], tets.shape[1], int(tets.max()) < len(points)
    (3, 4, True)
    """
    with tempfile.TemporaryDirectory(prefix="tetdb-") as folder:
        with mesh(Surface(points, triangles), os.path.join(folder, "mesh"), **options) as store:
            merged = store.merged()
            return merged.points, merged.tets


@dataclass(frozen=True)
class Comparison:
    """Whether two stores hold the same mesh, bit for bit.

    Attributes
    ----------
    same : bool
        The same mesh in the same sub-domains.
    digests : tuple of str
        Of both.
    subdomains : list of int
        Ranks of those that differ, or that only one has.
    """

    same: bool
    digests: tuple[str, str]
    subdomains: list[int]


def compare(a: Store | str | os.PathLike[str], b: Store | str | os.PathLike[str]) -> Comparison:
    """Compares two finished stores by their digests."""
    stores = [s if isinstance(s, Store) else open(s) for s in (a, b)]
    rows = [{s.rank: s.digest for s in store.subdomains} for store in stores]
    ranks = sorted(rows[0].keys() | rows[1].keys())
    differ = [rank for rank in ranks if rows[0].get(rank) != rows[1].get(rank)]
    digests = stores[0].digest, stores[1].digest
    return Comparison(digests[0] == digests[1], digests, differ)


def _path(path: Any) -> str:
    try:
        where = os.fsdecode(path)
    except TypeError:
        raise _options.usage(f"{path!r} is no path", "path") from None
    if not where or "\0" in where:
        raise _options.usage(f"{path!r} is no path", "path")
    return where
