//! Wanted edge lengths of a new mesh.

use std::path::Path;
use std::sync::Arc;

use super::Error;
use super::field_arrays::{FieldArrays, IN_STORE};
use crate::pipeline::SizeFile;
use tetdb_base::geom::Point;
use tetdb_kernel::sizing::{
    Formula, LabelSize, Length, RegionSize, SizeOptions, SizeSource, SourceShape,
};

/// Wanted edge lengths: the lengths of the surface's own edges, and the sizes given here. The least of all counts.
///
/// Values that make no sense are refused when meshing starts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sizes {
    sizes: SizeOptions,
    expression: Option<String>,
    pub(super) file: Option<SizeFile>,
    pub(super) field: Option<Arc<FieldArrays>>,
}

impl Sizes {
    /// Uses the lengths of the surface's own edges, growing inwards.
    pub fn from_surface() -> Self {
        Self::default()
    }

    /// Wants `h` in the interior. The gradation joins `h` to the surface's edges.
    pub fn interior(h: Length) -> Self {
        let mut sizes = Self::default();
        sizes.sizes.hsiz = Some(h);
        sizes
    }

    /// Allows no length below `h` away from the surface.
    pub fn at_least(mut self, h: Length) -> Self {
        self.sizes.hmin = Some(h);
        self
    }

    /// Allows no length above `h`.
    pub fn at_most(mut self, h: Length) -> Self {
        self.sizes.hmax = Some(h);
        self
    }

    /// Limits the ratio of neighboring edge lengths; above 1. Default: 1.3.
    pub fn gradation(mut self, ratio: f64) -> Self {
        self.sizes.hgrad = Some(ratio);
        self
    }

    /// Wants `h` in the box between two corners. Outside the box, lengths grow, or are at most `outside`.
    pub fn in_box(self, low: [f64; 3], high: [f64; 3], h: Length, outside: Option<Length>) -> Self {
        let [p, q] = [low, high].map(Point::from_array);
        self.with_shape(SourceShape::Box { low: p.min(q), high: p.max(q) }, h, outside)
    }

    /// Wants `h` in a ball. Outside the ball, lengths grow, or are at most `outside`.
    pub fn in_sphere(
        self,
        center: [f64; 3],
        radius: f64,
        h: Length,
        outside: Option<Length>,
    ) -> Self {
        let center = Point::from_array(center);
        self.with_shape(SourceShape::Sphere { center, radius: Length::Units(radius) }, h, outside)
    }

    /// Wants `h` in a cylinder around the axis from `a` to `b`. Outside the cylinder, lengths grow, or are at most `outside`.
    pub fn in_cylinder(
        self,
        a: [f64; 3],
        b: [f64; 3],
        radius: f64,
        h: Length,
        outside: Option<Length>,
    ) -> Self {
        let ends = [a, b].map(Point::from_array);
        self.with_shape(SourceShape::Cylinder { ends, radius: Length::Units(radius) }, h, outside)
    }

    /// Wants at most `h` in a region, given by its number, its name or a label on it.
    pub fn in_region(mut self, region_or_label: &str, h: Length) -> Self {
        self.sizes.regions.push(RegionSize { which: region_or_label.trim().to_owned(), h });
        self
    }

    /// Wants at most `h` on the triangles of a label and up to `distance` from them; from there lengths grow.
    pub fn near_label(mut self, label: &str, h: Length, distance: Option<Length>) -> Self {
        self.sizes.labels.push(LabelSize { label: label.trim().to_owned(), h, distance });
        self
    }

    /// Adds a length as an expression in x, y and z, such as `0.06 + 0.1*abs(z)`.
    pub fn expression(mut self, text: &str) -> Self {
        self.expression = Some(text.to_owned());
        self
    }

    /// Reads lengths at the vertices of a background mesh: a MEDIT `.sol` file with its `.mesh` file next to it.
    pub fn field(mut self, file: impl AsRef<Path>) -> Self {
        let path = file.as_ref().to_string_lossy().into_owned();
        self.file = Some(SizeFile { path, hash: None });
        self.field = None;
        self
    }

    /// Sets lengths at the vertices of a tetrahedral background mesh, linear in between. Outside the background mesh they have no
    /// effect.
    ///
    /// Shape: `lengths` runs parallel to `points`; `tets` has positions in `points`. The store keeps a copy. Only for a new mesh.
    ///
    /// Errors: `count-mismatch`, `not-a-number`, `index-out-of-range`, `bad-size` and `unsupported-content` name the point or the
    /// tetrahedron.
    pub fn field_of_arrays(
        mut self,
        points: &[[f64; 3]],
        tets: &[[u32; 4]],
        lengths: &[f64],
    ) -> Result<Self, Error> {
        let field = FieldArrays::new(points, tets, lengths)?;
        self.file = Some(SizeFile { path: IN_STORE.to_owned(), hash: Some(field.hash()) });
        self.field = Some(Arc::new(field));
        Ok(self)
    }

    fn with_shape(mut self, shape: SourceShape, inside: Length, outside: Option<Length>) -> Self {
        self.sizes.sources.push(SizeSource { shape, inside, outside });
        self
    }

    /// The options of these sizes, without files and arrays. Errors: values that make no sense.
    pub(super) fn options(&self) -> Result<SizeOptions, Error> {
        let formula = self.expression.as_deref().map(Formula::parse).transpose()?;
        let sizes =
            SizeOptions { formula: formula.or(self.sizes.formula.clone()), ..self.sizes.clone() };
        sizes.check()?;
        Ok(sizes)
    }
}

impl From<(SizeOptions, Option<SizeFile>)> for Sizes {
    fn from((sizes, file): (SizeOptions, Option<SizeFile>)) -> Self {
        Self { sizes, expression: None, file, field: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::OptionsText;

    #[test]
    fn values_on_record_mean_what_they_mean_in_code() {
        let sizes = Sizes::interior(Length::share_of_diagonal(0.02))
            .gradation(1.4)
            .in_box([0.0; 3], [1.0, 2.0, 3.0], Length::percent(1.0), Some(Length::units(0.3)))
            .in_sphere([0.5, -1e-7, 0.0], 0.1, Length::units(0.01), None)
            .in_cylinder([0.0; 3], [1.0; 3], 0.25, Length::units(0.1), None)
            .expression("x + 1")
            .in_region("rock, wet", Length::units(0.25))
            .near_label("7,3", Length::units(0.25), None);
        let options = sizes.options().expect("good sizes");
        let text = OptionsText::from_sizes(&options, None);
        assert_eq!(text.hsiz.as_deref(), Some("2%"));
        assert_eq!(text.size_sphere, ["0.5,-0.0000001,0,0.1,0.01"]);
        assert_eq!(text.size_region, ["rock, wet,0.25"]);
        assert_eq!(text.size_label, ["7,3,0.25,0"]);
        assert_eq!(text.sizes(), Ok(options));
        for bad in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
            let bad = Length::units(bad);
            let inside = |h| Sizes::default().in_sphere([0.0; 3], 1.0, h, None);
            for sizes in [Sizes::interior(bad), inside(bad), Sizes::default().in_region("1", bad)] {
                assert_eq!(
                    sizes.options().map_err(|e| e.code()).err(),
                    Some("bad-size".parse().expect("a code"))
                );
            }
        }
        assert!(
            Sizes::default()
                .in_sphere([f64::NAN; 3], 1.0, Length::units(0.1), None)
                .options()
                .is_err()
        );
    }
}
