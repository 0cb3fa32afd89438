//! Sums of two doubles, some 106 bits: enough for most signs that doubles cannot decide.
//!
//! Source: T. J. Dekker, "A floating-point technique for extending the available precision" (1971); error bounds of sums and products:
//! M. Joldes, J.-M. Muller and V. Popescu, "Tight and rigorous error bounds for basic building blocks of double-word arithmetic" (2017).

/// The sum of both; the second is at most half of the last bit of the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoublePair(f64, f64);

/// Half of the bits of a double.
const SPLITTER: f64 = 134_217_729.0;

/// `a + b` without rounding.
#[inline]
fn sum(a: f64, b: f64) -> DoublePair {
    let s = a + b;
    let t = s - a;
    DoublePair(s, (a - (s - t)) + (b - t))
}

/// `a + b` without rounding, where `a` is not smaller.
#[inline]
fn quick_sum(a: f64, b: f64) -> DoublePair {
    let s = a + b;
    DoublePair(s, b - (s - a))
}

/// Both halves of a double.
#[inline]
fn halves(a: f64) -> (f64, f64) {
    let c = SPLITTER * a;
    let high = c - (c - a);
    (high, a - high)
}

/// `a · b` without rounding.
#[inline]
fn product(a: f64, b: f64) -> DoublePair {
    let p = a * b;
    let ((a, c), (b, d)) = (halves(a), halves(b));
    DoublePair(p, ((a * b - p) + a * d + c * b) + c * d)
}

impl DoublePair {
    /// `a - b + rest`, off by at most 2^-52 of the larger of `rest` and the rounding error of `a - b`.
    #[inline]
    pub fn difference(a: f64, b: f64, rest: f64) -> Self {
        let Self(high, low) = sum(a, -b);
        let Self(high, more) = sum(high, rest);
        // The rest may cancel the leading part.
        sum(high, low + more)
    }

    /// Off by at most 2^-104 of the sum of both magnitudes.
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        let (high, low) = (sum(self.0, other.0), sum(self.1, other.1));
        let Self(first, second) = quick_sum(high.0, high.1 + low.0);
        quick_sum(first, second + low.1)
    }

    /// See [`DoublePair::plus`].
    #[inline]
    pub fn minus(self, other: Self) -> Self {
        self.plus(Self(-other.0, -other.1))
    }

    /// Off by at most 2^-102 of the product.
    #[inline]
    pub fn times(self, other: Self) -> Self {
        let Self(high, low) = product(self.0, other.0);
        quick_sum(high, low + (self.0 * other.1 + self.1 * other.0))
    }

    /// Rounded.
    #[inline]
    pub fn value(self) -> f64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::tests::oracle::RandomNumbers;
    use dashu::rational::RBig;

    #[test]
    fn sums_and_products_are_those_of_rationals_but_for_the_last_bits() {
        let mut numbers = RandomNumbers(1);
        let mut next = |power: i32| numbers.next() * 2f64.powi(power + 1);
        let rational = |x: f64| RBig::try_from(x).expect("finite");
        let of = |p: DoublePair| rational(p.0) + rational(p.1);
        let size = |x: RBig| x.to_f64().value().abs();
        let share = |k: i32| 2f64.powi(-k);
        for k in 0..2000 {
            let (a, b, rest) = (next(0), next(-(k % 60)), next(-50 - k % 13));
            let p = DoublePair::difference(a, b, rest);
            let left = size(rational(a) - rational(b) - rational(a - b));
            assert!(
                size(of(p) - (rational(a) - rational(b) + rational(rest)))
                    <= share(52) * left.max(rest.abs())
            );
            let q = DoublePair::difference(next(0), next(-3), next(-54));
            let total = size(of(p)) + size(of(q));
            assert!(size(of(p.plus(q)) - (of(p) + of(q))) <= share(104) * total);
            assert!(size(of(p.minus(q)) - (of(p) - of(q))) <= share(104) * total);
            let exact = of(p) * of(q);
            assert!(size(of(p.times(q)) - &exact) <= share(102) * size(exact));
        }
    }
}
