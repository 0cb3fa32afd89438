"""Wanted edge lengths, as arguments and as the native half words them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from ._errors import TetdbError

__all__ = ["Box", "Cylinder", "Field", "Function", "InRegion", "NearLabel", "Size", "Sphere"]

Length: TypeAlias = Union[float, str]
"""A number in the surface's units, or text such as ``"2%"``: a share of the diagonal of its box."""

_BATCH = 1 << 16


@dataclass(frozen=True)
class Box:
    """`h` in the box between two corners; elsewhere lengths grow, or are `outside` at most."""

    low: Sequence[float]
    high: Sequence[float]
    h: Length
    outside: Length | None = None


@dataclass(frozen=True)
class Sphere:
    """`h` in a ball; elsewhere lengths grow, or are `outside` at most."""

    center: Sequence[float]
    radius: float
    h: Length
    outside: Length | None = None


@dataclass(frozen=True)
class Cylinder:
    """`h` in a cylinder around the axis from `a` to `b`; elsewhere lengths grow, or are `outside` at most."""

    a: Sequence[float]
    b: Sequence[float]
    radius: float
    h: Length
    outside: Length | None = None


@dataclass(frozen=True)
class InRegion:
    """`h` at most in a region, named by its number or by a label on it."""

    region: int | str
    h: Length


@dataclass(frozen=True)
class NearLabel:
    """`h` at most on triangles with a label and up to `distance` from them; from there lengths grow."""

    label: str
    h: Length
    distance: Length | None = None


@dataclass(frozen=True, eq=False)
class Field:
    """Lengths at the vertices of a background mesh, linear in its tetrahedra; nothing is asked for outside.

    Parameters
    ----------
    points : (n, 3) float
        Vertices.
    tets : (m, 4) int
        Tetrahedra, of either orientation.
    lengths : (n,) float
        Wanted edge lengths, above zero.
    """

    points: npt.ArrayLike
    tets: npt.ArrayLike
    lengths: npt.ArrayLike


@dataclass(frozen=True)
class Function:
    """A callable that is asked once for lengths at the corners of a regular grid of cubes.

    Parameters
    ----------
    h : callable
        Takes points (k, 3), returns lengths (k,), above zero. Asked in batches, in one thread.
    cells : int
        Cubes along the longest side of the surface's box. Details narrower than a cube are missed; memory grows with its third power
        (32: 25 MB).
    """

    h: Callable[[npt.NDArray[np.float64]], npt.ArrayLike]
    cells: int = 32


Size: TypeAlias = Union[
    Box, Sphere, Cylinder, InRegion, NearLabel, Field, Function, str, "os.PathLike[str]", Callable[..., Any]
]
"""A shape, a field, a callable, an expression in x, y and z as text, or the path of a ``.sol`` file."""


def bad_size(message: str, where: str) -> TetdbError:
    return TetdbError("bad-size", message, where, "a size is a number above zero, or text such as '2%'")


def length(value: Any, where: str) -> tuple[float, bool]:
    """A number, and whether it is in percent of the diagonal."""
    percent = isinstance(value, str) and value.strip().endswith("%")
    if isinstance(value, (bool, bytes)) or value is None:
        raise bad_size(f"{value!r} is no length", where)
    try:
        number = float(value.strip().rstrip("%") if isinstance(value, str) else value)
    except (TypeError, ValueError):
        raise bad_size(f"{value!r} is no length", where) from None
    if not (number > 0 and np.isfinite(number)):
        raise bad_size(f"{value!r} is no length above zero", where)
    return number, percent


def numbers(value: Any, count: int, where: str, code: str = "bad-size") -> list[float]:
    try:
        array = np.asarray(value, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        raise TetdbError(code, f"{value!r} are no numbers", where) from None
    if array.size != count or not np.isfinite(array).all():
        raise TetdbError(code, f"{value!r}: expected {count} finite numbers", where)
    return [float(x) for x in array]


def _shape(size: Any, where: str) -> tuple[str, list[float], tuple[float, bool], tuple[float, bool] | None]:
    if isinstance(size, Box):
        kind, all_ = "box", [*numbers(size.low, 3, where), *numbers(size.high, 3, where)]
    elif isinstance(size, Sphere):
        kind, all_ = "sphere", [*numbers(size.center, 3, where), *numbers(size.radius, 1, where)]
    else:
        ends = [*numbers(size.a, 3, where), *numbers(size.b, 3, where)]
        kind, all_ = "cylinder", [*ends, *numbers(size.radius, 1, where)]
    outside = None if size.outside is None else length(size.outside, where)
    return kind, all_, length(size.h, where), outside


def _field(field: Field, where: str) -> tuple[Any, Any, Any]:
    try:
        points = np.ascontiguousarray(field.points, dtype=np.float64)
        tets = np.asarray(field.tets)
        lengths = np.ascontiguousarray(field.lengths, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise bad_size(f"a field is not made of arrays of numbers: {error}", where) from None
    if points.ndim != 2 or points.shape[1:] != (3,) or tets.ndim != 2 or tets.shape[1:] != (4,):
        raise bad_size(f"points {points.shape}, tets {tets.shape}: expected (n, 3), (m, 4)", where)
    if tets.dtype.kind not in "iu" or (tets.size and (tets.min() < 0 or tets.max() >= len(points))):
        raise TetdbError("index-out-of-range", "tetrahedra name points that are not there", where)
    if lengths.shape != (len(points),):
        raise TetdbError("count-mismatch", f"lengths {lengths.shape} for {len(points)} points", where)
    return points, np.ascontiguousarray(tets, dtype=np.uint32), lengths


def ask(h: Callable[..., Any], points: npt.NDArray[np.float64], where: str) -> npt.NDArray[np.float64]:
    """Lengths at points, in batches; what is no length is refused with its point."""
    out = np.empty(len(points))
    for first in range(0, len(points), _BATCH):
        some = points[first : first + _BATCH]
        try:
            found = np.asarray(h(some), dtype=np.float64)
            out[first : first + len(some)] = np.broadcast_to(found, (len(some),))
        except (TypeError, ValueError) as error:
            raise bad_size(f"the callable gives no lengths for points {some.shape}: {error}", where) from error
    bad = np.flatnonzero(~(np.isfinite(out) & (out > 0)))
    if bad.size:
        at = points[bad[0]]
        raise bad_size(f"the callable gives {out[bad[0]]}, no length above zero", f"{where} at {at.tolist()}")
    return out


def grid(function: Function, bounds: Sequence[Sequence[float]], where: str) -> Field:
    """The callable's values on cubes around the surface, each cube in six tetrahedra."""
    low, high = np.asarray(bounds[0]), np.asarray(bounds[1])
    if not isinstance(function.cells, (int, np.integer)) or not 1 <= function.cells <= 512:
        raise bad_size(f"{function.cells!r} cells: expected 1 to 512", where)
    width = float((high - low).max()) / function.cells
    n = np.maximum(np.ceil((high - low) / width * (1 - 1e-12)), 1).astype(int)
    axes = [low[k] + width * np.arange(n[k] + 1) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    strides = np.array([(n[1] + 1) * (n[2] + 1), n[2] + 1, 1])
    cells = [np.arange(n[k]) for k in range(3)]
    first = (np.stack(np.meshgrid(*cells, indexing="ij"), axis=-1).reshape(-1, 3) @ strides)[:, None]
    tets = [
        first + np.array([0, strides[i], strides[i] + strides[j], strides.sum()])
        for i in range(3)
        for j in range(3)
        if i != j
    ]
    return Field(points, np.concatenate(tets), ask(function.h, points, where))


def words(
    bounds: Sequence[Sequence[float]] | None,
    hsiz: Length | None,
    hmin: Length | None,
    hmax: Length | None,
    hgrad: float | None,
    size: Size | Iterable[Size] | None,
) -> dict[str, Any]:
    """Sizes as the native half takes them."""
    out: dict[str, Any] = {"shapes": [], "regions": [], "labels": [], "expression": None, "file": None, "field": None}
    for name, value in (("hsiz", hsiz), ("hmin", hmin), ("hmax", hmax)):
        out[name] = None if value is None else length(value, name)
    out["hgrad"] = None if hgrad is None else numbers(hgrad, 1, "hgrad")[0]
    every: list[Any] = []
    if size is not None:
        every = list(size) if isinstance(size, (list, tuple)) else [size]

    def only(key: str, value: Any, where: str) -> None:
        if out[key] is not None or (key in ("file", "field") and (out["file"] or out["field"])):
            raise bad_size("there can be one expression, and one field, file or callable", where)
        out[key] = value

    for i, one in enumerate(every):
        where = f"size[{i}]" if isinstance(size, (list, tuple)) else "size"
        if isinstance(one, (Box, Sphere, Cylinder)):
            out["shapes"].append(_shape(one, where))
        elif isinstance(one, InRegion):
            out["regions"].append((str(one.region), length(one.h, where)))
        elif isinstance(one, NearLabel):
            distance = None if one.distance is None else length(one.distance, where)
            out["labels"].append((str(one.label), length(one.h, where), distance))
        elif isinstance(one, Field):
            only("field", _field(one, where), where)
        elif isinstance(one, os.PathLike):
            only("file", os.fspath(one), where)
        elif isinstance(one, str):
            only("expression", one, where)
        elif isinstance(one, Function) or callable(one):
            if bounds is None:
                raise bad_size("a callable cannot be used here", where)
            function = one if isinstance(one, Function) else Function(one)
            only("field", _field(grid(function, bounds, where), where), where)
        else:
            raise bad_size(f"{type(one).__name__} is no size", where)
    return out
