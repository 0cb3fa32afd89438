//! Generated surfaces with known difficulties.

use super::build::{check, check_facets, delaunay};
use crate::boundary::{RecoveryReport, recover};
use tetdb_base::geom::Point;

/// Deterministic pseudo-random numbers in [0, 1).
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
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
                2 => (x + y + face as u32).is_multiple_of(2),
                _ => next() < 0.5,
            });
            let name = format!("cube {n} cut {way}");
            let report = recovered(&name, &points, &triangles);
            assert!(report.steiner <= triangles.len() as u32, "{name}");
            let name = format!("turned cube {n} cut {way}");
            let report = recovered(&name, &turned(&points), &triangles);
            assert!(report.steiner <= triangles.len() as u32, "{name}");
        }
    }
}

/// A prism over a regular polygon of `n` corners whose top is turned by `twist` against the bottom.
///
/// The sides are cut along the diagonal that the twist pushes inward: for three corners and a large
/// twist this is Schönhardt's polyhedron, which has no tetrahedra without further points.
pub fn twisted(n: u32, twist: f64, height: f64) -> (Vec<Point>, Vec<[u32; 3]>) {
    let corner = |i: u32, turn: f64, z: f64| {
        let t = f64::from(i) / f64::from(n) * std::f64::consts::TAU + turn;
        Point::new(t.cos(), t.sin(), z)
    };
    let mut points: Vec<Point> = (0..n).map(|i| corner(i, 0.0, 0.0)).collect();
    points.extend((0..n).map(|i| corner(i, twist, height)));
    let mut triangles = Vec::new();
    for i in 1..n - 1 {
        triangles.push([0, i + 1, i]);
        triangles.push([n, n + i, n + i + 1]);
    }
    for i in 0..n {
        let j = (i + 1) % n;
        triangles.push([i, j, n + i]);
        triangles.push([j, n + j, n + i]);
    }
    (points, triangles)
}

#[test]
fn twisted_prisms_get_points_inside_only() {
    for n in 3..9 {
        for k in 0..6 {
            let twist = -0.1 - 0.15 * f64::from(k) * 3.0 / f64::from(n);
            let (points, triangles) = twisted(n, twist, 1.0);
            recovered(&format!("prism {n} by {twist}"), &points, &triangles);
            recovered(&format!("turned prism {n} by {twist}"), &turned(&points), &triangles);
        }
    }
}

/// Joins solids into one surface, each scaled and moved.
pub fn joined(parts: &[(Vec<Point>, Vec<[u32; 3]>)]) -> (Vec<Point>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for (p, t) in parts {
        let base = points.len() as u32;
        points.extend_from_slice(p);
        triangles.extend(t.iter().map(|t| t.map(|v| v + base)));
    }
    (points, triangles)
}

pub fn placed(
    part: &(Vec<Point>, Vec<[u32; 3]>),
    scale: Point,
    by: Point,
) -> (Vec<Point>, Vec<[u32; 3]>) {
    (part.0.iter().map(|&p| p * scale + by).collect(), part.1.clone())
}

#[test]
fn a_stack_of_twisted_prisms_close_together_is_recovered() {
    let prism = twisted(3, -0.5, 1.0);
    let parts: Vec<_> = (0..6)
        .map(|i| placed(&prism, Point::ONE, Point::new(0.0, 0.0, 1.01 * f64::from(i))))
        .collect();
    let (points, triangles) = joined(&parts);
    recovered("stack", &points, &triangles);
    recovered("turned stack", &turned(&points), &triangles);
}

#[test]
fn thin_plates_with_different_cuts_are_recovered() {
    for thickness in [0.1, 1e-2, 1e-4, 1e-6] {
        let (points, triangles) = cube(5, |x, y, face| (x * 3 + y + face as u32).is_multiple_of(2));
        let plate = placed(&(points, triangles), Point::new(1.0, 1.0, thickness), Point::ZERO);
        recovered(&format!("plate {thickness}"), &plate.0, &plate.1);
        recovered(&format!("turned plate {thickness}"), &turned(&plate.0), &plate.1);
    }
}

#[test]
fn nested_shells_are_told_apart() {
    use crate::boundary::{RegionPolicy, RegionRule, fill_regions};
    use tetdb_base::surface::{Seed, SeedKind};
    let seed = |at: f64, name: &str| Seed {
        point: Point::splat(at),
        kind: SeedKind::Region(Some(name.to_owned())),
    };
    let make = || {
        let parts: Vec<_> = (0..3)
            .map(|i| {
                let side = 10.0 - 3.0 * f64::from(i);
                let solid = cube(3, |x, y, _| (x + y).is_multiple_of(2));
                placed(&solid, Point::splat(side / 3.0), Point::splat(1.5 * f64::from(i)))
            })
            .collect();
        let (points, triangles) = joined(&parts);
        let mut mesh = delaunay(&points, &triangles);
        recover(&mut mesh).expect("nested cubes");
        mesh
    };
    for (policy, filled, volume) in [
        (RegionPolicy::Parity, vec![1, 0, 2], 1000.0 - 343.0 + 64.0),
        (RegionPolicy::All, vec![1, 2, 3], 1000.0),
        (RegionPolicy::Outer, vec![1, 0, 0], 657.0),
        (RegionPolicy::Seeds, vec![0, 0, 1], 64.0),
    ] {
        let mut mesh = make();
        let mut rule = RegionRule::from(policy);
        if policy == RegionPolicy::Seeds {
            rule.seeds = vec![seed(5.0, "core")];
        }
        let regions = fill_regions(&mut mesh, &rule).expect("closed");
        let numbers: Vec<u32> = regions.list.iter().map(|r| r.region).collect();
        assert_eq!(numbers, filled, "{policy:?}");
        let sum: f64 = regions.list.iter().filter(|r| r.region > 0).map(|r| r.volume).sum();
        assert!((sum - volume).abs() < 1e-9, "{policy:?} {sum}");
        check(&mut mesh);
        let n: u32 = regions.list.iter().filter(|r| r.region > 0).map(|r| r.tets).sum();
        assert_eq!(n, mesh.n_tets());
    }
    for seeds in [vec![seed(-5.0, "out")], vec![seed(5.0, "a"), seed(5.1, "b")]] {
        let mut rule = RegionRule::from(RegionPolicy::Seeds);
        rule.seeds = seeds;
        assert!(fill_regions(&mut make(), &rule).is_err());
    }
    // All normals point outward: the middle shell is inside two of them.
    let regions = fill_regions(&mut make(), &RegionPolicy::ByOrientation.into()).expect("oriented");
    assert!(regions.list.iter().all(|r| r.region > 0));
}

#[test]
fn two_cubes_that_share_a_wall_are_both_filled() {
    use crate::boundary::{RegionPolicy, fill_regions};
    let (points, triangles) = cube(2, |_, _, _| true);
    // The second cube is the mirror image across x = 0, so the wall's triangles match.
    let mirrored: Vec<Point> = points.iter().map(|p| Point::new(-p.x, p.y, p.z)).collect();
    let mut all = points.clone();
    let mut twin = vec![0u32; points.len()];
    for (i, p) in mirrored.iter().enumerate() {
        twin[i] = all.iter().position(|q| q == p).unwrap_or_else(|| {
            all.push(*p);
            all.len() - 1
        }) as u32;
    }
    let mut both = triangles.clone();
    both.extend(triangles.iter().map(|&[a, b, c]| [a, c, b].map(|v| twin[v as usize])));
    let mut mesh = delaunay(&all, &both);
    recover(&mut mesh).expect("two cubes");
    let regions = fill_regions(&mut mesh, &RegionPolicy::Parity.into()).expect("closed");
    assert!(!regions.all_instead_of_parity);
    assert_eq!(regions.list.iter().map(|r| r.region).collect::<Vec<_>>(), [1, 2]);
    // Given once, the wall makes parity contradictory.
    both.truncate(triangles.len());
    both.extend(
        triangles
            .iter()
            .map(|&[a, b, c]| [a, c, b].map(|v| twin[v as usize]))
            .filter(|t| !t.iter().all(|&v| all[v as usize].x == 0.0)),
    );
    let mut mesh = delaunay(&all, &both);
    recover(&mut mesh).expect("two cubes and a wall");
    let regions = fill_regions(&mut mesh, &RegionPolicy::Parity.into()).expect("closed");
    assert!(regions.all_instead_of_parity);
    assert_eq!(regions.list.len(), 2);
}

#[test]
fn random_cuts_of_cospherical_and_random_hulls_are_recovered() {
    // Rings of latitude: many cocircular and cospherical points, quads cut at random.
    let mut next = random(11);
    for (n_rings, n_around) in [(3u32, 5u32), (6, 12), (10, 20)] {
        for round in 0..6 {
            let squash = [1.0, 0.3, 0.02][round % 3];
            let mut points = vec![Point::new(0.0, 0.0, -squash), Point::new(0.0, 0.0, squash)];
            for r in 1..=n_rings {
                let t = std::f64::consts::PI * (f64::from(r) / f64::from(n_rings + 1) - 0.5);
                for k in 0..n_around {
                    let u = std::f64::consts::TAU * f64::from(k) / f64::from(n_around);
                    points.push(Point::new(t.cos() * u.cos(), t.cos() * u.sin(), t.sin() * squash));
                }
            }
            let id = |r: u32, k: u32| 2 + r * n_around + k % n_around;
            let mut triangles = Vec::new();
            for k in 0..n_around {
                triangles.push([0, id(0, k + 1), id(0, k)]);
                triangles.push([1, id(n_rings - 1, k), id(n_rings - 1, k + 1)]);
                for r in 0..n_rings - 1 {
                    let [a, b, c, d] = [id(r, k), id(r, k + 1), id(r + 1, k + 1), id(r + 1, k)];
                    if next() < 0.5 {
                        triangles.extend([[a, b, c], [a, c, d]]);
                    } else {
                        triangles.extend([[a, b, d], [b, c, d]]);
                    }
                }
            }
            recovered(&format!("rings {n_rings} {n_around} {round}"), &points, &triangles);
            recovered(
                &format!("turned rings {n_rings} {n_around} {round}"),
                &turned(&points),
                &triangles,
            );
        }
    }
}

/// A long thin plate, top and bottom cut into slats from corner to corner, with small tetrahedra above and below its middle.
fn slats(n: u32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let (long, step, thick) = (30.0, 0.125, 0.25);
    let mut points = Vec::new();
    for z in [0.0, -thick] {
        for x in [0.0, long] {
            points.extend((0..=n).map(|i| Point::new(x, step * f64::from(i), z)));
        }
    }
    let at = |low: u32, right: u32, i: u32| (2 * low + right) * (n + 1) + i;
    let mut triangles = Vec::new();
    for i in 0..n {
        triangles.push([at(0, 0, 0), at(0, 1, i), at(0, 1, i + 1)]);
        triangles.push([at(0, 1, n), at(0, 0, i + 1), at(0, 0, i)]);
        triangles.push([at(1, 1, 0), at(1, 0, i), at(1, 0, i + 1)]);
        triangles.push([at(1, 0, n), at(1, 1, i + 1), at(1, 1, i)]);
        for (right, j, k) in [(0, i + 1, i), (1, i, i + 1)] {
            triangles.push([at(0, right, j), at(1, right, j), at(1, right, k)]);
            triangles.push([at(0, right, j), at(1, right, k), at(0, right, k)]);
        }
    }
    for (i, from, to) in [(0, 0, 1), (n, 1, 0)] {
        triangles.push([at(0, from, i), at(1, from, i), at(1, to, i)]);
        triangles.push([at(0, from, i), at(1, to, i), at(0, to, i)]);
    }
    let mut next = random(3);
    for k in 0..n {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let middle = Point::new(
            0.4 * long + 6.0 * next(),
            step * f64::from(n) * next(),
            side * (1.0 + next()) - thick / 2.0,
        );
        let first = points.len() as u32;
        let corners = [Point::ZERO, Point::X, Point::Y, Point::Z];
        points.extend(corners.map(|c| middle + c * 1e-3));
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        triangles.extend(faces.map(|f: [u32; 3]| f.map(|i| first + i)));
    }
    (points, triangles)
}

#[test]
fn a_plate_of_slats_that_edges_pierce_is_recovered_by_turning_edges() {
    for n in [8, 40] {
        let (points, triangles) = slats(n);
        let report = recovered("slats", &points, &triangles);
        assert!(report.missing_segments > n, "{report:?}");
        // A point for each crossing of a segment would be many times this.
        assert!(report.points_on_surface < 40 * n, "{report:?}");
        assert!(report.steiner < 20 * n, "{report:?}");
        recovered("turned slats", &turned(&points), &triangles);
    }
}

#[test]
fn fans_of_hundreds_of_slats_are_turned_edge_by_edge() {
    for n in [100, 600, 1000] {
        let (points, triangles) = twisted(n, 0.0, 0.2);
        let report = recovered(&format!("fan {n}"), &points, &triangles);
        assert_eq!(report.points_on_surface, 0, "{n}: {report:?}");
        // From the hub, an edge is turned once; from the outline it was turned thirteen times.
        let flips_max = if n < 1000 { 8 } else { 2 };
        let n_facets = u64::from(report.facets);
        assert!(report.flips < flips_max * n_facets, "{n}: {report:?}");
    }
}
