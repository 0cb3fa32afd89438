//! Tests of whole runs: distance, crossings, topology, labels, corners, angles.

use super::*;
use tetdb_base::geom::mix;
use tetdb_base::surface::{Seeker, SurfaceBuilder, validate};

fn built(points: &[Point], triangles: &[([u32; 3], &str)]) -> Surface {
    let mut builder = SurfaceBuilder::new();
    builder.begin_file("test");
    points.iter().for_each(|p| builder.vertex(*p).unwrap());
    for (t, name) in triangles {
        let label = builder.label(name);
        builder.triangle(*t, label).unwrap();
    }
    builder.end_file().unwrap();
    builder.finish()
}

/// The box between two corners, each side under the name `names[side]`.
fn box_of(low: Point, high: Point, names: [&str; 6]) -> Surface {
    let at = |k: usize| {
        let side = |bit: usize, axis: usize| if k & bit != 0 { high[axis] } else { low[axis] };
        Point::new(side(1, 0), side(2, 1), side(4, 2))
    };
    let points: Vec<Point> = (0..8).map(at).collect();
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = sides
        .iter()
        .zip(names)
        .flat_map(|(&[a, b, c, d], name)| [([a, b, c], name), ([a, c, d], name)]);
    built(&points, &halves.collect::<Vec<_>>())
}

fn joined(parts: &[Surface]) -> Surface {
    let mut builder = SurfaceBuilder::new();
    for part in parts {
        builder.begin_file("part");
        part.points.iter().for_each(|p| builder.vertex(*p).unwrap());
        for (t, triangle) in (0u32..).zip(&part.triangles) {
            let label = builder.label(part.label_name(t));
            builder.triangle(*triangle, label).unwrap();
        }
        builder.end_file().unwrap();
    }
    builder.finish()
}

/// A cylinder of `n` facets that are needles, its caps fans of needles.
fn cylinder(n: u32, length: f64) -> Surface {
    let ring = |z: f64| {
        (0..n).map(move |k| {
            let angle = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
            Point::new(angle.cos(), angle.sin(), z)
        })
    };
    let points: Vec<Point> = ring(0.0).chain(ring(length)).collect();
    let mut triangles = Vec::new();
    for k in 0..n {
        let next = (k + 1) % n;
        triangles.push(([k, next, n + next], "side"));
        triangles.push(([k, n + next, n + k], "side"));
    }
    for k in 1..n - 1 {
        triangles.push(([0, k + 1, k], "caps"));
        triangles.push(([n, n + k, n + k + 1], "caps"));
    }
    built(&points, &triangles)
}

/// A sphere with bumps, from a divided octahedron.
fn lump(n: i32, seed: u64) -> Surface {
    let wave = [0, 1, 2].map(|k| 1.0 + (mix(seed + k) % 5) as f64);
    let place = |p: Point| {
        let u = p.normalize();
        u * (1.0
            + 0.2 * (wave[0] * u.x).sin() * (wave[1] * u.y).cos()
            + 0.1 * (wave[2] * u.z).sin())
    };
    let mut builder = SurfaceBuilder::new();
    builder.begin_file("lump");
    let label = builder.label("lump");
    let mut count = 0;
    for sign in 0..8 {
        let axis = |bit: usize| if sign >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let point = |i: i32, j: i32| {
            let [x, y] = [i, j].map(f64::from);
            place(Point::new(axis(0) * x, axis(1) * y, axis(2) * (f64::from(n) - x - y)))
        };
        let flips = (sign as u32).count_ones() % 2 == 1;
        let mut add = |t: [Point; 3]| {
            t.iter().for_each(|p| builder.vertex(*p).unwrap());
            let [a, b, c] = [count, count + 1, count + 2];
            builder.triangle(if flips { [a, c, b] } else { [a, b, c] }, label).unwrap();
            count += 3;
        };
        for i in 0..n {
            for j in 0..n - i {
                add([point(i, j), point(i + 1, j), point(i, j + 1)]);
                if i + j + 1 < n {
                    add([point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
                }
            }
        }
    }
    builder.end_file().unwrap();
    builder.finish()
}

fn settings(tolerance: f64) -> RemeshSettings {
    RemeshSettings {
        tolerance,
        feature_cos: 40f64.to_radians().cos(),
        hmax: f64::INFINITY,
        hmin: 0.0,
        growth: 0.3,
    }
}

fn euler(surface: &Surface) -> i64 {
    let closed = tetdb_base::surface::closedness(surface);
    let n_triangles = surface.n_triangles() - closed.two_sided.len();
    surface.n_vertices() as i64 - closed.n_edges as i64 + n_triangles as i64
}

/// Greatest distance from samples of `a` to `b`.
fn distance(a: &Surface, b: &Surface) -> f64 {
    let seeker = Seeker::new(b);
    let mut most = 0.0f64;
    for t in 0..a.n_triangles() as u32 {
        let [x, y, z] = a.corners(t);
        for k in 0..40u64 {
            let at =
                |i: u64| (mix(u64::from(t) * 80 + 2 * k + i) >> 11) as f64 / (1u64 << 53) as f64;
            let (mut u, mut v) = (at(0), at(1));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            most = most.max(seeker.distance(x + (y - x) * u + (z - x) * v, f64::INFINITY));
        }
        [x, y, z].iter().for_each(|p| most = most.max(seeker.distance(*p, f64::INFINITY)));
    }
    most
}

/// Remeshes and checks what always holds.
fn remeshed(surface: &Surface, settings: &RemeshSettings) -> (Surface, RemeshReport) {
    assert!(validate(surface).is_valid(), "{:?}", validate(surface).defects.first());
    let scratch = ScratchSpace::boundless();
    let (result, report) =
        remesh(surface, settings, &|_| f64::INFINITY, &scratch, &|_| ()).unwrap();
    let found = validate(&result);
    assert!(found.is_valid(), "{:?}", found.defects.first());
    assert_eq!(euler(surface), euler(&result));
    for (a, b) in [(surface, &result), (&result, surface)] {
        let away = distance(a, b);
        assert!(away <= settings.tolerance, "{away} of {}", settings.tolerance);
    }
    let names = |s: &Surface| {
        let mut all: Vec<String> =
            (0..s.n_triangles() as u32).map(|t| s.label_name(t).to_owned()).collect();
        all.sort();
        all.dedup();
        all
    };
    assert_eq!(names(surface), names(&result));
    assert_eq!(report.triangles, result.n_triangles() as u64);
    (result, report)
}

const SIDES: [&str; 6] = ["box"; 6];

#[test]
fn a_box_of_many_needles_becomes_few_triangles_with_the_same_corners() {
    let (low, high) = (Point::ZERO, Point::new(2.0, 1.0, 1.0));
    let whole = box_of(low, high, SIDES);
    let (few, _) = remeshed(&whole, &settings(1e-3));
    assert_eq!(few.n_triangles(), 12, "a box is good as it is");
    let fine = tetdb_base::surface::split(&whole, &|p| 0.05 + 0.2 * p.x, u64::MAX).unwrap().0;
    assert!(fine.n_triangles() > 500);
    let (few, report) = remeshed(&fine, &settings(1e-3));
    assert!(few.n_triangles() < fine.n_triangles() / 4, "{}", few.n_triangles());
    assert_eq!((report.corners, report.curves), (8, 12));
    for p in &whole.points {
        assert!(few.points.contains(p), "{p:?}");
    }
    // The edges are exact: volume by the sum of corner determinants.
    let volume = |s: &Surface| {
        let each = (0..s.n_triangles() as u32).map(|t| s.corners(t));
        each.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum::<f64>()
    };
    assert!((volume(&few).abs() - 2.0).abs() < 1e-12, "{}", volume(&few));
}

#[test]
fn needles_of_cylinders_vanish() {
    for (n, length) in [(12, 3.0), (48, 0.4), (80, 4.0)] {
        let surface = cylinder(n, length);
        let (_, report) = remeshed(&surface, &settings(5e-3));
        assert!(report.angle_before < 10.0 && report.angle > 18.0, "{n} {length} {report:?}");
    }
}

#[test]
fn lumps_stay_within_the_tolerance() {
    for (seed, tolerance) in [(1, 0.02), (2, 0.01), (3, 0.05)] {
        let surface = lump(9, seed);
        let (_, report) = remeshed(&surface, &settings(tolerance));
        assert!(report.angle > 15.0, "{report:?}");
    }
}

#[test]
fn shells_nearer_than_the_tolerance_do_not_cross() {
    let inner = cylinder(40, 2.0);
    let mut outer = inner.clone();
    for p in &mut outer.points {
        *p = Point::new(p.x * 1.002, p.y * 1.002, p.z * 1.002 - 0.002);
    }
    let (result, _) = remeshed(&joined(&[inner, outer]), &settings(0.02));
    assert_eq!(tetdb_base::surface::closedness(&result).n_components, 2);
}

#[test]
fn a_plate_thinner_than_the_tolerance_keeps_both_sides() {
    let plate = box_of(Point::ZERO, Point::new(3.0, 2.0, 0.01), SIDES);
    let (_, report) = remeshed(&plate, &RemeshSettings { hmax: 0.4, ..settings(0.02) });
    assert!(report.triangles > 50, "{report:?}");
}

#[test]
fn borders_of_labels_are_kept_as_curves() {
    let names = ["a", "b", "a", "b", "c", "c"];
    let surface = box_of(Point::ZERO, Point::new(1.0, 2.0, 3.0), names);
    let settings = RemeshSettings { hmax: 0.4, ..settings(0.3) };
    let (_, report) = remeshed(&surface, &settings);
    assert_eq!(report.corners, 8);
    // A label on a flat part: its border is no edge of the shape.
    let mut fine = tetdb_base::surface::split(&surface, &|_| 0.3, u64::MAX).unwrap().0;
    fine.label_names.push("patch".to_owned());
    let label = fine.label_names.len() as u32 - 1;
    for t in 0..fine.n_triangles() {
        let middle = fine.corners(t as u32).iter().sum::<Point>() / 3.0;
        if middle.z == 0.0 && middle.distance(Point::new(0.5, 1.0, 0.0)) < 0.3 {
            fine.labels[t] = label;
        }
    }
    remeshed(&fine, &settings);
}

#[test]
fn walls_between_three_triangles_and_double_walls_are_kept() {
    let names = ["left"; 6];
    let left = box_of(Point::ZERO, Point::ONE, names);
    let right = box_of(Point::X, Point::new(2.0, 1.0, 1.0), ["right"; 6]);
    // The wall twice, once for each side, and then once.
    let double = joined(&[left, right]);
    let closed = tetdb_base::surface::closedness(&double);
    assert_eq!(closed.two_sided.len(), 2);
    let settings = RemeshSettings { hmax: 0.3, ..settings(1e-3) };
    let (result, _) = remeshed(&double, &settings);
    assert!(!tetdb_base::surface::closedness(&result).two_sided.is_empty());
    let mut once = double.clone();
    let backs: Vec<u32> = closed.two_sided.iter().map(|pair| pair[1]).collect();
    let is_kept = |t: u32| !backs.contains(&t);
    once.triangles =
        (0u32..).zip(double.triangles).filter(|(t, _)| is_kept(*t)).map(|(_, t)| t).collect();
    once.labels =
        (0u32..).zip(double.labels).filter(|(t, _)| is_kept(*t)).map(|(_, l)| l).collect();
    let (result, _) = remeshed(&once, &settings);
    assert!(tetdb_base::surface::closedness(&result).n_odd > 0);
}

#[test]
fn the_result_is_the_same_each_time_and_at_each_scale() {
    let surface = lump(6, 7);
    let once = remeshed(&surface, &settings(0.02)).0;
    assert_eq!(once, remeshed(&surface, &settings(0.02)).0);
    for scale in [2f64.powi(-30), 2f64.powi(30)] {
        let mut scaled = surface.clone();
        scaled.points.iter_mut().for_each(|p| *p *= scale);
        let (result, _) = remeshed(&scaled, &settings(0.02 * scale));
        assert_eq!(result.triangles, once.triangles, "{scale}");
    }
}

#[test]
fn a_surface_that_does_not_fit_is_refused() {
    let scratch = ScratchSpace::new(1 << 16, std::env::temp_dir());
    let refused = remesh(&lump(9, 1), &settings(0.01), &|_| f64::INFINITY, &scratch, &|_| ());
    assert!(matches!(refused, Err(SurfaceError::Memory { .. })), "{refused:?}");
    let scratch = ScratchSpace::new(1 << 20, std::env::temp_dir());
    let fine = RemeshSettings { hmax: 1e-3, hmin: 1e-3, ..settings(0.01) };
    let refused = remesh(&lump(9, 1), &fine, &|_| f64::INFINITY, &scratch, &|_| ());
    assert!(matches!(refused, Err(SurfaceError::SplitMemory { .. })), "{refused:?}");
}
