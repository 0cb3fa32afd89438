"""Examples of the guide and of docstrings run; types hold; the adaptive loop lowers its error."""

from __future__ import annotations

import doctest
import importlib
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tetdb

ROOT = Path(os.environ.get("TETDB_ROOT", Path(__file__).parents[3]))
EXAMPLES = ROOT / "tools/python/examples"


def test_blocks_of_the_guide_run_one_after_the_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (ROOT / "src/guide/python.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    assert len(blocks) > 8
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, block, "exec"), names)


def test_examples_of_docstrings_run() -> None:
    modules = [tetdb, *(importlib.import_module(m.name) for m in pkgutil.iter_modules(tetdb.__path__, "tetdb.") if m.name != "tetdb._native")]
    results = [doctest.testmod(module, optionflags=doctest.ELLIPSIS) for module in modules]
    assert sum(r.attempted for r in results) > 10 and sum(r.failed for r in results) == 0


def test_everything_public_is_documented() -> None:
    for name in tetdb.__all__:
        if name != "__version__":
            assert getattr(tetdb, name).__doc__, name


def test_types_hold_in_package_and_examples() -> None:
    pytest.importorskip("mypy")
    words = [sys.executable, "-m", "mypy", "--strict", "-p", "tetdb"]
    words += [word for example in EXAMPLES.glob("*.py") for word in ("-m", example.stem)]
    env = {**os.environ, "MYPYPATH": str(EXAMPLES)}
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=Path(__file__).parent, env=env)
    assert done.returncode == 0 and "no issues found" in done.stdout, done.stdout


def test_the_adaptive_loop_lowers_its_error(tmp_path: Path) -> None:
    pytest.importorskip("scipy")
    done = subprocess.run([sys.executable, str(EXAMPLES / "poisson.py"), str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
