//! A wanted size as a function of position.

use super::SizingError;
use tetdb_base::geom::Point;

/// A wanted size as a function of position.
pub trait SizeConstraint: Sync {
    /// The size wanted at `p`, in input units; infinite for none.
    ///
    /// Errors: a value that is no size, and where.
    fn h(&self, p: Point) -> Result<f64, SizingError>;

    /// The option that asks for the size; `None` where nobody needs to know.
    fn option(&self) -> Option<&'static str> {
        None
    }

    /// Returns whether a cube must be divided for this constraint; `None` if only its values can decide.
    fn divides(&self, middle: Point, width: f64) -> Option<bool> {
        let _ = (middle, width);
        None
    }
}
