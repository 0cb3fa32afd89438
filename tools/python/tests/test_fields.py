"""Fields: arrays in, the same arrays out."""

from __future__ import annotations

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


def test_dropping_and_refusing(st: tetdb.Store) -> None:
    st.fields["T"] = np.zeros(st.n_tets)
    with pytest.raises(tetdb.TetdbError) as refused:
        st.fields["T"] = np.zeros(st.n_tets)
    assert refused.value.code == "bad-field"
    with pytest.raises(tetdb.TetdbError):
        st.fields["U"] = np.zeros(3)
    with pytest.raises(tetdb.TetdbError):
        st.resaturate(0, scale=0.8)
    del st.fields["T"]
    assert not st.fields and "T" not in st.fields
    with pytest.raises(KeyError):
        st.fields["T"]
