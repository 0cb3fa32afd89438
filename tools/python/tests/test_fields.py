"""Fields: arrays in, the same arrays out."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import tetdb


@pytest.fixture
def st(tmp_path: Path) -> tetdb.Store:
    return tetdb.mesh(tetdb.sample("box,h=0.2"), tmp_path / "a.tetdb", hsiz=0.1)


def test_arrays_come_back(st: tetdb.Store) -> None:
    part = st.subdomain(0)
    x = np.asarray(part.points[:, 0])
    st.fields["T"] = 300 + x
    st.fields["u"] = np.asarray(part.points, dtype="f4")
    marks = np.arange(st.n_tets, dtype="i8")
    st.fields["mark"] = marks
    assert list(st.fields) == ["T", "u", "mark"]
    field = st.fields["T"]
    assert (field.at, field.dtype, field.components) == ("vertices", np.dtype("f8"), 1)
    assert np.array_equal(field.array(), 300 + x)
    assert np.array_equal(st.fields["u"].array(), part.points.astype("f4"))
    assert np.array_equal(np.concatenate(list(st.fields["mark"].chunks())), marks)
    # By id, in any order; and by an expression.
    order = np.random.default_rng(1).permutation(st.n_tets)
    st.fields.add("shuffled", marks[order], ids=order)
    assert st.fields["shuffled"].digest == st.fields["mark"].digest
    st.fields.add("e", "300 + x")
    assert st.fields["e"].digest == field.digest
    hits = st.query("T > 300.9 and mark >= 0")
    assert len(hits) and (hits["centroid"][:, 0] > 0.9).all()


def test_pictures_are_colored_by_fields(st: tetdb.Store, tmp_path: Path) -> None:
    st.fields["T"] = lambda points: 300 + points[:, 0]
    st.fields["u"] = lambda points: points
    assert st.fields.columns == ["T", "u.x", "u.y", "u.z"]
    pictures = []
    for color in ("T", "u.x", "u.z"):
        st.snapshot(tmp_path / "a.png", color=color, pixels=(80, 60), plane=((0.5, 0.5, 0.5), (0, 1, 0)))
        pictures.append((tmp_path / "a.png").read_bytes())
    assert pictures[0] != pictures[2] and pictures[1] != pictures[2]
    with pytest.raises(tetdb.TetdbError, match="u.x"):
        st.snapshot(tmp_path / "b.png", color="u")
    assert not (tmp_path / "b.png").exists()


def test_callables_give_values_chunk_by_chunk(parts: tetdb.Store, tmp_path: Path) -> None:
    shutil.copytree(parts.path, tmp_path / "a.tetdb")
    with tetdb.open(tmp_path / "a.tetdb") as st:
        calls = []

        def linear(points: np.ndarray) -> np.ndarray:
            assert not points.flags.writeable
            calls.append(len(points))
            return 300 + points[:, 0]

        st.fields["T"] = linear
        assert sum(calls) == sum(part.n_points for part in st.subdomains)
        assert calls == [len(chunk) for chunk in st.fields["T"].chunks()]
        st.fields.add("E", "300 + x")
        assert st.fields["T"].digest == st.fields["E"].digest
        st.fields["u"] = lambda points: points.astype("f4") @ np.diag([1, 2, 3]).astype("f4")
        assert (st.fields["u"].components, st.fields["u"].dtype) == (3, np.dtype("f4"))
        st.fields.add("q", lambda chunk: chunk.quality, at="tets")
        assert np.array_equal(st.fields["q"].array(1), st.subdomain(1).quality)
        st.fields.add("number", lambda chunk: chunk.ids, at="tets")
        st.fields.add("v", lambda chunk: chunk.vertex_ids[chunk.tets[:, :3]], at="tets")
        part = st.subdomain(1)
        assert np.array_equal(st.fields["number"].array(1), part.ids)
        assert np.array_equal(st.fields["v"].array(1), part.vertex_ids[part.tets[:, :3]])
        assert sum(st.fields["number"].array() >> 29) == st.subdomains[1].n_tets


def test_what_a_callable_raises_is_raised(st: tetdb.Store) -> None:
    class Own(Exception):
        pass

    error = Own("no")

    def raising(_: object) -> np.ndarray:
        raise error

    for at in ("vertices", "tets"):
        with pytest.raises(Own) as raised:
            st.fields.add("T", raising, at=at)
        assert raised.value is error and raised.traceback[-1].name == "raising"
    for values in [lambda p: 1.0, lambda p: p[1:, 0], lambda p: p[:, :2], lambda p: ["a"] * len(p)]:
        with pytest.raises(tetdb.TetdbError) as bad:
            st.fields["T"] = values
        assert bad.value.code == "bad-field"
    with pytest.raises(tetdb.TetdbError):
        st.fields.add("T", lambda p: p[:, 0], ids=np.arange(3))
    # The session is not free before the field is added.
    asking = [lambda p: st.query("x > 2"), lambda p: st.close(), lambda p: st.fields.add("V", "x"), lambda p: st.undo()]
    for values in asking:
        with pytest.raises(tetdb.StoreBusy):
            st.fields["T"] = values
    assert not st.fields and st.verify().ok
    st.fields["T"] = lambda points: points[:, 0]
    with pytest.raises(tetdb.TetdbError) as bad:
        st.fields["T"] = raising
    assert bad.value.code == "bad-field"


def test_dropping_and_refusing(st: tetdb.Store) -> None:
    st.fields["T"] = np.zeros(st.n_tets)
    with pytest.raises(tetdb.TetdbError) as refused:
        st.fields["T"] = np.zeros(st.n_tets)
    assert refused.value.code == "bad-field"
    with pytest.raises(tetdb.TetdbError):
        st.fields["U"] = np.zeros(3)
    del st.fields["T"]
    assert not st.fields and "T" not in st.fields
    with pytest.raises(KeyError):
        st.fields["T"]


def test_going_to_another_mesh(st: tetdb.Store, tmp_path: Path) -> None:
    other = tetdb.mesh(tetdb.sample("box,h=0.2"), tmp_path / "other.tetdb", hsiz=0.15)
    st.fields.add("T", "300 + x - 2*y")
    st.fields.add("heat", "1 + x*y", at="tets")
    linear, overlap = other.transfer(st)
    assert (linear["method"], overlap["method"], linear["from_outside"]) == ("linear", "overlap", 0)
    before, after = overlap["integrals"]
    assert np.allclose(before, after, rtol=1e-12)
    x, y, _ = other.subdomain(0).points.T
    assert np.allclose(other.fields["T"].array(), 300 + x - 2 * y, rtol=1e-12)
    with pytest.raises(tetdb.TetdbError) as refused:
        other.transfer(st, "T")
    assert refused.value.code == "bad-field"
    with pytest.raises(tetdb.TetdbError):
        other.transfer(st, ["T"], method="cubic")
    digest = other.fields["T"].digest
    other.resaturate(0, scale=0.8)
    assert other.fields["T"].digest != digest
    other.undo()
    assert other.fields["T"].digest == digest


def test_meshes_adapt_to_fields(tmp_path: Path) -> None:
    with tetdb.mesh(tetdb.sample("box,h=0.08"), tmp_path / "box.tetdb") as st:
        st.fields.add("u", "exp(-x/0.2)")
        n = st.n_tets
        plan = st.adapt("u", factor=2.0, estimate="jump", dry_run=True)
        assert plan["subdomains"][0]["is_changed"] and st.n_tets == n
        plan = st.adapt("u", tets=2 * n, hmin=0.01)
        assert 0.8 < st.n_tets / plan["wanted_tets"] < 1.2
        for bad in ({"tets": 0}, {"factor": -1.0}, {"estimate": "guess"}, {"tets": 5, "factor": 2.0}):
            with pytest.raises(tetdb.TetdbError):
                st.adapt("u", **bad)
        with pytest.raises(tetdb.TetdbError):
            st.adapt("nothing", factor=1.0)


def test_versions_are_read_and_fields_come_from_them(tmp_path: Path) -> None:
    path = tmp_path / "box.tetdb"
    with tetdb.mesh(tetdb.sample("box,h=0.2"), path) as st:
        st.fields.add("u", "x")
        assert st.save_version("first", "with u") == []
        del st.fields["u"]
        st.fields.add("v", "y")
        before = st.n_tets
        st.resaturate(0, scale=0.7)
        assert st.diff_versions("first")["subdomains"][0]["tets"] == [before, st.n_tets]
        assert [version["name"] for version in st.versions()] == ["first"]
        with tetdb.open(path, version="first") as old:
            assert (old.n_tets, list(old.fields)) == (before, ["u"])
            assert not old.diff_versions("first")["same"]
            with pytest.raises(tetdb.TetdbError):
                old.fields.add("w", "z")
            with tetdb.mesh(tetdb.sample("box,h=0.25"), tmp_path / "other.tetdb") as other:
                other.transfer(old)
                assert list(other.fields) == ["u"]
        st.restore_version("first")
        assert (st.n_tets, list(st.fields)) == (before, ["u"])
        st.drop_version("first")
        assert st.versions() == []
