"""Runs that are interrupted go on to the same mesh; runs beside each other do not disturb each other."""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import pytest
from conftest import OPTIONS, RUNS, SPEC

import tetdb


def test_runs_cancelled_at_any_time_end_soon_and_go_on_to_the_same_mesh(tmp_path: Path, parts: tetdb.Store) -> None:
    surface = tetdb.sample(SPEC)
    begun = time.monotonic()
    tetdb.mesh(surface, tmp_path / "whole", threads=2, **OPTIONS)
    usual = time.monotonic() - begun
    chance = random.Random(7)
    resumed = 0
    for k in range(RUNS):
        path, after = tmp_path / f"{k}", chance.uniform(0, usual)
        timer = threading.Timer(after, signal.raise_signal, [signal.SIGINT])
        timer.start()
        try:
            store = tetdb.mesh(surface, path, threads=1 + k % 2, **OPTIONS)
        except KeyboardInterrupt:
            if path.exists():
                resumed += 1
                store = tetdb.resume(path, threads=1 + k // 2 % 2)
            else:
                store = tetdb.mesh(surface, path, **OPTIONS)
        finally:
            timer.cancel()
            timer.join()
        assert store.digest == parts.digest, (k, after)
    print(f"{RUNS} runs, {resumed} resumed, {usual:.2f} s each")
    assert resumed >= RUNS // 4


SCRIPT = """
import signal, sys, tetdb
signal.signal(signal.SIGINT, signal.default_int_handler)
def say(event):
    if event.kind == "store":
        print("begun", flush=True)
try:
    tetdb.mesh(tetdb.sample("balls,count=5,h=0.04"), sys.argv[1], hsiz=0.02, progress=say)
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(3)
"""


def test_control_c_ends_a_run_and_leaves_a_store(tmp_path: Path) -> None:
    path = tmp_path / "s"
    child = subprocess.Popen([sys.executable, "-c", SCRIPT, str(path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "begun\n"
    child.send_signal(signal.SIGINT)
    assert child.stdout.read() == "interrupted\n" and child.wait() == 3
    with pytest.raises(tetdb.TetdbError, match="store-unfinished"):
        tetdb.open(path)


def test_an_exception_of_the_listener_ends_the_run(tmp_path: Path) -> None:
    class Enough(Exception):
        pass

    def listener(event: tetdb.Event) -> None:
        assert threading.current_thread() is threading.main_thread()
        if event.kind == "store":
            raise Enough

    surface = tetdb.sample(SPEC)
    with pytest.raises(Enough):
        tetdb.mesh(surface, tmp_path / "s", progress=listener, **OPTIONS)
    events: list[tetdb.Event] = []
    assert tetdb.resume(tmp_path / "s", progress=events.append).is_verified
    assert {"progress", "note", "store"} >= {event.kind for event in events} and events


def small(path: str) -> str:
    with tetdb.mesh(tetdb.sample("balls,count=1"), path, threads=1, memory="64MiB") as store:
        return store.digest


def test_twenty_threads_mesh_at_once(tmp_path: Path) -> None:
    with ThreadPoolExecutor(20) as pool:
        digests = list(pool.map(small, [str(tmp_path / f"{k}") for k in range(20)]))
    assert len(set(digests)) == 1


def digest_of(store: tetdb.Store) -> tuple[str, int]:
    return store.digest, len(store.query("quality > 1.5"))


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_processes_mesh_and_open_handles_again(method: str, tmp_path: Path, parts: tetdb.Store) -> None:
    wanted = digest_of(parts)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context(method)) as pool:
        assert len(set(pool.map(small, [str(tmp_path / f"{k}") for k in range(4)]))) == 1
        assert list(pool.map(digest_of, [parts] * 4)) == [wanted] * 4


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_child_may_use_its_parents_handle(parts: tetdb.Store) -> None:
    wanted = digest_of(parts)
    child = os.fork()
    if child == 0:
        os._exit(0 if digest_of(parts) == wanted else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert digest_of(parts) == wanted


def test_threads_may_share_a_handle(parts: tetdb.Store) -> None:
    wanted = len(parts.query("quality > 1.5"))

    def work(k: int) -> bool:
        part = parts.subdomain(k % 2)
        return len(parts.query("quality > 1.5")) == wanted and len(part.tets) == len(part.quality)

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(24)))
