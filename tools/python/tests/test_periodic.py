"""Periodic pairs: the vertices of one label, moved, are those of the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tetdb


def test_pairs_of_a_box(tmp_path: Path) -> None:
    st = tetdb.mesh(tetdb.sample("box,h=0.25"), tmp_path / "a.tetdb")
    digest = st.digest
    assert st.periodic == []
    st.add_periodic("x-low", "x-high")
    st.add_periodic("y-low", "y-high", kind="translate")
    assert st.digest == digest
    along_x, along_y = st.periodic
    part = st.subdomain(0)
    place = {number: part.points[i] for i, number in enumerate(np.ravel(part.vertex_ids))}
    for pair, motion in ((along_x, [1, 0, 0]), (along_y, [0, 1, 0])):
        assert pair["pairs"].shape == (pair["vertices"], 2) and pair["vertices"] > 20
        for one, other in pair["pairs"]:
            assert np.allclose(place[one] + motion, place[other], atol=1e-12)
    assert (along_x["first"], along_x["second"]) == ("x-low", "x-high")
    assert np.allclose(along_x["map"], np.eye(3, 4) + [[0, 0, 0, 1], [0] * 4, [0] * 4])


def test_what_is_no_pair_is_refused(tmp_path: Path) -> None:
    st = tetdb.mesh(tetdb.sample("box,h=0.25"), tmp_path / "a.tetdb")
    with pytest.raises(tetdb.SurfaceError, match="x-low"):
        st.add_periodic("x-low", "y-low", kind="translate")
    with pytest.raises(tetdb.TetdbError, match="no motion"):
        st.add_periodic("x-low", "x-high", kind="shear")
    assert st.periodic == []
