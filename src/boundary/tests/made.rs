//! Made surfaces with known difficulties.

use super::build::{check, check_facets, delaunay};
use crate::boundary::{RecoveryReport, recover};
use crate::geom::Point;

/// Deterministic pseudo-random numbers in [0, 1).
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn recovered(name: &str, points: &[Point], triangles: &[[u32; 3]]) -> RecoveryReport {
    let mut mesh = delaunay(points, triangles);
    check(&mut mesh);
    let report = recover(&mut mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
    check(&mut mesh);
    check_facets(&mut mesh);
    report
}

/// The surface of a cube of `n` cells a side; `diagonal(x, y, face)` chooses how a square is cut.
pub fn cube(
    n: u32,
    mut diagonal: impl FnMut(u32, u32, usize) -> bool,
) -> (Vec<Point>, Vec<[u32; 3]>) {
    let mut points: Vec<Point> = Vec::new();
    let mut ids = std::collections::HashMap::new();
    let mut triangles = Vec::new();
    let mut id = |p: [u32; 3], points: &mut Vec<Point>| {
        *ids.entry(p).or_insert_with(|| {
            points.push(Point::from_array(p.map(f64::from)));
            points.len() as u32 - 1
        })
    };
    for face in 0..6 {
        let (axis, high) = (face / 2, face % 2 == 1);
        for x in 0..n {
            for y in 0..n {
                let corner = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(u, v)| {
                    let mut p = [0; 3];
                    p[axis] = if high { n } else { 0 };
                    p[(axis + 1) % 3] = u;
                    p[(axis + 2) % 3] = v;
                    id(p, &mut points)
                });
                let mut pair = if diagonal(x, y, face) {
                    [[0, 1, 2], [0, 2, 3]]
                } else {
                    [[0, 1, 3], [1, 2, 3]]
                };
                if !high {
                    pair.iter_mut().for_each(|t| t.swap(1, 2));
                }
                triangles.extend(pair.map(|t| t.map(|k: usize| corner[k])));
            }
        }
    }
    (points, triangles)
}

/// Rotates by a fixed odd angle so that coordinates are not round.
pub fn turned(points: &[Point]) -> Vec<Point> {
    let q = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, 2.7);
    points.iter().map(|&p| q * p).collect()
}

#[test]
fn grids_on_a_cube_need_no_points_whichever_way_they_are_cut() {
    let mut next = random(5);
    for n in [1, 2, 3, 7, 16] {
        for way in 0..4 {
            let (points, triangles) = cube(n, |x, y, face| match way {
                0 => true,
                1 => false,
                2 => (x + y + face as u32) % 2 == 0,
                _ => next() < 0.5,
            });
            let name = format!("cube {n} cut {way}");
            let report = recovered(&name, &points, &triangles);
            assert_eq!(report.steiner, 0, "{name}");
            let name = format!("turned cube {n} cut {way}");
            let report = recovered(&name, &turned(&points), &triangles);
            assert!(report.steiner <= triangles.len() as u32, "{name}");
        }
    }
}
