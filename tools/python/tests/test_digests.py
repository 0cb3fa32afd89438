"""The mesh is the program's, bit for bit, whoever asks for it and with however many threads."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tetdb

CASES: list[tuple[str, list[str], dict[str, Any]]] = [
    ("box,h=0.3", [], {}),
    ("box,h=0.2", ["--hsiz", "7.3%"], {"hsiz": "7.3%"}),
    ("box,h=0.3", ["--hsiz", "0.1", "--hgrad", "1.5"], {"hsiz": 0.1, "hgrad": 1.5}),
    ("balls,count=3", ["--regions", "all"], {"regions": "all"}),
    ("balls,count=2", ["--optimize", "none"], {"optimize": "none"}),
    ("shells,count=2,h=0.3", ["--regions", "all", "--size-region", "2,0.15"],
     {"regions": "all", "size": tetdb.InRegion(2, 0.15)}),
    ("knot,h=0.2", ["--size-sphere", "2,0,0,0.5,0.1"], {"size": tetdb.Sphere((2, 0, 0), 0.5, 0.1)}),
    ("knot,h=0.3", ["--size-box", "-1,-1,-1,1,1,1,0.1,20%"],
     {"size": [tetdb.Box((-1, -1, -1), (1, 1, 1), 0.1, "20%")]}),
    ("box,h=0.3", ["--size-expr", "0.06+0.3*abs(z)"], {"size": "0.06+0.3*abs(z)"}),
    ("box,h=0.07", ["--subdomains", "2", "--hsiz", "0.045"], {"subdomains": 2, "hsiz": 0.045}),
    ("balls,count=3", ["--region-seed=0.01,0.01,0.01,rock"], {"seeds": {"rock": (0.01, 0.01, 0.01)}}),
    ("balls,count=3", ["--regions", "all", "--hole", "0.01,0.01,0.01"], {"regions": "all", "holes": [(0.01, 0.01, 0.01)]}),
    ("box,h=0.5", ["--hsiz", "0.1", "--refine-surface"], {"hsiz": 0.1, "refine_surface": True}),
    ("sphere,h=0.3", ["--hmax", "20%", "--optimize", "delaunay"], {"hmax": "20%", "optimize": "delaunay"}),
]  # fmt: skip


@pytest.mark.parametrize(("spec", "words", "options"), CASES, ids=[f"{c[0]} {' '.join(c[1])}" for c in CASES])
def test_digests_are_those_of_the_program(
    spec: str, words: list[str], options: dict[str, Any], run: Callable[..., str], tmp_path: Path
) -> None:
    run("sample", spec, "-o", "surface.off")
    run("mesh", "surface.off", "-o", "program", "--threads", "1", *words)
    wanted = run("digest", "program").split()[0]
    surface = tetdb.Surface.read(tmp_path / "surface.off")
    arrays = tetdb.Surface(surface.points, surface.triangles, surface.labels)
    with tetdb.mesh(surface, tmp_path / "one", threads=1, **options) as one:
        assert one.digest == wanted
    with tetdb.mesh(arrays, tmp_path / "two", threads=2, memory="128MiB", **options) as two:
        assert two.digest == wanted
    # What one wrote is the same job for the other: nothing is meshed again.
    assert tetdb.mesh(surface, tmp_path / "program", **options).digest == wanted


def test_sheets_are_those_of_the_program(run: Callable[..., str], tmp_path: Path) -> None:
    run("sample", "faults,cells=6", "-o", "faults.obj")
    run("mesh", "faults.obj", "--embed", "faults_sheets.obj", "-o", "program", "--name", "faults_sheets.obj=cut")
    wanted = run("digest", "program").split()[0]
    sheet = tetdb.Surface(tmp_path / "faults_sheets.obj")
    with tetdb.mesh(tmp_path / "faults.obj", tmp_path / "s", embed={"cut": sheet}) as store:
        assert store.digest == wanted and any(label.startswith("cut") for label in store.labels)
    both = pickle.loads(pickle.dumps(tetdb.Surface(tmp_path / "faults.obj").embedded(sheet, "cut")))
    assert tetdb.mesh(both, tmp_path / "again").digest == wanted
    with pytest.raises(tetdb.TetdbError):
        both.refined(0.1)


def test_edges_and_points_are_those_of_the_program(run: Callable[..., str], tmp_path: Path) -> None:
    run("sample", "wells,count=4,points=5,cells=6", "-o", "w.obj")
    words = "mesh w.obj --embed w_sheets.obj --embed-edges w_wires.obj --embed-points w_wires.obj -o program"
    run(*words.split(), "--subdomains", "2")
    wanted = run("digest", "program").split()[0]
    wires = tmp_path / "w_wires.obj"
    layers = {"layers": tmp_path / "w_sheets.obj"}
    lines = [line.split(maxsplit=1) for line in wires.read_text().splitlines()]
    points = np.array([rest.split() for word, rest in lines if word == "v"], dtype=float)
    edges, marks, group = [], [], ""
    for word, rest in lines:
        group = rest if word == "g" else group
        if word == "l":
            edges.append((group, [int(v) - 1 for v in rest.split()]))
        if word == "p":
            marks.append(int(rest) - 1)
    arrays = points, [ends for _, ends in edges], [name for name, _ in edges]
    for name, inside in {"files": (wires, wires), "arrays": (arrays, points[marks])}.items():
        options = {"embed": layers, "embed_edges": {"in": inside[0]}, "embed_points": {"at": inside[1]}}
        with tetdb.mesh(tmp_path / "w.obj", tmp_path / name, subdomains=2, **options) as store:
            assert store.digest == wanted and {"in:well-1", "at"} <= set(store.labels)
            store.verify()
    whole = tetdb.Surface(tmp_path / "w.obj").embedded(tmp_path / "w_sheets.obj", "layers")
    whole = whole.embedded_edges(arrays, "in").embedded_points((points[marks], [f"s{i}" for i in range(5)]), "at")
    with tetdb.mesh(pickle.loads(pickle.dumps(whole)), tmp_path / "again", subdomains=2) as store:
        assert store.digest == wanted and "at:s4" in store.labels
    run("verify", "arrays", "--full")


def test_points_on_triangles_are_put_in_where_the_surface_is_refined(run: Callable[..., str], tmp_path: Path) -> None:
    box, on_top = tetdb.sample("box,h=0.5"), [[0.3, 0.4, 1.0], [0.5, 0.25, 1.0], [0.2, 0.3, 0.6]]
    edges = {"rod": (on_top, [[0, 2]])}
    options: dict[str, Any] = {"embed_edges": edges, "embed_points": {"sensors": on_top}, "hsiz": 0.3}
    with pytest.raises(tetdb.TetdbError, match="meet where they should not"):
        tetdb.mesh(box, tmp_path / "refused", **options)
    with tetdb.mesh(box, tmp_path / "s", refine_surface=True, **options) as store:
        store.verify()
        assert store.merged().points.tolist().count([0.3, 0.4, 1.0]) == 1
    run("verify", "s", "--full")
    near: dict[str, Any] = {"sensors": [[0.3, 0.4, 1.0 - 1e-13]]}
    with tetdb.mesh(box, tmp_path / "moved", snap_embedded="1%", embed_points=near, hsiz=0.3) as store:
        assert [0.3, 0.4, 1.0] in store.merged().points.tolist()
    outside: dict[str, Any] = {"sensors": [[0.3, 0.4, 0.5], [9.0, 0.4, 0.5]]}
    with pytest.raises(tetdb.TetdbError, match="nothing is filled"):
        tetdb.mesh(box, tmp_path / "out", embed_points=outside, hsiz=0.3)
    with tetdb.mesh(box, tmp_path / "in", embed_outside="skip", embed_points=outside, hsiz=0.3) as store:
        assert "sensors" in store.labels
    with tetdb.mesh(box, tmp_path / "near_label", size=tetdb.NearLabel("z-high", 0.1, "5%")) as store:
        assert store.n_tets > 1500
    with pytest.raises(tetdb.TetdbError, match="e-1[34] from it"):
        tetdb.mesh(box, tmp_path / "near", refine_surface=True, embed_points=near, hsiz=0.3)
