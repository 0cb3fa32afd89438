//! Errors of expressions.

/// A text that is no expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExprError {
    /// Byte of the text where the fault was found; its length when something is missing at the end.
    pub at: usize,
    /// The error, as a sentence.
    pub message: String,
}
