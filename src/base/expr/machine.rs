//! Evaluation: operations in postfix on a short stack of numbers. A truth is 1 or 0.

use super::op::{BinaryOp, Op, STACK_MAX, Unary};

impl Unary {
    pub(super) fn apply(self, x: f64) -> f64 {
        match self {
            Self::Abs => x.abs(),
            Self::Ceil => x.ceil(),
            Self::Cos => libm::cos(x),
            Self::Exp => libm::exp(x),
            Self::Floor => x.floor(),
            Self::Log => libm::log(x),
            Self::Negate => -x,
            Self::Not => truth(x == 0.0),
            Self::Round => x.round(),
            Self::Sign if x == 0.0 || x.is_nan() => x,
            Self::Sign => x.signum(),
            Self::Sin => libm::sin(x),
            Self::Sqrt => x.sqrt(),
            Self::Tan => libm::tan(x),
        }
    }
}

impl BinaryOp {
    pub(super) fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::And => truth(a != 0.0 && b != 0.0),
            Self::Divide => a / b,
            Self::Equal => truth(a == b),
            Self::Greater => truth(a > b),
            Self::GreaterEqual => truth(a >= b),
            Self::Less => truth(a < b),
            Self::LessEqual => truth(a <= b),
            Self::Max | Self::Min if a.is_nan() || b.is_nan() => f64::NAN,
            Self::Max if b > a => b,
            Self::Min if b < a => b,
            Self::Max | Self::Min => a,
            Self::Multiply => a * b,
            Self::NotEqual => truth(a != b),
            Self::Or => truth(a != 0.0 || b != 0.0),
            Self::Power => libm::pow(a, b),
            Self::Subtract => a - b,
        }
    }
}

fn truth(is: bool) -> f64 {
    f64::from(u8::from(is))
}

/// Runs `ops`, which the parser has counted: the stack neither overflows nor runs empty, and one value is left.
pub(super) fn run(ops: &[Op], lists: &[Vec<f64>], values: &[f64]) -> f64 {
    let mut stack = [0.0; STACK_MAX];
    let mut n = 0;
    for op in ops {
        match *op {
            Op::Constant(value) => {
                stack[n] = value;
                n += 1;
            }
            Op::Variable(v) => {
                stack[n] = values[v];
                n += 1;
            }
            Op::Unary(f) => stack[n - 1] = f.apply(stack[n - 1]),
            Op::BinaryOp(f) => {
                n -= 1;
                stack[n - 1] = f.apply(stack[n - 1], stack[n]);
            }
            Op::In(list) => stack[n - 1] = truth(lists[list].contains(&stack[n - 1])),
            Op::If => {
                n -= 2;
                let chosen = if stack[n - 1] != 0.0 { n } else { n + 1 };
                stack[n - 1] = stack[chosen];
            }
        }
    }
    stack[0]
}
