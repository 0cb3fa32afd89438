//! Wraps of soups and of surfaces with faults.

use super::*;
use tetdb_base::geom::mix;
use tetdb_base::surface::{nearest_point, validate};

fn at(k: u64) -> f64 {
    (mix(k) >> 11) as f64 / (1u64 << 53) as f64
}

fn point(k: u64) -> Point {
    Point::new(at(3 * k), at(3 * k + 1), at(3 * k + 2))
}

/// A surface of separate triangles.
fn soup(triangles: impl IntoIterator<Item = [Point; 3]>) -> Surface {
    let points: Vec<Point> = triangles.into_iter().flatten().collect();
    let n = points.len() as u32 / 3;
    Surface {
        points,
        triangles: (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        labels: (0..n).map(|t| t % 2).collect(),
        label_names: vec!["even".to_owned(), "odd".to_owned()],
        ..Surface::default()
    }
}

fn random(n: u64, seed: u64, size: f64) -> Vec<[Point; 3]> {
    let corner = |k: u64, i: u64| point(mix(seed) ^ (9 * k + i));
    let triangle = |k: u64| {
        let middle = corner(k, 0);
        [1, 2, 3].map(|i| middle + (corner(k, i) - Point::splat(0.5)) * size)
    };
    (0..n).map(triangle).collect()
}

/// The sides of a box, one left out.
fn box_without(low: Point, high: Point, missing: Option<usize>) -> Vec<[Point; 3]> {
    let corner = |k: usize| {
        let side = |i: usize| if k >> i & 1 == 0 { low[i] } else { high[i] };
        Point::new(side(0), side(1), side(2))
    };
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let kept = faces.iter().enumerate().filter(|(f, _)| Some(*f) != missing);
    kept.flat_map(|(_, &[a, b, c, d])| [[a, b, c], [a, c, d]].map(|t| t.map(corner))).collect()
}

/// Wraps, and checks by other means what is certain of a wrap.
fn wrapped(surface: &Surface, gap: f64, offset: f64) -> (Surface, WrapReport) {
    let settings = WrapSettings { gap, offset };
    let (wrap, report) = wrap(surface, &settings, &ScratchSpace::boundless(), &|_| ()).unwrap();
    let validation = validate(&wrap);
    assert!(validation.is_valid(), "{:?}", validation.defects.first());
    assert_eq!(validation.closedness.n_inconsistent, 0);
    let all: Vec<[Point; 3]> =
        (0..surface.n_triangles() as u32).map(|t| surface.corners(t)).collect();
    for (k, &p) in wrap.points.iter().enumerate() {
        let step = 1 + wrap.n_vertices() * all.len() / 1_000_000;
        if k % step == 0 {
            let near = all.iter().map(|t| nearest_point(*t, p).distance(p));
            let distance = near.filter(|d| d.is_finite()).fold(f64::INFINITY, f64::min);
            assert!(distance <= offset && distance > 0.0, "{distance} {offset}");
        }
    }
    let edges = manifold_edges(&wrap);
    assert_eq!(2 * edges, 3 * wrap.n_triangles());
    assert!(volume(&wrap) > 0.0);
    assert!(report.distance_to_input_max > 0.0);
    (wrap, report)
}

/// Number of edges, each of which must have two triangles of opposite directions.
fn manifold_edges(surface: &Surface) -> usize {
    let mut edges = std::collections::HashMap::new();
    for &[a, b, c] in &surface.triangles {
        for (x, y) in [(a, b), (b, c), (c, a)] {
            *edges.entry((x.min(y), x.max(y))).or_insert((0, 0)) = {
                let (m, n) = edges.get(&(x.min(y), x.max(y))).copied().unwrap_or((0, 0));
                if x < y { (m + 1, n) } else { (m, n + 1) }
            };
        }
    }
    assert!(edges.values().all(|e| *e == (1, 1)));
    edges.len()
}

fn volume(surface: &Surface) -> f64 {
    let origin = surface.points[0];
    let of = |t: u32| {
        let [a, b, c] = surface.corners(t).map(|p| p - origin);
        a.dot(b.cross(c)) / 6.0
    };
    (0..surface.n_triangles() as u32).map(of).sum()
}

#[test]
fn random_soups_are_enclosed_by_closed_manifolds() {
    for seed in 0..20u64 {
        let n = [10, 30, 100, 300, 2000][seed as usize % 5];
        let size = [0.1, 0.5, 0.02, 1.0][seed as usize / 5];
        let surface = soup(random(n, seed, size));
        let (wrap, _) = wrapped(&surface, 0.06, 0.01);
        let used: Vec<u32> = wrap.labels.clone();
        assert!(used.contains(&0) && used.contains(&1), "labels of both kinds are near");
    }
}

#[test]
fn gaps_narrower_than_asked_for_are_closed_and_wider_ones_entered() {
    let open = soup(box_without(Point::ZERO, Point::ONE, Some(5)));
    let (closed, _) = wrapped(&open, 0.8, 0.01);
    assert!((volume(&closed) - 1.0).abs() < 0.15, "{}", volume(&closed));
    let (entered, _) = wrapped(&open, 0.1, 0.01);
    assert!(volume(&entered) < 0.3, "{}", volume(&entered));
}

#[test]
fn boxes_through_each_other_become_one_shell_and_boxes_apart_two() {
    let mut both = box_without(Point::ZERO, Point::ONE, None);
    both.extend(box_without(Point::splat(0.5), Point::splat(1.5), None));
    let (one, report) = wrapped(&soup(both), 0.1, 0.01);
    assert_eq!(report.shells, 1);
    assert!((volume(&one) - 1.875).abs() < 0.15, "{}", volume(&one));
    let mut both = box_without(Point::ZERO, Point::ONE, None);
    both.extend(box_without(Point::splat(1.5), Point::splat(2.0), None));
    assert_eq!(wrapped(&soup(both), 0.1, 0.01).1.shells, 2);
}

#[test]
fn hemispheres_needles_planes_and_single_triangles_are_wrapped() {
    let sphere = |u: u32, v: u32| {
        let [a, b] = [u, v].map(|k| f64::from(k) * std::f64::consts::FRAC_PI_8);
        Point::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin())
    };
    let cap = (0..16).flat_map(|u| (0..4).map(move |v| (u, v))).flat_map(|(u, v)| {
        let [a, b, c, d] =
            [(u, v), (u + 1, v), (u + 1, v + 1), (u, v + 1)].map(|(u, v)| sphere(u, v));
        [[a, b, c], [a, c, d]]
    });
    let (wrap, _) = wrapped(&soup(cap), 0.1, 0.02);
    assert!(volume(&wrap) < 0.6, "a shell, not a ball: {}", volume(&wrap));
    let needles = (0..30u64).map(|k| {
        let (a, b) = (point(2 * k), point(2 * k + 1));
        [a, b, a + (b - a) * 0.5 + point(k) * 1e-9]
    });
    wrapped(&soup(needles), 0.1, 0.01);
    let flat = (0..50u64).map(|k| {
        [0, 1, 2].map(|i| {
            let p = point(3 * k + i);
            Point::new(p.x, p.y, 0.25)
        })
    });
    wrapped(&soup(flat), 0.1, 0.01);
    let one = [Point::ZERO, Point::X, Point::Y];
    wrapped(&soup([one]), 0.05, 0.01);
    wrapped(&soup([one]), 5.0, 0.01);
    wrapped(&soup([one]), 0.05, 0.3);
    wrapped(&soup([one, one, one]), 0.1, 0.01);
    // Without area: an edge and a point.
    wrapped(&soup([[Point::ZERO, Point::X, Point::X], [Point::Y; 3]]), 0.1, 0.01);
}

#[test]
fn large_coordinates_shift_the_wrap_and_nothing_else() {
    let shift = Point::new(1e6, -1e6, 1e6);
    let boxes = box_without(Point::ZERO, Point::ONE, Some(3));
    let moved = boxes.iter().map(|t| t.map(|p| p + shift));
    let (far, _) = wrapped(&soup(moved), 0.1, 0.01);
    let (near, _) = wrapped(&soup(boxes), 0.1, 0.01);
    let ratio = far.n_triangles() as f64 / near.n_triangles() as f64;
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn lengths_that_make_no_sense_are_refused() {
    let surface = soup(box_without(Point::ZERO, Point::ONE, None));
    let of = |gap, offset| {
        let settings = WrapSettings { gap, offset };
        wrap(&surface, &settings, &ScratchSpace::boundless(), &|_| ()).unwrap_err()
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(of(bad, 0.1), WrapError::Length { what: "gap", .. }));
        assert!(matches!(of(0.1, bad), WrapError::Length { what: "offset", .. }));
    }
    assert!(matches!(of(0.1, 1e-15), WrapError::Rounding { .. }));
    let settings = WrapSettings { gap: 0.1, offset: 0.1 };
    let none = wrap(&Surface::default(), &settings, &ScratchSpace::boundless(), &|_| ());
    assert_eq!(none.unwrap_err(), WrapError::Empty);
    let tight = ScratchSpace::new(1 << 20, std::env::temp_dir());
    let refused = wrap(&surface, &WrapSettings { gap: 0.01, offset: 0.001 }, &tight, &|_| ());
    assert!(matches!(refused, Err(WrapError::Memory { .. })));
}
