"""Exceptions: one class for each thing a caller may want to do about it."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = [
    "InvalidMesh",
    "NoRoom",
    "OutOfMemory",
    "StoreBusy",
    "StoreDamaged",
    "SurfaceError",
    "TetdbError",
]


class TetdbError(Exception):
    """Something was not done, and nothing of it is left but a store that can be resumed.

    Attributes
    ----------
    code : str
        The word for it, one of the table of error codes in the guide.
    message : str
        What happened.
    where : str or None
        A file with its line, ids, coordinates, or the name of an argument.
    help : str or None
        What to do about it.
    """

    def __init__(
        self, code: str, message: str, where: str | None = None, help: str | None = None
    ) -> None:
        super().__init__(code, message, where, help)
        self.code = code
        self.message = message
        self.where = where
        self.help = help

    def __str__(self) -> str:
        at = f" (at {self.where})" if self.where else ""
        return f"{self.code}: {self.message}{at}" + (f"; {self.help}" if self.help else "")


class SurfaceError(TetdbError):
    """A surface that cannot be read or meshed; `where` names the triangle, the point or the line."""


class StoreBusy(TetdbError):
    """Another process or handle writes the store, or changed it while it was read: ask again."""


class StoreDamaged(TetdbError):
    """The store is not what was written; what is damaged can be meshed again."""


class OutOfMemory(TetdbError):
    """The memory cap is too small for this work; nothing was begun."""


class NoRoom(TetdbError):
    """The disk has no room for the mesh."""


class InvalidMesh(TetdbError):
    """Verification found the mesh invalid."""


_CLASSES: dict[str, type[TetdbError]] = {
    "busy": StoreBusy,
    "store-changed": StoreBusy,
    "damaged": StoreDamaged,
    "memory": OutOfMemory,
    "no-room": NoRoom,
    "disk-full": NoRoom,
    "invalid-mesh": InvalidMesh,
} | dict.fromkeys(
    (
        "bad-sample",
        "unreadable-file",
        "unknown-format",
        "truncated-file",
        "unexpected-text",
        "not-a-number",
        "index-out-of-range",
        "count-mismatch",
        "coordinate-range",
        "unsupported-content",
        "surface-too-large",
        "empty-surface",
        "degenerate-triangle",
        "duplicate-triangle",
        "open-surface",
        "self-intersection",
        "unrecovered-triangles",
        "nothing-filled",
        "contradicting-orientation",
        "surface-changed",
        "bad-field",
        "not-periodic",
        "bad-mesh",
        "bad-seed",
        "sheet-outside",
        "wire-outside",
        "degenerate-edge",
        "duplicate-wire",
        "wire-contact",
        "wire-too-near",
    ),
    SurfaceError,
)


_HELP = {
    "memory": "give a larger `memory`",
    "no-tasks": "`tetdb.plan` and `tetdb.gather` say which can be done now",
    "store-exists": "`existing=\"replace\"` replaces it",
    "store-unfinished": "`tetdb.resume` finishes it",
}
"""Which argument or call helps, where the library does not say more."""


def of_code(
    code: str, message: str, where: str | None = None, help: str | None = None
) -> TetdbError:
    return _CLASSES.get(code, TetdbError)(code, message, where, help or _HELP.get(code))


def needed(package: str) -> Any:
    """A package that only some calls need. Raises ImportError with what to install."""
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as error:
        raise ImportError(f"this needs the package {package}: pip install {package}", name=package) from error
