//! A parsed expression and its evaluation.

use super::op::{Op, STACK_MAX};
use super::{machine, ranges};

/// Type of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExprKind {
    /// A number.
    Number,
    /// True or false.
    Truth,
}

/// An expression ready to be evaluated, by any number of threads at once.
///
/// Shape: `ops` in postfix order; no prefix of them needs more than [`Expression::STACK_MAX`] values at once.
#[derive(Clone, Debug)]
pub struct Expression {
    pub(super) ops: Vec<Op>,
    pub(super) lists: Vec<Vec<f64>>,
    pub(super) kind: ExprKind,
}

impl Expression {
    /// Longest text in bytes.
    pub const TEXT_MAX: usize = 16_384;
    /// Most values waiting for their operation, and most brackets and signs within each other.
    pub const STACK_MAX: usize = STACK_MAX;

    /// Type of the expression.
    pub fn kind(&self) -> ExprKind {
        self.kind
    }

    /// Returns whether it names the variable at a position.
    pub fn names(&self, variable: usize) -> bool {
        (self.ops.iter()).any(|op| matches!(op, Op::Variable(v) if *v == variable))
    }

    /// Its value, where it is a number; `values` are those of the variables.
    ///
    /// Panics when it is a truth, or with fewer values than variables.
    pub fn number(&self, values: &[f64]) -> f64 {
        assert_eq!(self.kind, ExprKind::Number, "a truth is no number");
        machine::run(&self.ops, &self.lists, values)
    }

    /// Its value, where it is a truth; `values` are those of the variables.
    ///
    /// Panics when it is a number, or with fewer values than variables.
    pub fn truth(&self, values: &[f64]) -> bool {
        assert_eq!(self.kind, ExprKind::Truth, "a number is no truth");
        machine::run(&self.ops, &self.lists, values) != 0.0
    }

    /// Returns whether it, a truth, can hold when each variable lies somewhere in its closed range.
    ///
    /// False is certain, true is not. Panics as [`Expression::truth`].
    pub fn may_hold(&self, ranges: &[[f64; 2]]) -> bool {
        self.may_hold_with(ranges, &[])
    }

    /// Like [`Expression::may_hold`], where some variables may also not be numbers.
    pub fn may_hold_with(&self, ranges: &[[f64; 2]], nan: &[bool]) -> bool {
        self.truths(ranges, nan)[0]
    }

    /// Returns whether it, a truth, holds wherever each variable lies in its closed range; `nan` tells which may also not be numbers.
    ///
    /// True is certain, false is not. Panics as [`Expression::truth`].
    pub fn must_hold_with(&self, ranges: &[[f64; 2]], nan: &[bool]) -> bool {
        self.truths(ranges, nan)[1]
    }

    fn truths(&self, ranges: &[[f64; 2]], nan: &[bool]) -> [bool; 2] {
        assert_eq!(self.kind, ExprKind::Truth, "a number is no truth");
        ranges::truths(&self.ops, &self.lists, ranges, nan)
    }
}
