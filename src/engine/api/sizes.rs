//! Wanted edge lengths.

use std::path::Path;
use std::sync::Arc;

use super::Error;
use super::field_arrays::{FieldArrays, IN_STORE};
use crate::pipeline::SizeFile;
use tetdb_base::geom::Point;
use tetdb_kernel::sizing::{Formula, Length, RegionSize, SizeOptions, SizeSource, SourceShape};

/// Wanted edge lengths: those of the surface's own edges, and where something else is said here, the least of all.
///
/// Values without a meaning are refused when the mesh is begun.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sizes {
    sizes: SizeOptions,
    expression: Option<String>,
    pub(super) file: Option<SizeFile>,
    pub(super) field: Option<Arc<FieldArrays>>,
}

impl Sizes {
    /// The lengths of the surface's own edges, growing inwards.
    pub fn from_surface() -> Self {
        Self::default()
    }

    /// `h` inside, joined to the surface's edges by the gradation.
    pub fn interior(h: Length) -> Self {
        let mut sizes = Self::default();
        sizes.sizes.hsiz = Some(h);
        sizes
    }

    /// No length below `h` away from the surface.
    pub fn at_least(mut self, h: Length) -> Self {
        self.sizes.hmin = Some(h);
        self
    }

    /// No length above `h`.
    pub fn at_most(mut self, h: Length) -> Self {
        self.sizes.hmax = Some(h);
        self
    }

    /// The ratio of neighboring edge lengths at most, above 1. Default: 1.3.
    pub fn gradation(mut self, ratio: f64) -> Self {
        self.sizes.hgrad = Some(ratio);
        self
    }

    /// `h` in the box between two corners; outside of it lengths grow, or are `outside` at most.
    pub fn in_box(self, low: [f64; 3], high: [f64; 3], h: Length, outside: Option<Length>) -> Self {
        let [p, q] = [low, high].map(Point::from_array);
        self.with_shape(SourceShape::Box { low: p.min(q), high: p.max(q) }, h, outside)
    }

    /// `h` in a ball; outside of it lengths grow, or are `outside` at most.
    pub fn in_sphere(
        self,
        center: [f64; 3],
        radius: f64,
        h: Length,
        outside: Option<Length>,
    ) -> Self {
        let center = Point::from_array(center);
        self.with_shape(SourceShape::Sphere { center, radius }, h, outside)
    }

    /// `h` in a cylinder around the axis from `a` to `b`; outside of it lengths grow, or are `outside` at most.
    pub fn in_cylinder(
        self,
        a: [f64; 3],
        b: [f64; 3],
        radius: f64,
        h: Length,
        outside: Option<Length>,
    ) -> Self {
        let ends = [a, b].map(Point::from_array);
        self.with_shape(SourceShape::Cylinder { ends, radius }, h, outside)
    }

    /// `h` at most in a region, named by its number or by a label on it.
    pub fn in_region(mut self, region_or_label: &str, h: Length) -> Self {
        self.sizes.regions.push(RegionSize { which: region_or_label.trim().to_owned(), h });
        self
    }

    /// A length as an expression in x, y and z, such as `0.06 + 0.1*abs(z)`.
    pub fn expression(mut self, text: &str) -> Self {
        self.expression = Some(text.to_owned());
        self
    }

    /// Lengths at the vertices of a background mesh: a MEDIT `.sol` with its `.mesh` beside it.
    pub fn field(mut self, file: impl AsRef<Path>) -> Self {
        let path = file.as_ref().to_string_lossy().into_owned();
        self.file = Some(SizeFile { path, hash: None });
        self.field = None;
        self
    }

    /// Lengths at the vertices of a tetrahedral background mesh, linear in between; nothing is asked for outside of it.
    ///
    /// SourceShape: `lengths` runs parallel to `points`, which `tets` index. The store keeps a copy. For a new mesh only. Errors:
    /// `count-mismatch`, `not-a-number`, `index-out-of-range`, `bad-size`, `unsupported-content` name the point or the tetrahedron.
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

    /// The sizes without those of files and arrays. Errors: values without a meaning.
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
            .in_region("rock, wet", Length::units(0.25));
        let options = sizes.options().expect("good sizes");
        let text = OptionsText::from_sizes(&options, None);
        assert_eq!(text.hsiz.as_deref(), Some("2%"));
        assert_eq!(text.size_sphere, ["0.5,-0.0000001,0,0.1,0.01"]);
        assert_eq!(text.size_region, ["rock, wet,0.25"]);
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
