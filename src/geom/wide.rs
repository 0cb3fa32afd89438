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
        rounded_differences([a, b, c, d], e).or_else(|| whole_differences([a, b, c, d, e]))?;
    Some(determinant_sign(seen))
}

/// The differences where doubles hold them exactly, as they do for points near each other and not too near zero.
fn rounded_differences(points: [Point; 4], e: Point) -> Option<[[i64; 3]; 4]> {
    let mut seen = [[0.0f64; 3]; 4];
    let mut unit = i32::MAX;
    let mut largest = 0.0f64;
    for (seen, p) in seen.iter_mut().zip(points) {
        let x = p - e;
        // What rounding took away (T. J. Dekker, 1971).
        let e_virtual = p - x;
        let tail = (p - (x + e_virtual)) + (e_virtual - e);
        if tail != Point::ZERO {
            return None;
        }
        *seen = x.to_array();
        largest = largest.max(x.abs().max_element());
        for x in *seen {
            unit = unit.min(parts(x).1);
        }
    }
    if !(-1000..=900).contains(&unit) {
        return None;
    }
    let per_unit = f64::from_bits(((1023 - unit) as u64) << 52);
    let word = (1u64 << DIFFERENCE_BITS) as f64;
    (largest * per_unit < word).then(|| seen.map(|p| p.map(|x| (x * per_unit) as i64)))
}

/// The differences as whole numbers of the smallest unit any coordinate needs.
#[cold]
fn whole_differences(points: [Point; 5]) -> Option<[[i64; 3]; 4]> {
    let points = points.map(|p| p.to_array().map(parts));
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
    let sum = |p: [(i64, i128); 3]| {
        let [p, q, r] = p.map(|(x, y)| product(y, x));
        add(add(p, q), r)
    };
    let abc = sum([(a[2], bc), (-b[2], ac), (c[2], ab)]);
    let bcd = sum([(b[2], cd), (-c[2], bd), (d[2], bc)]);
    let cda = sum([(c[2], da), (d[2], ac), (a[2], cd)]);
    let dab = sum([(d[2], ab), (a[2], bd), (b[2], da)]);
    let square = |p: [i64; 3]| {
        let [x, y, z] = p.map(|x| i128::from(x) * i128::from(x));
        (x + y + z) as u128
    };
    let plus = add(lifted(square(c), dab), lifted(square(a), bcd));
    let minus = add(lifted(square(d), abc), lifted(square(b), cda));
    let difference = add(plus, negative(minus));
    if difference[4] >> 63 != 0 {
        Ordering::Less
    } else if difference == [0; 5] {
        Ordering::Equal
    } else {
        Ordering::Greater
    }
}

/// A whole number of `N` words, least significant first, negative ones as complement.
type Wide<const N: usize> = [u64; N];

fn add<const N: usize>(a: Wide<N>, b: Wide<N>) -> Wide<N> {
    let mut sum = [0; N];
    let mut carry = false;
    for i in 0..N {
        let (s, c) = a[i].overflowing_add(b[i]);
        let (s, d) = s.overflowing_add(u64::from(carry));
        sum[i] = s;
        carry = c | d;
    }
    sum
}

fn negative<const N: usize>(a: Wide<N>) -> Wide<N> {
    let mut one = [0; N];
    one[0] = 1;
    add(a.map(|word| !word), one)
}

/// Product of a number of up to 127 bits and a word.
fn product(a: i128, b: i64) -> Wide<3> {
    let (low, high) = (a.unsigned_abs() as u64, (a.unsigned_abs() >> 64) as u64);
    let b_abs = u128::from(b.unsigned_abs());
    let first = u128::from(low) * b_abs;
    let second = u128::from(high) * b_abs + (first >> 64);
    let wide = [first as u64, second as u64, (second >> 64) as u64];
    if (a < 0) == (b < 0) {
        wide
    } else {
        negative(wide)
    }
}

/// Product of a square and a determinant of three rows.
fn lifted(square: u128, det: Wide<3>) -> Wide<5> {
    let is_negative = det[2] >> 63 != 0;
    let det = if is_negative { negative(det) } else { det };
    let mut wide = [0u64; 5];
    for (i, s) in [square as u64, (square >> 64) as u64]
        .into_iter()
        .enumerate()
    {
        let mut carry = 0;
        for (j, d) in det.into_iter().enumerate() {
            let sum = u128::from(s) * u128::from(d) + u128::from(wide[i + j]) + carry;
            wide[i + j] = sum as u64;
            carry = sum >> 64;
        }
        wide[i + 3] = carry as u64;
    }
    if is_negative { negative(wide) } else { wide }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::oracle::{exact, insphere_truth};
    use crate::geom::tests::Numbers;

    #[test]
    fn nearly_all_points_of_one_sphere_fit_and_get_their_sign() {
        let mut numbers = Numbers(7);
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
