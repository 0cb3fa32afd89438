//! A length in input units or as a share of the surface.

use std::fmt;

use super::SizingError;

/// A length in the units of the surface, or a share of its box diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// In the units of the surface.
    Units(f64),
    /// In percent of the diagonal of the surface's box.
    Percent(f64),
}

impl fmt::Display for Length {
    /// As [`Length::parse`] reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Units(length) => write!(f, "{length}"),
            Self::Percent(percent) => write!(f, "{percent}%"),
        }
    }
}

impl Length {
    /// A length in the units of the surface.
    pub const fn units(length: f64) -> Self {
        Self::Units(length)
    }

    /// A share of the diagonal of the surface's box: 0.01 is one percent.
    pub const fn share_of_diagonal(share: f64) -> Self {
        Self::Percent(100.0 * share)
    }

    /// A share of the diagonal of the surface's box in percent.
    pub const fn percent(percent: f64) -> Self {
        Self::Percent(percent)
    }

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
            Ok(x) if is_length(x) => Ok(if percent { Self::Percent(x) } else { Self::Units(x) }),
            _ => Err(bad_length(option, text.to_owned())),
        }
    }

    /// Checks that the length is one.
    ///
    /// # Errors
    /// [`SizingError::BadValue`] with the name of `option` for what is no number above zero.
    pub fn check(self, option: &'static str) -> Result<(), SizingError> {
        let (Self::Units(x) | Self::Percent(x)) = self;
        if is_length(x) { Ok(()) } else { Err(bad_length(option, self.to_string())) }
    }

    /// The length for a surface whose box has that diagonal.
    pub fn resolve(self, diagonal: f64) -> f64 {
        match self {
            Self::Units(x) => x,
            Self::Percent(x) => x * 0.01 * diagonal,
        }
    }
}

fn is_length(x: f64) -> bool {
    x.is_normal() && x > 0.0
}

fn bad_length(option: &'static str, found: String) -> SizingError {
    SizingError::BadValue {
        option,
        found,
        expected: "a length above zero, such as 0.25, or a share of the box diagonal, such as 1%",
    }
}
