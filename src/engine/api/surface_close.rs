//! Holes of a surface closed where winding numbers say what is inside.

use serde::Serialize;
use tetdb_schema::code::Code;
use tetdb_schema::source::Origin;

use super::error::Error;
use super::surface::refuse_sheets;
use super::surface_repair::within;
use super::{ResolveReport, Settings, Surface, guarded};
use tetdb_base::geom::{counted, short};
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::{self, show};
use tetdb_repair::close::{
    CloseError, Closed, ClosedHole, Watcher, close, close_bytes, is_promising,
};

/// Holes listed in words.
const LISTED: usize = 3;

/// What was done to close a surface. Serialized, it is the key `winding` of `tetdb check --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CloseReport {
    /// Holes that were closed, the largest first.
    pub holes: Vec<ClosedHole>,
    /// Area of all of them.
    pub hole_area: f64,
    /// Triangles added.
    pub triangles_added: usize,
    /// Vertices added inside holes.
    pub points_added: usize,
    /// Triangles turned outward.
    pub turned: usize,
    /// Triangles dropped with inside on both sides.
    pub dropped_inside: usize,
    /// Triangles dropped with outside on both sides.
    pub dropped_outside: usize,
    /// Triangles dropped that another one gives from the other side.
    pub dropped_repeated: usize,
    /// Volume weighted with the winding number of the given surface.
    pub volume_by_winding: f64,
    /// Volume enclosed now.
    pub volume: f64,
    /// Volume with a winding number between 0.3 and 0.7, where the choice is open to doubt.
    pub volume_doubtful: f64,
    /// What was done to crossings first.
    pub resolve: ResolveReport,
}

impl CloseReport {
    fn new(done: Closed) -> Self {
        Self {
            hole_area: done.hole_area(),
            triangles_added: done.triangles_added,
            points_added: done.points_added,
            turned: done.turned,
            dropped_inside: done.dropped_inside,
            dropped_outside: done.dropped_outside,
            dropped_repeated: done.dropped_repeated,
            volume_by_winding: done.volume_by_winding,
            volume: done.volume,
            volume_doubtful: done.volume_doubtful,
            resolve: ResolveReport::new(&done.resolved, 0, Vec::new()),
            holes: done.holes,
        }
    }

    /// The counts in words.
    pub fn in_words(&self) -> String {
        let mut text = match self.holes.len() as u64 {
            0 => "no hole was to be closed".to_owned(),
            n => {
                let new = counted(self.triangles_added as u64, "[triangle|triangles]");
                let area = short(self.hole_area);
                format!("{}, with {new} of area {area}", counted(n, "[hole was|holes were] closed"))
            }
        };
        if !self.holes.is_empty() {
            let named = |hole: &ClosedHole| {
                let [area, length] = [hole.area, hole.boundary].map(short);
                format!("{} of area {area} in a boundary of {length}", hole.label)
            };
            let listed: Vec<String> = self.holes.iter().take(LISTED).map(named).collect();
            let rest = if self.holes.len() > LISTED { ", …" } else { "" };
            text += &format!(" ({}{rest})", listed.join(", "));
        }
        for (n, what) in [
            (self.points_added, "[vertex was|vertices were] added in them"),
            (self.turned, "[triangle was|triangles were] turned outward"),
            (self.dropped_inside, "[triangle|triangles] inside [was|were] dropped"),
            (self.dropped_outside, "[triangle|triangles] outside [was|were] dropped"),
            (self.dropped_repeated, "repeated [triangle was|triangles were] dropped"),
        ] {
            if n > 0 {
                text += &format!("; {}", counted(n as u64, what));
            }
        }
        text += &format!("; the volume is {}", short(self.volume));
        if self.volume_doubtful > 1e-9 * self.volume {
            text += &format!(", and {} of space is open to doubt", short(self.volume_doubtful));
        }
        if self.resolve.rounds > 0 {
            text += &format!("; before that, {}", self.resolve.in_words());
        }
        text
    }
}

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
            Ok(done) => CloseReport::new(done),
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
    let done = attempt(|| close(&mut copy, scratch, &|_, _, _| {})).ok()?.ok()?;
    Some(CloseReport::new(done))
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
