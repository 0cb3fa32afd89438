//! Wanted edge lengths.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use super::Error;
use super::field_arrays::{FieldArrays, IN_STORE};
use crate::pipeline::Options;

/// A length in the units of the surface, or a share of its box diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// In the units of the surface.
    Units(f64),
    /// A share of the diagonal of the surface's box: 0.01 is one percent.
    ShareOfDiagonal(f64),
    /// The same in percent, on record as it is given.
    Percent(f64),
}

impl Length {
    /// A length in the units of the surface.
    pub const fn units(length: f64) -> Self {
        Self::Units(length)
    }

    /// A share of the diagonal of the surface's box: 0.01 is one percent.
    pub const fn share_of_diagonal(share: f64) -> Self {
        Self::ShareOfDiagonal(share)
    }

    /// A share of the diagonal of the surface's box in percent.
    pub const fn percent(percent: f64) -> Self {
        Self::Percent(percent)
    }
}

impl fmt::Display for Length {
    /// As it is put on record.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Units(length) => write!(f, "{length}"),
            Self::ShareOfDiagonal(share) => write!(f, "{}%", 100.0 * share),
            Self::Percent(percent) => write!(f, "{percent}%"),
        }
    }
}

/// Wanted edge lengths: those of the surface's own edges, and where something else is said here, the least of all.
///
/// Values without a meaning are refused when the mesh is begun.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sizes {
    #[doc(hidden)]
    pub options: Options,
    #[doc(hidden)]
    pub field: Option<Arc<FieldArrays>>,
}

impl Sizes {
    /// The lengths of the surface's own edges, growing inwards.
    pub fn from_surface() -> Self {
        Self::default()
    }

    /// `h` inside, joined to the surface's edges by the gradation.
    pub fn interior(h: Length) -> Self {
        let mut sizes = Self::default();
        sizes.options.hsiz = Some(h.to_string());
        sizes
    }

    /// No length below `h` away from the surface.
    pub fn at_least(mut self, h: Length) -> Self {
        self.options.hmin = Some(h.to_string());
        self
    }

    /// No length above `h`.
    pub fn at_most(mut self, h: Length) -> Self {
        self.options.hmax = Some(h.to_string());
        self
    }

    /// The ratio of neighboring edge lengths at most, above 1. Default: 1.3.
    pub fn gradation(mut self, ratio: f64) -> Self {
        self.options.hgrad = Some(ratio.to_string());
        self
    }

    /// `h` in the box between two corners; outside of it lengths grow, or are `outside` at most.
    pub fn in_box(
        mut self,
        low: [f64; 3],
        high: [f64; 3],
        h: Length,
        outside: Option<Length>,
    ) -> Self {
        let numbers = [low, high].concat();
        self.options.size_box.push(list(&numbers, h, outside));
        self
    }

    /// `h` in a ball; outside of it lengths grow, or are `outside` at most.
    pub fn in_sphere(
        mut self,
        center: [f64; 3],
        radius: f64,
        h: Length,
        outside: Option<Length>,
    ) -> Self {
        let numbers = [&center[..], &[radius]].concat();
        self.options.size_sphere.push(list(&numbers, h, outside));
        self
    }

    /// `h` in a cylinder around the axis from `a` to `b`; outside of it lengths grow, or are `outside` at most.
    pub fn in_cylinder(
        mut self,
        a: [f64; 3],
        b: [f64; 3],
        radius: f64,
        h: Length,
        outside: Option<Length>,
    ) -> Self {
        let numbers = [&a[..], &b[..], &[radius]].concat();
        self.options.size_cylinder.push(list(&numbers, h, outside));
        self
    }

    /// `h` at most in a region, named by its number or by a label on it.
    pub fn in_region(mut self, region_or_label: &str, h: Length) -> Self {
        self.options.size_region.push(format!("{region_or_label},{h}"));
        self
    }

    /// A length as an expression in x, y and z, such as `0.06 + 0.1*abs(z)`.
    pub fn expression(mut self, text: &str) -> Self {
        self.options.size_expr = Some(text.to_owned());
        self
    }

    /// Lengths at the vertices of a background mesh: a MEDIT `.sol` with its `.mesh` beside it.
    pub fn field(mut self, file: impl AsRef<Path>) -> Self {
        self.options.size_field = Some(file.as_ref().to_string_lossy().into_owned());
        self.field = None;
        self
    }

    /// Lengths at the vertices of a tetrahedral background mesh, linear in between; nothing is asked for outside of it.
    ///
    /// Shape: `lengths` runs parallel to `points`, which `tets` index. The store keeps a copy. For a new mesh only. Errors:
    /// `count-mismatch`, `not-a-number`, `index-out-of-range`, `bad-size`, `unsupported-content` name the point or the tetrahedron.
    pub fn field_of_arrays(
        mut self,
        points: &[[f64; 3]],
        tets: &[[u32; 4]],
        lengths: &[f64],
    ) -> Result<Self, Error> {
        let field = FieldArrays::new(points, tets, lengths)?;
        self.options.size_field = Some(IN_STORE.to_owned());
        self.options.size_field_hash = Some(field.hash());
        self.field = Some(Arc::new(field));
        Ok(self)
    }
}

fn list(numbers: &[f64], h: Length, outside: Option<Length>) -> String {
    let mut words: Vec<String> = numbers.iter().map(f64::to_string).collect();
    words.push(h.to_string());
    words.extend(outside.map(|h| h.to_string()));
    words.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_in_code_means_what_is_typed_in_a_shell() {
        let sizes = Sizes::interior(Length::share_of_diagonal(0.02))
            .gradation(1.4)
            .in_sphere([0.5, -1e-7, 0.0], 0.1, Length::units(0.01), None)
            .in_region("rock", Length::units(0.25));
        let options = sizes.options;
        assert_eq!(options.hsiz.as_deref(), Some("2%"));
        assert_eq!(options.size_sphere, ["0.5,-0.0000001,0,0.1,0.01"]);
        assert_eq!(options.size_region, ["rock,0.25"]);
        assert!(options.sizes().is_ok());
    }
}
