//! The small typed expression language of sizes and queries. It has no access to a mesh.
//!
//! | what | how |
//! |---|---|
//! | numbers | `2`, `.5`, `1e-3`, `pi`, and the variables of the place |
//! | arithmetic | `+ - * /`, `^` (a power, to the right: `2^3^2 = 2^9`), `-x` (after `^`: `-2^2 = -4`) |
//! | comparison | `= != < <= > >=` (also `==`), not chained; `region in [1, 4, 9]` |
//! | truths | `true`, `false`, `not`, then `and` (also `&&`), then `or` (also `||`) |
//! | functions | `abs ceil cos exp floor log` (natural) `max min pow round sign sin sqrt tan`, `if(truth, number, number)` |
//!
//! Both sides of every operation are evaluated; none has an effect. Numbers are doubles: `1/0` is infinite, `0/0` and
//! `sqrt(-1)` are not numbers (NaN). Operations on NaN give NaN, `min` and `max` too. Every comparison with NaN is
//! false; only `!=` is true. `round` takes halves away from zero, `sign(0) = 0`. Functions use basic operations alone,
//! so that a value has the same bits on every machine.
//!
//! Reading order: `words` (text to tokens), `parser` (tokens to operations), `machine` (evaluation), `ranges`
//! (evaluation over intervals of the variables).

mod error;
mod expression;
mod machine;
mod op;
mod parser;
mod ranges;
#[cfg(test)]
mod tests;
mod words;

pub use error::ExprError;
pub use expression::{ExprKind, Expression};
