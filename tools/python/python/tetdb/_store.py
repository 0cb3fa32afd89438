"""Finished stores: reports, sub-domains as arrays, questions, files, sub-domains meshed again."""

from __future__ import annotations

import base64
import html
import json
import math
import os
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native, _options, _sizes
from ._errors import TetdbError, needed
from ._fields import Fields
from ._native import ArrowStream
from ._options import Progress
from ._sizes import Length, Size

__all__ = ["Chunk", "Merged", "Quality", "Region", "Store", "Subdomain", "SubdomainInfo", "Verification"]

_TET_BITS = 29
_HIT = np.dtype(
    [
        ("id", "<i8"), ("vertices", "<i8", 4), ("region", "<i4"), ("subdomain", "<i4"), ("corners", "<f8", (4, 3)),
        ("centroid", "<f8", 3), ("quality", "<f8"), ("volume", "<f8"), ("edge_min", "<f8"), ("edge_max", "<f8"),
        ("angle_min", "<f8"), ("angle_max", "<f8"),
    ]
)  # fmt: skip
_VARIABLES = (
    "quality", "region", "subdomain", "volume", "x", "y", "z", "edge_min", "edge_max", "angle_min", "angle_max",
)  # fmt: skip
_FACE = np.dtype([("vertices", "<i4", 3), ("cut", "<i4"), ("index", "<i4"), ("other", "<i4"), ("tet", "<i4")])
_FACET = np.dtype(
    [("triangle", "<i8"), ("vertices", "<i4", 3), ("label", "<i4"), ("regions", "<i4", 2), ("tets", "<i4", 2)]
)

_COLORS = ("subdomain", "region", "quality", "size", "label")
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Ids = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Quality:
    """Shapes of tetrahedra; q = √6/12 · longest edge / inradius, 1 is regular.

    Attributes
    ----------
    bins : list of int
        Tetrahedra with q in [1, 2[, [2, 3[ … [9, 10[, [10, ∞[.
    worst : float
        The greatest q.
    dihedral_degrees : tuple of float
        Least and greatest dihedral angle.
    """

    bins: list[int]
    worst: float
    dihedral_degrees: tuple[float, float]


@dataclass(frozen=True)
class Region:
    """A region that the surface encloses; `labels` are names of labels on its boundary."""

    region: int
    filled: bool
    tets: int
    volume: float
    labels: list[str]


@dataclass(frozen=True)
class SubdomainInfo:
    """What the catalog says of a sub-domain; `interface_faces` are shared with others."""

    rank: int
    n_tets: int
    n_points: int
    interface_faces: int
    digest: str
    worst: float
    volume: float
    bounds: tuple[tuple[float, ...], ...]
    bytes: int


@dataclass(frozen=True)
class Verification:
    """What a verification found: nothing, or kinds of what is wrong with how often each occurs."""

    ok: bool
    n_tets: int
    findings: dict[str, int]


@dataclass(frozen=True, eq=False)
class Chunk:
    """Tetrahedra of one sub-domain with their own points, all as read-only arrays.

    Attributes
    ----------
    subdomain : int
        Whose they are.
    points : (k, 3) float64
        Their points.
    tets : (m, 4) int32
        Positions in `points`; positive volume in this order.
    regions : (m,) int32
        Region of each.
    ids : (m,) int64
        Lasting id of each: ``subdomain << 29 | number``.
    vertex_ids : (k,) int64
        Lasting id of each point, the same in all sub-domains that share it.
    """

    subdomain: int
    points: Floats
    tets: Ints
    regions: Ints
    ids: Ids
    vertex_ids: Ids

    @cached_property
    def quality(self) -> Floats:
        """(m,) float64: q of each tetrahedron, computed when it is first asked for."""
        return _locked(_native.qualities(self.points, self.tets))


@dataclass(frozen=True, eq=False)
class Merged:
    """Sub-domains joined: `points` (n, 3), `tets` (m, 4), `regions` (m,), `subdomains` (m,), `vertex_ids` (n,)."""

    points: Floats
    tets: Ints
    regions: Ints
    subdomains: Ints
    vertex_ids: Ids


def _locked(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    array.flags.writeable = False
    return array


class Subdomain:
    """A sub-domain as read-only arrays, each read when it is first asked for and kept as long as this is.

    Numbers of points and tetrahedra are positions in these arrays.
    """

    def __init__(self, store: Store, rank: int) -> None:
        self.rank = rank
        self.info = store._info(rank)
        self._part = store._native.part(rank)
        self._input_triangles: int | None = store._said()["input_triangles"]

    def __repr__(self) -> str:
        return f"<tetdb.Subdomain {self.rank}: {self.info.n_tets} tetrahedra>"

    @cached_property
    def points(self) -> Floats:
        """(n, 3) float64."""
        return _locked(self._part.points())

    @cached_property
    def tets(self) -> Ints:
        """(m, 4) int32: positions in `points`; positive volume in this order."""
        return _locked(self._part.tets())

    @cached_property
    def regions(self) -> Ints:
        """(m,) int32: the region of each tetrahedron."""
        return _locked(self._part.regions().reshape(-1))

    @cached_property
    def quality(self) -> Floats:
        """(m,) float64: q of each tetrahedron, 1 is regular."""
        return _locked(self._part.quality().reshape(-1))

    @cached_property
    def ids(self) -> Ids:
        """(m,) int64: lasting ids of the tetrahedra."""
        first = self.rank << _TET_BITS
        return _locked(np.arange(first, first + self.info.n_tets, dtype=np.int64))

    @cached_property
    def vertex_ids(self) -> Ids:
        """(n,) int64: lasting ids of the points, the same in all sub-domains that share one."""
        return _locked(self._part.vertex_ids().reshape(-1))

    @cached_property
    def lengths(self) -> npt.NDArray[np.float32]:
        """(n,) float32: the edge length wanted at each point."""
        return _locked(self._part.lengths().reshape(-1))

    @cached_property
    def interfaces(self) -> npt.NDArray[np.void]:
        """Structured, one row for each face shared with another sub-domain: `vertices` (3), `cut`, `index`, `other`, `tet`.

        The pair `cut`, `index` is the same in both sub-domains; vertices run counter-clockwise seen from outside this one.
        """
        return _locked(self._part.interfaces().view(_FACE).reshape(-1))

    @cached_property
    def facets(self) -> npt.NDArray[np.void]:
        """Structured, one row for each input triangle: `triangle`, `vertices` (3), `label`, `regions` (2), `tets` (2, -1: none)."""
        rows = self._part.facets().view(_FACET).reshape(-1)
        if self._input_triangles is not None:
            # Others hold embedded edges.
            rows = rows[rows["triangle"] < self._input_triangles]
        return _locked(rows)


class Store:
    """A finished mesh on disk; :func:`mesh`, :func:`open` and :func:`resume` return one.

    Handles may be used from several threads, and are opened again by a copy in another process (pickle or fork). As a context manager
    it is closed at the end; it opens again when it is asked.
    """

    def __init__(
        self,
        path: str,
        *,
        memory: int | str | None = None,
        threads: int | None = None,
        version: str | None = None,
    ) -> None:
        self.path = path
        self._how: dict[str, Any] = {"memory": memory, "threads": threads, "version": version}
        self._settings = _options.settings(memory, threads, version)
        self._handle = (os.getpid(), _native.Store(path, self._settings))
        self._summary: dict[str, Any] | None = None
        self._lock = threading.Lock()

    @property
    def _native(self) -> _native.Store:
        process, handle = self._handle
        if process != os.getpid():
            # A child has no threads of its parent; the old handle waits for none when it goes.
            handle = _native.Store(self.path, self._settings)
            self._handle, self._lock = (os.getpid(), handle), threading.Lock()
        return handle

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Lets go of the store's files; the next question opens them again."""
        self._native.close()

    def __reduce__(self) -> tuple[Any, ...]:
        return _reopened, (self.path, self._how)

    def __repr__(self) -> str:
        n = len(self.subdomains)
        return f"<tetdb.Store {self.path!r}: {self.n_tets} tetrahedra in {n} sub-domain{'s' * (n > 1)}>"

    # Reports.

    def _said(self) -> dict[str, Any]:
        native = self._native
        with self._lock:
            if self._summary is None:
                self._summary = json.loads(native.summary())
            return self._summary

    @property
    def n_tets(self) -> int:
        """Tetrahedra."""
        return int(self._said()["n_tets"])

    @property
    def digest(self) -> str:
        """One number for the mesh, the same for equal meshes: 32 hexadecimal digits."""
        return str(self._said()["digest"])

    @property
    def fields(self) -> Fields:
        """Values kept with the mesh, by name: ``st.fields["T"] = array``, ``st.fields["T"].chunks()``, ``del st.fields["T"]``."""
        return Fields(self)

    @property
    def is_verified(self) -> bool:
        """Whether a verification is on record."""
        return bool(self._said()["is_verified"])

    @property
    def labels(self) -> list[str]:
        """Names of the labels; a label is a position here."""
        return list(self._said()["labels"])

    @property
    def label_sets(self) -> dict[str, list[str]]:
        """Labels of triangles in several groups, and the labels of those; empty where no triangle is in two."""
        names, said = self.labels, self._said()["label_sets"]
        return {names[one["label"]]: [names[m] for m in one["members"]] for one in said}

    @property
    def regions(self) -> list[Region]:
        """Regions by number, those that are not filled among them."""
        labels = self.labels
        rows = self._said()["regions"]
        return [Region(**{**row, "labels": [labels[i] for i in row["labels"]]}) for row in rows]

    @property
    def subdomains(self) -> list[SubdomainInfo]:
        """Sub-domains by rank."""
        return [_info_of(row) for row in self._said()["subdomains"]]

    def _info(self, rank: int) -> SubdomainInfo:
        rows = self._said()["subdomains"]
        if not 0 <= _options.count(rank, 0, "rank") < len(rows):
            raise TetdbError("no-such-part", f"there is no sub-domain {rank}: they are numbered from 0 to {len(rows) - 1}", "rank")
        return _info_of(rows[rank])

    def quality(self) -> Quality:
        """Shapes of all tetrahedra, as they are on record."""
        rows = [row["quality"] for row in self._said()["subdomains"]]
        bins = np.sum([row["bins"] for row in rows], axis=0)
        least = min(row["dihedral"][0] for row in rows)
        most = max(row["dihedral"][1] for row in rows)
        worst = max(row["worst"] for row in rows)
        return Quality([int(n) for n in bins], worst, (math.degrees(least), math.degrees(most)))

    # Arrays.

    def subdomain(self, rank: int) -> Subdomain:
        """A sub-domain as arrays, read when they are asked for."""
        return Subdomain(self, rank)

    def chunks(self, n: int = 1_000_000) -> Iterator[Chunk]:
        """The whole mesh, `n` tetrahedra at most at a time, so that memory does not grow with the mesh.

        Examples
        --------
        >>> import tetdb, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with tetdb.mesh(tetdb.sample("box,h=0.4"), folder + "/box.tetdb") as store:
        ...         sum(len(chunk.tets) for chunk in store.chunks(500)) == store.n_tets
        True
        """
        return self._chunks(_options.count(n, 1, "n"))

    def _chunks(self, n: int) -> Iterator[Chunk]:
        for row in self.subdomains:
            part = self._native.part(row.rank)
            for first in range(0, row.n_tets, n):
                chunk = chunk_of(row.rank, first, part.block(first, n))
                yield chunk
                # What the caller let go of is gone before the next is read.
                del chunk

    def merged(self, subdomains: int | Sequence[int] | None = None) -> Merged:
        """Tetrahedra of sub-domains joined to one mesh in memory, of all by default; a sub-domain that is named twice counts once."""
        ranks = [r.rank for r in self.subdomains] if subdomains is None else list(dict.fromkeys(_options.ranks(subdomains, "subdomains")))
        parts = [self.subdomain(rank) for rank in ranks]
        if not parts:
            raise TetdbError("no-such-part", "an empty list of sub-domains", "subdomains")
        ids = np.concatenate([part.vertex_ids for part in parts])
        vertex_ids, first, number = np.unique(ids, return_index=True, return_inverse=True)
        if len(vertex_ids) >= 2**31:
            raise TetdbError("usage", f"{len(vertex_ids)} vertices are too many for one mesh of int32", "subdomains", "join fewer sub-domains, or read chunks")
        points = np.concatenate([part.points for part in parts])[first]
        starts = np.cumsum([0] + [part.info.n_points for part in parts])
        number = number.reshape(-1).astype(np.int32)
        tets = np.concatenate([number[start:][part.tets] for start, part in zip(starts, parts)])
        regions = np.concatenate([part.regions for part in parts])
        owners = np.repeat(np.array(ranks, np.int32), [len(part.tets) for part in parts])
        return Merged(points, tets, regions, owners, vertex_ids)

    def to_pyvista(self, subdomain: int | Sequence[int] | None = None) -> Any:
        """A PyVista ``UnstructuredGrid`` of the tetrahedra, with cell data `region`, `subdomain` and `quality`; needs the package pyvista.

        The input's triangles with their labels are in :attr:`Subdomain.facets`, and in what :meth:`export` writes.
        """
        pyvista = needed("pyvista")
        mesh = self.merged(subdomain)
        cells = {pyvista.CellType.TETRA: mesh.tets}
        grid = pyvista.UnstructuredGrid(cells, mesh.points)
        grid.cell_data["region"] = mesh.regions
        grid.cell_data["subdomain"] = mesh.subdomains
        grid.cell_data["quality"] = _native.qualities(mesh.points, mesh.tets)
        return grid

    def arrow(
        self, table: str = "tets", *, where: str | None = None, columns: Sequence[str] | None = None
    ) -> ArrowStream:
        """A table as an Arrow stream, which DuckDB, Polars, pandas and pyarrow read chunk by chunk, without copies.

        The answer has ``__arrow_c_stream__``: ``pyarrow.table(stream)``, ``polars.DataFrame(stream)``, or its name in a DuckDB query. No
        package is needed to make it. Each reader begins with the first row, of the store as it is then.

        Parameters
        ----------
        table : str
            `tets`, `vertices`, `faces`, `interfaces`, `subdomains`, `regions`, `labels` or `versions`.
        where : str, optional
            A condition on tetrahedra as in :meth:`query`, such as ``"quality > 6 and x < 0.5"``. Chunks that cannot have such
            tetrahedra are not read.
        columns : sequence of str, optional
            Names of columns, in this order; all unless given. `schema` of the answer has names and types.

        Returns
        -------
        ArrowStream
            Columns have the names and types of the Parquet export. Behind them are those of the fields at tetrahedra or vertices: `T`,
            or `u.x`, `u.y`, `u.z`.

        Raises
        ------
        TetdbError
            ``bad-query`` for an unknown table or column, and for a condition on another table than `tets`; ``bad-expression``. Damage
            that is met while the stream is read is an error of its reader.
        """
        names = None if columns is None else [str(name) for name in columns]
        return self._native.arrow(table, where, names)

    # Questions.

    def query(
        self,
        where: str | None = None,
        *,
        box: npt.ArrayLike | None = None,
        sphere: tuple[npt.ArrayLike, float] | None = None,
        plane: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
        inside: bool = False,
        subdomains: int | Sequence[int] | None = None,
        regions: int | Sequence[int] | None = None,
        labels: Sequence[int | str] | None = None,
        touching_surface: bool = False,
        order_by: str | None = None,
        descending: bool = True,
        limit: int | None = None,
    ) -> npt.NDArray[np.void]:
        """Tetrahedra that all of it holds of.

        Parameters
        ----------
        where : str, optional
            A condition such as ``"quality > 3 and region in [1, 2]"`` on quality, region, subdomain, volume, x, y, z (of the centroid),
            edge_min, edge_max, angle_min and angle_max (degrees).
        box, sphere, plane : optional
            They meet the box (2, 3) of two corners, the ball (center, radius), the plane (point, normal).
        inside : bool
            They lie wholly in box and ball.
        subdomains, regions, labels : optional
            They are in one of these, or stand on input triangles with one of these labels, or in a group of this name.
        order_by : str, optional
            One of the numbers a condition may name; the greatest first, or the least unless `descending`.
        limit : int, optional
            No more answers.

        Returns
        -------
        structured array
            `id`, `vertices` (4 lasting ids), `region`, `subdomain`, `corners` (4, 3), `centroid` (3), `quality`, `volume`, `edge_min`,
            `edge_max`, `angle_min`, `angle_max`.

        Examples
        --------
        >>> import tetdb, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with tetdb.mesh(tetdb.sample("box,h=0.4"), folder + "/box.tetdb") as store:
        ...         worst = store.query("quality > 1", order_by="quality", limit=3)
        >>> len(worst), bool((np.diff(worst["quality"]) <= 0).all())
        (3, True)
        """
        ball = flat = corners = None
        if box is not None:
            corners = np.reshape(_sizes.numbers(box, 6, "box", "bad-query"), (2, 3)).tolist()
        if sphere is not None:
            center, radius = _two(sphere, "sphere")
            ball = _sizes.numbers(center, 3, "sphere", "bad-query"), _sizes.numbers(radius, 1, "sphere", "bad-query")[0]
        if plane is not None:
            flat = [_sizes.numbers(one, 3, "plane", "bad-query") for one in _two(plane, "plane")]
        if where is not None and not isinstance(where, str):
            raise TetdbError("bad-expression", f"{where!r} is no text", "where")
        if order_by is not None:
            _options.one_of(order_by, _VARIABLES, "order_by")
        words = self._native.query(
            {
                "condition": where,
                "box_": corners,
                "sphere": ball,
                "plane": flat,
                "inside": bool(inside),
                "subdomains": None if subdomains is None else _options.ranks(subdomains, "subdomains"),
                "regions": None if regions is None else _options.ranks(regions, "regions"),
                "labels": None if labels is None else [self._label(one) for one in labels],
                "touching_surface": bool(touching_surface),
                "order_by": None if order_by is None else (order_by, bool(descending)),
                "limit": None if limit is None else _options.count(limit, 0, "limit"),
            }
        )
        return words.view(_HIT).reshape(-1)

    def _label(self, label: int | str) -> int:
        names = self.labels
        if isinstance(label, str):
            if label not in names:
                raise TetdbError("no-such-part", f"there is no label {label!r}", "labels")
            return names.index(label)
        return _options.count(label, 0, "labels")

    def locate(self, points: npt.ArrayLike, *, barycentric: bool = False) -> Any:
        """The tetrahedron that holds each point.

        Parameters
        ----------
        points : (n, 3) or (3,) float
            Where to look.
        barycentric : bool
            Whether barycentric coordinates are returned, too.

        Returns
        -------
        ids : (n,) int64
            Lasting ids, the least where several tetrahedra hold a point; -1 outside of the mesh.
        shares : (n, 4) float64, only with `barycentric`
            A zero says exactly that the point is on that face; NaN outside.
        """
        try:
            at = np.ascontiguousarray(points, dtype=np.float64)
        except (TypeError, ValueError):
            raise TetdbError("bad-query", "points are no numbers", "points") from None
        at = at.reshape(1, 3) if at.shape == (3,) else at
        if at.ndim != 2 or at.shape[1] != 3 or not np.isfinite(at).all():
            raise TetdbError("bad-query", f"points {at.shape}: expected finite numbers (n, 3)", "points")
        ids, shares = self._native.locate(at)
        return (ids, shares) if barycentric else ids

    # Files and pictures.

    def export(
        self,
        path: str | os.PathLike[str],
        *,
        subdomains: int | Sequence[int] | None = None,
        regions: int | Sequence[int] | None = None,
        pieces: bool = False,
        content: str = "mesh",
        order: int = 1,
        ascii: bool = False,
        ghosts: bool = False,
        split_sheets: bool = False,
        one_partition: bool = False,
    ) -> list[str]:
        """Writes the mesh for another program, in the format that the ending says, as ``tetdb export`` does.

        ``.vtu``, ``.pvtu``, ``.vtkhdf``, ``.xdmf``, ``.exo`` (Exodus II), ``.foam`` (OpenFOAM), ``.msh``, ``.mesh``, ``.meshb``, ``.mfem``,
        ``.inp``, ``.bdf`` (Nastran), ``.su2``, ``.ele``, ``.npy``, ``.json``; the guide says which can do what. ``.mesh``, ``.meshb``, ``.ele`` and ``.npy`` have numbers in place of the names in
        :attr:`labels`; what a format has no place for, is in files beside it.

        Parameters
        ----------
        subdomains, regions : optional
            Only these.
        pieces : bool
            Each sub-domain in a file of its own.
        content : {"mesh", "boundary", "interfaces"}
            All of it, or only faces (``.vtu``, ``.vtkhdf``).
        order : {1, 2}
            Nodes of the elements: corners, or also the middles of edges.
        ascii : bool
            Text where the format has both.
        ghosts : bool
            With each partition the tetrahedra of others that touch it (``.msh``).
        split_sheets : bool
            Sheets as slits, with vertices of their own on both sides.
        one_partition : bool
            All sub-domains as one partition, each vertex once (``.vtkhdf``).

        Returns
        -------
        list of str
            The files that were written.
        """
        if isinstance(order, bool) or order not in (1, 2):
            raise _options.usage(f"{order!r}: expected 1 or 2", "order")
        _options.one_of(content, ("mesh", "boundary", "interfaces"), "content")
        flags = {"pieces": pieces, "ascii": ascii, "ghosts": ghosts, "split_sheets": split_sheets, "one_partition": one_partition}
        words = {
            "subdomains": [] if subdomains is None else _options.ranks(subdomains, "subdomains"),
            "regions": [] if regions is None else _options.ranks(regions, "regions"),
            "is_second_order": order == 2,
            "flags": [content, *(flag for flag, is_set in flags.items() if is_set)],
        }
        return [str(file) for file, _ in self._native.export(os.fspath(path), words)]

    def snapshot(
        self,
        path: str | os.PathLike[str],
        *,
        kind: str = "cut",
        color: str = "subdomain",
        plane: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
        seen_from: npt.ArrayLike | None = None,
        where: str | None = None,
        crinkle: bool = False,
        pixels: tuple[int, int] = (1600, 1200),
    ) -> None:
        """Draws a cut or the surface into a ``.png`` or ``.svg`` file.

        Parameters
        ----------
        kind : {"cut", "surface"}
            A cut through the mesh, or the surface in space.
        color : {"subdomain", "region", "quality", "size", "label"} or a field
            What colors stand for: `label` of a surface, a field, or a component such as ``"u.x"``, of a cut.
        plane : (point, normal), optional
            Where it is cut; by default through the middle.
        seen_from : (3,), optional
            Direction towards the viewer, of a surface.
        where : str, optional
            Only tetrahedra that a condition holds of, as in :meth:`query`.
        crinkle : bool
            Whole tetrahedra instead of polygons.
        """
        flat = None
        if plane is not None:
            flat = [_sizes.numbers(one, 3, "plane", "bad-query") for one in _two(plane, "plane")]
        self._native.snapshot(
            os.fspath(path),
            {
                "kind": _options.one_of(kind, ("cut", "surface"), "kind"),
                "color": _options.one_of(color, (*_COLORS, *self.fields.columns), "color"),
                "plane": flat,
                "seen_from": None if seen_from is None else _sizes.numbers(seen_from, 3, "seen_from", "bad-query"),
                "condition": where,
                "crinkle": bool(crinkle),
                "pixels": [_options.count(n, 1, "pixels") for n in _two(pixels, "pixels")],
            },
        )

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes a page for a browser: numbers, charts, surfaces to be turned, cuts. ``.html``."""
        self._native.report(os.fspath(path))

    def _repr_html_(self) -> str:
        with tempfile.TemporaryDirectory(prefix="tetdb-") as folder:
            file = os.path.join(folder, "cut.png")
            self.snapshot(file, pixels=(360, 270))
            with open(file, "rb") as opened:
                picture = base64.b64encode(opened.read()).decode()
        quality = self.quality()
        rows = {
            "tetrahedra": f"{self.n_tets:,}",
            "sub-domains": str(len(self.subdomains)),
            "filled regions": str(sum(region.filled for region in self.regions)),
            "worst quality": f"{quality.worst:.2f}",
            "digest": self.digest,
        }
        cells = "".join(f"<tr><th>{key}</th><td>{value}</td></tr>" for key, value in rows.items())
        return (
            f"<div><b>{html.escape(self.path)}</b><table>{cells}</table>"
            f'<img alt="a cut through the mesh" src="data:image/png;base64,{picture}"></div>'
        )

    # Changes.

    def resaturate(
        self,
        subdomains: int | Sequence[int],
        *,
        sizes: npt.ArrayLike | Callable[[Floats], npt.ArrayLike] | None = None,
        hsiz: Length | None = None,
        hmin: Length | None = None,
        hmax: Length | None = None,
        hgrad: float | None = None,
        size: Size | Iterable[Size] | None = None,
        scale: float = 1.0,
        progress: bool | Progress | None = None,
    ) -> None:
        """Meshes sub-domains again with other sizes; all others keep their digests. Verifies.

        Parameters
        ----------
        subdomains : int or list of int
            Which, by rank.
        sizes : array or callable, optional
            A length for each tetrahedron of the sub-domains, by rank, in the order of their arrays; or a callable that takes centroids
            (m, 3) and returns lengths (m,).
        hsiz, hmin, hmax, hgrad, size : optional
            As of :func:`mesh`, beside those on record: single lengths replace them, shapes are added. Not with `sizes`.
        scale : float
            All lengths times this.
        """
        ranks = sorted(set(_options.ranks(subdomains, "subdomains")))
        lengths = None
        if callable(sizes):
            at = [part.points[part.tets].mean(axis=1) for part in map(self.subdomain, ranks)]
            lengths = _sizes.ask(sizes, np.concatenate(at), "sizes").tolist() if at else []
        elif sizes is not None:
            n = sum(self._info(rank).n_tets for rank in ranks)
            lengths = _sizes.numbers(sizes, n, "sizes", "count-mismatch")
            if min(lengths, default=1.0) <= 0:
                raise _sizes.bad_size("a length is not above zero", f"sizes[{int(np.argmin(lengths))}]")
        words = None
        if any(option is not None for option in (hsiz, hmin, hmax, hgrad, size)):
            words = _sizes.words(None, hsiz, hmin, hmax, hgrad, size)
            if lengths is not None and any(option is not None for option in (hsiz, size)):
                raise _options.usage("lengths of tetrahedra, or other sizes, not both", "sizes")
        job = {
            "ranks": ranks,
            "sizes": words,
            "lengths": lengths,
            "scale": _sizes.numbers(scale, 1, "scale")[0],
            "repair": False,
        }
        self._changed(lambda: self._native.resaturate(job, _options.listener(progress)))

    def adapt(
        self,
        field: str,
        *,
        tets: int | None = None,
        factor: float | None = None,
        estimate: str = "hessian",
        hmin: Length | None = None,
        hmax: Length | None = None,
        hgrad: float | None = None,
        change: float = 1.25,
        dry_run: bool = False,
        progress: bool | Progress | None = None,
    ) -> dict[str, Any]:
        """Meshes sub-domains again with the lengths that are best for a field at vertices. The surface and interfaces stay. Verifies.

        Parameters
        ----------
        field : str
            Its name, or that of a component, such as `u.x`; of type `f32` or `f64`.
        tets : int, optional
            Wanted number of tetrahedra.
        factor : float, optional
            The same as a multiple of those there are; without both, as many.
        estimate : str
            `hessian` for the least error of values, `jump` for that of gradients.
        hmin, hmax, hgrad : optional
            Least and greatest length, and their gradation.
        change : float
            Ratio of two lengths above which they differ. Sub-domains with other lengths in more than a twentieth are meshed again.
        dry_run : bool
            Only says what would change.

        Returns
        -------
        dict
            `tets`, `wanted_tets`, `predicted_tets`, `sizes`, `subdomains`, and the triangles of `surface` and `interfaces` that are longer than
            wanted, which stay.
        """
        if estimate not in ("hessian", "jump"):
            raise _options.usage(f"{estimate!r} is no estimate: expected 'hessian' or 'jump'", "estimate")
        if tets is not None and factor is not None:
            raise _options.usage("a number of tetrahedra, or a factor, not both", "tets")
        if tets is not None and not 0 < tets < 2**63:
            raise _sizes.bad_size(f"{tets} tetrahedra make no sense, expected one or more", "tets")
        job = {
            "field": field,
            "tets": None if tets is None else int(tets),
            "factor": None if factor is None else _sizes.numbers(factor, 1, "factor")[0],
            "estimate": estimate,
            "sizes": _sizes.words(None, None, hmin, hmax, hgrad, None),
            "change": _sizes.numbers(change, 1, "change")[0],
            "dry_run": bool(dry_run),
        }
        said = "{}"

        def work() -> None:
            nonlocal said
            said = self._native.adapt(job, _options.listener(progress))

        self._changed(work)
        return dict(json.loads(said))

    def transfer(
        self,
        other: Store,
        fields: str | Sequence[str] | None = None,
        method: str | None = None,
    ) -> list[dict[str, Any]]:
        """Adds fields of another store, evaluated on this mesh.

        Parameters
        ----------
        other : Store
            The store that has the fields.
        fields : str or list of str, optional
            Their names; left out, all.
        method : str, optional
            `linear` for values at vertices, `overlap` for those at tetrahedra, or `nearest`; left out, the first two.

        Returns
        -------
        list of dict
            For each field its name, `method`, `from_outside` (values of places outside of the other mesh), and at tetrahedra `covered` and
            `integrals` before and after.
        """
        if method not in (None, "linear", "overlap", "nearest"):
            raise _options.usage(f"{method!r} is no method: expected 'linear', 'overlap' or 'nearest'", "method")
        names = [fields] if isinstance(fields, str) else list(fields or [])
        if fields is not None and not names:
            return []
        said = "[]"

        def work() -> None:
            nonlocal said
            said = self._native.transfer(other.path, other._how["version"], names, method)

        self._changed(work)
        return list(json.loads(said))

    @property
    def periodic(self) -> list[dict[str, Any]]:
        """The periodic pairs: for each `first` and `second`, the names of its labels, the `map` from the one to the other (three rows of
        four), the `angle` of a rotation in radians, counts, and `pairs`, an array of shape (n, 2) of lasting ids of vertices.
        """
        found = json.loads(self._native.periodic())
        return [{**pair, "pairs": self._native.periodic_vertices(place)} for place, pair in enumerate(found)]

    def add_periodic(
        self, first: str, second: str, kind: str | None = None, tolerance: float | None = None
    ) -> None:
        """Records that the triangles of the label `first` are those of `second`, moved; the mesh does not change.

        The motion is found from the triangles; `kind`, "translate" or "rotate", chooses where both would do. `tolerance` is in units of
        the input, by default a millionth of the diagonal around both labels. Raises `SurfaceError` with the code `not-periodic` where something has no partner.
        """
        if kind not in (None, "translate", "rotate"):
            raise _options.usage(f"{kind!r} is no motion: expected 'translate' or 'rotate'", "kind")
        self._changed(lambda: self._native.add_periodic((first, second), kind, tolerance))

    def repair(self, subdomains: Sequence[int] = ()) -> None:
        """Meshes damaged sub-domains again as they were; without a list, all that are damaged."""
        ranks = _options.ranks(subdomains, "subdomains")
        job = {"ranks": ranks, "sizes": None, "lengths": None, "scale": 1.0, "repair": True}
        self._changed(lambda: self._native.resaturate(job, None))

    def versions(self) -> list[dict[str, Any]]:
        """The versions, the oldest first: for each `name`, `note`, `saved`, `digest`, counts, `fields`, and the `bytes` that dropping it frees.

        `tetdb.open(path, version=name)` reads one.
        """
        return list(json.loads(self._native.versions()))

    def save_version(self, name: str, note: str = "", keep: int | None = None) -> list[str]:
        """Saves mesh and fields as they are under a name; no file is copied.

        With `keep`, the oldest versions beyond that number are dropped; their names are returned.
        """
        keep = None if keep is None else _options.count(keep, 1, "keep")
        dropped: list[str] = []
        self._changed(lambda: dropped.extend(self._native.save_version(name, note, keep)))
        return dropped

    def restore_version(self, name: str) -> None:
        """Makes mesh and fields those of a version; :meth:`undo` brings back what was before."""
        self._changed(lambda: self._native.restore_version(name))

    def drop_version(self, name: str) -> None:
        """Drops a version, and files that nothing else needs."""
        self._changed(lambda: self._native.drop_version(name))

    def diff_versions(self, first: str, second: str = "now") -> dict[str, Any]:
        """Compares two versions; `now` is the store as it is. The answer is that of `tetdb version STORE diff --json`."""
        return dict(json.loads(self._native.diff_versions(first, second)))

    def undo(self) -> None:
        """Brings back what the last change replaced."""
        self._changed(self._native.undo)

    def _changed(self, work: Callable[[], None]) -> None:
        try:
            work()
        finally:
            self._summary = None

    def verify(self, full: bool = True) -> Verification:
        """Verifies the mesh by exact predicates, against its surface where that is still there.

        An invalid mesh is an answer. With `full` it is also counted how many free faces are locally Delaunay.
        """
        n_tets, findings = self._native.verify(bool(full))
        return Verification(not findings, n_tets, dict(findings))


def chunk_of(rank: int, first: int, block: tuple[Floats, Ids, Ints, Ints]) -> Chunk:
    """A block whose first tetrahedron has the number `first` in its sub-domain."""
    points, vertex_ids, tets, regions = block
    for array in (points, vertex_ids, tets, regions):
        _locked(array)
    start = (rank << _TET_BITS) + first
    ids = _locked(np.arange(start, start + len(tets), dtype=np.int64))
    return Chunk(rank, points, tets, regions, ids, vertex_ids)


def _info_of(row: dict[str, Any]) -> SubdomainInfo:
    low, high = row["digest"]
    return SubdomainInfo(
        rank=row["rank"],
        n_tets=row["tets"],
        n_points=row["vertices"],
        interface_faces=row["interface_faces"],
        digest=f"{high:016x}{low:016x}",
        worst=row["quality"]["worst"],
        volume=row["volume"],
        bounds=tuple(tuple(corner) for corner in row["bounds"]),
        bytes=row["bytes"],
    )


def _two(value: Any, where: str) -> tuple[Any, Any]:
    try:
        first, second = value
    except (TypeError, ValueError):
        raise TetdbError("bad-query", f"{value!r}: expected two things", where) from None
    return first, second


def _reopened(path: str, how: dict[str, Any]) -> Store:
    return Store(path, **how)
