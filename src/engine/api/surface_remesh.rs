//! Surfaces remeshed within a tolerance.

use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::Surface as Inner;
use tetdb_kernel::sizing::SizeOptions;
use tetdb_repair::remesh::{RemeshReport, RemeshSettings, remesh};
use tetdb_schema::code::Code;

use tetdb_schema::source::Origin;

use super::surface::refuse_sheets;
use super::{Error, Length, OptionsText, Settings, Sizes, Surface, guarded};

/// Greatest tolerance as a share of the box diagonal: beyond it two sides of most parts are as near as the tolerance.
const TOLERANCE_MOST: f64 = 0.1;
/// Least tolerance as a share of the largest coordinate: below it, the rounding of coordinates decides.
const TOLERANCE_LEAST: f64 = 1e-9;
/// Ratio of neighboring edge lengths where none is given: at 1.3 a fifth more triangles, from 1.6 on one tetrahedron in two hundred is poor.
const GRADATION: f64 = 1.4;
/// Steps of progress.
const STEPS: u64 = 1000;

/// How a surface is remeshed: [`Surface::remeshed`].
#[derive(Clone, Debug)]
pub struct SurfaceRemesh {
    /// Greatest distance of any point of either surface from the other. Default: 0.05 % of the box diagonal.
    pub tolerance: Length,
    /// Edges between triangles whose normals differ by more than this angle in degrees are kept. Default: 40.
    pub feature_angle: f64,
    /// Greatest edge length. Default: none.
    pub hmax: Option<Length>,
    /// Least edge length asked for. Default: twice the tolerance.
    pub hmin: Option<Length>,
    /// Greatest ratio of neighboring edge lengths. Default: 1.4.
    pub hgrad: Option<f64>,
    /// Lengths in shapes, and a formula for them.
    places: SizeOptions,
}

impl Default for SurfaceRemesh {
    fn default() -> Self {
        Self {
            tolerance: Length::percent(0.05),
            feature_angle: 40.0,
            hmax: None,
            hmin: None,
            hgrad: None,
            places: SizeOptions::default(),
        }
    }
}

impl SurfaceRemesh {
    /// Takes wanted lengths from the sizes of a mesh: `hsiz` or else `hmax`, `hmin`, `hgrad`, shapes and the expression. Lengths of regions and of
    /// labels, and those of a size field, shape the inside alone.
    pub fn with_sizes(self, sizes: &Sizes) -> Result<Self, Error> {
        Ok(self.sized(&sizes.options()?))
    }

    /// [`SurfaceRemesh::with_sizes`] for sizes as options.
    #[doc(hidden)]
    pub fn sized(mut self, sizes: &SizeOptions) -> Self {
        (self.hmax, self.hmin, self.hgrad) = (sizes.hsiz.or(sizes.hmax), sizes.hmin, sizes.hgrad);
        self.places.sources.clone_from(&sizes.sources);
        self.places.formula.clone_from(&sizes.formula);
        self.places.hgrad = sizes.hgrad;
        self
    }

    /// The settings for one surface, in its units.
    fn settings(&self, surface: &Inner) -> Result<RemeshSettings, Error> {
        self.tolerance.check("tolerance")?;
        let sizes = SizeOptions {
            hmax: self.hmax,
            hmin: self.hmin,
            hgrad: self.hgrad,
            ..self.places.clone()
        };
        sizes.check()?;
        let bounds = surface.bounds();
        let diagonal = bounds.diagonal();
        let tolerance = self.tolerance.resolve(diagonal);
        let refuse =
            |message: String, help: &str| Err(Error::new(Code::Usage, message).with_help(help));
        if !(1.0..=90.0).contains(&self.feature_angle) {
            let message =
                format!("the feature angle is {}, expected 1 to 90 degrees", self.feature_angle);
            return refuse(
                message,
                "40 keeps the edges that a part shows, and 20 those of coarse cylinders as well",
            );
        }
        if tolerance > TOLERANCE_MOST * diagonal {
            let message = format!(
                "the tolerance {tolerance} is more than a tenth of the box diagonal {diagonal}"
            );
            return refuse(message, "0.05% suits most parts");
        }
        let largest = bounds.low.abs().max(bounds.high.abs()).max_element();
        if tolerance < TOLERANCE_LEAST * largest {
            let message = format!(
                "the tolerance {tolerance} is below the rounding of coordinates as large as {largest}"
            );
            return refuse(message, "allow more, or move the surface to the origin");
        }
        let [hmax, hmin] = [self.hmax, self.hmin].map(|h| h.map(|h| h.resolve(diagonal)));
        if let (Some(least), Some(most)) = (hmin, hmax)
            && least > most
        {
            let message = format!("the least length {least} is above the greatest {most}");
            return refuse(message, "ask for a least length, hmin, below the greatest");
        }
        Ok(RemeshSettings {
            tolerance,
            feature_cos: self.feature_angle.to_radians().cos(),
            hmax: hmax.unwrap_or(f64::INFINITY),
            hmin: hmin.unwrap_or(0.0),
            growth: self.hgrad.unwrap_or(GRADATION).ln(),
        })
    }
}

impl Surface {
    /// A surface of even triangles, no point of which is farther than a tolerance from this one, nor the reverse.
    ///
    /// Lengths follow curvature and thickness within the given bounds. Edges between faces, borders of labels and edges of more than two
    /// triangles are kept as curves, and corners stay where they are. The result is validated.
    ///
    /// Errors: a surface with defects or with sheets; lengths or angles that make no sense; `memory`.
    pub fn remeshed(&self, options: &SurfaceRemesh) -> Result<(Self, RemeshReport), Error> {
        self.remeshed_with(options, &Settings::new())
    }

    /// [`Surface::remeshed`] within the memory of `settings`.
    pub fn remeshed_with(
        &self,
        options: &SurfaceRemesh,
        settings: &Settings,
    ) -> Result<(Self, RemeshReport), Error> {
        refuse_sheets(&self.inner, "remeshed")?;
        let wanted = options.settings(&self.inner)?;
        self.validate_with(settings)?;
        guarded(settings, || {
            let scratch = settings.scratch_space(self.inner.bytes() as u64)?;
            let progress = |share: f64| {
                settings.count("remesh", (share * STEPS as f64) as u64, STEPS, "steps");
            };
            self.remeshed_in(&wanted, options.feature_angle, &options.places, &scratch, &progress)
        })
        .and_then(|(even, report)| {
            even.validate_with(settings)?;
            Ok((even, report))
        })
    }

    /// Remeshes a surface, and puts that on record.
    fn remeshed_in(
        &self,
        wanted: &RemeshSettings,
        angle: f64,
        places: &SizeOptions,
        scratch: &ScratchSpace,
        progress: &dyn Fn(f64),
    ) -> Result<(Self, RemeshReport), Error> {
        let diagonal = self.inner.bounds().diagonal();
        let most = |p| places.at_place(p, diagonal);
        let remesh = || remesh(&self.inner, wanted, &most, scratch, progress);
        let (mut inner, report) = attempt(remesh)??;
        inner.notes.clone_from(&self.inner.notes);
        let RemeshSettings { tolerance, hmax, hmin, growth, .. } = *wanted;
        let mut text = format!(
            "tolerance={tolerance:e},angle={angle},hmax={hmax:e},hmin={hmin:e},growth={growth:e}"
        );
        if !places.sources.is_empty() || places.formula.is_some() {
            let places = OptionsText::from_sizes(places, None);
            text += &format!(",places={}", serde_json::json!(places));
        }
        Ok((self.replaced_by(inner, Origin::Remeshed(text)), report))
    }

    /// Remeshes again as the record says; the copy in a store is remeshed already.
    pub(super) fn remeshed_again(
        mut self,
        text: &str,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        if self.sources.iter().any(|s| s.origin == Origin::Copy) {
            self.record(Origin::Remeshed(text.to_owned()));
            return Ok(self);
        }
        let damaged = || Error::new(Code::Damaged, "the record of the remeshing cannot be read");
        let (numbers, places) = text.split_once(",places=").unwrap_or((text, "{}"));
        let number = |key: &str| -> Result<f64, Error> {
            let mut pairs = numbers.split(',').filter_map(|pair| pair.split_once('='));
            let value = pairs.find(|(k, _)| *k == key).and_then(|(_, value)| value.parse().ok());
            value.ok_or_else(damaged)
        };
        let places: OptionsText = serde_json::from_str(places).map_err(|_| damaged())?;
        let wanted = RemeshSettings {
            tolerance: number("tolerance")?,
            feature_cos: number("angle")?.to_radians().cos(),
            hmax: number("hmax")?,
            hmin: number("hmin")?,
            growth: number("growth")?,
        };
        let places = places.sizes()?;
        Ok(self.remeshed_in(&wanted, number("angle")?, &places, scratch, &|_| ())?.0)
    }
}
