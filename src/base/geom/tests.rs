//! Signs compared with exact numbers, on points chosen to be hard.
//!
//! Why: one wrong sign is a wrong mesh. How: a hundred thousand cases of each kind ("TETDB_CASES" sets another number).
//! They include points in one plane and on one sphere, off by one unit in the last place, far from the origin, of mixed
//! magnitudes.

pub(super) mod oracle;

use std::cmp::Ordering;

use super::{Point, in_sphere_perturbed, insphere, orient};
use oracle::{RandomNumbers, cases, exact, insphere_truth, orient_truth};

impl RandomNumbers {
    /// One unit in the last place up, down, or none, on each axis.
    fn nudged(&mut self, p: Point) -> Point {
        Point::from_array(p.to_array().map(|x| match (self.next() * 6.0) as i32 {
            1.. => x.next_up(),
            0 => x,
            _ => x.next_down(),
        }))
    }
}

/// Five points of the kind `k`.
fn hard_points(numbers: &mut RandomNumbers, k: usize) -> [Point; 5] {
    let offset = numbers.point() * [0.0, 1.0, 1e3, 1e8][k / 8 % 4];
    let scale = [1.0, 1e-12, 1e20, 1e-25][k / 32 % 4];
    let (a, b, c) = (numbers.point(), numbers.point(), numbers.point());
    let mut p = match k % 8 {
        // On a small grid: exact ties of all kinds.
        0 => [0; 5].map(|_| (numbers.point() * 4.0).round()),
        // In the plane of the first three, up to rounding.
        1 | 2 => {
            let mut mix = || a + (b - a) * numbers.next() + (c - a) * numbers.next();
            let (d, e) = (mix(), mix());
            [a, b, c, d, e]
        }
        // On one sphere, up to rounding.
        3 | 4 => [0; 5].map(|_| a + numbers.point().normalize_or_zero() * 0.7),
        // On a line.
        5 => [0; 5].map(|_| a + (b - a) * numbers.next()),
        // Of mixed magnitudes.
        6 => [0, 1, 2, 3, 4].map(|i| numbers.point() * 2f64.powi(-17 * i)),
        _ => [a, b, c, numbers.point(), numbers.point()],
    };
    for p in &mut p {
        *p = *p * scale + offset * scale;
        if k % 2 == 1 {
            *p = numbers.nudged(*p);
        }
    }
    p
}

fn sign(x: f64) -> Ordering {
    x.partial_cmp(&0.0).expect("a number")
}

#[test]
fn signs_are_those_of_exact_numbers() {
    let mut numbers = RandomNumbers(3);
    let mut seen = [[0u32; 3]; 2];
    for k in 0..cases() {
        let p = hard_points(&mut numbers, k);
        let [a, b, c, d, e] = p;
        let truth = orient_truth(&[a, b, c, d].map(exact));
        assert_eq!(sign(orient(a, b, c, d)), truth, "{p:?}");
        seen[0][(truth as i8 + 1) as usize] += 1;
        let truth = insphere_truth(&p.map(exact));
        assert_eq!(sign(insphere(a, b, c, d, e)), truth, "{p:?}");
        seen[1][(truth as i8 + 1) as usize] += 1;
    }
    // All cases were tested.
    let least = cases() as u32 / 50;
    assert!(seen.iter().flatten().all(|&n| n > least), "{seen:?}");
}

#[test]
fn ties_are_decided_alike_from_every_side() {
    let mut numbers = RandomNumbers(5);
    let mut ties = 0;
    for _ in 0..cases() / 10 {
        let p = [0; 5].map(|_| (numbers.point() * 4.0).round());
        let different = (0..5).all(|i| (0..i).all(|j| p[i] != p[j]));
        let [a, b, c, d, e] = p;
        if !different || orient(a, b, c, d) <= 0.0 {
            continue;
        }
        ties += u32::from(insphere(a, b, c, d, e) == 0.0);
        let inside = in_sphere_perturbed(a, b, c, d, e);
        for even in [[b, c, a, d], [c, a, b, d], [b, a, d, c], [d, c, b, a]] {
            let [a, b, c, d] = even;
            assert_eq!(in_sphere_perturbed(a, b, c, d, e), inside);
        }
        // Two tetrahedra on one face see each other alike, when both are positive.
        if orient(a, c, b, e) > 0.0 {
            assert_eq!(in_sphere_perturbed(a, c, b, e, d), inside, "{p:?}");
        }
    }
    assert!(ties > cases() as u32 / 1000, "{ties}");
}
