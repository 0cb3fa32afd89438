//! Whole numbers times powers of two: exact sums and products of doubles, of any size.

use std::cmp::Ordering;

/// `± magnitude · 2^exponent`; zero has no words.
///
/// Invariant: the last word of the magnitude is not zero, and the first one is odd.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Dyadic {
    negative: bool,
    /// Words, least significant first.
    magnitude: Vec<u64>,
    exponent: i64,
}

/// Bits of the mantissa of a double.
const MANTISSA: u32 = 52;

impl From<f64> for Dyadic {
    /// The double itself, which must be finite.
    fn from(x: f64) -> Self {
        let bits = x.to_bits();
        let biased = (bits >> MANTISSA & 0x7ff) as i64;
        let fraction = bits & ((1 << MANTISSA) - 1);
        let (whole, exponent) = match biased {
            0 => (fraction, -1074),
            _ => (fraction | 1 << MANTISSA, biased - 1075),
        };
        Self { negative: x < 0.0, magnitude: vec![whole], exponent }.trimmed()
    }
}

impl Dyadic {
    /// Restores the invariant.
    fn trimmed(mut self) -> Self {
        while self.magnitude.last() == Some(&0) {
            self.magnitude.pop();
        }
        let Some(zero_words) = self.magnitude.iter().position(|&w| w != 0) else {
            return Self::default();
        };
        let zero_bits = self.magnitude[zero_words].trailing_zeros();
        self.magnitude.drain(..zero_words);
        if zero_bits > 0 {
            let n = self.magnitude.len();
            for i in 0..n {
                let next = self.magnitude.get(i + 1).copied().unwrap_or(0);
                self.magnitude[i] = self.magnitude[i] >> zero_bits | next << (64 - zero_bits);
            }
            if self.magnitude[n - 1] == 0 {
                self.magnitude.pop();
            }
        }
        self.exponent += 64 * zero_words as i64 + i64::from(zero_bits);
        self
    }

    /// The magnitude in units of 2^`exponent`, which is not above its own.
    fn shifted(&self, exponent: i64) -> Vec<u64> {
        let shift = (self.exponent - exponent) as usize;
        let (words, bits) = (shift / 64, shift % 64);
        let mut shifted = vec![0; words];
        let mut carry = 0;
        for &w in &self.magnitude {
            shifted.push(w << bits | carry);
            carry = if bits == 0 { 0 } else { w >> (64 - bits) };
        }
        if carry != 0 {
            shifted.push(carry);
        }
        shifted
    }

    fn is_zero(&self) -> bool {
        self.magnitude.is_empty()
    }

    fn sum(&self, other: &Self, negate: bool) -> Self {
        let other_negative = other.negative != negate;
        if other.is_zero() {
            return self.clone();
        }
        if self.is_zero() {
            let mut sum = other.clone();
            sum.negative = other_negative;
            return sum;
        }
        let exponent = self.exponent.min(other.exponent);
        let (a, b) = (self.shifted(exponent), other.shifted(exponent));
        let (negative, magnitude) = if self.negative == other_negative {
            (self.negative, added(a, &b))
        } else if compared(&a, &b) == Ordering::Less {
            (other_negative, subtracted(b, &a))
        } else {
            (self.negative, subtracted(a, &b))
        };
        Self { negative, magnitude, exponent }.trimmed()
    }

    /// `self + other`.
    pub fn plus(&self, other: &Self) -> Self {
        self.sum(other, false)
    }

    /// `self - other`.
    pub fn minus(&self, other: &Self) -> Self {
        self.sum(other, true)
    }

    /// `self * other`.
    pub fn times(&self, other: &Self) -> Self {
        let (a, b) = (&self.magnitude, &other.magnitude);
        let mut product = vec![0u64; a.len() + b.len()];
        for (i, &x) in a.iter().enumerate() {
            let mut carry = 0u128;
            for (j, &y) in b.iter().enumerate() {
                carry += u128::from(x) * u128::from(y) + u128::from(product[i + j]);
                product[i + j] = carry as u64;
                carry >>= 64;
            }
            product[i + b.len()] = carry as u64;
        }
        Self {
            negative: self.negative != other.negative,
            magnitude: product,
            exponent: self.exponent + other.exponent,
        }
        .trimmed()
    }

    /// -1, 0 or 1.
    pub fn sign(&self) -> i32 {
        match (self.is_zero(), self.negative) {
            (true, _) => 0,
            (false, true) => -1,
            (false, false) => 1,
        }
    }

    /// Order of `self` and `other`.
    pub fn compare(&self, other: &Self) -> Ordering {
        self.minus(other).sign().cmp(&0)
    }

    /// The 64 leading bits as a double, and the power of two they count.
    fn leading(&self) -> (f64, i64) {
        let n = self.magnitude.len();
        let Some(&top) = self.magnitude.last() else {
            return (0.0, 0);
        };
        let zeros = top.leading_zeros();
        let below = if n > 1 { self.magnitude[n - 2] } else { 0 };
        let bits = if zeros == 0 { top } else { top << zeros | below >> (64 - zeros) };
        let sign = if self.negative { -1.0 } else { 1.0 };
        let exponent = self.exponent + 64 * (n as i64 - 1) - i64::from(zeros);
        (sign * bits as f64, exponent)
    }

    /// The value rounded; one out of range keeps its sign.
    pub fn estimate(&self) -> f64 {
        let (leading, exponent) = self.leading();
        if leading == 0.0 {
            return 0.0;
        }
        let value = times_power(leading, exponent);
        value.abs().clamp(f64::MIN_POSITIVE, f64::MAX).copysign(leading)
    }

    /// `self / other` to about `50 * terms` bits; `None` for a division by zero.
    pub fn over(&self, other: &Self, terms: u32) -> Option<Self> {
        let (divisor, divisor_exponent) = other.leading();
        if divisor == 0.0 {
            return None;
        }
        let mut quotient = Self::default();
        let mut rest = self.clone();
        for _ in 0..terms {
            let (leading, exponent) = rest.leading();
            if leading == 0.0 {
                break;
            }
            let mut term = Self::from(leading / divisor);
            term.exponent += exponent - divisor_exponent;
            rest = rest.minus(&term.times(other));
            quotient = quotient.plus(&term);
        }
        Some(quotient)
    }

    /// A number of few bits within `slack`, which is positive.
    pub fn shortened(&self, slack: &Self) -> Self {
        // The last bit kept is worth at most `slack`, so cutting the rest off moves by less.
        let (_, exponent) = slack.leading();
        let unit = exponent + 63;
        let drop = unit - self.exponent;
        if drop <= 0 || self.is_zero() {
            return self.clone();
        }
        let (words, bits) = (drop as usize / 64, drop as usize % 64);
        if words >= self.magnitude.len() {
            return Self::default();
        }
        let mut magnitude = self.magnitude[words..].to_vec();
        magnitude[0] = magnitude[0] >> bits << bits;
        Self { negative: self.negative, magnitude, exponent: self.exponent + 64 * words as i64 }
            .trimmed()
    }
}

/// `x · 2^exponent` in two steps, since a power may leave the range where the product does not.
fn times_power(x: f64, exponent: i64) -> f64 {
    let power = |e: i64| f64::from_bits(((e.clamp(-1022, 1023) + 1023) as u64) << MANTISSA);
    let half = exponent / 2;
    x * power(half) * power(exponent - half)
}

fn compared(a: &[u64], b: &[u64]) -> Ordering {
    a.len().cmp(&b.len()).then_with(|| a.iter().rev().cmp(b.iter().rev()))
}

fn added(mut a: Vec<u64>, b: &[u64]) -> Vec<u64> {
    if a.len() < b.len() {
        a.resize(b.len(), 0);
    }
    let mut carry = false;
    for (i, x) in a.iter_mut().enumerate() {
        let (sum, c) = x.overflowing_add(b.get(i).copied().unwrap_or(0));
        let (sum, d) = sum.overflowing_add(u64::from(carry));
        (*x, carry) = (sum, c | d);
    }
    if carry {
        a.push(1);
    }
    a
}

/// `a - b`, where `a` is not less.
fn subtracted(mut a: Vec<u64>, b: &[u64]) -> Vec<u64> {
    let mut borrow = false;
    for (i, x) in a.iter_mut().enumerate() {
        let (rest, c) = x.overflowing_sub(b.get(i).copied().unwrap_or(0));
        let (rest, d) = rest.overflowing_sub(u64::from(borrow));
        (*x, borrow) = (rest, c | d);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use dashu::rational::RBig;

    fn rational(x: f64) -> RBig {
        RBig::try_from(x).expect("finite")
    }

    #[test]
    fn sums_and_products_are_those_of_rationals() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let mantissa = (state >> 12) as f64 / (1u64 << 40) as f64 - 2048.0;
            mantissa * 2f64.powi((state >> 3) as i32 % 130 - 65)
        };
        for _ in 0..2000 {
            let x: [f64; 5] = std::array::from_fn(|_| next());
            let [a, b, c, d, e] = x.map(Dyadic::from);
            let value = a.times(&b).minus(&c.times(&d)).times(&e).plus(&a);
            let [p, q, r, s, t] = x.map(rational);
            let expected = (&p * &q - &r * &s) * &t + &p;
            let found = value.estimate();
            let relative = (rational(found) - &expected) / &expected;
            assert!(relative.to_f64().value().abs() < 1e-15, "{x:?}: {found}");
            assert_eq!(value.minus(&value).sign(), 0);
            // A quotient of three terms, times the divisor, is right to far beyond doubles.
            let quotient = value.over(&c, 3).expect("not zero");
            let rest = value.minus(&quotient.times(&c));
            assert!(rest.estimate().abs() <= found.abs() * 1e-40);
            let slack = Dyadic::from(found.abs() * 1e-3);
            let short = value.shortened(&slack);
            assert!(short.magnitude.len() == 1 && short.magnitude[0] < 1 << 12);
            assert!(value.minus(&short).estimate().abs() <= slack.estimate());
        }
    }

    #[test]
    fn numbers_of_any_size_keep_their_sign() {
        let tiny = Dyadic::from(-1e-300);
        let mut power = tiny.clone();
        for _ in 0..6 {
            power = power.times(&tiny);
        }
        assert_eq!(power.estimate(), -f64::MIN_POSITIVE);
        let huge = Dyadic::from(1e300);
        assert_eq!(huge.times(&huge).estimate(), f64::MAX);
        assert_eq!(Dyadic::from(0.0).estimate(), 0.0);
        assert_eq!(Dyadic::from(1.5).estimate(), 1.5);
        assert_eq!(Dyadic::from(5e-324).plus(&Dyadic::from(1e308)).estimate(), 1e308);
    }
}
