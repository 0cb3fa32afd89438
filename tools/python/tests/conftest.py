"""What the tests share: the program they compare with, and small stores."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import tetdb

RUNS = int(os.environ.get("TETDB_RUNS", "20"))
"""Cancelled runs; many more than in the checks may be asked for."""


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


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tetdb.Store]:
    """A cube with two filled balls in two sub-domains."""
    path = tmp_path_factory.mktemp("parts") / "parts.tetdb"
    surface = tetdb.sample("balls,count=2,h=0.06")
    with tetdb.mesh(surface, path, regions="all", subdomains=2, hsiz=0.035, threads=2) as store:
        assert len(store.subdomains) == 2
        yield store
