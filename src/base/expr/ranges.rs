//! What can come out when variables lie within ranges: the same operations on intervals.
//!
//! Rounding is monotone, so the ends of the intervals of sums, products, quotients and roots, rounded as values are,
//! hold all rounded values. Of the other functions nothing is claimed.

use super::op::{Binary, Op, STACK_MAX, Unary};

/// The values that can occur: numbers from `low` to `high`, and NaN perhaps. Of a truth, 0 and 1 are such numbers.
#[derive(Clone, Copy, Debug)]
struct Range {
    low: f64,
    high: f64,
    nan: bool,
}

const ANY: Range = Range { low: f64::NEG_INFINITY, high: f64::INFINITY, nan: true };

impl Range {
    /// From values that are its ends; anything when one is not a number.
    fn of(ends: &[f64], nan: bool) -> Self {
        if ends.iter().any(|e| e.is_nan()) {
            return ANY;
        }
        Self {
            low: ends.iter().copied().fold(f64::INFINITY, f64::min),
            high: ends.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            nan,
        }
    }

    fn truth(may_fail: bool, may_hold: bool) -> Self {
        Self {
            low: f64::from(u8::from(!may_fail)),
            high: f64::from(u8::from(may_hold)),
            nan: false,
        }
    }

    fn holds_zero(self) -> bool {
        self.low <= 0.0 && self.high >= 0.0
    }

    fn is_bounded(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }
}

/// See [`Expression::may_hold`].
pub(super) fn may_hold(ops: &[Op], lists: &[Vec<f64>], ranges: &[[f64; 2]]) -> bool {
    let mut stack = [ANY; STACK_MAX];
    let mut n = 0;
    for op in ops {
        match *op {
            Op::Constant(value) => {
                stack[n] = Range::of(&[value], false);
                n += 1;
            }
            Op::Variable(v) => {
                stack[n] = Range::of(&ranges[v], false);
                n += 1;
            }
            Op::Unary(f) => stack[n - 1] = unary(f, stack[n - 1]),
            Op::Binary(f) => {
                n -= 1;
                stack[n - 1] = binary(f, stack[n - 1], stack[n]);
            }
            Op::In(list) => {
                let x = stack[n - 1];
                let within = |v: &f64| x.low <= *v && *v <= x.high;
                stack[n - 1] = Range::truth(true, lists[list].iter().any(within));
            }
            Op::If => {
                n -= 2;
                let (condition, yes, no) = (stack[n - 1], stack[n], stack[n + 1]);
                stack[n - 1] = match (condition.low > 0.0, condition.high > 0.0) {
                    (true, _) => yes,
                    (_, false) => no,
                    _ => Range::of(&[yes.low, yes.high, no.low, no.high], yes.nan || no.nan),
                };
            }
        }
    }
    stack[0].high > 0.0
}

fn unary(f: Unary, x: Range) -> Range {
    match f {
        Unary::Negate | Unary::Ceil | Unary::Floor | Unary::Round | Unary::Sign => {
            Range::of(&[f.of(x.low), f.of(x.high)], x.nan)
        }
        Unary::Abs if x.holds_zero() => Range::of(&[0.0, x.low.abs(), x.high.abs()], x.nan),
        Unary::Abs => Range::of(&[x.low.abs(), x.high.abs()], x.nan),
        Unary::Sqrt if x.low >= 0.0 => Range::of(&[x.low.sqrt(), x.high.sqrt()], x.nan),
        Unary::Not => Range::truth(x.high > 0.0, x.low <= 0.0),
        Unary::Sin | Unary::Cos if x.is_bounded() => Range::of(&[-1.0, 1.0], x.nan),
        Unary::Cos | Unary::Exp | Unary::Log | Unary::Sin | Unary::Sqrt | Unary::Tan => ANY,
    }
}

fn binary(f: Binary, a: Range, b: Range) -> Range {
    let nan = a.nan || b.nan;
    let ends = |f: Binary| {
        let pairs = [(a.low, b.low), (a.low, b.high), (a.high, b.low), (a.high, b.high)];
        pairs.map(|(a, b)| f.of(a, b))
    };
    // Infinite ends meet only where a range is unbounded: what is between them need not come near.
    let bounded = a.is_bounded() && b.is_bounded();
    match f {
        Binary::Add | Binary::Subtract | Binary::Multiply if bounded => Range::of(&ends(f), nan),
        Binary::Divide if bounded && !b.holds_zero() => Range::of(&ends(f), nan),
        Binary::Max | Binary::Min => Range::of(&ends(f), nan),
        Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide | Binary::Power => ANY,
        Binary::Less => Range::truth(nan || a.high >= b.low, a.low < b.high),
        Binary::LessEqual => Range::truth(nan || a.high > b.low, a.low <= b.high),
        Binary::Greater => Range::truth(nan || a.low <= b.high, a.high > b.low),
        Binary::GreaterEqual => Range::truth(nan || a.low < b.high, a.high >= b.low),
        Binary::Equal | Binary::NotEqual => {
            let may_be_one = a.low <= b.high && b.low <= a.high;
            let must_be_one = !nan && a.low == b.high && a.high == b.low;
            match f {
                Binary::Equal => Range::truth(!must_be_one, may_be_one),
                _ => Range::truth(may_be_one, !must_be_one),
            }
        }
        Binary::And => Range::truth(a.low <= 0.0 || b.low <= 0.0, a.high > 0.0 && b.high > 0.0),
        Binary::Or => Range::truth(a.low <= 0.0 && b.low <= 0.0, a.high > 0.0 || b.high > 0.0),
    }
}
