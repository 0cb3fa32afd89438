use std::collections::BTreeSet;

use super::*;
use crate::tests::{Named, p, surface};
use tetdb_base::geom::mix;
use tetdb_base::storage::{CancelToken, RunContext, attempt};
use tetdb_base::surface::{orient_alike, validate};
use tetdb_kernel::samples::SampleSpec;

fn silent(_: &'static str, _: u64, _: u64) {}

/// A grid of `n` by `m` quadrilaterals, each cut in two; `at` places its corners.
fn grid(n: usize, m: usize, at: impl Fn(usize, usize) -> Point) -> Vec<Named> {
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for corners in [[a, b, c], [a, c, d]] {
                let [x, y, z] = corners;
                if x != y && y != z && z != x {
                    triangles.push(("grid", corners));
                }
            }
        }
    }
    triangles
}

/// The angle of step `k` of `n`, the same at both ends of a turn.
fn turn(k: usize, n: usize) -> (f64, f64) {
    (std::f64::consts::TAU * (k % n) as f64 / n as f64).sin_cos()
}

fn sphere(n: usize) -> Vec<Named> {
    grid(2 * n, n, |i, j| {
        let (sin, cos) = turn(i, 2 * n);
        let (s, c) = (std::f64::consts::PI * j as f64 / n as f64).sin_cos();
        match j {
            0 => p(0.0, 0.0, -1.0),
            j if j == n => p(0.0, 0.0, 1.0),
            _ => p(s * cos, s * sin, -c),
        }
    })
}

fn torus(n: usize, m: usize) -> Vec<Named> {
    grid(n, m, |i, j| {
        let ((sin, cos), (s, c)) = (turn(i, n), turn(j, m));
        p((1.0 + 0.4 * c) * cos, (1.0 + 0.4 * c) * sin, 0.4 * s)
    })
}

/// A box from `low` to `high`.
fn block(name: &'static str, low: Point, high: Point) -> Vec<Named> {
    let corner = |c: usize| {
        let at = |axis: usize| if c >> axis & 1 == 1 { high[axis] } else { low[axis] };
        p(at(0), at(1), at(2))
    };
    let walls =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let cut = walls.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    cut.map(|t| (name, t.map(corner))).collect()
}

fn middle((_, [a, b, c]): &Named) -> Point {
    (*a + *b + *c) / 3.0
}

fn turned(triangles: Vec<Named>) -> Vec<Named> {
    triangles.into_iter().map(|(name, [a, b, c])| (name, [a, c, b])).collect()
}

/// Volume enclosed by a closed surface.
fn volume(surface: &Surface) -> f64 {
    (0..surface.n_triangles() as u32)
        .map(|t| {
            let [a, b, c] = surface.corners(t);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

/// Corners and label of each triangle, its direction left out.
fn places(surface: &Surface) -> BTreeSet<(String, [[u64; 3]; 3])> {
    let place = |t: u32| {
        let mut corners = surface.corners(t).map(|p| p.to_array().map(f64::to_bits));
        corners.sort_unstable();
        (surface.label_name(t).to_owned(), corners)
    };
    (0..surface.n_triangles() as u32).map(place).collect()
}

/// Closes a surface and checks what holds of every closed one.
fn closed(before: &Surface) -> (Surface, CloseReport) {
    let mut after = before.clone();
    let done = close(&mut after, &ScratchSpace::boundless(), &silent).expect("it closes");
    let found = validate(&after);
    assert!(found.is_valid() && found.closedness.n_inconsistent == 0, "{found:?}");
    assert_eq!(found.closedness.two_sided, Vec::<[u32; 2]>::new());
    assert!((volume(&after) - done.volume).abs() < 1e-9 * done.volume, "{done:?}");
    let (then, now) = (places(before), places(&after));
    if done.resolve.rounds == 0 {
        let new = now.difference(&then).collect::<Vec<_>>();
        assert!(new.iter().all(|(label, _)| label.starts_with("closed-hole-")), "{new:?}");
        assert_eq!(new.len(), done.triangles_added);
        let dropped = done.dropped_inside + done.dropped_outside + done.dropped_repeated;
        let all = before.n_triangles() + done.triangles_added;
        let merged = done.resolve.merged + done.resolve.collapsed_dropped;
        assert_eq!(after.n_triangles(), all - dropped - merged);
    }
    (after, done)
}

fn refused(before: &Surface) -> CloseError {
    let mut after = before.clone();
    close(&mut after, &ScratchSpace::boundless(), &silent).expect_err("it has no inside")
}

fn with_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    RunContext::new(n, CancelToken::new()).enter(work)
}

#[test]
fn winding_numbers_are_those_of_the_plain_sum() {
    for spec in
        ["knot,h=0.1", "broken,kind=holes,count=40,seed=3,h=0.1", "broken,kind=soup,count=500"]
    {
        let surface: Surface =
            SampleSpec::parse(spec).and_then(|s| s.make()).expect("a good sample").into();
        let tree = WindingTree::new(&surface, |_| true);
        let bounds = surface.bounds();
        let (mut worst, mut seed) = (0f64, 1u64);
        for _ in 0..2000 {
            let share = [0; 3].map(|_| {
                seed = mix(seed + 1);
                (seed >> 11) as f64 / (1u64 << 53) as f64
            });
            let at = bounds.low + Point::from_array(share) * (bounds.high - bounds.low);
            let plain: f64 = (0..surface.n_triangles() as u32)
                .map(|t| winding::solid_angle(surface.corners(t).map(|p| p - at)))
                .sum();
            worst = worst.max((plain / (4.0 * std::f64::consts::PI) - tree.at(at)).abs());
        }
        assert!(worst < 6e-3, "{spec}: {worst}");
    }
}

#[test]
fn a_closed_surface_stays_as_it_is() {
    for triangles in [sphere(8), torus(16, 8), block("a", Point::ZERO, Point::ONE)] {
        let before = surface(&triangles);
        let (after, done) = closed(&before);
        assert_eq!(after, before);
        assert_eq!((done.holes.len(), done.turned), (0, 0));
        assert!(done.volume_doubtful < 1e-12);
        assert!((done.volume - done.volume_by_winding).abs() < 1e-3 * done.volume);
    }
}

#[test]
fn a_missing_side_of_a_box_is_closed_by_its_plane() {
    for (high, n) in [(p(1.0, 1.0, 1.0), 2), (p(1.0, 2.0, 0.5), 2), (p(3.0, 1.0, 0.3), 2)] {
        for side in 0..6 {
            let mut triangles = block("a", Point::ZERO, high);
            triangles.drain(2 * side..2 * side + n);
            let (after, done) = closed(&surface(&triangles));
            assert_eq!(done.holes.len(), 1, "{side}: {done:?}");
            assert_eq!(after.label_names, ["a", "closed-hole-1"]);
            let whole = high.x * high.y * high.z;
            assert!((done.volume - whole).abs() < 1e-12, "{side} of {high}: {done:?}");
            let open = [high.y * high.z, high.x * high.z, high.x * high.y][side / 2];
            assert!((done.holes[0].area - open).abs() < 1e-12);
        }
    }
}

#[test]
fn each_cap_of_a_sphere_is_one_hole() {
    let whole = surface(&sphere(24));
    let mut caps: Vec<Point> = vec![Point::X, -Point::X, Point::Y, -Point::Y, Point::Z, -Point::Z];
    caps.extend([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)].map(|(x, y)| p(x, y, 1.0).normalize()));
    caps.extend([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)].map(|(x, y)| p(x, y, -1.0).normalize()));
    for n in [1, 3, 12] {
        let mut triangles = sphere(24);
        triangles.retain(|t| caps[..n].iter().all(|cap| cap.dot(middle(t).normalize()) < 0.97));
        let (_, done) = closed(&surface(&triangles));
        assert_eq!(done.holes.len(), n, "{done:?}");
        // A cap is at most 0.04 high.
        let lost = volume(&whole) - done.volume;
        assert!(lost > 0.0 && lost < 0.04 * done.hole_area, "{n}: {lost}");
    }
}

#[test]
fn ragged_holes_are_closed() {
    for seed in 0..8u64 {
        let mut triangles = sphere(20);
        let mut k = seed * 1000;
        triangles.retain(|t| {
            k += 1;
            let near = middle(t).z;
            near < 0.5 || near < 0.8 && !mix(k).is_multiple_of(3)
        });
        let (_, done) = closed(&surface(&triangles));
        let whole = volume(&surface(&sphere(20)));
        assert!(done.volume < whole && done.volume > 0.8 * whole, "{seed}: {done:?}");
        assert!(done.volume_doubtful < 0.3 * whole);
    }
}

#[test]
fn a_torus_cut_open_is_closed_at_both_ends() {
    let mut triangles = torus(32, 12);
    triangles.drain(..3 * 24);
    let (_, done) = closed(&surface(&triangles));
    assert_eq!(done.holes.len(), 2, "{done:?}");
    let disk = std::f64::consts::PI * 0.16;
    assert!((done.hole_area - 2.0 * disk).abs() < 0.1 * disk, "{done:?}");
}

#[test]
fn turned_and_doubled_shells_are_solids() {
    let ball = sphere(10);
    let (after, done) = closed(&surface(&turned(ball.clone())));
    assert_eq!(done.turned, ball.len());
    assert!(volume(&after) > 4.0);
    // One of two apart is turned.
    let apart: Vec<Named> =
        ball.iter().map(|(name, t)| (*name, t.map(|p| p + Point::X * 3.0))).collect();
    let both = [ball.clone(), turned(apart)].concat();
    let (_, done) = closed(&surface(&both));
    assert_eq!(done.turned, ball.len());
    assert!(done.volume > 8.0);
    // The same shell twice.
    let (after, done) = closed(&surface(&[ball.clone(), ball.clone()].concat()));
    assert_eq!((after.n_triangles(), done.resolve.merged), (ball.len(), ball.len()));
    // A slightly smaller shell inside, both seen from outside.
    let within: Vec<Named> = ball.iter().map(|(_, t)| ("in", t.map(|p| p * 0.9))).collect();
    let (after, done) = closed(&surface(&[ball.clone(), within].concat()));
    assert_eq!((after.n_triangles(), done.dropped_inside), (ball.len(), ball.len()));
    // Given from both sides.
    let (after, done) = closed(&surface(&[ball.clone(), turned(ball.clone())].concat()));
    assert_eq!((after.n_triangles(), done.dropped_repeated), (ball.len(), ball.len()));
}

#[test]
fn turned_shells_do_not_cancel_those_they_overlap() {
    let [a, b] =
        [block("a", Point::ZERO, Point::ONE), block("b", p(0.5, 0.25, 0.375), p(1.5, 1.25, 1.375))];
    let union = 2.0 - 0.5 * 0.75 * 0.625;
    for both in [[a.clone(), turned(b.clone())].concat(), [turned(a.clone()), b.clone()].concat()] {
        let (_, done) = closed(&surface(&both));
        assert!((done.volume - union).abs() < 1e-12 && done.turned >= 12, "{done:?}");
    }
    // All inside out, with a cavity.
    let cavity: Vec<Named> = sphere(6).iter().map(|(_, t)| ("in", t.map(|p| p * 0.5))).collect();
    let (_, done) = closed(&surface(&[turned(sphere(10)), cavity].concat()));
    assert!(done.volume < 3.7, "{done:?}");
}

#[test]
fn a_cavity_stays_empty() {
    let cavity: Vec<Named> = sphere(6).iter().map(|(_, t)| ("in", t.map(|p| p * 0.5))).collect();
    let before = surface(&[sphere(10), turned(cavity)].concat());
    let (after, done) = closed(&before);
    assert_eq!(after, before);
    assert!(done.volume < 3.7);
}

#[test]
fn overlapping_boxes_become_their_union() {
    let both = [
        block("a", Point::ZERO, Point::ONE),
        block("b", p(0.5, 0.25, 0.375), p(1.5, 1.25, 1.375)),
        // It shares a wall with the first.
        block("c", p(-1.0, 0.0, 0.0), p(0.0, 1.0, 1.0)),
    ]
    .concat();
    let (after, done) = closed(&surface(&both));
    assert!((done.volume - (3.0 - 0.5 * 0.75 * 0.625)).abs() < 1e-12, "{done:?}");
    assert!(after.label_names.iter().all(|name| !name.starts_with("closed")), "{done:?}");
    assert!(done.dropped_inside > 0);
}

#[test]
fn what_has_no_inside_is_an_error() {
    let sheet = grid(6, 6, |i, j| p(i as f64, j as f64, 0.1 * ((i * j) % 3) as f64));
    assert!(matches!(refused(&surface(&sheet)), CloseError::NothingInside));
    let strip = grid(24, 3, |i, j| {
        let half = std::f64::consts::PI * i as f64 / 24.0;
        let ((sin, cos), (s, c)) = ((2.0 * half).sin_cos(), half.sin_cos());
        let off = 0.2 * (j as f64 - 1.5);
        p((1.0 + off * c) * cos, (1.0 + off * c) * sin, off * s)
    });
    let mut moebius = surface(&strip);
    orient_alike(&mut moebius);
    assert!(matches!(refused(&moebius), CloseError::NothingInside));
    assert!(matches!(refused(&Surface::default()), CloseError::NothingInside));
}

#[test]
fn broken_samples_are_closed_on_any_number_of_threads() {
    for kind in ["holes", "turned", "doubled", "cracks", "tjunctions", "crossings"] {
        for seed in 0..20 {
            let spec = format!("broken,kind={kind},seed={seed},count=6");
            let sample = SampleSpec::parse(&spec).and_then(|s| s.make()).expect("a good sample");
            let mut before: Surface = sample.into();
            orient_alike(&mut before);
            let (after, done) = closed(&before);
            let least = if kind == "tjunctions" { 0.99 } else { 3.0 };
            assert!(done.volume > least, "{spec}: {done:?}");
            if seed < 2 {
                for n in [1, 2] {
                    let (again, done_again) = with_threads(n, || closed(&before));
                    assert_eq!((&again, &done_again), (&after, &done), "{spec}");
                }
            }
        }
    }
}

#[test]
fn a_cancelled_run_ends() {
    let token = CancelToken::new();
    token.cancel();
    let mut surface = surface(&sphere(8));
    let scratch = ScratchSpace::boundless();
    let run = RunContext::new(1, token);
    let done = run.enter(|| attempt(|| close(&mut surface, &scratch, &silent).map(|_| ())));
    assert!(done.is_err());
}
