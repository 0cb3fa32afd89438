//! Holes of a surface closed where winding numbers say what is inside.

use tetdb_schema::code::Code;
use tetdb_schema::source::Origin;

use super::error::Error;
use super::surface::refuse_sheets;
use super::surface_repair::within;
use super::{Settings, Surface, guarded};
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::{self, show};
use tetdb_repair::close::{CloseError, CloseReport, Watcher, close, close_bytes, is_promising};

impl Surface {
    /// Makes a closed surface of one with open edges, turned or doubled shells, or overlapping parts.
    ///
    /// Crossings are resolved first, as by [`Surface::resolved`]. Inside is where the surface goes around more than half a time, by its
    /// generalized winding number. Triangles between inside and outside stay, turned outward, with their labels; all others are
    /// dropped. New triangles close the holes, with labels `closed-hole-1` for the largest, `closed-hole-2` and so on; from the
    /// thousandth on, holes share one. Overlapping parts become their union.
    ///
    /// Errors: as [`Surface::closed_reported`].
    pub fn closed(self) -> Result<Self, Error> {
        Ok(self.closed_reported(&Settings::new())?.0)
    }

    /// [`Surface::closed`] within the memory of `settings`. Also returns what was done.
    ///
    /// # Errors
    /// `nothing-filled` if the surface goes around nothing; those of [`Surface::resolve_reported`]; `memory`; `usage` if anything is
    /// embedded.
    pub fn closed_reported(self, settings: &Settings) -> Result<(Self, CloseReport), Error> {
        refuse_sheets(&self.inner, "repaired")?;
        guarded(settings, || {
            let scratch = within(settings, &self.inner, close_bytes(&self.inner))?;
            self.closed_in(&scratch, &settings.repair_watcher())
        })
    }

    /// Closes holes, and puts that on record.
    pub(super) fn closed_in(
        self,
        scratch: &ScratchSpace,
        watch: &Watcher,
    ) -> Result<(Self, CloseReport), Error> {
        Ok(self.try_closed_in(scratch, watch)??)
    }

    /// [`Surface::closed_in`], with what may be answered by another repair as an inner error.
    pub(super) fn try_closed_in(
        mut self,
        scratch: &ScratchSpace,
        watch: &Watcher,
    ) -> Result<Result<(Self, CloseReport), CloseError>, Error> {
        let report = match attempt(|| close(&mut self.inner, scratch, watch))? {
            Ok(report) => report,
            Err(e) => return Ok(Err(e)),
        };
        let CloseReport { hole_area, turned, dropped_inside, dropped_outside, volume, .. } = report;
        let text = format!(
            "holes={},area={hole_area:e},added={},turned={turned},dropped-inside={dropped_inside},dropped-outside={dropped_outside},volume={volume:e},moved={:e}",
            report.holes.len(),
            report.triangles_added,
            report.resolve.moved_most
        );
        self.record(Origin::Closed(text));
        Ok(Ok((self, report)))
    }
}

/// Tries to close a copy of a surface; `None` where that fails, or some triangles tell that it would.
pub(super) fn tried(surface: &surface::Surface, scratch: &ScratchSpace) -> Option<CloseReport> {
    if !is_promising(surface) {
        return None;
    }
    let mut copy = surface.clone();
    attempt(|| close(&mut copy, scratch, &|_, _, _| {})).ok()?.ok()
}

impl From<CloseError> for Error {
    fn from(e: CloseError) -> Self {
        match e {
            CloseError::Resolve(e) => e.into(),
            CloseError::Boundary(e) => e.into(),
            CloseError::NothingInside => Self::new(Code::NothingFilled, &e)
                .with_help("embed it in another surface as a sheet, or wrap it"),
            CloseError::Unsound { ref places, .. } => {
                let at: Vec<String> = places.iter().take(4).map(|p| show(*p)).collect();
                Self::new(Code::SelfIntersection, &e)
                    .at(at.join(", "))
                    .with_help("look at these places; please report this surface")
            }
        }
    }
}
