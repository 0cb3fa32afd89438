//! Questions about points and solids.

use super::*;

/// The lowest id among the tetrahedra that contain the point, by exact signs of volumes in rational numbers.
fn holder(all: &[(Aabb, Hit)], p: Point) -> Option<TetId> {
    let near = all.iter().filter(|(b, _)| b.low.cmple(p).all() && p.cmple(b.high).all());
    let mut holding = near.filter(|(_, t)| oracle::holds(&t.corners, p));
    holding.next().map(|(_, t)| t.id)
}

#[test]
fn points_are_found_in_the_lowest_tetrahedron_that_holds_them() -> Outcome {
    let mut random = Random::new(1);
    for (fixture, lattice) in [(grid(4, 3)?, 4), (grid(18, 1)?, 18), (real()?, 0)] {
        let all = fixture.all()?;
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
        let all: Vec<_> = all.into_iter().map(|t| (Aabb::around(t.corners), t)).collect();
        let mut session = fixture.session(64 << 20)?;
        let located = session.locate(&points)?;
        for (located, &p) in located.iter().zip(&points) {
            assert_eq!(located.point, p);
            assert_eq!(located.found.map(|t| t.id), holder(&all, p), "{p}");
            let Some(found) = located.found else { continue };
            let corners = found.corners.iter().zip(located.barycentric);
            let again = corners.fold(Point::ZERO, |sum, (c, s)| sum + *c * s);
            assert!((again - p).length() < 1e-9 * found.edges()[1].max(p.length()));
        }
        // A few points at a time, each batch in a new session: the other way of searching.
        for batch in points.chunks(7).step_by(25) {
            let alone = fixture.session(64 << 20)?.locate(batch)?;
            let together = &located[points.iter().position(|p| p == &batch[0]).unwrap_or(0)..];
            assert_eq!(alone[0], together[0]);
            for answer in alone {
                assert_eq!(answer.found.map(|t| t.id), holder(&all, answer.point));
            }
        }
    }
    Ok(())
}

/// Solids that touch grid tetrahedra in corners, edges and faces, and other solids.
fn solids(random: &mut Random, lattice: Option<usize>, bounds: &Aabb) -> Vec<Solid> {
    let point = |r: &mut Random| match lattice {
        Some(cells) => r.lattice(cells),
        None => r.point(bounds),
    };
    let mut solids = Vec::new();
    for i in 0..9 {
        let (a, b) = (point(random), point(random));
        let b = if i % 3 == 0 { a } else { b };
        solids.push(Solid::Box(Aabb { low: a.min(b), high: a.max(b) }));
        let radius = match (lattice, i % 3) {
            (_, 0) => 0.0,
            (Some(_), 1) => random.below(5) as f64 / 2.0,
            // Through the corner of a cell, up to rounding.
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
    for (fixture, lattice) in [(grid(4, 2)?, Some(4)), (real()?, None)] {
        let all = fixture.all()?;
        let mut session = fixture.session(64 << 20)?;
        let bounds = session.bounds();
        let mut touching = 0;
        for solid in solids(&mut random, lattice, &bounds) {
            for inside in [false, true] {
                let selection = Selection { solids: vec![solid], inside, ..Selection::default() };
                let found = ids(session.select(selection)?)?;
                let found: BTreeSet<TetId> = found.into_iter().collect();
                for (i, tet) in all.iter().enumerate() {
                    // Rational numbers are slow, so only some of the many distant tetrahedra are checked.
                    let far = solid.bounds().is_some_and(|b| !b.meets(&Aabb::around(tet.corners)));
                    if lattice.is_none() && i % if far { 997 } else { 41 } != 0 {
                        continue;
                    }
                    let expected = match inside {
                        true => oracle::within(&solid, &tet.corners),
                        false => oracle::meets(&solid, &tet.corners),
                    };
                    assert_eq!(found.contains(&tet.id), expected, "{solid:?} {inside} {tet:?}");
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
            let bounds = Aabb { low: Point::splat(-1.0), high: Point::splat(2.0) };
            for solid in solids(&mut random, Some(1), &bounds) {
                let solid = match solid {
                    Solid::Box(b) => Solid::Box(Aabb {
                        low: (b.low - shift.abs() * 1e-17) * scale,
                        high: b.high * scale,
                    }),
                    Solid::Sphere { center, radius } => {
                        Solid::Sphere { center: center * scale, radius: radius * scale }
                    }
                    Solid::Plane { point, normal } => Solid::Plane { point: point * scale, normal },
                };
                assert_eq!(solid.meets(&own), oracle::meets(&solid, &own), "{solid:?}");
                assert_eq!(solid.holds(&own), oracle::within(&solid, &own), "{solid:?}");
            }
        }
    }
}
