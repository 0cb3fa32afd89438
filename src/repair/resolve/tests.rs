use std::collections::BTreeMap;

use super::*;
use crate::tests::{Named, p, surface};
use tetdb_base::geom::mix;
use tetdb_base::surface::{ContactKind, closedness, validate};

/// A box from `low` to `high`, turned by `turn` about the axis (1, 2, 3).
fn block(name: &'static str, low: Point, high: Point, turn: f64) -> Vec<Named> {
    let rotation = glam::DQuat::from_axis_angle(p(1.0, 2.0, 3.0).normalize(), turn);
    let corner = |c: usize| {
        let at = |axis: usize| if c >> axis & 1 == 1 { high[axis] } else { low[axis] };
        let at = p(at(0), at(1), at(2));
        if turn == 0.0 { at } else { rotation * at }
    };
    let walls =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let cut = walls.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    cut.map(|t| (name, t.map(corner))).collect()
}

/// Area of all triangles in each group.
fn areas(surface: &Surface) -> BTreeMap<String, f64> {
    let mut areas = BTreeMap::new();
    for t in 0..surface.n_triangles() as u32 {
        let [a, b, c] = surface.corners(t);
        for &member in surface.label_members(&surface.labels[t as usize]) {
            let name = surface.label_names[member as usize].clone();
            *areas.entry(name).or_insert(0.0) += 0.5 * (b - a).cross(c - a).length();
        }
    }
    areas
}

/// Resolves a surface and checks what holds of every resolved one.
fn resolved(triangles: &[Named]) -> (Surface, Resolved) {
    let before = surface(triangles);
    let scratch = ScratchSpace::boundless();
    let pairs = pairs_that_touch(&before, &scratch).expect("few pairs");
    let mut after = before.clone();
    let done = resolve(&mut after, &scratch).expect("it settles");
    assert_eq!(done.pairs, pairs.len() as u64);
    assert_eq!(pairs_that_touch(&after, &scratch), Some(Vec::new()), "{done:?}");
    let (then, now) = (areas(&before), areas(&after));
    assert_eq!(then.keys().collect::<Vec<_>>(), now.keys().collect::<Vec<_>>());
    for (name, area) in &then {
        assert!((now[name] - area).abs() <= 1e-12 * area, "{name}: {area} and {}", now[name]);
    }
    // Triangles of no pair and without a divided edge are there as they were, in their order.
    let mut is_touched = vec![false; before.n_triangles()];
    pairs.iter().flat_map(|(pair, _)| pair).for_each(|&t| is_touched[t as usize] = true);
    let corners: Vec<[Point; 3]> =
        (0..after.n_triangles() as u32).map(|t| after.corners(t)).collect();
    let mut at = 0;
    for t in (0..before.n_triangles()).filter(|&t| !is_touched[t]) {
        let own = before.corners(t as u32);
        let is_neighbor = (0..before.n_triangles()).any(|o| {
            is_touched[o]
                && before.triangles[o].iter().filter(|v| before.triangles[t].contains(v)).count()
                    > 1
        });
        if !is_neighbor {
            at += corners[at..].iter().position(|c| *c == own).expect("it is kept") + 1;
        }
    }
    let diagonal = before.bounds().diagonal();
    assert!(done.moved_most <= 1e-14 * diagonal, "{done:?}");
    let mut again = after.clone();
    assert_eq!(resolve(&mut again, &scratch).map(|done| done.rounds), Ok(0));
    assert_eq!(again, after);
    (after, done)
}

#[test]
fn a_triangle_through_another_is_divided_with_it() {
    let flat = [p(0.0, 0.0, 0.0), p(4.0, 0.0, 0.0), p(0.0, 4.0, 0.0)];
    for (upright, n) in [
        // Through the inside, through an edge, a vertex on the face, a vertex on an edge, an edge on an edge.
        ([p(0.7, 0.7, -1.0), p(1.1, 0.9, -1.3), p(0.8, 0.9, 1.7)], 8),
        ([p(-1.0, 1.0, -1.0), p(1.0, 0.9, -1.3), p(0.8, 0.9, 1.7)], 8),
        ([p(1.0, 1.0, 0.0), p(1.0, 2.0, 1.0), p(2.0, 1.0, 1.0)], 4),
        ([p(2.0, 0.0, 0.0), p(1.0, -1.0, 1.0), p(3.0, -1.0, 1.0)], 3),
        ([p(2.0, -1.0, -1.0), p(2.0, 1.0, 1.0), p(2.0, -3.0, 3.0)], 4),
    ] {
        let (after, done) = resolved(&[("flat", flat), ("upright", upright)]);
        assert_eq!((after.n_triangles(), done.moved_most < 1e-15), (n, true), "{done:?}");
    }
}

#[test]
fn triangles_of_one_plane_share_their_overlap() {
    let t = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| [a, b, c].map(|[x, y]| p(x, y, x + 2.0 * y));
    let base = t([0.0, 0.0], [4.0, 0.0], [0.0, 4.0]);
    for other in [
        t([1.0, 1.0], [5.0, 1.5], [1.5, 5.0]),
        t([0.5, 0.5], [1.5, 0.75], [0.75, 1.5]),
        t([0.0, 0.0], [4.0, 0.0], [1.0, 5.0]),
        t([-1.0, -1.0], [3.0, 0.5], [0.5, 3.0]),
    ] {
        let (after, _) = resolved(&[("base", base), ("other", other)]);
        assert!(
            after.label_names.iter().any(|name| name == "base+other"),
            "{:?}",
            after.label_names
        );
        let mut turned = other;
        turned.swap(1, 2);
        let (after, _) = resolved(&[("base", base), ("other", turned)]);
        assert!(!closedness(&after).two_sided.is_empty());
    }
}

#[test]
fn three_triangles_through_one_point_share_it() {
    let third = |x: f64| x / 3.0;
    let planes = [p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0), p(0.3, 0.2, 1.0)].map(Point::normalize);
    let middle = p(third(1.0), third(2.0), third(0.7));
    let around = planes.map(|normal| {
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        [0.0f64, 2.1, 4.2].map(|angle| middle + u * angle.cos() + v * angle.sin())
    });
    let names = ["a", "b", "c"];
    let triangles: Vec<Named> = names.into_iter().zip(around).collect();
    let (after, _) = resolved(&triangles);
    let mut degrees = vec![BTreeMap::new(); after.n_vertices()];
    for (t, triangle) in after.triangles.iter().enumerate() {
        triangle.iter().for_each(|&v| _ = degrees[v as usize].insert(after.labels[t], ()));
    }
    let common: Vec<usize> = (0..degrees.len()).filter(|&v| degrees[v].len() == 3).collect();
    assert_eq!(common.len(), 1);
    assert!(after.points[common[0]].distance(middle) < 1e-15);
}

#[test]
fn boxes_that_cross_become_closed_walls() {
    let one = Point::ONE;
    for (shift, turn) in [
        (p(0.5, 0.4, 0.3), 0.0),
        (p(0.2, 0.1, 0.6), 0.7),
        (p(0.0, 0.0, 0.5), 0.0),
        (p(1.0, 0.25, 0.5), 0.0),
    ] {
        let mut both = block("a", Point::ZERO, one, 0.0);
        both.extend(block("b", shift, shift + one, turn));
        let (after, done) = resolved(&both);
        let found = validate(&after);
        assert!(found.is_valid(), "{:?}", found.defects);
        assert!(done.rounds > 0 && done.divided > 0);
    }
}

#[test]
fn a_grid_of_crossing_boxes_is_resolved() {
    let mut all = Vec::new();
    for k in 0..27 {
        let low = p((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64) * 0.8;
        all.extend(block(
            "a",
            low,
            low + Point::ONE,
            if k % 2 == 0 { 0.0 } else { 0.02 * k as f64 },
        ));
    }
    let mut after = surface(&all);
    let done = resolve(&mut after, &ScratchSpace::boundless()).expect("it settles");
    let found = validate(&after);
    assert!(found.is_valid(), "{done:?} {:?}", &found.defects[..found.defects.len().min(5)]);
    assert!(done.rounds <= 5, "{done:?}");
}

#[test]
fn needles_almost_parallel_are_resolved() {
    for seed in 0..20u64 {
        let at = |k: u64| (mix(seed * 1000 + k) >> 11) as f64 / (1u64 << 53) as f64;
        let needle = |k: u64| {
            let y = 1e-9 * at(3 * k);
            [
                p(0.0, y, 1e-9 * at(3 * k + 1)),
                p(1.0, 1e-9 - y, 1e-9 * at(3 * k + 2)),
                p(0.5, 1e-3, 1e-7 * at(k + 77)),
            ]
        };
        let triangles: Vec<Named> = (0..6).map(|k| ("n", needle(k))).collect();
        let mut after = surface(&triangles);
        let done = resolve(&mut after, &ScratchSpace::boundless());
        assert!(done.as_ref().is_ok_and(|done| done.moved_most < 1e-14), "seed {seed}: {done:?}");
    }
}

#[test]
fn soups_are_resolved_the_same_on_any_number_of_threads() {
    use tetdb_base::storage::{CancelToken, RunContext};
    for seed in 0..4u64 {
        let at = |k: u64| (mix(seed << 32 | k) >> 40) as f64 / (1u64 << 24) as f64;
        let corner = |k: u64| p(at(3 * k), at(3 * k + 1), at(3 * k + 2));
        let t = |k: u64| [corner(3 * k), corner(3 * k + 1), corner(3 * k + 2)];
        let triangles: Vec<Named> = (0..40).map(|k| ("soup", t(k))).collect();
        let run = |threads| {
            let mut after = surface(&triangles);
            let context = RunContext::new(threads, CancelToken::default());
            let done = context.enter(|| resolve(&mut after, &ScratchSpace::boundless()));
            (after, done)
        };
        let (one, done) = run(1);
        assert!(done.as_ref().is_ok_and(|d| d.pairs > 100), "seed {seed}: {done:?}");
        assert_eq!((one, done), run(3));
    }
}

#[test]
fn triangles_without_area_and_repeated_ones_are_merged() {
    let [a, b, c, d] = [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0), p(0.5, 0.0, 0.0)];
    let mut all = block("box", p(3.0, 3.0, 3.0), p(4.0, 4.0, 4.0), 0.0);
    all.extend([("x", [a, b, c]), ("y", [b, c, a]), ("x", [c, a, b]), ("flat", [a, d, b])]);
    let mut after = surface(&all);
    let done = resolve(&mut after, &ScratchSpace::boundless()).expect("it settles");
    assert_eq!(
        (done.collapsed_dropped, done.merged, done.rounds, after.n_triangles()),
        (1, 2, 0, 13)
    );
    assert_eq!(after.label_name(12), "x+y");
    assert_eq!(after.n_vertices(), 11);
}

#[test]
fn a_heap_beyond_the_limit_is_an_error() {
    // A thousand triangles through one line: half a million pairs; with 1,500 there are more than a million.
    let fan = |k: u64| {
        let angle = k as f64 * 0.002;
        let y = p(0.0, angle.cos(), angle.sin());
        [p(-1.0, 0.0, 0.0) - y + Point::X * 1e-3 * k as f64, p(1.0, 0.0, 0.0) - y, y]
    };
    let triangles: Vec<Named> = (0..1500).map(|k| ("f", fan(k))).collect();
    let found = resolve(&mut surface(&triangles), &ScratchSpace::boundless());
    assert_eq!(found, Err(ResolveError::TooMany));
    let kind = ContactKind::Crossing;
    let place = Contact { kind, at: Point::ZERO };
    let error = ResolveError::Unsettled { n: 3, rounds: 12, places: vec![place] };
    assert!(error.to_string().contains("3 pairs"));
}
#[test]
fn a_vertex_on_an_edge_and_next_to_its_end_is_put_in() {
    let near = 2f64.powi(-50);
    let flat = [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0)];
    for x in [near, 4.0 * near, 1.0 - near] {
        let (after, _) = resolved(&[
            ("flat", flat),
            ("up", [p(x, 0.0, 0.0), p(0.5, -1.0, 1.0), p(0.7, -1.0, 1.0)]),
        ]);
        assert_eq!((after.n_triangles(), after.n_vertices()), (3, 6));
    }
}

#[test]
fn walls_that_nearly_coincide_settle_or_are_named() {
    let mut n_settled = 0;
    for seed in 0..10u64 {
        let at = |k: u64| (mix(seed << 8 | k) >> 11) as f64 / (1u64 << 53) as f64;
        let low = p(0.5 * at(1), 0.5 * at(2), 1.0);
        let mut both = block("a", Point::ZERO, Point::ONE, 0.1 + at(0));
        both.extend(block("b", low, low + Point::ONE, 0.1 + at(0)));
        let mut after = surface(&both);
        match resolve(&mut after, &ScratchSpace::boundless()) {
            Ok(_) => {
                assert!(validate(&after).is_valid(), "seed {seed}");
                n_settled += 1;
            }
            Err(ResolveError::Unsettled { places, .. }) => {
                assert!(!places.is_empty() && places.iter().all(|c| c.at.is_finite()));
            }
            Err(error) => panic!("seed {seed}: {error}"),
        }
    }
    assert!(n_settled >= 8, "{n_settled}");
}
