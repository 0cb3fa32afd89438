//! Signs of polynomials in doubles: first with a bound on the rounding, then, where that leaves a doubt, without rounding.

use std::cmp::Ordering;

use tetdb_base::geom::{Dyadic, Point};

/// A number that can be added and multiplied, and whose sign may be known.
pub(crate) trait Ring: Clone {
    fn from_f64(x: f64) -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;
    /// `None` when rounding hides it.
    fn sign(&self) -> Option<Ordering>;
}

/// A double and a bound on its error.
#[derive(Clone, Copy)]
pub(super) struct Near {
    value: f64,
    error: f64,
}

/// Covers the rounding of a result and of its bound.
const EPSILON: f64 = 2.0 * f64::EPSILON;

impl Near {
    fn rounded(value: f64, error: f64) -> Self {
        // The least normal number stands for what underflow takes away.
        let error = (error + value.abs() * EPSILON) * (1.0 + EPSILON) + f64::MIN_POSITIVE;
        Self { value, error }
    }
}

impl Ring for Near {
    fn from_f64(x: f64) -> Self {
        Self { value: x, error: 0.0 }
    }

    fn plus(&self, other: &Self) -> Self {
        Self::rounded(self.value + other.value, self.error + other.error)
    }

    fn minus(&self, other: &Self) -> Self {
        Self::rounded(self.value - other.value, self.error + other.error)
    }

    fn times(&self, other: &Self) -> Self {
        let error = self.value.abs() * other.error
            + other.value.abs() * self.error
            + self.error * other.error;
        Self::rounded(self.value * other.value, error * (1.0 + 2.0 * EPSILON))
    }

    fn sign(&self) -> Option<Ordering> {
        // Also false when something overflowed.
        (self.value.abs() > self.error && self.value.is_finite())
            .then(|| self.value.total_cmp(&0.0))
    }
}

impl Ring for Dyadic {
    fn from_f64(x: f64) -> Self {
        Self::from(x)
    }

    fn plus(&self, other: &Self) -> Self {
        Dyadic::plus(self, other)
    }

    fn minus(&self, other: &Self) -> Self {
        Dyadic::minus(self, other)
    }

    fn times(&self, other: &Self) -> Self {
        Dyadic::times(self, other)
    }

    fn sign(&self) -> Option<Ordering> {
        Some(Dyadic::sign(self).cmp(&0))
    }
}

/// A vector of such numbers.
#[derive(Clone)]
pub(crate) struct Vector<R>([R; 3]);

impl<R: Ring> Vector<R> {
    pub fn from_point(p: Point) -> Self {
        Self(p.to_array().map(R::from_f64))
    }

    /// From `a` to `b`.
    pub fn between(a: Point, b: Point) -> Self {
        let (a, b) = (Self::from_point(a), Self::from_point(b));
        Self([0, 1, 2].map(|i| b.0[i].minus(&a.0[i])))
    }

    pub fn dot(&self, other: &Self) -> R {
        let [x, y, z] = [0, 1, 2].map(|i| self.0[i].times(&other.0[i]));
        x.plus(&y).plus(&z)
    }

    pub fn cross(&self, other: &Self) -> Self {
        let minor =
            |i: usize, j: usize| self.0[i].times(&other.0[j]).minus(&self.0[j].times(&other.0[i]));
        Self([minor(1, 2), minor(2, 0), minor(0, 1)])
    }
}

/// Returns whether the number is not below zero; `None` if rounding hides its sign.
pub(super) fn not_negative<R: Ring>(x: &R) -> Option<bool> {
    x.sign().map(|s| s != Ordering::Less)
}
