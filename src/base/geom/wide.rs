//! The sphere determinant in whole numbers.
//!
//! Points on one sphere, as surfaces of balls and cylinders give them, defeat every filter, and expansions decide
//! them slowly. Such points are near each other, though: in units of the last bit any of them has, their
//! differences are whole numbers of one machine word, and the determinant is one of five words.

use std::cmp::Ordering;

use super::Point;

/// Differences are below two to this power: a determinant is then below 2^312.
const DIFFERENCE_BITS: u32 = 61;
/// Bits to which a coordinate may be shifted.
const COORDINATE_BITS: i32 = 126;

/// Sign of the sphere determinant of [`insphere`](super::insphere); `None` when the differences need more than a word.
pub(super) fn insphere_sign(a: Point, b: Point, c: Point, d: Point, e: Point) -> Option<Ordering> {
    let seen =
        rounded_differences([a, b, c, d], e).or_else(|| integer_differences([a, b, c, d, e]))?;
    Some(determinant_sign(seen))
}

/// The differences where doubles hold them exactly, as they do for points near each other and not too near zero.
///
/// The unit is as small as the largest difference allows. Its value does not matter, if all coordinates are whole
/// numbers of it.
fn rounded_differences(points: [Point; 4], e: Point) -> Option<[[i64; 3]; 4]> {
    let mut seen = [Point::ZERO; 4];
    let mut largest = Point::ZERO;
    let mut lost = Point::ZERO;
    for (seen, p) in seen.iter_mut().zip(points) {
        let x = p - e;
        // The rounding error (T. J. Dekker, 1971).
        let e_virtual = p - x;
        let tail = (p - (x + e_virtual)) + (e_virtual - e);
        lost += tail.abs();
        *seen = x;
        largest = largest.max(x.abs());
    }
    let exponent = (largest.max_element().to_bits() >> 52) as i32 - 1023;
    // Not multiplied by less than one, which could lose bits of a very small difference.
    if lost != Point::ZERO || !(-900..DIFFERENCE_BITS as i32).contains(&exponent) {
        return None;
    }
    let shift = DIFFERENCE_BITS as i32 - 1 - exponent;
    let per_unit = f64::from_bits(((1023 + shift) as u64) << 52);
    let mut is_whole = true;
    // Loops here and below: `map` on arrays is not always inlined.
    let mut whole = [[0i64; 3]; 4];
    for (whole, x) in whole.iter_mut().zip(seen) {
        for (whole, x) in whole.iter_mut().zip((x * per_unit).to_array()) {
            *whole = x as i64;
            is_whole &= *whole as f64 == x;
        }
    }
    is_whole.then_some(whole)
}

/// The differences as whole numbers of the smallest unit any coordinate needs.
#[cold]
fn integer_differences(points: [Point; 5]) -> Option<[[i64; 3]; 4]> {
    let parts_of = |p: Point| [parts(p.x), parts(p.y), parts(p.z)];
    let [a, b, c, d, e] = points;
    let points = [parts_of(a), parts_of(b), parts_of(c), parts_of(d), parts_of(e)];
    let unit = points.iter().flatten().map(|p| p.1).min()?;
    let mut whole = [[0i128; 3]; 5];
    for (whole, point) in whole.iter_mut().zip(&points) {
        for (whole, &(mantissa, exponent)) in whole.iter_mut().zip(point) {
            if mantissa != 0 {
                let shift = exponent - unit;
                if shift + 54 > COORDINATE_BITS {
                    return None;
                }
                *whole = i128::from(mantissa) << shift;
            }
        }
    }
    let mut seen = [[0i64; 3]; 4];
    for (seen, point) in seen.iter_mut().zip(&whole) {
        for i in 0..3 {
            let difference = point[i] - whole[4][i];
            if difference.unsigned_abs() >> DIFFERENCE_BITS != 0 {
                return None;
            }
            seen[i] = difference as i64;
        }
    }
    Some(seen)
}

/// Mantissa and exponent, the mantissa odd or zero; a zero has the largest exponent.
fn parts(x: f64) -> (i64, i32) {
    if x == 0.0 {
        return (0, i32::MAX);
    }
    let bits = x.to_bits();
    let biased = (bits >> 52 & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (mantissa, exponent) = match biased {
        0 => (fraction, -1074),
        _ => (fraction | 1 << 52, biased - 1075),
    };
    let zeros = mantissa.trailing_zeros();
    let mantissa = mantissa >> zeros;
    let signed = if x < 0.0 { -mantissa } else { mantissa };
    (signed, exponent + zeros as i32)
}

/// Sign of the determinant of rows (x, y, z, x² + y² + z²), in the order that makes it positive for a point inside.
fn determinant_sign([a, b, c, d]: [[i64; 3]; 4]) -> Ordering {
    let minor = |p: [i64; 3], q: [i64; 3]| {
        i128::from(p[0]) * i128::from(q[1]) - i128::from(q[0]) * i128::from(p[1])
    };
    let (ab, bc, cd, da) = (minor(a, b), minor(b, c), minor(c, d), minor(d, a));
    let (ac, bd) = (minor(a, c), minor(b, d));
    // Three products of 61 and 123 bits.
    let product = |(x, y): (i64, i128)| Triple::product(y, x);
    let sum = |[p, q, r]: [(i64, i128); 3]| product(p).plus(product(q)).plus(product(r));
    let bcd = sum([(b[2], cd), (-c[2], bd), (d[2], bc)]);
    let dab = sum([(d[2], ab), (a[2], bd), (b[2], da)]);
    let minus_abc = sum([(-a[2], bc), (b[2], ac), (-c[2], ab)]);
    let minus_cda = sum([(-c[2], da), (-d[2], ac), (-a[2], cd)]);
    let square = |p: [i64; 3]| {
        let square = |x: i64| i128::from(x) * i128::from(x);
        (square(p[0]) + square(p[1]) + square(p[2])) as u128
    };
    let mut det = DigitColumns::default();
    det.add(square(a), bcd);
    det.add(square(b), minus_cda);
    det.add(square(c), dab);
    det.add(square(d), minus_abc);
    det.sign()
}

/// A whole number of three words, negative ones as complement.
///
/// Signs are nearly random here, and a branch would be mispredicted every other time: there is none.
#[derive(Clone, Copy)]
struct Triple {
    low: u64,
    high: i128,
}

impl Triple {
    /// Product of numbers of 123 and 61 bits.
    #[inline(always)]
    fn product(a: i128, b: i64) -> Self {
        let b = i128::from(b);
        let low = i128::from(a as u64) * b;
        let high = i128::from((a >> 64) as i64) * b;
        Self { low: low as u64, high: high + (low >> 64) }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        let (low, carry) = self.low.overflowing_add(other.low);
        Self { low, high: self.high + other.high + i128::from(carry) }
    }
}

/// A sum of products of five words, as sums of their words: of a few dozen, each of 64 bits, so that none overflows.
#[derive(Default)]
struct DigitColumns([i128; 5]);

impl DigitColumns {
    /// Adds the product of a square of 124 bits and a determinant of three rows of 186.
    #[inline(always)]
    fn add(&mut self, square: u128, det: Triple) {
        let squares = [square as u64, (square >> 64) as u64];
        let (middle, high) = (det.high as u64, (det.high >> 64) as i64);
        for (i, s) in squares.into_iter().enumerate() {
            for (j, d) in [det.low, middle].into_iter().enumerate() {
                let product = u128::from(s) * u128::from(d);
                self.0[i + j] += i128::from(product as u64);
                self.0[i + j + 1] += i128::from((product >> 64) as u64);
            }
            let product = i128::from(s) * i128::from(high);
            self.0[i + 2] += i128::from(product as u64);
            self.0[i + 3] += product >> 64;
        }
    }

    fn sign(&self) -> Ordering {
        let mut carry = 0;
        let mut rest = 0;
        let [low @ .., high] = self.0;
        for column in low {
            let sum = column + carry;
            rest |= sum as u64;
            carry = sum >> 64;
        }
        (high + carry).cmp(&0).then((rest > 0).cmp(&false))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::tests::oracle::RandomNumbers;
    use crate::geom::tests::oracle::{exact, insphere_truth};

    #[test]
    fn nearly_all_points_of_one_sphere_fit_and_get_their_sign() {
        let mut numbers = RandomNumbers(7);
        let (mut decided, mut ties) = (0, 0);
        for round in 0..4000 {
            let center = numbers.point() * 3.0;
            let radius = [1e-3, 0.1, 1.0, 64.0][round % 4];
            let p = [0; 5].map(|_| {
                let p = numbers.point();
                if round % 3 == 0 {
                    // On a grid: many are exactly on one sphere.
                    (p * 3.0).round() * radius
                } else {
                    center + p.normalize() * radius
                }
            });
            let [a, b, c, d, e] = p;
            if let Some(sign) = insphere_sign(a, b, c, d, e) {
                decided += 1;
                ties += usize::from(sign == Ordering::Equal);
                assert_eq!(sign, insphere_truth(&p.map(exact)), "{p:?}");
            }
        }
        assert!(decided > 3800 && ties > 300, "{decided} {ties}");
    }

    #[test]
    fn what_does_not_fit_is_left() {
        let p = [0.0, 1e-300, 1.0, 2.0, 3.0].map(|x| Point::new(x, x * x, 1.0 - x));
        let [a, b, c, d, e] = p;
        assert_eq!(insphere_sign(a, b, c, d, e), None);
    }

    #[test]
    fn the_largest_differences_do_not_overflow() {
        let m = (1i64 << DIFFERENCE_BITS) - 1;
        // Corners of a cube and its center, then a point far outside.
        let inside = [[m, m, -m], [-m, m, m], [m, -m, m], [-m, -m, -m]];
        let positive = determinant_sign(inside);
        let [a, b, c, d] = inside;
        assert_eq!(determinant_sign([b, a, c, d]), positive.reverse());
        assert_ne!(positive, Ordering::Equal);
    }
}
