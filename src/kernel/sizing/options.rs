//! Wanted sizes, as asked for.

use std::fmt;

use super::SizingError;
use super::closed::slope_of_gradation;
use super::constraint::SizeConstraint as _;
use super::formula::Formula;
use super::label::LabelSize;
use super::length::Length;
use super::sources::SizeSource;
use tetdb_base::geom::Point;

/// A size for one region, as asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionSize {
    /// A region's number, or a label of triangles around it.
    pub which: String,
    /// The size in it.
    pub h: Length,
}

impl RegionSize {
    /// Parses `REGION_OR_LABEL,H`; a label may have commas.
    ///
    /// # Errors
    /// Names the option and the value.
    pub fn parse(text: &str) -> Result<Self, SizingError> {
        let parts = text.rsplit_once(',').filter(|(which, _)| !which.trim().is_empty());
        let (which, h) = parts.ok_or_else(|| SizingError::BadValue {
            option: "size_region",
            found: text.to_owned(),
            expected: "REGION,H or LABEL,H, such as 2,0.05",
        })?;
        Ok(Self { which: which.trim().to_owned(), h: Length::parse("size_region", h)? })
    }
}

impl fmt::Display for RegionSize {
    /// As [`RegionSize::parse`] reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.which, self.h)
    }
}

/// Ratio of the lengths of two edges that follow each other, where none is asked for: slope 0.262. At 1.1 meshes of solids have
/// three times as many tetrahedra as the surface needs; at 2 neighbors differ so much that their quality suffers.
const GRADATION: f64 = 1.3;
/// The same next to needles, where quality is lost anyway. With 1.3 a lever of a CAD program takes 31,000 tetrahedra instead of 2,900
/// and more bad ones; with 2 everywhere even scans lose up to a quarter of theirs.
const GRADATION_NEEDLES: f64 = 2.0;

/// Wanted sizes. By default they come from the surface's own edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SizeOptions {
    /// One size for the whole interior, joined to the surface's edges by the gradation.
    pub hsiz: Option<Length>,
    /// Smallest and largest size of the interior; the surface's own edges may be beyond.
    pub hmin: Option<Length>,
    /// Largest size of the interior.
    pub hmax: Option<Length>,
    /// Largest ratio of the lengths of two edges that follow each other; by default 1.3, and 2 next to needles. The field's slope
    /// is at most `beta = ln(hgrad)`: in a field of that slope, steps of one h grow by `exp(beta)` each.
    pub hgrad: Option<f64>,
    /// Shapes with sizes of their own; `hmin` bounds them too.
    pub sources: Vec<SizeSource>,
    /// A length by position; `hmin` bounds it too.
    pub formula: Option<Formula>,
    /// Lengths of regions; `hmin` bounds them too. The builder of the field turns them into [`Region`](super::Region)s.
    pub regions: Vec<RegionSize>,
    /// Lengths near the triangles of labels; `hmin` bounds them too. The builder of the field turns them into
    /// [`NearLabel`](super::NearLabel)s.
    pub labels: Vec<LabelSize>,
}

impl SizeOptions {
    /// Reads the texts of `--hsiz`, `--hmin`, `--hmax` and `--hgrad`; absent ones keep their default.
    ///
    /// # Errors
    /// Names the option and the value.
    pub fn parse(
        hsiz: Option<&str>,
        hmin: Option<&str>,
        hmax: Option<&str>,
        hgrad: Option<&str>,
    ) -> Result<Self, SizingError> {
        let length =
            |option, text: Option<&str>| text.map(|t| Length::parse(option, t)).transpose();
        let mut options = Self {
            hsiz: length("hsiz", hsiz)?,
            hmin: length("hmin", hmin)?,
            hmax: length("hmax", hmax)?,
            ..Self::default()
        };
        if let Some(text) = hgrad {
            let value = text.trim().parse().ok().filter(|&x| gradation_is_good(x));
            options.hgrad = Some(value.ok_or_else(|| bad_gradation(text))?);
        }
        Ok(options)
    }

    /// Adds other sizes: single values replace those here, shapes, regions and labels join the lists.
    pub fn add(&mut self, other: &Self) {
        self.hsiz = other.hsiz.or(self.hsiz);
        self.hmin = other.hmin.or(self.hmin);
        self.hmax = other.hmax.or(self.hmax);
        self.hgrad = other.hgrad.or(self.hgrad);
        self.sources.extend_from_slice(&other.sources);
        self.regions.extend_from_slice(&other.regions);
        self.labels.extend_from_slice(&other.labels);
        if other.formula.is_some() {
            self.formula.clone_from(&other.formula);
        }
    }

    /// Checks each value by itself.
    ///
    /// # Errors
    /// Names the option and the value.
    pub fn check(&self) -> Result<(), SizingError> {
        for (option, length) in [("hsiz", self.hsiz), ("hmin", self.hmin), ("hmax", self.hmax)] {
            length.map_or(Ok(()), |length| length.check(option))?;
        }
        match self.hgrad {
            Some(x) if !gradation_is_good(x) => return Err(bad_gradation(&x.to_string())),
            _ => {}
        }
        self.sources.iter().try_for_each(SizeSource::check)?;
        self.regions.iter().try_for_each(|region| region.h.check("size_region"))?;
        self.labels.iter().try_for_each(LabelSize::check)
    }

    /// Largest ratio of the lengths of two edges that follow each other.
    pub fn gradation(&self) -> f64 {
        self.hgrad.unwrap_or(GRADATION)
    }

    /// Slope bound of the field, `ln(hgrad)`.
    pub fn beta(&self) -> f64 {
        slope_of_gradation(self.gradation())
    }

    /// Slope bound next to needles.
    pub(super) fn beta_needles(&self) -> f64 {
        slope_of_gradation(self.hgrad.unwrap_or(GRADATION_NEEDLES))
    }

    /// The size that shapes and the formula ask for at a place, for a box of that diagonal; infinite where they ask for none.
    pub fn at_place(&self, p: Point, diagonal: f64) -> f64 {
        let of_formula = self.formula.as_ref().and_then(|formula| formula.h(p).ok());
        let shapes = self.sources.iter().map(|s| s.resolve(diagonal, 0.0).h(p, self.beta()));
        shapes.chain(of_formula).fold(f64::INFINITY, f64::min)
    }

    /// Lengths for a box of that diagonal, checked together.
    pub(super) fn resolve(&self, diagonal: f64) -> Result<Targets, SizingError> {
        if !gradation_is_good(self.gradation()) {
            return Err(bad_gradation(&self.gradation().to_string()));
        }
        let resolve = |option: &'static str, length: Option<Length>| {
            let Some(length) = length else {
                return Ok(None);
            };
            let x = length.resolve(diagonal);
            if x.is_normal() && x > 0.0 {
                return Ok(Some(x));
            }
            Err(SizingError::BadValue {
                option,
                found: format!("{length:?}"),
                expected: "a length above zero",
            })
        };
        let targets = Targets {
            hsiz: resolve("hsiz", self.hsiz)?,
            hmin: resolve("hmin", self.hmin)?,
            hmax: resolve("hmax", self.hmax)?,
            beta: self.beta(),
            beta_needles: self.beta_needles(),
        };
        match (targets.hmin, targets.hmax) {
            (Some(hmin), Some(hmax)) if hmin > hmax => Err(SizingError::Crossed { hmin, hmax }),
            _ => Ok(targets),
        }
    }
}

/// Below 1.02 the field would be nearly one constant, its smallest value.
fn gradation_is_good(x: f64) -> bool {
    (1.02..=10.0).contains(&x)
}

fn bad_gradation(found: &str) -> SizingError {
    SizingError::BadValue {
        option: "hgrad",
        found: found.to_owned(),
        expected: "a ratio from 1.02 to 10, such as 1.3",
    }
}

/// Wanted lengths of one surface, in one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Targets {
    pub hsiz: Option<f64>,
    pub hmin: Option<f64>,
    pub hmax: Option<f64>,
    /// Slope bound of the field, and where the surface has needles.
    pub beta: f64,
    pub beta_needles: f64,
}

impl Targets {
    /// The same lengths in another unit.
    pub fn scaled(self, factor: f64) -> Self {
        let scale = |x: Option<f64>| x.map(|x| x * factor);
        Self {
            hsiz: scale(self.hsiz),
            hmin: scale(self.hmin),
            hmax: scale(self.hmax),
            beta: self.beta,
            beta_needles: self.beta_needles,
        }
    }

    /// Largest factor on the slope bound.
    pub fn slope_factor_max(&self) -> f64 {
        self.beta_needles / self.beta
    }

    /// Returns whether anything but the surface's edges was asked for.
    pub fn any(&self) -> bool {
        self.hsiz.is_some() || self.hmin.is_some() || self.hmax.is_some()
    }

    /// The size wanted in the interior where the surface alone would give `h`.
    pub fn interior(&self, h: f64) -> f64 {
        let h = self.hsiz.unwrap_or(h);
        h.max(self.hmin.unwrap_or(0.0)).min(self.hmax.unwrap_or(f64::INFINITY))
    }
}
