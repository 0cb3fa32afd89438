"""What is read from a store fits together, and cannot be changed."""

from __future__ import annotations

import gc
import pickle
from pathlib import Path

import numpy as np
import pytest
from conftest import OPTIONS, SPEC

import tetdb
from tetdb._errors import of_code


def volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6


def test_subdomains_fill_the_regions(parts: tetdb.Store) -> None:
    total = 0
    for row in parts.subdomains:
        part = parts.subdomain(row.rank)
        assert part.points.shape == (row.n_points, 3) and part.points.dtype == np.float64
        assert part.tets.shape == (row.n_tets, 4) and part.tets.dtype == np.int32
        assert part.ids.dtype == np.int64 and len(part.vertex_ids) == row.n_points
        volume = volumes(part.points, part.tets)
        assert (volume > 0).all() and np.isclose(volume.sum(), row.volume)
        assert part.quality.max() == pytest.approx(row.worst)
        assert (part.lengths > 0).any()
        total += row.n_tets
        for region in parts.regions:
            assert (part.regions == region.region).any() or not region.filled or region.tets < total
    assert total == parts.n_tets == sum(r.tets for r in parts.regions) == sum(parts.quality().bins)


def test_interfaces_are_alike_on_both_sides(parts: tetdb.Store) -> None:
    sides = []
    for rank in (0, 1):
        part = parts.subdomain(rank)
        faces = part.interfaces
        assert len(faces) == part.info.interface_faces > 0 and (faces["other"] == 1 - rank).all()
        key = np.lexsort((faces["index"], faces["cut"]))
        sides.append(np.sort(part.vertex_ids[faces["vertices"][key]], axis=1))
        in_tet = (part.tets[faces["tet"]][:, :, None] == faces["vertices"][:, None, :]).any(axis=1)
        assert in_tet.all()
    assert (sides[0] == sides[1]).all()


def test_facets_are_the_input_triangles(parts: tetdb.Store) -> None:
    surface = tetdb.sample(SPEC)
    seen = np.zeros(surface.n_triangles, bool)
    for rank in (0, 1):
        part = parts.subdomain(rank)
        facets = part.facets
        seen[facets["triangle"]] = True
        given = surface.points[surface.triangles[facets["triangle"]]]
        assert (part.points[facets["vertices"]] == given).all()
        assert [parts.labels[i] for i in facets["label"][:20]] == list(surface.labels[facets["triangle"][:20]])
    assert seen.all()


@pytest.mark.parametrize("n", [1000, 20_000, 10**9])
def test_chunks_are_the_subdomains(parts: tetdb.Store, n: int) -> None:
    ids = []
    for chunk in parts.chunks(n):
        assert 0 < len(chunk.tets) <= n and not chunk.tets.flags.writeable
        assert chunk.tets.max() == len(chunk.points) - 1 and (np.unique(chunk.tets) == np.arange(len(chunk.points))).all()
        part = parts.subdomain(chunk.subdomain)
        at = slice(int(chunk.ids[0] - part.ids[0]), int(chunk.ids[-1] - part.ids[0]) + 1)
        assert (chunk.points[chunk.tets] == part.points[part.tets[at]]).all()
        assert (chunk.vertex_ids[chunk.tets] == part.vertex_ids[part.tets[at]]).all()
        assert (chunk.regions == part.regions[at]).all() and (chunk.quality == part.quality[at]).all()
        ids.append(chunk.ids)
    assert len(np.unique(np.concatenate(ids))) == parts.n_tets


def test_a_merged_mesh_conforms(parts: tetdb.Store) -> None:
    mesh = parts.merged()
    faces = np.sort(np.concatenate([np.delete(mesh.tets, k, axis=1) for k in range(4)]), axis=1)
    counts = np.unique(faces, axis=0, return_counts=True)[1]
    assert counts.max() == 2
    # The balls' triangles are inside, filled on both sides: the walls alone are the boundary.
    surface = tetdb.sample(SPEC)
    assert (counts == 1).sum() == (surface.labels == "walls").sum()
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)


def test_questions_are_answered_as_the_arrays_say(parts: tetdb.Store) -> None:
    quality = np.concatenate([parts.subdomain(r).quality for r in (0, 1)])
    found = parts.query("quality > 1.6")
    assert len(found) == (quality > 1.6).sum()
    worst = parts.query(order_by="quality", limit=5)
    assert np.allclose(worst["quality"], np.sort(quality)[::-1][:5], rtol=1e-6)
    best = parts.query(order_by="quality", descending=False, limit=1)
    assert best["quality"][0] == pytest.approx(quality.min())
    inside = parts.query(box=[(0.2, 0.2, 0.2), (0.5, 0.5, 0.5)], inside=True)
    assert len(inside) and (inside["corners"] >= 0.2).all() and (inside["corners"] <= 0.5).all()
    assert set(parts.query(regions=1)["region"]) == {1}
    assert set(parts.query(subdomains=[1])["subdomain"]) == {1}
    on = parts.query(labels=["balls"])
    assert 0 < len(on) < parts.n_tets
    assert len(parts.query("quality > 1000")) == 0
    assert (found["id"] >> 29 == found["subdomain"]).all()


def test_points_are_found_where_they_are(parts: tetdb.Store) -> None:
    chunk = next(parts.chunks(300))
    centers = chunk.points[chunk.tets].mean(axis=1)
    ids, shares = parts.locate(centers, barycentric=True)
    assert (ids == chunk.ids).all() and np.allclose(shares, 0.25)
    assert parts.locate([5.0, 5.0, 5.0]).tolist() == [-1]
    assert parts.locate(np.empty((0, 3))).shape == (0,)


def test_arrays_are_read_only_and_outlive_their_store(tmp_path: Path) -> None:
    store = tetdb.mesh(tetdb.sample("box,h=0.4"), tmp_path / "s")
    part = store.subdomain(0)
    every = [part.points, part.tets, part.regions, part.quality, part.ids, part.vertex_ids, part.interfaces]
    for array in every:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    copies = [array.copy() for array in every]
    store.close()
    del part, store
    gc.collect()
    assert all((a == b).all() for a, b in zip(every, copies))


def test_handles_and_surfaces_survive_pickling(parts: tetdb.Store) -> None:
    other = pickle.loads(pickle.dumps(parts))
    assert other.digest == parts.digest and tetdb.compare(other, parts).same
    surface = tetdb.sample("balls,count=2")
    again = pickle.loads(pickle.dumps(surface))
    assert (again.points == surface.points).all() and (again.labels == surface.labels).all()
    error = tetdb.SurfaceError("open-surface", "open", "triangle 0", "close it")
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize(
    "code", ["bad-seed", "sheet-outside", "wire-outside", "wire-contact", "wire-too-near", "degenerate-edge", "duplicate-wire"]
)
def test_codes_of_what_is_inside_a_surface_are_surface_errors(code: str) -> None:
    assert isinstance(of_code(code, "it was refused"), tetdb.SurfaceError)


def test_subdomains_are_meshed_again_and_brought_back(tmp_path: Path) -> None:
    with tetdb.mesh(tetdb.sample(SPEC), tmp_path / "s", **OPTIONS) as store:
        before, rows = store.digest, store.subdomains
        store.query(limit=1)
        store.resaturate([1], scale=0.8)
        assert store.subdomains[0].digest == rows[0].digest and store.subdomains[1].n_tets > rows[1].n_tets
        store.undo()
        assert store.digest == before
        lengths = np.full(rows[1].n_tets, 0.03)
        store.resaturate(1, sizes=lengths)
        by_array = store.digest
        store.undo()
        store.resaturate([1], sizes=lambda p: np.full(len(p), 0.03))
        assert store.digest == by_array != before
        store.undo()
        store.resaturate([0], size=tetdb.Sphere((0.2, 0.2, 0.2), 0.1, 0.02))
        assert store.verify().ok and store.subdomains[1].digest == rows[1].digest


def test_a_callable_is_a_field_of_recorded_numbers(tmp_path: Path) -> None:
    asked = []

    def h(points: np.ndarray) -> np.ndarray:
        asked.append(points)
        return 0.05 + 0.3 * points[:, 0]

    surface = tetdb.sample("box,h=0.3")
    first = tetdb.mesh(surface, tmp_path / "a", size=h, threads=1)
    assert sum(map(len, asked)) == 33**3
    second = tetdb.mesh(surface, tmp_path / "b", size=tetdb.Function(h), threads=2)
    assert first.digest == second.digest
    low, high = (np.concatenate([c.points for c in first.chunks()])[:, 0] < 0.5).mean(), 0.5
    assert low > high
    first.close()
    assert tetdb.resume(tmp_path / "a").digest == first.digest
    first.resaturate([0], scale=0.9)


def test_surfaces_are_checked_repaired_and_refined(tmp_path: Path) -> None:
    surface = tetdb.sample("box,h=0.5")
    report = surface.check()
    assert report.ok and report.volume == pytest.approx(1.0) and len(report.defects) == 0
    open_ = tetdb.Surface(surface.points, surface.triangles[1:])
    report = open_.check()
    assert not report.ok and set(report.defects.codes) == {"open-surface"} and report.n_open_edges == 3
    assert report.defects.triangles.shape == report.defects.places[:, :2].shape == (3, 2)
    corners = surface.points[surface.triangles[0]]
    assert np.allclose(sorted(map(tuple, report.defects.places)),
                       sorted(tuple((corners[i] + corners[j]) / 2) for i, j in ((0, 1), (1, 2), (2, 0))))
    twice = tetdb.Surface(surface.points, np.concatenate([surface.triangles, surface.triangles[:1]]))
    assert not twice.check().ok and twice.repaired().check().ok
    assert surface.refined(0.2).n_triangles > surface.n_triangles
    surface.write(tmp_path / "s.obj")
    assert tetdb.Surface(tmp_path / "s.obj").n_triangles == surface.n_triangles
    estimate = surface.estimate(hsiz="5%")
    assert estimate.tets > surface.estimate(hsiz="20%").tets and estimate.subdomains == 1


def test_holes_are_closed_and_crossings_resolved(tmp_path: Path) -> None:
    corners = np.array([[c & 1, c >> 1 & 1, c >> 2] for c in range(8)], dtype=float)
    walls = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    box = tetdb.Surface(corners, np.array([t for a, b, c, d in walls for t in ((a, b, c), (a, c, d))]))
    open_ = tetdb.Surface(box.points, box.triangles[2:])
    closed = open_.repaired("winding")
    (step,) = closed.repairs
    hole = step["winding"]["holes"][0]
    assert hole["label"] == "closed-hole-1" and hole["area"] == pytest.approx(1) and closed.check().ok
    assert (closed.labels == "closed-hole-1").sum() == 2 and closed.check().volume == pytest.approx(1)
    crossing = tetdb.Surface(np.concatenate([box.points, box.points + (0.5, 0.25, 0.375)]),
                             np.concatenate([box.triangles, box.triangles + len(box.points)]))
    resolved = crossing.repaired("resolve")
    assert resolved.repairs[0]["resolve"]["pairs"] > 0 and resolved.check().ok
    united = crossing.repaired("auto")
    assert [*united.repairs[-1]] == ["winding"] and united.check().volume == pytest.approx(2 - 0.5 * 0.75 * 0.625)
    with tetdb.mesh(united, tmp_path / "u", hsiz="30%") as store:
        assert store.verify().ok
    assert box.repaired("auto").repairs == [] == box.repairs
    with pytest.raises(tetdb.SurfaceError, match="goes around nothing"):
        tetdb.Surface(box.points, box.triangles[:2]).repaired("winding")
    for bad in (lambda: box.repaired("magic"), lambda: box.repaired("auto", weld=1e-6), lambda: box.repaired([1])):
        with pytest.raises(tetdb.TetdbError):
            bad()


def test_surfaces_are_wrapped_and_remeshed(tmp_path: Path) -> None:
    ball = tetdb.sample("sphere,radius=1,h=0.3")
    open_ = tetdb.Surface(ball.points, ball.triangles[4:])
    wrap = open_.wrapped(gap="20%", offset=0.05)
    (step,) = wrap.repairs
    assert wrap.check().ok and step["wrap"]["triangles"] == wrap.n_triangles
    assert (np.linalg.norm(wrap.points, axis=1) > 0.9).all() and step["wrap"]["distance_to_input_max"] < 0.5
    even = ball.remeshed("2%", hmax=0.5)
    (step,) = even.repairs
    assert even.check().ok and step["remesh"]["triangles"] == even.n_triangles
    assert step["remesh"]["distance_bound"] <= 0.02 * 2 * 3**0.5 * 1.001
    with tetdb.mesh(even, tmp_path / "even", hsiz="20%") as store:
        assert store.verify().ok
    for bad in (lambda: open_.remeshed(), lambda: ball.wrapped(gap=-1.0), lambda: ball.remeshed(tolerance="60%")):
        with pytest.raises(tetdb.TetdbError):
            bad()


def test_a_store_shows_itself(parts: tetdb.Store, tmp_path: Path) -> None:
    assert "data:image/png;base64," in parts._repr_html_()
    parts.snapshot(tmp_path / "s.svg", color="quality", plane=((0.5, 0.5, 0.5), (1, 0, 0)), crinkle=True)
    parts.snapshot(tmp_path / "s.png", kind="surface", seen_from=(1, 1, 1), pixels=(80, 60))
    parts.snapshot(tmp_path / "l.svg", kind="surface", color="label")
    parts.report(tmp_path / "r.html")
    assert all((tmp_path / name).stat().st_size > 500 for name in ("s.svg", "s.png", "l.svg", "r.html"))
    assert parts.verify(full=False).ok
