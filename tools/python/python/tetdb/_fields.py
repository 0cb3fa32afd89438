"""Fields of a store: values at vertices or tetrahedra, as arrays."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator, MutableMapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._errors import TetdbError

if TYPE_CHECKING:
    from ._store import Store

__all__ = ["Fields", "StoreField"]

_TYPES = {"f4": "f4", "f8": "f8", "i1": "i4", "i2": "i4", "i4": "i4", "i8": "i8", "u1": "i4", "u2": "i4", "u4": "i8"}
"""The type of a field that holds numbers of a type."""


class StoreField:
    """A field of a store, of :attr:`Store.fields`.

    Attributes
    ----------
    name : str
        Its name.
    at : str
        `vertices` or `tets`.
    dtype : numpy.dtype
        Type of its numbers.
    components : int
        Numbers of a value: 1, 3, 6 or 9.
    """

    def __init__(self, store: Store, said: dict[str, Any]) -> None:
        self._store = store
        self.name = str(said["name"])
        self.at = str(said["at"])
        self.dtype = np.dtype(said["type"].replace("f32", "f4").replace("f64", "f8").replace("i32", "i4").replace("i64", "i8"))
        self.components = int(said["components"])
        self.ranges: list[dict[str, Any]] = said["ranges"]
        self.bytes = int(said["bytes"])
        self.digest = str(said["digest"])

    def __repr__(self) -> str:
        return f"<tetdb.StoreField {self.name!r}: {self.components} x {self.dtype} at {self.at}>"

    def chunks(self, subdomain: int | None = None) -> Iterator[npt.NDArray[Any]]:
        """The values of each chunk of vertices or tetrahedra, by sub-domain, in the order of the sub-domains' arrays."""
        ranks = range(len(self._store.subdomains)) if subdomain is None else [subdomain]
        for rank in ranks:
            part = self._store._native.field(self.name, rank)
            for chunk in range(part.n_chunks):
                values = part.chunk(chunk)
                yield values if self.components == 1 else values.reshape(-1, self.components)

    def array(self, subdomain: int | None = None) -> npt.NDArray[Any]:
        """All values; a vertex that several sub-domains share is in each of them."""
        return np.concatenate(list(self.chunks(subdomain)))


class Fields(MutableMapping[str, Any]):
    """The fields of a store by name. `fields["T"] = array` or `fields["T"] = callable` adds one, `del fields["T"]` drops it."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def _said(self) -> list[dict[str, Any]]:
        return list(json.loads(self._store._native.fields()))

    @property
    def columns(self) -> list[str]:
        """What conditions and pictures call the fields: by name, or by component, such as ``u.x``."""
        return [str(column) for field in self._said() for column in field["columns"]]

    def __iter__(self) -> Iterator[str]:
        return iter([field["name"] for field in self._said()])

    def __len__(self) -> int:
        return len(self._said())

    def __getitem__(self, name: str) -> StoreField:
        for said in self._said():
            if said["name"] == name:
                return StoreField(self._store, said)
        raise KeyError(name)

    def __setitem__(self, name: str, values: npt.ArrayLike | Callable[[Any], npt.ArrayLike]) -> None:
        self.add(name, values)

    def __delitem__(self, name: str) -> None:
        if name not in self:
            raise KeyError(name)
        self._store._native.drop_field(name)

    def add(
        self,
        name: str,
        values: npt.ArrayLike | str | Callable[[Any], npt.ArrayLike],
        *,
        at: str | None = None,
        ids: npt.ArrayLike | None = None,
    ) -> None:
        """Adds a field.

        Parameters
        ----------
        name : str
            Its name.
        values : array, str or callable
            A row for each value, of 1, 3, 6 or 9 numbers, in the order of an export or as `ids` say; an expression such as
            ``"300 + 20*x"``; or a callable that is called once for each chunk and returns such rows. At vertices it takes their points
            (n, 3), at tetrahedra a :class:`Chunk`. Memory is that of a chunk. The type is that of the first answer. What the callable raises
            is raised here, and no field is added.
        at : str, optional
            `vertices` or `tets`; left out, an array with as many rows as there are tetrahedra is at these, all else at vertices.
        ids : array of int, optional
            Lasting ids of the vertices or tetrahedra, one for each row.
        """
        native = self._store._native
        if isinstance(values, str):
            native.add_field(name, at or "vertices", values, False, None)
            return
        if at not in (None, "vertices", "tets"):
            raise TetdbError("bad-field", f"at={at!r}: expected 'vertices' or 'tets'", None, None)
        if callable(values):
            if ids is not None:
                raise TetdbError("bad-field", "ids belong to an array; a callable gives the values of a chunk in its order", "ids")
            native.fill_field(name, at or "vertices", _at_tets(values) if at == "tets" else _at_vertices(values))
            return
        array = np.ascontiguousarray(values)
        place = at or ("tets" if len(array) == self._store.n_tets else "vertices")
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "values.npy")
            np.save(file, array)
            names = None
            if ids is not None:
                names = os.path.join(folder, "ids.npy")
                np.save(names, np.ascontiguousarray(ids, dtype="<i8"))
            native.add_field(name, place, file, True, names)


def _at_vertices(values: Callable[[Any], npt.ArrayLike]) -> Callable[..., npt.NDArray[Any]]:
    """`values` as the native half calls it, with points."""

    def answer(points: npt.NDArray[np.float64]) -> npt.NDArray[Any]:
        points.flags.writeable = False
        return _numbers(values(points), len(points))

    return answer


def _at_tets(values: Callable[[Any], npt.ArrayLike]) -> Callable[..., npt.NDArray[Any]]:
    """`values` as the native half calls it, with a block of tetrahedra."""
    from ._store import chunk_of

    def answer(rank: int, first: int, block: Any) -> npt.NDArray[Any]:
        chunk = chunk_of(rank, first, block)
        return _numbers(values(chunk), len(chunk.tets))

    return answer


def _numbers(found: npt.ArrayLike, n: int) -> npt.NDArray[Any]:
    """What a callable returns for `n` places, number by number, in a type that fields have."""
    array = np.asarray(found)
    kind = _TYPES.get(array.dtype.str[1:])
    if kind is None:
        raise TetdbError("bad-field", f"the callable returns {array.dtype}: expected float32, float64 or integers of up to 8 bytes")
    if not array.ndim or len(array) != n:
        raise TetdbError("bad-field", f"the callable returns an array of shape {array.shape}: expected {n} rows")
    return np.ascontiguousarray(array, dtype=kind).reshape(-1)
