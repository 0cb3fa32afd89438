//! The small typed expression language of sizes and queries. This room knows no mesh.
//!
//! | what | how |
//! |---|---|
//! | numbers | `2`, `.5`, `1e-3`, `pi`, and the variables of the place |
//! | arithmetic | `+ - * /`, `^` (a power, to the right: `2^3^2 = 2^9`), `-x` (after `^`: `-2^2 = -4`) |
//! | comparison | `= != < <= > >=` (also `==`), not chained; `region in [1, 4, 9]` |
//! | truths | `true`, `false`, `not`, then `and`, then `or` |
//! | functions | `abs ceil cos exp floor log` (natural) `max min pow round sign sin sqrt tan`, `if(truth, number, number)` |
//!
//! Both sides of everything are evaluated; nothing has an effect. Numbers are doubles: `1/0` is infinite, `0/0` and
//! `sqrt(-1)` are not numbers (NaN). What is computed from NaN is NaN, `min` and `max` too; every
//! comparison with it is false, only `!=` is true. `round` takes halves away from zero, `sign(0) = 0`.
//! Functions come from basic operations alone, so that a value has the same bits on every machine.
//!
//! Reading order: `words` (text to words), `parser` (words to operations), `machine` (what an operation does), `ranges`
//! (what can come out when variables lie within ranges).

mod machine;
mod parser;
mod ranges;
#[cfg(test)]
mod tests;
mod words;

use machine::Op;

/// What an expression is: a number or a truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Number,
    Truth,
}

/// A text that is no expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExprError {
    /// Byte of the text where the fault was found; its length when something is missing at the end.
    pub at: usize,
    pub message: String,
}

/// An expression ready to be evaluated, by any number of threads at once.
///
/// Shape: `ops` in postfix order; no prefix of them needs more than [`Expression::STACK_MAX`] values at once.
#[derive(Clone, Debug)]
pub struct Expression {
    ops: Vec<Op>,
    lists: Vec<Vec<f64>>,
    kind: Kind,
}

impl Expression {
    /// Longest text in bytes.
    pub const TEXT_MAX: usize = 16_384;
    /// Most values waiting for their operation, and most brackets and signs within each other.
    pub const STACK_MAX: usize = 64;

    /// Reads `text`; `variables` are the names it may use, by position.
    ///
    /// Errors: the first fault and its place.
    pub fn parse(text: &str, variables: &[&str]) -> Result<Self, ExprError> {
        parser::parse(text, variables)
    }

    /// What it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Whether it asks for the variable at this position.
    pub fn uses(&self, variable: usize) -> bool {
        self.ops
            .iter()
            .any(|op| matches!(op, Op::Variable(v) if *v == variable))
    }

    /// Its value, where it is a number; `values` are those of the variables.
    ///
    /// Panics when it is a truth, or with fewer values than variables.
    pub fn number(&self, values: &[f64]) -> f64 {
        assert_eq!(self.kind, Kind::Number, "a truth is no number");
        machine::run(&self.ops, &self.lists, values)
    }

    /// Its value, where it is a truth; `values` are those of the variables.
    ///
    /// Panics when it is a number, or with fewer values than variables.
    pub fn truth(&self, values: &[f64]) -> bool {
        assert_eq!(self.kind, Kind::Truth, "a number is no truth");
        machine::run(&self.ops, &self.lists, values) != 0.0
    }

    /// Whether it, a truth, can hold when each variable lies somewhere in its closed range.
    ///
    /// False is certain, true is not. Panics as [`Expression::truth`].
    pub fn may_hold(&self, ranges: &[[f64; 2]]) -> bool {
        assert_eq!(self.kind, Kind::Truth, "a number is no truth");
        ranges::may_hold(&self.ops, &self.lists, ranges)
    }
}
