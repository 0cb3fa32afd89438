//! Conditions that select tetrahedra.

use super::Error;
pub use tetdb_base::expr::ExprError;
use tetdb_base::expr::{ExprKind, Expression};
use tetdb_schema::code::Code;
pub use tetdb_store::query::VARIABLES;

/// A condition on the [`VARIABLES`] of a tetrahedron, such as `quality > 6 and region in [1, 2]`.
///
/// ```
/// use tetdb_engine::api::Condition;
///
/// assert!(Condition::parse("quality > 6 and x < 0.5").is_ok());
/// assert_eq!(Condition::parse("quality > six").unwrap_err().at, 10);
/// ```
#[derive(Clone, Debug)]
pub struct Condition(pub(super) Expression);

impl Condition {
    /// Parses a condition. Errors: the byte where `text` makes no sense, and the reason.
    pub fn parse(text: &str) -> Result<Self, ExprError> {
        let parsed = Expression::parse(text, &VARIABLES)?;
        if parsed.kind() == ExprKind::Truth {
            return Ok(Self(parsed));
        }
        let message = "this is a number; a condition compares, such as `quality > 6`".to_owned();
        Err(ExprError { at: 0, message })
    }

    /// [`Condition::parse`] with an [`Error`] for the caller. Errors: `bad-expression`.
    pub(super) fn parse_located(text: &str) -> Result<Self, Error> {
        Self::parse(text).map_err(|error| {
            Error::new(Code::BadExpression, &error)
                .at(format!("character {} of {text}", error.at + 1))
                .with_help("such as quality > 6 and region in [1, 2]")
        })
    }
}
