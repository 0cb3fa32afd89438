"""What cannot be meshed or asked is refused by the right class with a place, and leaves nothing."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tetdb

BOX = tetdb.sample("box,h=0.5")
POINTS, TRIANGLES = BOX.points, BOX.triangles


def bad_surfaces(chance: random.Random) -> list[Callable[[], Any]]:
    """Arrays that make no closed surface, each spoiled in one place."""

    def arrays(points: Any = POINTS, triangles: Any = TRIANGLES, labels: Any = None) -> Callable[[], Any]:
        return lambda: (points, triangles, labels)

    made = []
    for _ in range(85):
        p, t = chance.randrange(len(POINTS)), chance.randrange(len(TRIANGLES))
        for value in (np.nan, np.inf, -np.inf):
            points = POINTS.copy()
            points[p, chance.randrange(3)] = value
            made.append(arrays(points))
        for index in (-1, len(POINTS), 2**31 - 1, -(2**31)):
            triangles = TRIANGLES.astype(np.int64)
            triangles[t, chance.randrange(3)] = index
            made.append(arrays(triangles=triangles))
        made.append(arrays(triangles=np.delete(TRIANGLES, t, axis=0)))
        triangles = TRIANGLES.copy()
        triangles[t, 1] = triangles[t, 0]
        made.append(arrays(triangles=triangles))
        made.append(arrays(triangles=np.concatenate([TRIANGLES, TRIANGLES[t : t + 1]])))
        corner = POINTS[TRIANGLES[t]].mean(axis=0)
        spike = np.concatenate([POINTS, [corner, corner + 0.1, corner - 0.1]])
        fin = np.concatenate([TRIANGLES, [[len(POINTS), len(POINTS) + 1, len(POINTS) + 2]]])
        made.append(arrays(spike, fin))
        made.append(arrays(labels=["a"] * chance.randrange(len(TRIANGLES))))
    wrong = [POINTS[:, :2], POINTS.ravel(), POINTS[None], POINTS.astype(complex), POINTS.astype(str), "no", None, 3, [[1, 2, 3], [4, 5]]]
    made += [arrays(points) for points in wrong]
    wrong = [TRIANGLES[:, :2], TRIANGLES.ravel(), TRIANGLES.astype(float), TRIANGLES.astype(str), [], "no", 3, [[0, 1], [2]]]
    made += [arrays(triangles=triangles) for triangles in wrong]
    made.append(arrays(triangles=np.empty((0, 3), np.int32)))
    return made


def test_bad_surfaces_are_refused_with_a_place(tmp_path: Path) -> None:
    makers = bad_surfaces(random.Random(1))
    assert len(makers) > 1000
    for maker in makers:
        points, triangles, labels = maker()
        with pytest.raises(tetdb.SurfaceError) as caught:
            tetdb.mesh(tetdb.Surface(points, triangles, labels), tmp_path / "s", threads=1)
        assert caught.value.where and caught.value.code, caught.value
        assert os.listdir(tmp_path) == []


OPTIONS: list[dict[str, Any]] = [
    *({key: value} for key in ("hsiz", "hmin", "hmax") for value in (0, -1, np.nan, np.inf, "", "x", "1%%x", "-2%", "0%", b"1", True, [], {}, object())),
    *({"hgrad": value} for value in ("x", np.nan, np.inf, [], object(), [1, 2], 0.5, 1.0, -3)),
    *({"regions": value} for value in ("odd", "", 1, "ALL")),
    *({"optimize": value} for value in ("much", "", 1, None)),
    *({"existing": value} for value in ("drop", "", 1, None)),
    *({"subdomains": value} for value in (0, -1, 1.5, "2", True, 2**40)),
    *({"threads": value} for value in (0, -1, 1.5, "2", True, 2**40)),
    *({"memory": value} for value in ("8", "GiB", "8 GX", "-1GiB", -1, 1.5, True, "", [], "1KiB", 0, "63MiB")),
    *({"seeds": value} for value in ([0, 0, 0], [[0, 0]], [[0, 0, np.nan]], "abc", {"a": "x"}, {"a": (9, 9, 9)}, [[9, 9, 9]], 3)),
    *({"holes": value} for value in ([0, 0, 0], [[0, 0]], [[0, 0, np.inf]], "abc", {"a": (0, 0, 0)}, [[9, 9, 9]], [[0.5, 0.5, 0.5]])),
    *({"embed": value} for value in ([BOX], BOX, {"": BOX}, {3: BOX}, {"a": "missing.stl"}, {"a": (0, 0, 0)}, {"a": BOX})),
    *({"embed_edges": value} for value in ([BOX], {"": "a.obj"}, {"a": "missing.obj"}, {"a": BOX}, {"a": ([[0.1, 0.1, 0.1]], [[0, 1]])}, {"a": ([[0.1, 0.1]], [[0, 0]])},
                                           {"a": ([[0.1, 0.1, 0.1], [0.2, 0.2, 0.2]], [[0, 1]], ["x", "y"])}, {"a": ([[0.1, 0.1, np.nan], [0.2, 0.2, 0.2]], [[0, 1]])})),
    *({"embed_points": value} for value in ([BOX], {"": [[0.1, 0.1, 0.1]]}, {"a": "missing.csv"}, {"a": BOX}, {"a": [[0.1, 0.1]]}, {"a": [[9, 9, 9]]}, {"a": ([[0.1, 0.1, 0.1]], ["x", "y"])})),
    *({"progress": value} for value in (1, "yes", [])),
    *({"size": value} for value in (
        3.0, object(), "x +", "1 < 2", "-1", "q", "0*x", b"x", {"h": 1}, Path("missing.sol"), Path("x.txt"),
        tetdb.Box((0, 0), (1, 1, 1), 0.1), tetdb.Box((0, 0, 0), (1, 1, np.nan), 0.1), tetdb.Box((0, 0, 0), (1, 1, 1), 0),
        tetdb.Box((0, 0, 0), (1, 1, 1), 0.1, -1), tetdb.Sphere((0, 0, 0), -1, 0.1), tetdb.Sphere((0, 0, 0), np.nan, 0.1),
        tetdb.Sphere("abc", 1, 0.1), tetdb.Cylinder((0, 0, 0), (0, 0), 1, 0.1), tetdb.InRegion("nowhere", 0.1),
        tetdb.InRegion(1, "x"), tetdb.InRegion(99, 0.1), [tetdb.InRegion(1, 0.1), 7], ["x", "y"],
        lambda p: np.zeros(len(p)), lambda p: np.full(len(p), np.nan), lambda p: p, lambda p: "x", lambda p: np.ones(3),
        lambda p: None, tetdb.Function(lambda p: np.ones(len(p)), 0), tetdb.Function(lambda p: np.ones(len(p)), "x"),
        tetdb.Field(POINTS, TRIANGLES, np.ones(len(POINTS))), tetdb.Field(POINTS, [[0, 1, 2, 999]], np.ones(len(POINTS))),
        tetdb.Field(POINTS, [[0, 1, 2, 2]], np.ones(len(POINTS))), tetdb.Field(POINTS[:4], [[0, 1, 2, 3]], [1, 1, 0, 1]),
        tetdb.Field(np.eye(4, 3), [[0, 1, 2, 3]], [1, 1, 1]), tetdb.Field("x", "y", "z"),
        tetdb.Field(np.eye(4, 3) * np.nan, [[0, 1, 2, 3]], [1, 1, 1, 1]),
    )),
]  # fmt: skip


@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: str(o)[:60])
def test_bad_options_are_refused_by_name(options: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(tetdb.TetdbError) as caught:
        tetdb.mesh(BOX, tmp_path / "s", **{"threads": 1, **options})
    assert caught.value.where or caught.value.help, caught.value
    assert os.listdir(tmp_path) == []
    assert isinstance(caught.value, tetdb.OutOfMemory) == (options.get("memory") in ("1KiB", 0, "63MiB"))


def test_bad_paths_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("something")
    for path in ("", "a\0b", 3, None, file, file / "below", "/proc/nowhere"):
        with pytest.raises(tetdb.TetdbError) as caught:
            tetdb.mesh(BOX, path)  # type: ignore[arg-type]
        assert caught.value.where or caught.value.help
    for path in (tmp_path / "missing", file, tmp_path):
        for call in (tetdb.open, tetdb.resume):
            with pytest.raises(tetdb.TetdbError):
                call(path)
    for surface in (tmp_path / "missing.stl", file, [file, "x.stl"], [], {}, 3, object()):
        with pytest.raises(tetdb.SurfaceError):
            tetdb.mesh(surface, tmp_path / "s")
    for spec in ("", "cube", "box,h=-1", "box,h", 7):
        with pytest.raises(tetdb.SurfaceError):
            tetdb.sample(spec)  # type: ignore[arg-type]
    assert file.read_text() == "something" and os.listdir(tmp_path) == ["file"]


def test_bad_questions_are_refused(parts: tetdb.Store, tmp_path: Path) -> None:
    questions: list[dict[str, Any]] = [
        *({"where": text} for text in ("quality >", "quality", "nothing > 1", "1", 7, "quality > 'a'", "((")),
        *({"order_by": text} for text in ("nothing", "", 3)),
        *({"box": box} for box in ((0, 0, 0), "abc", [[0, 0, 0], [1, 1, np.nan]], 3)),
        *({"sphere": one} for one in (3, ((0, 0, 0),), ((0, 0), 1), ((0, 0, 0), "x"))),
        *({"plane": one} for one in (3, ((0, 0, 0),), ((0, 0, 0), (0, 0)))),
        *({"limit": one} for one in (-1, 1.5, "x")),
        *({"subdomains": one} for one in ([-1], "x", [99], [1.5], 1.5)),
        *({"labels": one} for one in (["nobody"], [-1], [1.5])),
    ]
    for question in questions:
        with pytest.raises(tetdb.TetdbError) as caught:
            parts.query(**question)
        assert caught.value.where or caught.value.help, question
    for points in ("x", [[0, 0]], [[0, 0, np.nan]], 3, None):
        with pytest.raises(tetdb.TetdbError):
            parts.locate(points)  # type: ignore[arg-type]
    for rank in (-1, 2, 1.5, "0", None, True):
        with pytest.raises(tetdb.TetdbError):
            parts.subdomain(rank)  # type: ignore[arg-type]
    for n in (0, -1, 1.5, "x"):
        with pytest.raises(tetdb.TetdbError):
            parts.chunks(n)  # type: ignore[arg-type]
    wrong: list[dict[str, Any]] = [{"order": 3}, {"order": "2"}, {"ghosts": True}, {"regions": [99]}, {"subdomains": "x"}, {"content": "all"}, {"ascii": True}]
    for options in wrong:
        with pytest.raises(tetdb.TetdbError):
            parts.export(tmp_path / "s.vtu", **options)
    for name in ("s.xyz", "s", "."):
        with pytest.raises(tetdb.TetdbError):
            parts.export(tmp_path / name)
        with pytest.raises(tetdb.TetdbError):
            parts.snapshot(tmp_path / name)
    before = parts.digest
    wrong = [
        {"sizes": [1.0]}, {"sizes": "x"}, {"sizes": lambda p: -np.ones(len(p))}, {"scale": 0}, {"scale": -1}, {"scale": np.nan},
        {"hsiz": "x"}, {"size": 3}, {"size": lambda p: p}, {"size": tetdb.Field(np.eye(4, 3), [[0, 1, 2, 3]], np.ones(4))},
    ]  # fmt: skip
    for options in wrong:
        with pytest.raises(tetdb.TetdbError):
            parts.resaturate([0], **options)
    with pytest.raises(tetdb.TetdbError):
        parts.resaturate([7], scale=0.9)
    assert parts.digest == before and parts.verify().ok and os.listdir(tmp_path) == []


def test_damage_and_other_writers_have_classes_of_their_own(tmp_path: Path) -> None:
    store = tetdb.mesh(BOX, tmp_path / "s")
    digest = store.digest
    store.close()
    reader = tetdb.open(tmp_path / "s")
    reader.query(limit=1)
    store.resaturate([0], scale=0.9)
    assert reader.query(limit=1).size
    store.undo()
    reader.close()
    store.close()
    busy: list[bool] = []

    def listener(event: tetdb.Event) -> None:
        if event.kind == "store":
            with pytest.raises(tetdb.StoreBusy):
                tetdb.resume(tmp_path / "t")
            busy.append(True)

    tetdb.mesh(tetdb.sample("balls,count=2"), tmp_path / "t", hsiz="2%", progress=listener)
    assert busy
    [file] = (tmp_path / "s").glob("subdomain-00000-*")
    content = bytearray(file.read_bytes())
    content[len(content) // 3 : len(content) // 2] = bytes(len(content) // 2 - len(content) // 3)
    file.write_bytes(content)
    with pytest.raises(tetdb.StoreDamaged):
        sum(len(chunk.tets) for chunk in store.chunks())
    store.close()
    store.repair()
    assert store.digest == digest and store.verify().ok
    with pytest.raises(tetdb.TetdbError, match="store-exists"):
        tetdb.mesh(BOX, tmp_path / "s", hsiz=0.2)
    assert tetdb.mesh(BOX, tmp_path / "s", hsiz=0.2, existing="replace").digest != digest
