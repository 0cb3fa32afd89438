//! Orientations of points kept without rounding, against exact numbers.
//!
//! Why: the exact path of recovery stands on these signs. How: up to four points on segments and facets of four
//! tetrahedron corners, often in one plane by construction.

use std::cmp::Ordering;

use crate::boundary::exact::{
    ExactPoint, PlacedPoint, orient_filtered, orient_in_pairs, orient_placed,
};
use tetdb_base::geom::Dyadic;
use tetdb_base::geom::Point;
use truth::{Exact, RandomNumbers, Truth, cases, exact, orient_truth};

/// The exact numbers that the signs of the crate below are tested against.
#[allow(dead_code, reason = "spheres are tested in the crate below")]
#[path = "../../../base/geom/tests/oracle.rs"]
mod truth;

/// `base + Σ share · (to - base)`.
fn combination(base: Point, shares: &[(Point, f64)]) -> Exact {
    let mut at = exact(base);
    for &(to, share) in shares {
        let (to, share) = (exact(to), Truth::from(share));
        for axis in 0..3 {
            let difference = &to[axis] - &Truth::from(base[axis]);
            at[axis] = &at[axis] + &(&share * &difference);
        }
    }
    at
}

#[test]
fn orientations_of_exact_points_are_those_of_exact_numbers() {
    let mut numbers = RandomNumbers(11);
    let mut seen = [0u32; 3];
    let mut n_in_pairs = 0;
    for k in 0..cases() {
        let offset = numbers.point() * [0.0, 10.0, 1e5][k % 3];
        let corners = [0; 4].map(|_| {
            let p = numbers.point();
            offset + if k % 5 == 0 { (p * 8.0).round() } else { p }
        });
        // Points over three corners lie in one plane, over all four mostly not.
        let planar = k % 2 == 0;
        let shapes: Vec<(Point, Option<ExactPoint>, Exact)> = (0..4)
            .map(|i| {
                let turn = if planar { 3 } else { 4 };
                let pick = |j: usize| corners[(i + j) % turn];
                let share = |x: f64| {
                    if k % 7 == 0 { (x * 64.0).round() / 64.0 } else { x }
                };
                let shares = [
                    (pick(1), share(numbers.next() + 0.5)),
                    (pick(2), share(numbers.next() + 0.5)),
                ];
                let shares = match (k / 3 + i) % 3 {
                    0 => &shares[..0],
                    1 => &shares[..1],
                    _ => &shares[..],
                };
                let kept: Vec<(Point, Dyadic)> =
                    shares.iter().map(|&(to, x)| (to, x.into())).collect();
                let kept: Vec<(Point, &Dyadic)> = kept.iter().map(|(to, x)| (*to, x)).collect();
                let point = ExactPoint::combination(pick(0), &kept);
                let truth = combination(pick(0), shares);
                if shares.is_empty() {
                    (pick(0), None, exact(pick(0)))
                } else {
                    (point.rounded(), Some(point), truth)
                }
            })
            .collect();
        let placed =
            [0, 1, 2, 3].map(|i| PlacedPoint { point: shapes[i].0, exact: shapes[i].1.as_ref() });
        let truth = orient_truth(&[0, 1, 2, 3].map(|i| shapes[i].2.clone()));
        let in_pairs = orient_in_pairs(placed);
        n_in_pairs += u32::from(in_pairs.is_some() && orient_filtered(placed).is_none());
        assert!(in_pairs.is_none_or(|det| det.partial_cmp(&0.0) == Some(truth)), "case {k}");
        let found = orient_placed(placed).partial_cmp(&0.0);
        assert_eq!(found, Some(truth), "case {k}");
        assert!(!planar || truth == Ordering::Equal, "case {k}");
        seen[(truth as i8 + 1) as usize] += 1;
    }
    assert!(seen.iter().all(|&n| n > cases() as u32 / 10), "{seen:?}");
    assert!(n_in_pairs > 0);
}
