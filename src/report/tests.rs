//! Every kind of question against a look at all tetrahedra: on a grid, where everything touches, and on a real mesh.

mod grid;
mod oracle;

use std::collections::BTreeSet;

use tetdb_schema::ids::{TetId, VertexId};

use super::*;
use crate::catalog::{Catalog, Job, Store};
use crate::expr::Expression;
use crate::geom::{Aabb, Point, mix};
use crate::store::Budget;
use grid::Grid;

pub(super) type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// A store in a folder of its own.
struct Made {
    dir: tempfile::TempDir,
}

impl Made {
    fn path(&self) -> std::path::PathBuf {
        self.dir.path().join("a.tetdb")
    }

    fn inquiry(&self, cap: u64) -> Outcome<Inquiry> {
        Ok(Inquiry::open(Store::open(self.path())?, &Budget::new(cap))?)
    }

    /// All tetrahedra, read without questions.
    fn all(&self) -> Outcome<Vec<Found>> {
        let mut store = Store::open(self.path())?;
        let mut all = Vec::new();
        for row in store.catalog().subdomains()? {
            let mut part = store.subdomain(row.rank)?;
            let tets = part.tets().collect::<Result<Vec<_>, _>>()?;
            for (id, tet) in tets {
                let corners = part.corners(tet.nodes)?;
                let (ids, points) = (corners.map(|c| c.id), corners.map(|c| c.point));
                all.push(Found::new(id, tet.region, ids, points));
            }
        }
        Ok(all)
    }
}

fn grid(cells: usize, parts: usize) -> Outcome<Made> {
    let made = Made {
        dir: tempfile::tempdir()?,
    };
    Grid { cells, parts }.write(&made.path())?;
    Ok(made)
}

/// A mesh of two sub-domains with several chunks.
fn real() -> Outcome<Made> {
    real_of("box,h=0.05")
}

/// A sample in two sub-domains.
fn real_of(sample: &str) -> Outcome<Made> {
    let made = Made {
        dir: tempfile::tempdir()?,
    };
    let surface = crate::samples::SampleSpec::parse(sample)?.make()?;
    let options = crate::pipeline::Options {
        subdomains: Some("2".to_owned()),
        ..Default::default()
    };
    let job = Job {
        options: serde_json::to_string(&options)?,
        ..Job::default()
    };
    let mut catalog = Catalog::create(made.path(), &job)?;
    let budget = Budget::new(512 << 20);
    crate::pipeline::mesh(&mut catalog, &surface.into(), &options, &budget, &|_| {})?;
    catalog.close()?;
    Ok(made)
}

/// Numbers that look random, the same for the same seed.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(mix(seed))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(1);
        mix(self.0)
    }

    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn point(&mut self, bounds: &Aabb) -> Point {
        let share = Point::new(self.share(), self.share(), self.share());
        bounds.low + (bounds.high - bounds.low) * share
    }

    /// On a lattice of half cells of a grid, within it and a step beyond.
    fn lattice(&mut self, cells: usize) -> Point {
        let mut axis = || self.below(2 * cells + 3) as f64 / 2.0 - 0.5;
        Point::new(axis(), axis(), axis())
    }
}

fn ids(found: impl IntoIterator<Item = Result<Found, ReportError>>) -> Outcome<Vec<TetId>> {
    let mut ids = Vec::new();
    for tet in found {
        ids.push(tet?.id);
    }
    Ok(ids)
}

/// The least id of those that hold the point, by exact signs of volumes in rational numbers.
fn holder(all: &[(Aabb, Found)], p: Point) -> Option<TetId> {
    let near = all
        .iter()
        .filter(|(b, _)| b.low.cmple(p).all() && p.cmple(b.high).all());
    let mut holding = near.filter(|(_, t)| oracle::holds(&t.corners, p));
    holding.next().map(|(_, t)| t.id)
}

#[test]
fn points_are_found_in_the_lowest_tetrahedron_that_holds_them() -> Outcome {
    let mut random = Random::new(1);
    for (made, lattice) in [(grid(4, 3)?, 4), (grid(18, 1)?, 18), (real()?, 0)] {
        let all = made.all()?;
        let mut points = Vec::new();
        for _ in 0..150 {
            let tet = all[random.below(all.len())];
            let [a, b, c, d] = tet.corners;
            points.extend([a, (a + b) * 0.5, (a + b + c) / 3.0, (a + b + c + d) * 0.25]);
            if lattice > 0 {
                points.push(random.lattice(lattice));
            }
            points.push(random.point(&Aabb::around(all[0].corners.into_iter().chain(tet.corners))));
        }
        let all: Vec<_> = all
            .into_iter()
            .map(|t| (Aabb::around(t.corners), t))
            .collect();
        let mut inquiry = made.inquiry(64 << 20)?;
        let located = inquiry.locate(&points)?;
        for (located, &p) in located.iter().zip(&points) {
            assert_eq!(located.point, p);
            assert_eq!(located.found.map(|t| t.id), holder(&all, p), "{p}");
            let Some(found) = located.found else { continue };
            let corners = found.corners.iter().zip(located.barycentric);
            let again = corners.fold(Point::ZERO, |sum, (c, s)| sum + *c * s);
            assert!((again - p).length() < 1e-9 * found.edges()[1].max(p.length()));
        }
        // One by one, from nothing: the other way to look.
        for batch in points.chunks(7).step_by(25) {
            let alone = made.inquiry(64 << 20)?.locate(batch)?;
            let together = &located[points.iter().position(|p| p == &batch[0]).unwrap_or(0)..];
            assert_eq!(alone[0], together[0]);
            for answer in alone {
                assert_eq!(answer.found.map(|t| t.id), holder(&all, answer.point));
            }
        }
    }
    Ok(())
}

/// Solids that touch grid tetrahedra in corners, edges and faces, and others.
fn solids(random: &mut Random, lattice: Option<usize>, bounds: &Aabb) -> Vec<Solid> {
    let point = |r: &mut Random| match lattice {
        Some(cells) => r.lattice(cells),
        None => r.point(bounds),
    };
    let mut solids = Vec::new();
    for i in 0..9 {
        let (a, b) = (point(random), point(random));
        let b = if i % 3 == 0 { a } else { b };
        solids.push(Solid::Box(Aabb {
            low: a.min(b),
            high: a.max(b),
        }));
        let radius = match (lattice, i % 3) {
            (_, 0) => 0.0,
            (Some(_), 1) => random.below(5) as f64 / 2.0,
            // Through the corner of a cell, but for rounding.
            _ => (a - b.round()).length() * 0.5,
        };
        solids.push(Solid::Sphere { center: a, radius });
        let normal = if a == b { Point::Z } else { b - a };
        solids.push(Solid::Plane { point: a, normal });
    }
    solids
}

#[test]
fn solids_select_what_meets_them_and_what_lies_in_them() -> Outcome {
    let mut random = Random::new(2);
    for (made, lattice) in [(grid(4, 2)?, Some(4)), (real()?, None)] {
        let all = made.all()?;
        let mut inquiry = made.inquiry(64 << 20)?;
        let bounds = inquiry.bounds();
        let mut touching = 0;
        for solid in solids(&mut random, lattice, &bounds) {
            for inside in [false, true] {
                let selection = Selection {
                    solids: vec![solid],
                    inside,
                    ..Selection::default()
                };
                let found = ids(inquiry.select(selection)?)?;
                let found: BTreeSet<TetId> = found.into_iter().collect();
                for (i, tet) in all.iter().enumerate() {
                    // Rational numbers are slow: of the many far away only some are looked at.
                    let far = solid
                        .bounds()
                        .is_some_and(|b| !b.meets(&Aabb::around(tet.corners)));
                    if lattice.is_none() && i % if far { 997 } else { 41 } != 0 {
                        continue;
                    }
                    let expected = match inside {
                        true => oracle::within(&solid, &tet.corners),
                        false => oracle::meets(&solid, &tet.corners),
                    };
                    assert_eq!(
                        found.contains(&tet.id),
                        expected,
                        "{solid:?} {inside} {tet:?}"
                    );
                }
                touching += found.len();
            }
        }
        assert!(touching > 500, "only {touching} found");
    }
    Ok(())
}

#[test]
fn solids_of_any_scale_are_met_exactly() {
    let mut random = Random::new(3);
    let corners = [Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0), Point::ONE];
    for scale in [1e-9, 1.0, 1e9] {
        let own = corners.map(|c| c * scale);
        for _ in 0..20 {
            let shift = random.lattice(2);
            let bounds = Aabb {
                low: Point::splat(-1.0),
                high: Point::splat(2.0),
            };
            for solid in solids(&mut random, Some(1), &bounds) {
                let solid = match solid {
                    Solid::Box(b) => Solid::Box(Aabb {
                        low: (b.low - shift.abs() * 1e-17) * scale,
                        high: b.high * scale,
                    }),
                    Solid::Sphere { center, radius } => Solid::Sphere {
                        center: center * scale,
                        radius: radius * scale,
                    },
                    Solid::Plane { point, normal } => Solid::Plane {
                        point: point * scale,
                        normal,
                    },
                };
                assert_eq!(solid.meets(&own), oracle::meets(&solid, &own), "{solid:?}");
                assert_eq!(solid.holds(&own), oracle::within(&solid, &own), "{solid:?}");
            }
        }
    }
}

/// Asks, and compares with a look at all.
fn expect(
    inquiry: &mut Inquiry,
    all: &[Found],
    selection: Selection,
    holds: impl Fn(&Found) -> bool,
) -> Outcome<usize> {
    let found = ids(inquiry.select(selection.clone())?)?;
    let expected: Vec<TetId> = all.iter().filter(|t| holds(t)).map(|t| t.id).collect();
    assert_eq!(found, expected, "{selection:?}");
    Ok(found.len())
}

#[test]
fn numbers_and_conditions_select_what_they_say() -> Outcome {
    for made in [grid(6, 3)?, real()?] {
        let all = made.all()?;
        let mut inquiry = made.inquiry(64 << 20)?;
        let none = Selection::default;
        expect(&mut inquiry, &all, none(), |_| true)?;
        let selection = Selection {
            subdomains: Some(vec![1]),
            ..none()
        };
        let n = expect(&mut inquiry, &all, selection, |t| {
            t.id.subdomain().rank() == 1
        })?;
        assert!(n > 0);
        let selection = Selection {
            regions: Some(vec![2, 7]),
            ..none()
        };
        expect(&mut inquiry, &all, selection, |t| t.region == 2)?;
        for text in [
            "quality > 1.5 and region = 1",
            "x < 0.25 or z > 0.75 and subdomain in [1]",
            "edge_max > 0.07 and angle_min < 40",
            "volume*6 < edge_min^3",
            "quality > 1e6",
        ] {
            let condition = Expression::parse(text, &VARIABLES)?;
            let selection = Selection {
                condition: Some(condition.clone()),
                ..none()
            };
            expect(&mut inquiry, &all, selection, |t| {
                condition.truth(&t.values())
            })?;
        }
        let three = [all[0].id, all[all.len() / 2].id, all[all.len() - 1].id];
        let selection = Selection {
            tets: Some(three.to_vec()),
            ..none()
        };
        expect(&mut inquiry, &all, selection, |t| three.contains(&t.id))?;
        assert_eq!(inquiry.tet(three[1])?, all[all.len() / 2]);
    }
    Ok(())
}

#[test]
fn surface_and_interfaces_select_what_stands_on_them() -> Outcome {
    let (cells, parts) = (6, 3);
    let made = grid(cells, parts)?;
    let all = made.all()?;
    let mut inquiry = made.inquiry(64 << 20)?;
    let faces =
        |t: &Found, on: &dyn Fn(&Point) -> bool| t.corners.iter().filter(|c| on(c)).count() == 3;
    let end = cells as f64;
    let outer = |c: &Point| c.min_element() == 0.0 || c.max_element() == end;
    let selection = Selection {
        touching_surface: true,
        ..Selection::default()
    };
    expect(&mut inquiry, &all, selection, |t| {
        t.corners.iter().any(outer)
    })?;
    // Label 0 is the side x = 0, label 5 the side z = end.
    let sides = |t: &Found| faces(t, &|c| c.x == 0.0) || faces(t, &|c| c.z == end);
    let selection = Selection {
        labels: Some(vec![0, 5]),
        ..Selection::default()
    };
    let n = expect(&mut inquiry, &all, selection.clone(), sides)?;
    // In the cells along the edge one tetrahedron has both.
    assert_eq!(n, 2 * 2 * cells * cells - cells);
    let cut = 4.0;
    let interface = |t: &Found| faces(t, &|c| c.x == cut);
    let both = Selection {
        interface: Some([2, 1]),
        ..Selection::default()
    };
    let n = expect(&mut inquiry, &all, both.clone(), interface)?;
    assert_eq!(n, 2 * 2 * cells * cells);
    let selection = Selection {
        labels: selection.labels,
        ..both
    };
    // Rows of cells under the side z = end have at most one face on each.
    expect(&mut inquiry, &all, selection, |t| interface(t) && sides(t))?;
    let selection = Selection {
        interface: Some([0, 2]),
        ..Selection::default()
    };
    let refused = inquiry.select(selection).err();
    assert!(matches!(refused, Some(ReportError::NoInterface(0, 2))));
    let selection = Selection {
        subdomains: Some(vec![3]),
        ..Selection::default()
    };
    assert!(inquiry.select(selection).is_err());
    Ok(())
}

#[test]
fn balls_shells_and_neighbors_cross_interfaces() -> Outcome {
    let mut random = Random::new(4);
    for made in [grid(4, 2)?, real()?] {
        let all = made.all()?;
        let mut inquiry = made.inquiry(64 << 20)?;
        let mut across = 0;
        for _ in 0..40 {
            let tet = all[random.below(all.len())];
            let [a, b, ..] = tet.vertices;
            let id = |n: u64| VertexId::from_number(n).expect("it came from a store");
            for vertices in [vec![a], vec![a, b]] {
                let named: Vec<VertexId> = vertices.iter().map(|&v| id(v)).collect();
                let selection = Selection {
                    sharing: Some(inquiry.around(&named)?),
                    ..Selection::default()
                };
                expect(&mut inquiry, &all, selection, |t| {
                    vertices.iter().all(|v| t.vertices.contains(v))
                })?;
            }
            let selection = Selection {
                sharing: Some(inquiry.next_to(tet.id)?),
                ..Selection::default()
            };
            let shared = |t: &Found| {
                t.vertices
                    .iter()
                    .filter(|v| tet.vertices.contains(v))
                    .count()
            };
            let n = expect(&mut inquiry, &all, selection.clone(), |t| shared(t) == 3)?;
            assert!((1..=4).contains(&n));
            let others = ids(inquiry.select(selection)?)?;
            across += others
                .iter()
                .filter(|o| o.subdomain() != tet.id.subdomain())
                .count();
        }
        assert!(
            across > 0 || all.len() > 1000,
            "no neighbor across the interface"
        );
        let nobody: TetId = "0:536870911".parse()?;
        assert!(matches!(
            inquiry.next_to(nobody),
            Err(ReportError::NoTet { .. })
        ));
        let nowhere = VertexId::from_number(7 << 32).expect("cut 7");
        let refused = inquiry.around(&[nowhere]);
        assert!(matches!(refused, Err(ReportError::NoVertex { .. })));
    }
    Ok(())
}

#[test]
fn answers_are_sorted_by_any_variable() -> Outcome {
    let made = grid(6, 2)?;
    let mut all = made.all()?;
    let mut inquiry = made.inquiry(64 << 20)?;
    for (variable, descending) in [(4, false), (4, true), (0, true), (3, false)] {
        let dir = made.dir.path();
        // Little memory: runs go to the disk.
        let ordered = Ordered::new(
            inquiry.select(Selection::default())?,
            variable,
            descending,
            dir,
            1 << 16,
        )?;
        let found: Vec<Found> = ordered.collect::<Result<_, _>>()?;
        all.sort_by(|a, b| {
            let (x, y) = (a.values()[variable], b.values()[variable]);
            let by_value = x.total_cmp(&y);
            let by_value = if descending {
                by_value.reverse()
            } else {
                by_value
            };
            by_value.then(a.id.cmp(&b.id))
        });
        assert_eq!(found, all);
    }
    Ok(())
}

#[test]
fn the_worst_and_the_best_are_found_without_a_look_at_all() -> Outcome {
    for made in [grid(6, 2)?, real()?] {
        let all = made.all()?;
        for (text, greatest, limit) in [
            ("true", true, 7),
            ("true", false, 1),
            ("x > 0.3", true, 100),
            ("quality < 1.3", true, 5),
            ("x > 99", true, 5),
            ("true", true, 0),
            ("y > 0.5", false, 1_000_000),
        ] {
            let condition = Expression::parse(text, &VARIABLES)?;
            let mut expected: Vec<Found> = all
                .iter()
                .copied()
                .filter(|t| condition.truth(&t.values()))
                .collect();
            let key = |t: &Found| {
                if greatest {
                    -t.shape.quality
                } else {
                    t.shape.quality
                }
            };
            expected.sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.id.cmp(&b.id)));
            expected.truncate(limit);
            let selection = Selection {
                condition: Some(condition),
                ..Selection::default()
            };
            let mut inquiry = made.inquiry(64 << 20)?;
            let found = inquiry.extreme(&selection, greatest, limit)?;
            assert_eq!(found, expected, "{text}");
            // A single one is found in the chunk that promises most, but for a promise hardly kept.
            let measures = inquiry.measures();
            assert!(
                limit > 1 || measures.tet_chunks_read <= 2,
                "{text}: {measures:?}"
            );
        }
    }
    Ok(())
}

#[test]
fn only_chunks_that_matter_are_read() -> Outcome {
    let made = real_of("box,h=0.035")?;
    let all = made.all()?;
    let mut inquiry = made.inquiry(64 << 20)?;
    let chunks = inquiry.measures();
    assert!(chunks.tet_chunks >= 4, "{chunks:?}");
    let nowhere = Selection {
        solids: vec![Solid::Sphere {
            center: Point::splat(-9.0),
            radius: 1.0,
        }],
        ..Selection::default()
    };
    assert_eq!(inquiry.select(nowhere)?.count(), 0);
    let never = Selection {
        condition: Some(Expression::parse("quality > 1e6 or x > 17", &VARIABLES)?),
        ..Selection::default()
    };
    assert_eq!(inquiry.select(never)?.count(), 0);
    inquiry.locate(&[Point::splat(-1.0)])?;
    assert_eq!(inquiry.measures().tet_chunks_read, 0);
    let center = all[all.len() / 3].centroid();
    inquiry.locate(&[center])?;
    let read = inquiry.measures();
    assert!(read.tet_chunks_read <= 2, "{read:?}");
    assert!(
        read.vertex_chunks_read < chunks.vertex_chunks / 2,
        "{read:?}"
    );
    Ok(())
}

/// Twice the area of a piece, turned counter-clockwise or not.
fn area(piece: &Piece) -> f64 {
    let corners = &piece.corners[..piece.n];
    let turned = corners.iter().zip(corners.iter().cycle().skip(1));
    turned.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum()
}

#[test]
fn sections_cover_what_the_plane_cuts_once() -> Outcome {
    let made = grid(4, 2)?;
    let mut inquiry = made.inquiry(64 << 20)?;
    let diagonal = 16.0 * 2f64.sqrt();
    for (origin, normal, expected) in [
        // Between and through vertices, from both sides, along a diagonal, through a corner.
        (Point::new(0.0, 0.0, 1.3), Point::Z, 16.0),
        (Point::new(0.0, 0.0, 2.0), Point::Z, 16.0),
        (Point::new(2.0, 0.0, 0.0), Point::NEG_X * 1e-200, 16.0),
        (
            Point::new(2.0, 2.0, 0.0),
            Point::new(1.0, 1.0, 0.0),
            diagonal,
        ),
        (Point::new(4.0, 4.0, 4.0), Point::ONE, 0.0),
    ] {
        let view = View::new(origin, normal);
        let section = |inquiry: &mut Inquiry, crinkle| {
            inquiry.section(
                &view,
                crinkle,
                Selection::default(),
                made.dir.path(),
                1 << 16,
            )
        };
        let cut = section(&mut inquiry, false)?;
        let extent = cut.extent;
        let pieces: Vec<Piece> = cut.collect::<Result<_, _>>()?;
        assert_eq!(pieces.len() as u64, extent.n);
        let sum: f64 = pieces.iter().map(|p| area(p).abs()).sum();
        assert!(
            (sum / 2.0 - expected).abs() < 1e-9,
            "{origin} {normal}: {sum}"
        );
        assert!(pieces.iter().all(|p| p.quality >= 1.0 && p.facing == 1.0));
        if expected == 0.0 {
            continue;
        }
        // Faces of whole tetrahedra, seen from the front, hide no less.
        let whole = section(&mut inquiry, true)?;
        let pieces: Vec<Piece> = whole.collect::<Result<_, _>>()?;
        assert!(
            pieces
                .iter()
                .all(|p| p.n == 3 && p.facing > 0.0 && area(p) > 0.0)
        );
        let sum: f64 = pieces.iter().map(area).sum();
        assert!(sum / 2.0 >= expected - 1e-9, "{sum}");
    }
    Ok(())
}
