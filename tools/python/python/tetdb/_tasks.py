"""A mesh by tasks that Dask, Parsl, Ray or a batch scheduler starts, each in a process of its own."""

from __future__ import annotations

import os
from typing import Any

from . import _native, _options
from ._mesh import _create, _path

__all__ = ["begin", "gather", "plan", "run_task"]


def begin(surface: Any, path: str | os.PathLike[str], **options: Any) -> None:
    """The coarse mesh alone, in a new store: what :func:`plan` divides among tasks.

    Parameters
    ----------
    surface, path
        As of :func:`mesh`.
    **options
        As of :func:`mesh`. Ask for about four `subdomains` for each task that runs at once.
    """
    _create(surface, path, True, **options)


def plan(
    path: str | os.PathLike[str],
    n: int,
    *,
    memory: int | str | None = None,
    threads: int | None = None,
) -> list[int]:
    """Plans for about `n` tasks at once; the numbers of those that can be done now.

    Tasks of one list need nothing of each other. When all are done, :func:`gather` has the next list. The mesh does not depend on `n`.

    Examples
    --------
    >>> import tetdb, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tetdb.begin(tetdb.sample("box,h=0.5"), folder + "/box.tetdb", hsiz="20%")
    ...     stage = tetdb.plan(folder + "/box.tetdb", 2)
    ...     while stage:
    ...         done = [tetdb.run_task(folder + "/box.tetdb", k) for k in stage]
    ...         stage = tetdb.gather(folder + "/box.tetdb")
    ...     all(done), tetdb.resume(folder + "/box.tetdb").is_verified
    (True, True)
    """
    n = _options.count(n, 1, "n")
    return _native.plan(_path(path), n, _how(None, None), _options.settings(memory, threads))


def run_task(
    path: str | os.PathLike[str],
    k: int,
    *,
    memory: int | str | None = None,
    threads: int | None = None,
    scratch: str | os.PathLike[str] | None = None,
    wait: float | None = None,
) -> bool:
    """Does task `k`, on any machine that sees the store's folder; False when it had been done before.

    It may be called again, also twice at once: :func:`gather` counts what was done once. The store is not opened, so any number of
    tasks run at once.

    Parameters
    ----------
    path : path
        Folder of the store.
    k : int
        One of the numbers of :func:`plan` or :func:`gather`.
    memory, threads : optional
        Of this task; see :func:`mesh`.
    scratch : path, optional
        A folder of this machine, to write in before files are copied to the store. Default: the store's own.
    wait : float, optional
        Seconds a file that is expected may be late. Default: 60.

    Raises
    ------
    TetdbError
        With code ``no-tasks`` while the task's turn has not come; those of a run, with the name of this machine.
    """
    k = _options.count(k, 0, "k")
    return _native.run_task(_path(path), k, _how(scratch, wait), _options.settings(memory, threads))


def gather(
    path: str | os.PathLike[str],
    *,
    memory: int | str | None = None,
    threads: int | None = None,
    wait: float | None = None,
) -> list[int]:
    """Commits what tasks have done; the tasks that can be done now, none when the mesh is finished.

    :func:`resume` then verifies and opens it.

    Raises
    ------
    TetdbError
        With code ``tasks-left`` when some have to be done again; the message has their numbers.
    """
    left = _native.gather(_path(path), _how(None, wait), _options.settings(memory, threads))
    return left or []


def _how(scratch: Any, wait: Any) -> dict[str, Any]:
    if wait is not None and (isinstance(wait, bool) or not isinstance(wait, (int, float)) or not 0 <= wait <= 1e6):
        raise _options.usage(f"{wait!r} is no number of seconds", "wait")
    return {"scratch": None if scratch is None else _path(scratch), "wait": None if wait is None else float(wait)}
