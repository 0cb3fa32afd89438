"""Options as the native half takes them."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _sizes
from ._errors import TetdbError
from ._sizes import Length, Size

__all__ = ["Event"]

_UNITS = {
    "K": 2**10, "KiB": 2**10, "M": 2**20, "MiB": 2**20, "G": 2**30, "GiB": 2**30, "T": 2**40, "TiB": 2**40,
    "kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12,
}  # fmt: skip


@dataclass(frozen=True)
class Event:
    """What a run says while it works.

    Attributes
    ----------
    kind : str
        ``"progress"``, ``"note"``, ``"warning"``, or ``"store"``: from now on there is a store at the path `text`.
    text : str
        Of progress the stage, one or two words; otherwise the sentence or the path.
    done, total, unit
        Of progress: work done, work in all where that is known, what they count.
    """

    kind: str
    text: str
    done: int = 0
    total: int | None = None
    unit: str = ""


Progress = Callable[[Event], object]


def _printer() -> Callable[..., object]:
    seen: list[tuple[str, int]] = []

    def show(kind: str, text: str, done: int, total: int | None, unit: str) -> None:
        if kind != "progress":
            print(f"tetdb: {text}", flush=True)
            return
        part = text, (10 * done // total if total else 0)
        if [part] != seen:
            seen[:] = [part]
            print(f"tetdb: {text} {done}{f' of {total}' if total else ''} {unit}", flush=True)

    return show


def listener(progress: bool | Progress | None) -> Callable[..., object] | None:
    if progress is None or progress is False:
        return None
    if progress is True:
        return _printer()
    if not callable(progress):
        raise usage(f"{progress!r} is neither True nor a callable", "progress")
    return lambda *words: progress(Event(*words))


def usage(message: str, where: str) -> TetdbError:
    return TetdbError("usage", message, where)


def one_of(value: Any, words: tuple[str, ...], where: str) -> str:
    if not isinstance(value, str) or value not in words:
        raise usage(f"{value!r}: expected one of {', '.join(words)}", where)
    return value


def count(value: Any, least: int, where: str) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        raise usage(f"{value!r} is no whole number", where) from None
    if isinstance(value, bool) or not least <= number < 2**31:
        raise usage(f"{value!r}: expected a whole number from {least}", where)
    return number


def settings(
    memory: int | str | None, threads: int | None, version: str | None = None
) -> dict[str, Any]:
    if threads is not None:
        threads = count(threads, 1, "threads")
    cap = None if memory is None else size_of_memory(memory)
    return {"memory": cap, "threads": threads, "version": version}


def size_of_memory(memory: Any) -> int:
    """Bytes of ``8 * 2**30``, ``"8GiB"`` or ``"2GB"``."""
    if isinstance(memory, str):
        found = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*([a-zA-Z]+)\s*", memory)
        if found and found[2] in _UNITS:
            return int(float(found[1]) * _UNITS[found[2]])
    else:
        try:
            if (number := operator.index(memory)) >= 0 and not isinstance(memory, bool):
                return number
        except TypeError:
            pass
    raise TetdbError("bad-memory", f"{memory!r} is not a memory size", "memory", "give bytes, or text such as '8GiB'")


def ranks(value: Any, where: str) -> list[int]:
    every = [value] if isinstance(value, int) else value
    try:
        return [count(one, 0, where) for one in every]
    except TypeError:
        raise usage(f"{value!r} is no list of sub-domains", where) from None


Seeds = Mapping[str, Sequence[float]] | npt.ArrayLike


def job(
    bounds: Sequence[Sequence[float]],
    hsiz: Length | None = None,
    hmin: Length | None = None,
    hmax: Length | None = None,
    hgrad: float | None = None,
    size: Size | Iterable[Size] | None = None,
    regions: str | None = None,
    seeds: Seeds | None = None,
    holes: npt.ArrayLike | None = None,
    refine_surface: bool = False,
    embed_outside: str = "error",
    optimize: str = "full",
    subdomains: int | None = None,
    keep_coarse: bool = True,
) -> dict[str, Any]:
    """What shapes a mesh, in the words of the native half."""
    rules = ("parity", "all", "outer", "by-orientation", "seeds", "all-but-holes")
    names: list[str | None]
    if isinstance(seeds, Mapping):
        names, inside = [str(name) for name in seeds], _points(list(seeds.values()), "seeds")
    else:
        inside = _points(seeds, "seeds")
        names = [None] * len(inside)
    empty = _points(holes, "holes")
    if regions is None and (inside or empty):
        regions = "seeds"
    return {
        "sizes": _sizes.words(bounds, hsiz, hmin, hmax, hgrad, size),
        "regions": None if regions is None else one_of(regions, rules, "regions"),
        "seeds": list(zip(inside, names)),
        "holes": empty,
        "refine_surface": bool(refine_surface),
        "skips_outside": one_of(embed_outside, ("error", "skip"), "embed_outside") == "skip",
        "optimize": one_of(optimize, ("none", "delaunay", "full"), "optimize"),
        "subdomains": None if subdomains is None else count(subdomains, 1, "subdomains"),
        "keep_coarse": bool(keep_coarse),
    }


def _points(value: Any, where: str) -> list[list[float]]:
    """Finite points (k, 3), or none."""
    try:
        points = np.asarray([] if value is None else value, dtype=np.float64)
    except (TypeError, ValueError):
        points = np.full(1, np.nan)
    if points.size and (points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all()):
        raise usage(f"{value!r}: expected points (k, 3)", where)
    return [] if not points.size else [[float(x) for x in point] for point in points]
