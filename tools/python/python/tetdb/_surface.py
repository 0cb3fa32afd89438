"""Surfaces: from files, arrays or other packages' meshes; checked, repaired, refined."""

from __future__ import annotations

import copy
import json
import os
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _cells, _native, _options
from ._errors import SurfaceError, TetdbError
from ._sizes import Length, Size, length

__all__ = ["CheckReport", "Defects", "Estimate", "Surface", "sample"]

REPAIRS = ("resolve", "winding", "auto")


@dataclass(frozen=True, eq=False)
class Defects:
    """What is wrong with a surface, kind by kind; all arrays run parallel.

    Attributes
    ----------
    codes : list of str
        The kind of each, such as ``"open-surface"``.
    triangles : (n, 2) int64
        The triangles it is about; -1 where there is no second one.
    places : (n, 3) float64
        A position where it can be seen, in the surface's units.
    """

    codes: list[str]
    triangles: npt.NDArray[np.int64]
    places: npt.NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.codes)


@dataclass(frozen=True, eq=False)
class CheckReport:
    """All that is wrong with a surface, and what its triangles allow.

    Attributes
    ----------
    ok : bool
        Whether it can be meshed.
    defects : Defects
        Up to 100,000 of them, with places.
    n_defects : int
        All of them.
    messages : list of str
        The first hundred in words.
    n_open_edges, n_small_angles, n_forcing_triangles : int
        Edges with one triangle; triangles with an angle below five degrees; triangles on which no tetrahedron can have q < 2.
    edges : tuple of float
        Least, median and greatest edge length.
    volume : float or None
        Enclosed volume of a closed surface.
    """

    ok: bool
    defects: Defects
    n_defects: int
    messages: list[str]
    n_open_edges: int
    n_small_angles: int
    n_forcing_triangles: int
    edges: tuple[float, ...]
    volume: float | None


@dataclass(frozen=True)
class Estimate:
    """What to expect of a mesh: counts, bytes, seconds on a server of 2.6 GHz."""

    tets: int
    vertices: int
    subdomains: int
    store_bytes: int
    disk_peak_bytes: int
    memory_least_bytes: int
    seconds: float


class Surface:
    """A triangle surface with labels; all triangles are turned like their neighbors.

    Parameters
    ----------
    points : (n, 3) float array, or a mesh
        Vertices; or all at once: a mesh of PyVista, VTK, trimesh or meshio (also a ``MultiBlock`` or a ``Scene``), a path, a list of paths.
    triangles : (m, 3) int array
        Positions in `points`, counter-clockwise seen from outside or all the other way.
    labels : (m,) array of str or int, optional
        The label of each triangle, or of each surface cell of a mesh; a list or tuple of them for one in several groups.

    Notes
    -----
    Polygons of meshes are cut into triangles. Of a mesh with surface cells, volume cells are left out; of one with volume cells alone the
    boundary is the surface, as of :meth:`boundary_of`. What is left out is said by a warning and in :attr:`notes`; a mesh without either
    is refused. Labels come from cell data ``label``, ``gmsh:physical`` or ``medit:ref``, from cell sets, and from names of blocks.

    Raises
    ------
    SurfaceError
        Wrong shapes or types, numbers that are not finite, triangles that name no point; `where` says which.

    Examples
    --------
    >>> import tetdb
    >>> points = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> s = tetdb.Surface(points, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> s.n_triangles, s.check().ok
    (4, True)
    """

    _inner: _native.Surface
    _parts: tuple[Callable[..., Surface], tuple[Any, ...]] | None = None
    """How it was embedded, and what: its triangles alone do not say which are sheets."""
    _repairs: tuple[dict[str, Any], ...] | list[dict[str, Any]] = ()

    def __init__(
        self,
        points: Any,
        triangles: npt.ArrayLike | None = None,
        labels: Sequence[str] | npt.ArrayLike | None = None,
    ) -> None:
        if triangles is None:
            if isinstance(points, Surface):
                self._inner, self._parts = points._inner, points._parts
                return
            if _is_path(points):
                self._inner = _native.Surface.read([os.fspath(points)])
                return
            if isinstance(points, (list, tuple)) and points and all(map(_is_path, points)):
                self._inner = _native.Surface.read([os.fspath(p) for p in points])
                return
            self._inner = _of_cells(_cells.of_mesh(points), labels)
            return
        self._inner = _of_arrays(points, triangles, labels)

    @classmethod
    def read(cls, *files: str | os.PathLike[str]) -> Surface:
        """Reads files as one surface: STL, PLY, OBJ, OFF, 3MF, GIFTI, MEDIT, Gmsh, TetGen and others; each a label unless it has its own."""
        return cls._of(_native.Surface.read([os.fspath(f) for f in files]))

    @classmethod
    def boundary_of(cls, mesh: Any) -> Surface:
        """The boundary of a mesh of volume cells, and faces between its regions; surface cells are left out.

        Regions are told by cell data ``label``, ``gmsh:physical``, ``medit:ref`` or ``region``. A triangle has the name of its region as
        label, one between two regions both names.

        Parameters
        ----------
        mesh : mesh or path
            Of PyVista, VTK or meshio, with tetrahedra, pyramids, prisms or hexahedra; or a ``.msh``, ``.mesh``, ``.meshb`` or ``.ele`` file.
        """
        if _is_path(mesh):
            return cls._of(_native.Surface.boundary_of(os.fspath(mesh)))
        return cls._of(_of_cells(_cells.of_mesh(mesh, volume_only=True), None))

    @classmethod
    def _again(cls, points: Any, triangles: Any, labels: Any, notes: list[str], seeds: list[tuple[str, bool]]) -> Surface:
        """A pickled one: with notes and seeds."""
        return cls._of(_of_arrays(points, triangles, labels).with_extras(notes, seeds))

    @classmethod
    def _of(cls, native: _native.Surface) -> Surface:
        surface = cls.__new__(cls)
        surface._inner = native
        return surface

    @property
    def points(self) -> npt.NDArray[np.float64]:
        """(n, 3) float64: the vertices, those with the same coordinates once. A copy."""
        return self._inner.points()

    @property
    def triangles(self) -> npt.NDArray[np.int32]:
        """(m, 3) int32: positions in `points`. A copy."""
        return self._inner.triangles().view(np.int32)

    @property
    def labels(self) -> npt.NDArray[np.str_]:
        """(m,) str: the label of each triangle; for one in several groups their names with ``+`` between them."""
        names, codes = self._inner.labels()
        return np.array(names, dtype=np.str_)[codes]

    @property
    def groups(self) -> dict[str, npt.NDArray[np.int64]]:
        """Numbers of the triangles in each group; one may be in several. ``{name: [rows]}`` of it are cell sets of meshio."""
        names, codes = self._inner.labels()
        sets = dict(self._inner.label_sets())
        found: dict[str, npt.NDArray[np.int64]] = {}
        for label, name in enumerate(names):
            if label not in sets:
                having = [label, *(one for one, members in sets.items() if label in members)]
                found[name] = np.flatnonzero(np.isin(codes, having))
        return found

    @property
    def notes(self) -> list[str]:
        """What was left out, cut, joined or turned when it was read."""
        return self._inner.notes()

    @property
    def n_points(self) -> int:
        return self._inner.n_points()

    @property
    def n_triangles(self) -> int:
        return self._inner.n_triangles()

    @property
    def bounds(self) -> tuple[tuple[float, ...], ...]:
        """Low and high corner of the smallest box around it."""
        return tuple(tuple(corner) for corner in self._inner.bounds())

    def check(self) -> CheckReport:
        """Finds all that is wrong, by exact predicates. Defects are an answer, not an error."""
        words, codes, triangles, places = self._inner.check()
        said = json.loads(words)
        edges = tuple(said.pop("edges"))
        ok = said["n_defects"] == 0
        return CheckReport(ok=ok, defects=Defects(codes, triangles, places), edges=edges, **said)

    def repaired(self, how: str | float | None = None, weld: float | None = None) -> Surface:
        """The same surface repaired; :attr:`repairs` of the result says what was done.

        Parameters
        ----------
        how : str, optional
            ``"resolve"`` divides crossing triangles along their intersections. ``"winding"`` then closes holes, turns shells outward and
            unites parts that overlap; new triangles are labeled ``closed-hole-1`` and so on. ``"auto"`` takes the first of joining near
            points, ``"resolve"`` and ``"winding"`` that leaves no defect. Without it, triangles of no area and repeated ones are dropped,
            triangles divided at T-junctions, and all turned alike.
        weld : float, optional
            Without `how`: points nearer than this share of the box diagonal are joined; up to 0.01.

        Raises
        ------
        SurfaceError
            ``nothing-filled`` where the surface goes around nothing; ``self-intersection`` where rounding makes new crossings.
        """
        if isinstance(how, str):
            if how not in REPAIRS or weld is not None:
                raise TetdbError("usage", f"{how!r} is no repair" if weld is None else "weld is for repairs without `how`", "how",
                                 f"one of {', '.join(REPAIRS)}")
            native, steps = self._inner.repaired_by(how)
            surface = self._of(native)
            surface._repairs = json.loads(steps)
            return surface
        weld = how if weld is None else weld
        if weld is not None and not isinstance(weld, (int, float)):
            raise TetdbError("bad-size", f"{weld!r} is no share of the box diagonal", "weld")
        return self._of(self._inner.repaired(weld))

    def wrapped(self, gap: Length = "1%", offset: Length = "0.1%") -> Surface:
        """A closed surface around all triangles, whatever these are: an alpha wrap. :attr:`repairs` of the result says what was done.

        Parameters
        ----------
        gap : float or str
            Openings narrower than about twice this are closed; triangles have about this size. In the surface's units, or a share of the
            diagonal of its box.
        offset : float or str
            Greatest distance of the vertices from the surface.

        Raises
        ------
        SurfaceError
            Where the offset is below the rounding of the coordinates.
        """
        return self._reported("wrap", *self._inner.wrapped(length(gap, "gap"), length(offset, "offset")))

    def remeshed(
        self,
        tolerance: Length = "0.05%",
        *,
        feature_angle: float = 40.0,
        hmin: Length | None = None,
        hmax: Length | None = None,
        hgrad: float | None = None,
    ) -> Surface:
        """The surface with even triangles. :attr:`repairs` of the result says what was done.

        Parameters
        ----------
        tolerance : float or str
            No point of either surface is farther from the other: in the surface's units, or a share of the diagonal of its box.
        feature_angle : float
            Edges between triangles whose normals differ by more degrees are kept, and borders of labels.
        hmin, hmax : float or str, optional
            Least and greatest edge length asked for. Default: twice the tolerance, and none.
        hgrad : float, optional
            Greatest ratio of neighboring edge lengths. Default: 1.4.

        Raises
        ------
        SurfaceError
            Where the surface cannot be meshed as it is.
        """
        least = None if hmin is None else length(hmin, "hmin")
        most = None if hmax is None else length(hmax, "hmax")
        return self._reported("remesh", *self._inner.remeshed(length(tolerance, "tolerance"), feature_angle, (least, most), hgrad))

    def _reported(self, step: str, native: _native.Surface, report: str) -> Surface:
        surface = self._of(native)
        surface._repairs = [*self._repairs, {step: json.loads(report)}]
        return surface

    @property
    def repairs(self) -> list[dict[str, Any]]:
        """What :meth:`repaired`, :meth:`wrapped` and :meth:`remeshed` did, step by step: each has one key, ``weld``, ``resolve``,
        ``winding``, ``wrap`` or ``remesh``, with counts, areas and distances."""
        return copy.deepcopy(list(self._repairs))

    def refined(self, hsiz: Length) -> Surface:
        """The same surface with edges of `hsiz` at most; new vertices lie on the old triangles."""
        return self._of(self._inner.refined(length(hsiz, "hsiz")))

    def embedded(self, sheet: Any, name: str) -> Surface:
        """The same with the triangles of `sheet` inside: faces of the mesh with tetrahedra on both sides, that part no region.

        Parameters
        ----------
        sheet : Surface, or what it takes
            Open or closed. It may end inside, and meet other sheets and the surface along edges and vertices that both have.
        name : str
            Of its label; where it has several, they are called ``name:LABEL``.
        """
        _check_name(name)
        inside = sheet if isinstance(sheet, Surface) else Surface(sheet)
        both = self._of(self._inner.embedded(inside._inner, name))
        both._parts = Surface.embedded, (self, inside, name)
        return both

    def embedded_edges(self, edges: Any, name: str, divide: bool = False, snap: Length | None = None) -> Surface:
        """The same with edges inside: each is an edge of the mesh, whole and in its place. To be called after :meth:`embedded`.

        Parameters
        ----------
        edges : path, or tuple
            An ``.obj``, legacy ``.vtk`` or ``.poly`` file; or points (n, 3), positions in them (m, 2), and, if it has three parts, m labels.
        name : str
            Of their label; where there are several, they are called ``name:LABEL``.
        divide : bool
            Whether triangles are divided where ends of edges lie exactly on them. Edges otherwise meet them, and each other, in common
            vertices alone.
        snap : float or str, optional
            Ends nearer than this to a triangle are moved onto it, and divide it there: a length, or ``"1%"`` of the diagonal.
        """
        _check_name(name)
        if _is_path(edges):
            given: Any = os.fspath(edges)
        elif isinstance(edges, tuple) and len(edges) in (2, 3):
            points, pairs = _points_of(edges[0]), np.asarray(edges[1])
            if pairs.dtype.kind not in "iu" or pairs.ndim != 2 or pairs.shape[1] != 2:
                raise SurfaceError("unsupported-content", f"expected integers (m, 2), found {pairs.dtype} {pairs.shape}", "edges")
            bad = np.flatnonzero(((pairs < 0) | (pairs >= len(points))).any(axis=1))
            if bad.size:
                raise SurfaceError("index-out-of-range", f"it names point {pairs[bad[0]].tolist()}, but there are {len(points)}", f"edge {bad[0]}")
            given = points, np.ascontiguousarray(pairs, dtype=np.uint32), _words(edges[2:], len(pairs))
        else:
            raise SurfaceError("unsupported-content", f"{type(edges).__name__} is no edges", "edges", "give a path, or points and pairs of them")
        both = self._of(self._inner.embedded_edges(given, name, bool(divide), _within(snap)))
        both._parts = Surface.embedded_edges, (self, edges, name, divide, snap)
        return both

    def embedded_points(self, points: Any, name: str, divide: bool = False, snap: Length | None = None) -> Surface:
        """The same with points inside: each is a vertex of the mesh that is not moved.

        Parameters
        ----------
        points : path, array or tuple
            A ``.csv``, ``.node``, ``.obj`` or legacy ``.vtk`` file; or (n, 3); or both of this and n labels.
        name, divide, snap
            As of :meth:`embedded_edges`.
        """
        _check_name(name)
        if _is_path(points):
            given: Any = os.fspath(points)
        else:
            xyz, *labels = points if isinstance(points, tuple) and len(points) == 2 else (points,)
            xyz = _points_of(xyz)
            given = xyz, _words(labels, len(xyz))
        both = self._of(self._inner.embedded_points(given, name, bool(divide), _within(snap)))
        both._parts = Surface.embedded_points, (self, points, name, divide, snap)
        return both

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes ``.stl``, ``.off``, ``.obj`` or ``.ply``; warns of labels, embedded edges and points, and seeds that the file does not keep."""
        labels, n_inside, n_seeds = self._inner.write(os.fspath(path))
        for n, what in ((labels, "labels"), (n_inside, "embedded edges and points"), (n_seeds, "points that mark regions and holes")):
            if n:
                warnings.warn(f"{os.fspath(path)} does not keep {what}", stacklevel=2)

    def estimate(
        self,
        *,
        hsiz: Length | None = None,
        hmin: Length | None = None,
        hmax: Length | None = None,
        hgrad: float | None = None,
        size: Size | Iterable[Size] | None = None,
        regions: str | None = None,
        seeds: _options.Seeds | None = None,
        holes: npt.ArrayLike | None = None,
        refine_surface: bool = False,
        subdomains: int | None = None,
        memory: int | str | None = None,
        threads: int | None = None,
    ) -> Estimate:
        """Tetrahedra, memory, disk and time to expect; nothing is written. Options as of :func:`mesh`.

        Examples
        --------
        >>> import tetdb
        >>> 100 < tetdb.sample("box,h=0.5").estimate(hsiz="10%").tets < 10_000
        True
        """
        job = _options.job(
            self.bounds, hsiz, hmin, hmax, hgrad, size, regions, seeds, holes, refine_surface,
            subdomains=subdomains,
        )  # fmt: skip
        settings = _options.settings(memory, threads)
        return Estimate(**json.loads(_native.predict(self._inner, job, settings)))

    def __reduce__(self) -> tuple[Any, ...]:
        if self._parts:
            return self._parts
        names, codes = self._inner.labels()
        for label, members in self._inner.label_sets():
            names[label] = _cells.TOGETHER.join(names[m] for m in members)
        words = np.array(names, dtype=np.str_)[codes]
        return Surface._again, (self.points, self.triangles, words, *self._inner.extras())

    def __repr__(self) -> str:
        return f"<tetdb.Surface: {self.n_points} points, {self.n_triangles} triangles>"


def sample(spec: str) -> Surface:
    """A generated surface such as ``"balls,count=100,seed=1"`` or ``"box,h=0.1"``."""
    if not isinstance(spec, str):
        raise SurfaceError("bad-sample", f"{spec!r} is no text", "spec")
    return Surface._of(_native.Surface.sample(spec))


def _within(snap: Length | None) -> tuple[float, bool] | None:
    return None if snap is None else length(snap, "snap")


def _check_name(name: object) -> None:
    if not isinstance(name, str) or not name:
        raise TetdbError("usage", f"{name!r} is no name of a sheet, edges or points", "name")


def _words(labels: Sequence[Any], n: int) -> list[str] | None:
    """`labels`: one sequence of them, or none."""
    if not labels or labels[0] is None:
        return None
    each = np.asarray(labels[0])
    if each.shape != (n,) or each.dtype.kind not in "UiuO":
        raise SurfaceError("count-mismatch", f"expected {n} labels, found {each.dtype} {each.shape}", "labels")
    return [str(label) for label in each]


def _is_path(value: object) -> bool:
    return isinstance(value, (str, os.PathLike))


def _refuse_masked(array: Any, what: str) -> None:
    if np.ma.is_masked(array):
        raise SurfaceError("unsupported-content", "a value is masked", what, "give arrays without masked values")


def _points_of(points: Any) -> npt.NDArray[np.float64]:
    _refuse_masked(points, "points")
    try:
        xyz = np.asarray(points)
    except (TypeError, ValueError) as error:
        raise SurfaceError("unsupported-content", f"no array: {error}", "points") from None
    if xyz.dtype.kind not in "fiu" or xyz.ndim != 2 or xyz.shape[1] != 3:
        raise SurfaceError("unsupported-content", f"expected real numbers (n, 3), found {xyz.dtype} {xyz.shape}", "points")
    return np.ascontiguousarray(xyz, dtype=np.float64)


def _of_cells(cells: _cells.Cells, labels: Any) -> _native.Surface:
    xyz = _points_of(cells.points)
    n = len(cells.counts)
    bad = np.flatnonzero((cells.corners < 0) | (cells.corners >= len(xyz)))
    if bad.size:
        cell = int(np.searchsorted(np.cumsum(cells.counts), bad[0], side="right"))
        raise SurfaceError("index-out-of-range", f"it names point {cells.corners[bad[0]]}, but there are {len(xyz)}", f"cell {cell}")
    words = cells.labels if labels is None else _cells.words_of(labels, n)
    for note in cells.notes:
        warnings.warn(note, stacklevel=3)
    if (cells.counts == 3).all() and not cells.notes and not cells.is_volume:
        return _of_arrays(xyz, cells.corners.reshape(-1, 3), words)
    counts, corners = cells.counts.astype(np.uint32), cells.corners.astype(np.uint32)
    return _native.Surface.of_cells(xyz, counts, corners, None if words is None else _coded(words), cells.is_volume, cells.notes)


def _coded(words: npt.NDArray[np.str_]) -> tuple[list[str], npt.NDArray[np.int64]]:
    names, codes = np.unique(words, return_inverse=True)
    return [str(n) for n in names], codes.astype(np.int64)


def _of_arrays(points: Any, triangles: Any, labels: Any) -> _native.Surface:
    xyz = _points_of(points)
    _refuse_masked(triangles, "triangles")
    try:
        tri = np.asarray(triangles)
    except (TypeError, ValueError) as error:
        raise SurfaceError("unsupported-content", f"no array: {error}", "triangles") from None
    if tri.size == 0 and tri.ndim == 2 and tri.shape[1] == 3:
        tri = tri.astype(np.int64)
    if tri.dtype.kind not in "iu" or tri.ndim != 2 or tri.shape[1] != 3:
        raise SurfaceError("unsupported-content", f"expected integers (m, 3), found {tri.dtype} {tri.shape}", "triangles")
    bad = np.flatnonzero(((tri < 0) | (tri >= len(xyz))).any(axis=1))
    if bad.size:
        raise SurfaceError(
            "index-out-of-range",
            f"it names point {tri[bad[0]].tolist()}, but there are {len(xyz)}",
            f"triangle {bad[0]}",
        )
    named = None if labels is None else _coded(_cells.words_of(labels, len(tri)))
    return _native.Surface.of_arrays(
        xyz,
        np.ascontiguousarray(tri, dtype=np.uint32),
        named,
    )
