"""A mesh by tasks is that of one process, whoever starts them."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest
from conftest import OPTIONS, SPEC

import tetdb

ROOT = Path(os.environ.get("TETDB_ROOT", Path(__file__).parents[3]))


def test_tasks_in_processes_of_their_own_give_the_same_mesh(tmp_path: Path, parts: tetdb.Store) -> None:
    path = tmp_path / "s"
    tetdb.begin(tetdb.sample(SPEC), path, **OPTIONS)
    with pytest.raises(tetdb.TetdbError, match="store-unfinished"):
        tetdb.open(path)
    first = stage = tetdb.plan(path, 2)
    assert stage and tetdb.plan(path, 2) == stage
    with pytest.raises(tetdb.TetdbError, match="no-tasks"):
        tetdb.run_task(path, stage[-1] + 1, wait=0.1)
    n = 0
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        while stage:
            n += len(stage)
            # Each twice, also at once: what is gathered counts once.
            assert any(pool.map(tetdb.run_task, [path] * 2 * len(stage), stage * 2))
            assert not tetdb.run_task(path, stage[0], threads=1, memory="128MiB", scratch=tmp_path, wait=1)
            stage = tetdb.gather(path)
    assert n > len(first)
    with tetdb.resume(path) as store:
        assert store.digest == parts.digest and store.is_verified
    with pytest.raises(tetdb.TetdbError, match="no-tasks"):
        tetdb.plan(path, 2)


def test_a_task_that_was_not_done_is_named(tmp_path: Path) -> None:
    tetdb.begin(tetdb.sample(SPEC), tmp_path / "s", **OPTIONS)
    (first,) = tetdb.plan(tmp_path / "s", 2)
    tetdb.run_task(tmp_path / "s", first)
    stage = tetdb.gather(tmp_path / "s")
    tetdb.run_task(tmp_path / "s", stage[0])
    with pytest.raises(tetdb.TetdbError, match=f"tasks-left.* {stage[1]}") as caught:
        tetdb.gather(tmp_path / "s", wait=0.1)
    assert caught.value.where and caught.value.help
    # One process goes on with what tasks have done.
    assert tetdb.resume(tmp_path / "s").is_verified


@pytest.mark.parametrize("words", [{"n": 0}, {"n": 1001}, {"n": "2"}, {"n": 1, "threads": 0}, {"n": 1, "memory": "x"}])
def test_bad_plans_are_refused(words: dict[str, object], tmp_path: Path) -> None:
    tetdb.begin(tetdb.sample("box,h=0.5"), tmp_path / "s")
    with pytest.raises(tetdb.TetdbError) as caught:
        tetdb.plan(tmp_path / "s", **words)  # type: ignore[arg-type]
    assert caught.value.where or caught.value.help
    for how in ({"wait": -1}, {"wait": "x"}, {"wait": float("nan")}, {"scratch": 3}):
        with pytest.raises(tetdb.TetdbError):
            tetdb.run_task(tmp_path / "s", 0, **how)  # type: ignore[arg-type]


@pytest.mark.parametrize("package", ["dask", "parsl"])
def test_schedulers_of_others_run_tasks(package: str, tmp_path: Path) -> None:
    pytest.importorskip("distributed" if package == "dask" else package)
    words = [sys.executable, str(ROOT / f"tools/python/examples/with_{package}.py"), str(tmp_path)]
    # Parsl starts its programs by name, as in an environment that is active.
    env = {**os.environ, "PATH": os.pathsep.join([os.path.dirname(sys.executable), os.environ["PATH"]])}
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=300, env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "in 2 sub-domains" in done.stdout
