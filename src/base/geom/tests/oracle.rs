//! Exact numbers `m · 2^e`: a slow reference for the signs.
//!
//! On a library's whole numbers, so that it shares nothing with the exact numbers of recovery, which it tests.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Sub};

use dashu::integer::IBig;

use super::Point;

/// An exact value; every finite double is one, and so are sums and products.
#[derive(Clone, Debug)]
pub struct Truth {
    mantissa: IBig,
    exponent: i32,
}

impl From<f64> for Truth {
    fn from(x: f64) -> Self {
        assert!(x.is_finite());
        let bits = x.to_bits();
        let (biased, fraction) = ((bits >> 52 & 0x7ff) as i32, bits & ((1 << 52) - 1));
        let (whole, exponent) = match biased {
            0 => (fraction, -1074),
            _ => (fraction | 1 << 52, biased - 1075),
        };
        let mantissa = IBig::from(whole);
        Self { mantissa: if x < 0.0 { -mantissa } else { mantissa }, exponent }
    }
}

impl Truth {
    fn at_exponent(&self, exponent: i32) -> IBig {
        &self.mantissa << (self.exponent - exponent) as usize
    }

    pub fn sign(&self) -> Ordering {
        self.mantissa.cmp(&IBig::ZERO)
    }
}

impl Add for &Truth {
    type Output = Truth;
    fn add(self, other: Self) -> Truth {
        let exponent = self.exponent.min(other.exponent);
        Truth { mantissa: self.at_exponent(exponent) + other.at_exponent(exponent), exponent }
    }
}

impl Sub for &Truth {
    type Output = Truth;
    fn sub(self, other: Self) -> Truth {
        let exponent = self.exponent.min(other.exponent);
        Truth { mantissa: self.at_exponent(exponent) - other.at_exponent(exponent), exponent }
    }
}

impl Mul for &Truth {
    type Output = Truth;
    fn mul(self, other: Self) -> Truth {
        Truth {
            mantissa: &self.mantissa * &other.mantissa,
            exponent: self.exponent + other.exponent,
        }
    }
}

/// A position without rounding.
pub type Exact = [Truth; 3];

pub fn exact(p: Point) -> Exact {
    p.to_array().map(Truth::from)
}

fn from(p: &Exact, origin: &Exact) -> Exact {
    [0, 1, 2].map(|i| &p[i] - &origin[i])
}

fn determinant([u, v, w]: [&Exact; 3]) -> Truth {
    let minor = |i: usize, j: usize| &(&v[i] * &w[j]) - &(&v[j] * &w[i]);
    let sum = &(&u[0] * &minor(1, 2)) + &(&u[1] * &minor(2, 0));
    &sum + &(&u[2] * &minor(0, 1))
}

/// Sign of det(b - a, c - a, d - a).
pub fn orient_truth([a, b, c, d]: &[Exact; 4]) -> Ordering {
    determinant([&from(b, a), &from(c, a), &from(d, a)]).sign()
}

/// Greater when `e` is inside the sphere of the positive tetrahedron `a b c d`.
pub fn insphere_truth([a, b, c, d, e]: &[Exact; 5]) -> Ordering {
    let seen = [a, b, c, d].map(|p| from(p, e));
    let lift = |p: &Exact| {
        let sum = &(&p[0] * &p[0]) + &(&p[1] * &p[1]);
        &sum + &(&p[2] * &p[2])
    };
    let [a, b, c, d] = &seen;
    // Expansion along the column of squares.
    let terms = [
        &lift(a) * &determinant([b, c, d]),
        &lift(b) * &determinant([a, c, d]),
        &lift(c) * &determinant([a, b, d]),
        &lift(d) * &determinant([a, b, c]),
    ];
    let sum = &(&terms[0] - &terms[1]) + &(&terms[2] - &terms[3]);
    sum.sign()
}

/// Seeded, uniform in [-0.5, 0.5).
pub struct RandomNumbers(pub u64);

impl RandomNumbers {
    pub fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    pub fn point(&mut self) -> Point {
        Point::new(self.next(), self.next(), self.next())
    }
}

/// Number of cases in a test.
pub fn cases() -> usize {
    let asked = std::env::var("TETDB_CASES").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(100_000)
}
