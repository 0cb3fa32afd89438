//! A length in input units or as a share of the surface.

use super::SizingError;

/// A length, or a share of the diagonal of the surface's box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// In input units.
    Absolute(f64),
    /// In percent of the box diagonal.
    Percent(f64),
}

impl Length {
    /// Reads `0.25` or `1%`; `option` names the value in errors.
    ///
    /// # Errors
    /// [`SizingError::BadValue`] for a text that is not a number above zero.
    pub fn parse(option: &'static str, text: &str) -> Result<Self, SizingError> {
        let trimmed = text.trim();
        let (digits, percent) = match trimmed.strip_suffix('%') {
            Some(digits) => (digits.trim_end(), true),
            None => (trimmed, false),
        };
        match digits.parse::<f64>() {
            Ok(x) if x.is_normal() && x > 0.0 => {
                Ok(if percent { Self::Percent(x) } else { Self::Absolute(x) })
            }
            _ => Err(SizingError::BadValue {
                option,
                found: text.to_owned(),
                expected: "a length above zero, such as 0.25, or a share of the box diagonal, such as 1%",
            }),
        }
    }

    /// The length for a surface whose box has that diagonal.
    pub fn resolve(self, diagonal: f64) -> f64 {
        match self {
            Self::Absolute(x) => x,
            Self::Percent(x) => x * 0.01 * diagonal,
        }
    }
}
