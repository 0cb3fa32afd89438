//! The listed solids, each as constructed, rotated, scaled, moved far away and shuffled.

use std::time::{Duration, Instant};

use tetdb_base::geom::Point;

use super::mesher::{Outcome, recovery, whole};
use super::random::Random;
use super::shape::Shape;
use super::solids::*;

/// Longest time for one case.
const CASE_TIME_MAX: Duration = Duration::from_secs(30);

/// Factor for the number of variants of each solid: the value of `TETDB_TORTURE`, or 1.
fn variants() -> usize {
    let word = std::env::var("TETDB_TORTURE").unwrap_or_default();
    word.parse().unwrap_or(1)
}

/// Checks that the outcome keeps the promise. A refusal is accepted only if rounding may have caused crossings.
fn judge(shape: &Shape, outcome: &Outcome, took: Duration, may_refuse: bool) -> Result<(), String> {
    let what = match outcome {
        Outcome::Meshed { .. } => None,
        Outcome::Refused(_) | Outcome::TooNear(_) if may_refuse => None,
        Outcome::Refused(why) => Some(format!("refused: {why}")),
        Outcome::TooNear(why) | Outcome::GaveUp(why) => Some(format!("gave up: {why}")),
        Outcome::Wrong(what) => Some(format!("wrong: {what}")),
    };
    if std::env::var_os("TETDB_TORTURE_TELL").is_some() {
        println!("{took:8.3?} {} {outcome:?}", shape.name);
    }
    match what {
        Some(what) => Err(format!("{}: {what}", shape.name)),
        None if took > CASE_TIME_MAX => Err(format!("{}: took {took:?}", shape.name)),
        None => Ok(()),
    }
}

/// Meshes the solids unchanged, through a store, and variants of them in memory.
fn torture(solids: Vec<Shape>) {
    let mut failures = Vec::new();
    let mut refused = [0, 0];
    for (k, solid) in solids.iter().enumerate() {
        let mut run = |shape: &Shape, may_refuse: bool, on_disk: bool| {
            let clock = Instant::now();
            let outcome = if on_disk { whole(shape, "none") } else { recovery(shape) };
            refused[0] += 1;
            refused[1] += usize::from(matches!(outcome, Outcome::Refused(_) | Outcome::TooNear(_)));
            failures.extend(judge(shape, &outcome, clock.elapsed(), may_refuse).err());
        };
        run(solid, false, true);
        let mut random = Random::new(k as u64);
        for round in 0..variants() {
            let shuffled = solid.clone().shuffled(&mut random);
            run(&shuffled, false, false);
            run(&shuffled.clone().turned(&mut random), true, false);
            let by = 10f64.powf(random.between(-9.0, 9.0));
            run(&shuffled.clone().turned(&mut random).scaled(by), true, round == 0);
            let far = Point::new(6e5, -7e5, 4e5);
            run(&shuffled.turned(&mut random).moved(far), true, false);
        }
    }
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
    // Most variants must be meshed; otherwise the test would show little.
    assert!(refused[1] * 2 < refused[0], "{} of {} refused", refused[1], refused[0]);
}

#[test]
fn twisted_prisms_alone_chained_and_nested() {
    let mut solids = Vec::new();
    for n in 3..10 {
        for k in 1..4 {
            let limit = std::f64::consts::PI * (1.0 - 2.0 / f64::from(n));
            solids.push(twisted(n, 1, -limit * 0.3 * f64::from(k), 1.0));
        }
    }
    for layers in [2, 5] {
        solids.push(twisted(3, layers, -0.5, 1.0));
        solids.push(twisted(6, layers, 0.6, 0.3));
    }
    for shells in [2, 4] {
        solids.push(nested(&twisted(3, 1, -0.4, 1.0), shells, 0.6));
        solids.push(nested(&twisted(5, 2, 0.5, 1.0), shells, 0.75));
    }
    torture(solids);
}

#[test]
fn chazelles_polyhedron() {
    let sizes = [(1, 0.1), (2, 0.1), (3, 1e-2), (4, 1e-1), (5, 1e-3)];
    torture(sizes.into_iter().map(|(n, gap)| chazelle(n, gap)).collect());
}

#[test]
fn grids_cut_one_way_both_ways_and_at_random() {
    let mut random = Random::new(7);
    let mut solids = Vec::new();
    for n in [1, 2, 5, 9] {
        for way in 0..4 {
            let mut s = grid([n; 3], |x, y, face| match way {
                0 => true,
                1 => face % 2 == 0,
                2 => (x + y).is_multiple_of(2),
                _ => random.one_in(2),
            });
            s.name = format!("{} cut way {way}", s.name);
            solids.push(s);
        }
    }
    torture(solids);
}

#[test]
fn cospherical_points() {
    let mut random = Random::new(8);
    let mut solids = vec![icosphere(0), icosphere(1), icosphere(2)];
    for (rings, around) in [(1, 3), (3, 5), (8, 16)] {
        solids.push(globe(rings, around, &mut random));
        let s = globe(rings, around, &mut random);
        solids.push(s.mapped(|p| Point::new(p.x, p.y, p.z * 0.02)).named(", flat"));
        solids.push(cylinder(around, rings, 2.0, &mut random));
        solids.push(cylinder(around, rings, 1e-3, &mut random));
    }
    torture(solids);
}

#[test]
fn needles_and_thin_plates() {
    let mut random = Random::new(9);
    let mut solids = Vec::new();
    for length in [1e2, 1e4, 1e6] {
        solids.push(cylinder(5, 1, length, &mut random));
        solids.push(cylinder(7, 6, length, &mut random));
        solids.push(twisted(3, 1, -0.5, length));
    }
    for thickness in [1e-2, 1e-4, 1e-6, 1e-8] {
        let s = grid([4, 4, 1], |x, y, face| (3 * x + y + face as u32).is_multiple_of(2));
        let s = s.mapped(|p| Point::new(p.x, p.y, p.z * thickness));
        solids.push(s.named(&format!(" thick {thickness:e}")));
    }
    torture(solids);
}

#[test]
fn small_dihedral_angles() {
    let mut random = Random::new(10);
    let mut solids = Vec::new();
    for angle in [1e-1, 1e-3, 1e-4, 1e-5, 1e-6] {
        solids.push(book(1, angle, angle));
        solids.push(book(3, angle, angle));
        solids.push(book(12, angle, angle * 3.0));
        solids.push(wedge(1, angle, &mut random));
        solids.push(wedge(6, angle, &mut random));
    }
    torture(solids);
}

#[test]
fn letters_with_holes() {
    let mut random = Random::new(11);
    let letters = [
        " ### ", "#   #", "#   #", "#####", "#   #", "     ", "#### ", "#   #", "#### ", "#   #",
        "#### ",
    ];
    let mut solids = Vec::new();
    for depth in [1.0, 0.1, 1e-3] {
        solids.push(extruded(&letters, depth, &mut random));
    }
    let e = [
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 0.5],
        [0.5, 0.5],
        [0.5, 2.0],
        [2.0, 2.0],
        [2.0, 2.5],
        [0.5, 2.5],
        [0.5, 4.5],
        [3.0, 4.5],
        [3.0, 5.0],
        [0.0, 5.0],
    ];
    let comb: Vec<[f64; 2]> = (0..40)
        .flat_map(|k| {
            let x = f64::from(k);
            [[x, 0.1], [x + 0.5, 20.0]]
        })
        .chain([[40.0, 0.1], [40.0, 0.0], [0.0, 0.0]])
        .collect();
    for depth in [5.0, 0.2, 1e-3] {
        solids.push(pulled("letter E", &e, depth));
        solids.push(pulled("comb", &comb, depth));
    }
    torture(solids);
}

#[test]
fn vertices_one_bit_apart() {
    let mut random = Random::new(12);
    let mut solids = Vec::new();
    for n in [1, 2, 4] {
        let cube = grid([n; 3], |x, y, _| (x * 7 + y).is_multiple_of(3)).mapped(|p| p + Point::ONE);
        solids.push(twins(n, &mut random));
        // A plate as thin as doubles allow, over a coordinate of one.
        let plate = cube.mapped(|p| {
            let z = if p.z == 1.0 { 1.0 } else { next_up(1.0) };
            Point::new(p.x, p.y, z)
        });
        if n == 1 {
            solids.push(plate.named(" one bit thick"));
        }
    }
    torture(solids);
}
