//! Sizes by an expression in x, y and z.

use super::SizingError;
use super::constraint::SizeConstraint;
use tetdb_base::expr::{ExprKind, Expression};
use tetdb_base::geom::Point;

/// An expression for the wanted length, in input units.
#[derive(Clone, Debug)]
pub struct Formula {
    text: String,
    expression: Expression,
}

impl Formula {
    /// Parses a number of `x`, `y`, `z` in the language of [`expr`](tetdb_base::expr).
    ///
    /// # Errors
    /// The fault and its place in the text.
    pub fn parse(text: &str) -> Result<Self, SizingError> {
        let bad = |at, message| SizingError::BadFormula { text: text.to_owned(), at, message };
        let expression =
            Expression::parse(text, &["x", "y", "z"]).map_err(|e| bad(e.at, e.message))?;
        match expression.kind() {
            ExprKind::Number => Ok(Self { text: text.to_owned(), expression }),
            ExprKind::Truth => Err(bad(0, "it is true or false, not a length".to_owned())),
        }
    }
}

impl std::fmt::Display for Formula {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl PartialEq for Formula {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl SizeConstraint for Formula {
    fn h(&self, p: Point) -> Result<f64, SizingError> {
        let h = self.expression.number(&p.to_array());
        // Sizes are kept in single precision, in units of the surface's extent.
        if h.is_normal() && h > 0.0 {
            return Ok(h);
        }
        Err(SizingError::NoSize { text: self.text.clone(), at: p.to_array(), found: h })
    }

    fn option(&self) -> Option<&'static str> {
        Some("size_expr")
    }
}
