//! Interval evaluation: bounds of an expression while variables lie within ranges.
//!
//! Rounding is monotone, so the ends of the intervals of sums, products, quotients and roots, rounded as values are,
//! hold all rounded values. Of the other functions nothing is claimed.

use super::op::{BinaryOp, Op, STACK_MAX, Unary};

/// Bounds of a value: numbers from `low` to `high`, perhaps NaN. For a truth the numbers are 0 and 1.
#[derive(Clone, Copy, Debug)]
struct Interval {
    low: f64,
    high: f64,
    nan: bool,
}

const ANY: Interval = Interval { low: f64::NEG_INFINITY, high: f64::INFINITY, nan: true };

impl Interval {
    /// From values that are its ends; anything when one is not a number.
    fn around(ends: &[f64], nan: bool) -> Self {
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

/// Returns whether a truth can hold, and whether it must: see [`Expression::may_hold`](super::Expression::may_hold).
pub(super) fn truths(
    ops: &[Op],
    lists: &[Vec<f64>],
    ranges: &[[f64; 2]],
    nan: &[bool],
) -> [bool; 2] {
    let mut stack = [ANY; STACK_MAX];
    let mut n = 0;
    for op in ops {
        match *op {
            Op::Constant(value) => {
                stack[n] = Interval::around(&[value], false);
                n += 1;
            }
            Op::Variable(v) => {
                stack[n] = Interval::around(&ranges[v], nan.get(v) == Some(&true));
                n += 1;
            }
            Op::Unary(f) => stack[n - 1] = unary(f, stack[n - 1]),
            Op::BinaryOp(f) => {
                n -= 1;
                stack[n - 1] = binary(f, stack[n - 1], stack[n]);
            }
            Op::In(list) => {
                let x = stack[n - 1];
                let within = |v: &f64| x.low <= *v && *v <= x.high;
                stack[n - 1] = Interval::truth(true, lists[list].iter().any(within));
            }
            Op::If => {
                n -= 2;
                let (condition, yes, no) = (stack[n - 1], stack[n], stack[n + 1]);
                stack[n - 1] = match (condition.low > 0.0, condition.high > 0.0) {
                    (true, _) => yes,
                    (_, false) => no,
                    _ => Interval::around(&[yes.low, yes.high, no.low, no.high], yes.nan || no.nan),
                };
            }
        }
    }
    [stack[0].high > 0.0, stack[0].low > 0.0]
}

fn unary(f: Unary, x: Interval) -> Interval {
    match f {
        Unary::Negate | Unary::Ceil | Unary::Floor | Unary::Round | Unary::Sign => {
            Interval::around(&[f.apply(x.low), f.apply(x.high)], x.nan)
        }
        Unary::Abs if x.holds_zero() => Interval::around(&[0.0, x.low.abs(), x.high.abs()], x.nan),
        Unary::Abs => Interval::around(&[x.low.abs(), x.high.abs()], x.nan),
        Unary::Sqrt if x.low >= 0.0 => Interval::around(&[x.low.sqrt(), x.high.sqrt()], x.nan),
        Unary::Not => Interval::truth(x.high > 0.0, x.low <= 0.0),
        Unary::Sin | Unary::Cos if x.is_bounded() => Interval::around(&[-1.0, 1.0], x.nan),
        Unary::Cos | Unary::Exp | Unary::Log | Unary::Sin | Unary::Sqrt | Unary::Tan => ANY,
    }
}

fn binary(f: BinaryOp, a: Interval, b: Interval) -> Interval {
    let nan = a.nan || b.nan;
    let ends = |f: BinaryOp| {
        let pairs = [(a.low, b.low), (a.low, b.high), (a.high, b.low), (a.high, b.high)];
        pairs.map(|(a, b)| f.apply(a, b))
    };
    // Infinite ends meet only in an unbounded range, whose inner values need not come near.
    let bounded = a.is_bounded() && b.is_bounded();
    match f {
        BinaryOp::Add | BinaryOp::Subtract | BinaryOp::Multiply if bounded => {
            Interval::around(&ends(f), nan)
        }
        BinaryOp::Divide if bounded && !b.holds_zero() => Interval::around(&ends(f), nan),
        BinaryOp::Max | BinaryOp::Min => Interval::around(&ends(f), nan),
        BinaryOp::Add
        | BinaryOp::Subtract
        | BinaryOp::Multiply
        | BinaryOp::Divide
        | BinaryOp::Power => ANY,
        BinaryOp::Less => Interval::truth(nan || a.high >= b.low, a.low < b.high),
        BinaryOp::LessEqual => Interval::truth(nan || a.high > b.low, a.low <= b.high),
        BinaryOp::Greater => Interval::truth(nan || a.low <= b.high, a.high > b.low),
        BinaryOp::GreaterEqual => Interval::truth(nan || a.low < b.high, a.high >= b.low),
        BinaryOp::Equal | BinaryOp::NotEqual => {
            let may_be_one = a.low <= b.high && b.low <= a.high;
            let must_be_one = !nan && a.low == b.high && a.high == b.low;
            match f {
                BinaryOp::Equal => Interval::truth(!must_be_one, may_be_one),
                _ => Interval::truth(may_be_one, !must_be_one),
            }
        }
        BinaryOp::And => {
            Interval::truth(a.low <= 0.0 || b.low <= 0.0, a.high > 0.0 && b.high > 0.0)
        }
        BinaryOp::Or => Interval::truth(a.low <= 0.0 && b.low <= 0.0, a.high > 0.0 || b.high > 0.0),
    }
}
