//! The least q of tetrahedra on a triangle, from a table: a search for each of millions of tetrahedra takes too long.

use std::sync::OnceLock;

use super::anatomy::FACES;
use super::bound::{excess, face_least};
use super::quality::quality;
use crate::geom::Point;

/// Intervals of the table in x, from 1/2 to 1, and in y, from [`LOW`] to [`HIGH`].
const N: [usize; 2] = [40, 60];
/// Triangles of a lesser height over their longest edge are needles: few, and searched.
const LOW: f64 = 0.15;
/// An equilateral one has 0.866.
const HIGH: f64 = 0.9;

/// Goodness by the third corner of a triangle with longest edge from (0, 0) to (1, 0).
fn table() -> &'static [f64] {
    static TABLE: OnceLock<Vec<f64>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let rows = (0..=N[1]).map(|j| LOW + (HIGH - LOW) * j as f64 / N[1] as f64);
        let places =
            rows.flat_map(|y| (0..=N[0]).map(move |i| (0.5 + 0.5 * i as f64 / N[0] as f64, y)));
        let least = |(x, y)| face_least([Point::ZERO, Point::X, Point::new(x, y, 0.0)]);
        places.map(|place| 1.0 / least(place)).collect()
    })
}

/// [`face_least`] within 5 in 1000.
fn face_least_near(corners: [Point; 3]) -> f64 {
    let [a, b, c] = corners;
    let mut squares = [(b - a), (c - b), (a - c)].map(|edge| edge.dot(edge));
    squares.sort_unstable_by(f64::total_cmp);
    let [short, middle, long] = squares;
    let x = 0.5 * (long + middle - short) / long;
    let y = (b - a).cross(c - a).length() / long;
    if !(LOW..HIGH).contains(&y) || !x.is_finite() {
        return face_least(corners);
    }
    let split = |at: f64, n: usize| {
        let cell = (at.max(0.0) as usize).min(n - 1);
        (cell, at - cell as f64)
    };
    let (i, u) = split((x - 0.5) * 2.0 * N[0] as f64, N[0]);
    let (j, v) = split((y - LOW) / (HIGH - LOW) * N[1] as f64, N[1]);
    let at = |i: usize, j: usize| table()[j * (N[0] + 1) + i];
    let low = at(i, j) * (1.0 - u) + at(i + 1, j) * u;
    let high = at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u;
    1.0 / (low * (1.0 - v) + high * v)
}

/// [`excess`] within 5 in 1000, quickly.
pub fn excess_near(points: [Point; 4], required: [bool; 4]) -> f64 {
    let q = quality(points);
    let mut faces = (0..4).filter(|&i| required[i]);
    match (faces.next(), faces.next()) {
        (None, _) => q,
        (Some(i), None) => (q / face_least_near(FACES[i].map(|k| points[k]))).max(1.0),
        _ => excess(points, required),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_as_good_as_a_search() {
        let mut n = 0;
        let mut unit = || {
            n += 1;
            crate::geom::mix(n) as f64 / u64::MAX as f64
        };
        let mut point = || Point::new(unit(), unit(), unit());
        for _ in 0..3000 {
            let corners = [point(), point(), point()];
            let (near, exact) = (face_least_near(corners), face_least(corners));
            assert!((near / exact - 1.0).abs() < 5e-3, "{corners:?}: {near} {exact}");
        }
    }
}
