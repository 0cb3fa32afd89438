"""What the tests share: the program they compare with, and small stores."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import tetdb

RUNS = int(os.environ.get("TETDB_RUNS", "20"))
"""Cancelled runs; many more than in the checks may be asked for."""

SPEC = "balls,count=2,h=0.07"
OPTIONS: dict[str, Any] = {"regions": "all", "hsiz": 0.048, "subdomains": 2}
"""A cube with two filled balls: about the least that is divided into two sub-domains."""


@pytest.fixture(autouse=True)
def interruptible() -> None:
    # A process in the background of a shell ignores Ctrl-C, and after Gmsh's first call it ends the process.
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def program() -> str:
    """The program `tetdb`, by TETDB_PROGRAM or PATH."""
    found = os.environ.get("TETDB_PROGRAM") or shutil.which("tetdb")
    assert found, "TETDB_PROGRAM names no program"
    return found


@pytest.fixture
def run(program: str, tmp_path: Path) -> Callable[..., str]:
    def call(*words: str) -> str:
        done = subprocess.run([program, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    return call


@pytest.fixture(scope="session")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tetdb.Store]:
    """The mesh of `SPEC` with `OPTIONS`, which tests read and do not change."""
    path = tmp_path_factory.mktemp("parts") / "parts.tetdb"
    with tetdb.mesh(tetdb.sample(SPEC), path, threads=2, **OPTIONS) as store:
        assert len(store.subdomains) == 2
        yield store
