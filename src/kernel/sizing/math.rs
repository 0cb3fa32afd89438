//! Logarithm and exponential from basic operations, equal on every machine.

use std::f64::consts::LN_2;

/// `atanh(e) / e`, even in `e`, for `|e| < 1`; 1 at zero.
#[inline]
pub(super) fn atanh_ratio(e: f64) -> f64 {
    let e2 = e * e;
    if e2 < 0.03 {
        return atanh_series(e2);
    }
    let e = e.abs();
    0.5 * ln((1.0 + e) / (1.0 - e)) / e
}

/// `1 + e2/3 + e2²/5 + …`; for `e2 <= 0.03` the first term left out is below 1e-17.
#[inline]
fn atanh_series(e2: f64) -> f64 {
    let mut sum = 0.0;
    for k in (1..=10).rev() {
        sum = e2 * (sum + 1.0 / f64::from(2 * k + 1));
    }
    1.0 + sum
}

/// Natural logarithm of a positive normal number, within 2 units in the last place or 2e-16.
pub(super) fn ln(x: f64) -> f64 {
    let bits = x.to_bits();
    let mut exponent = (bits >> 52) as i32 - 1023;
    let mut mantissa = f64::from_bits((bits & 0x000f_ffff_ffff_ffff) | (1023u64 << 52));
    if mantissa > std::f64::consts::SQRT_2 {
        mantissa *= 0.5;
        exponent += 1;
    }
    // ln m = 2 atanh((m - 1)/(m + 1)), with |argument| <= 0.172.
    let e = (mantissa - 1.0) / (mantissa + 1.0);
    f64::from(exponent) * LN_2 + 2.0 * e * atanh_series(e * e)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_platform() {
        for i in 1..2000 {
            let x = f64::from(i) * 0.013;
            assert!((ln(x) - x.ln()).abs() <= 4e-16 * x.ln().abs().max(1.0), "{x}");
            assert!((ln(x * 1e-200) - (x * 1e-200).ln()).abs() < 1e-12);
            let e = (x / 26.0) * 0.999;
            assert!((atanh_ratio(e) * e - e.atanh()).abs() < 1e-14 * e.atanh(), "{e}");
        }
        assert_eq!(atanh_ratio(0.0), 1.0);
    }
}
