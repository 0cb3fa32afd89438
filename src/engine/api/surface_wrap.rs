//! Closed surfaces around others, at an offset.

use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface;
use tetdb_repair::wrap::{WrapError, WrapReport, WrapSettings, wrap};
use tetdb_schema::code::Code;
use tetdb_schema::source::Origin;

use super::{Error, Length, Settings, Surface, guarded};

/// Steps of progress.
const STEPS: u64 = 1000;

/// How a surface is wrapped: [`Surface::wrapped`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceWrap {
    /// Openings narrower than about twice this are closed; triangles have about this size. Default: 1 % of the box diagonal.
    pub gap: Length,
    /// Greatest distance of the vertices from the surface. Default: 0.1 % of the box diagonal.
    pub offset: Length,
}

impl Default for SurfaceWrap {
    fn default() -> Self {
        Self { gap: Length::percent(1.0), offset: Length::percent(0.1) }
    }
}

impl SurfaceWrap {
    /// The lengths in units of the surface.
    pub(super) fn settings(&self, surface: &surface::Surface) -> WrapSettings {
        let diagonal = surface.bounds().diagonal();
        // Without points there is no diagonal.
        let of = |length: Length| match surface.points.is_empty() {
            true => 1.0,
            false => length.resolve(diagonal),
        };
        WrapSettings { gap: of(self.gap), offset: of(self.offset) }
    }
}

impl Surface {
    /// A closed surface around all triangles, edges and points of this one, which may be open, cross itself or be a soup.
    ///
    /// The wrap is a 2-manifold that encloses all of this surface and touches none of it; exact signs check that. All vertices are new
    /// and at most the offset away. Openings narrower than the gap are closed, and what only they lead to is filled, as closed hollows
    /// are; the report has how far the two are apart there, measured at samples. Triangles have the label of the nearest one.
    ///
    /// Errors: lengths that make no sense; no triangles; `memory`.
    pub fn wrapped(&self, options: &SurfaceWrap) -> Result<(Self, WrapReport), Error> {
        self.wrapped_with(options, &Settings::new())
    }

    /// [`Surface::wrapped`] within the memory of `settings`. The result is validated.
    pub fn wrapped_with(
        &self,
        options: &SurfaceWrap,
        settings: &Settings,
    ) -> Result<(Self, WrapReport), Error> {
        options.gap.check("gap")?;
        options.offset.check("offset")?;
        let wanted = options.settings(&self.inner);
        let done = guarded(settings, || {
            let scratch = settings.scratch_space(self.inner.bytes() as u64)?;
            let progress = |share: f64| {
                settings.count("wrap", (share * STEPS as f64) as u64, STEPS, "steps");
            };
            self.wrapped_in(&wanted, &scratch, &progress)
        })?;
        done.0.validate_with(settings)?;
        Ok(done)
    }

    /// Wraps a surface, and puts that on record.
    pub(super) fn wrapped_in(
        &self,
        wanted: &WrapSettings,
        scratch: &ScratchSpace,
        progress: &dyn Fn(f64),
    ) -> Result<(Self, WrapReport), Error> {
        let (mut inner, report) = attempt(|| wrap(&self.inner, wanted, scratch, progress))??;
        inner.notes.clone_from(&self.inner.notes);
        let text = format!("gap={:e},offset={:e}", wanted.gap, wanted.offset);
        Ok((self.replaced_by(inner, Origin::Wrapped(text)), report))
    }

    /// Wraps again as the record says; the copy in a store is wrapped already.
    pub(super) fn wrapped_again(
        mut self,
        text: &str,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        if self.sources.iter().any(|s| s.origin == Origin::Copy) {
            self.record(Origin::Wrapped(text.to_owned()));
            return Ok(self);
        }
        let number = |key: &str| {
            let mut pairs = text.split(',').filter_map(|pair| pair.split_once('='));
            pairs.find(|(k, _)| *k == key).and_then(|(_, value)| value.parse().ok())
        };
        match (number("gap"), number("offset")) {
            (Some(gap), Some(offset)) => {
                Ok(self.wrapped_in(&WrapSettings { gap, offset }, scratch, &|_| ())?.0)
            }
            _ => Err(Error::new(Code::Damaged, "the record of the wrap cannot be read")),
        }
    }
}

impl From<WrapError> for Error {
    fn from(e: WrapError) -> Self {
        let (code, help) = match e {
            WrapError::Empty => (Code::EmptySurface, "give a surface with triangles"),
            WrapError::Range { .. } => {
                (Code::CoordinateRange, "scale the surface to ordinary units, for example metres")
            }
            WrapError::Length { .. } => (
                Code::BadSize,
                "a gap of 1% of the box diagonal and an offset of 0.1% suit most surfaces",
            ),
            WrapError::Rounding { .. } => (
                Code::BadSize,
                "ask for a larger gap and offset, or move the surface to the origin",
            ),
            WrapError::Memory { .. } => (
                Code::Memory,
                "allow more memory, or ask for a larger gap; triangles grow with the square of its inverse",
            ),
            WrapError::Incomplete { .. } => {
                (Code::Internal, "another gap or offset may work; please report the surface")
            }
        };
        Self::new(code, e).with_help(help)
    }
}
