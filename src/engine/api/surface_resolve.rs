//! Crossing triangles of a surface divided where they cross.

use serde::Serialize;
use tetdb_schema::code::Code;
use tetdb_schema::source::Origin;

use super::error::Error;
use super::surface::refuse_sheets;
use super::surface_repair::within;
use super::{Settings, Surface, guarded};
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::{
    self, EnclosedVolumes, OUTSIDE, Seeker, VOLUMES_TRIANGLE, repair_bytes, show, validate_with,
};
use tetdb_kernel::boundary::RegionPolicy;
use tetdb_repair::resolve::{ResolveError, Resolved, resolve};

/// What was done to crossing triangles. Serialized, it is the key `resolve` of `tetdb check --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ResolveReport {
    /// The counts.
    #[serde(flatten)]
    pub done: Resolved,
    /// Defects left, such as open edges.
    pub n_defects: u64,
    /// Rules that fill what overlapping parts fill together, if parity does not.
    pub regions: Vec<&'static str>,
}

impl Surface {
    /// Divides triangles that cross or overlap, along their intersections.
    ///
    /// Afterwards triangles touch in common vertices and edges alone. New vertices are exact intersections, rounded once to the nearest
    /// doubles. Pieces keep their labels; what two triangles cover together is one triangle with both labels. All other triangles stay
    /// as they are. Parts that overlapped enclose several regions then: see [`Regions`](super::Regions).
    ///
    /// Errors: as [`Surface::resolve_reported`].
    pub fn resolved(self) -> Result<Self, Error> {
        Ok(self.resolve_reported(&Settings::new())?.0)
    }

    /// [`Surface::resolved`] within the memory of `settings`. Also returns the counts.
    ///
    /// # Errors
    /// `self-intersection` where rounding makes new crossings again and again; `memory`; `usage` if anything is embedded.
    pub fn resolve_reported(self, settings: &Settings) -> Result<(Self, ResolveReport), Error> {
        refuse_sheets(&self.inner, "repaired")?;
        guarded(settings, || {
            let scratch = within(settings, &self.inner, repair_bytes(&self.inner))?;
            let (surface, done) = self.resolved_in(&scratch)?;
            let report = report(&surface.inner, done, &scratch)?;
            Ok((surface, report))
        })
    }

    /// Divides triangles that cross, and puts that on record.
    pub(super) fn resolved_in(mut self, scratch: &ScratchSpace) -> Result<(Self, Resolved), Error> {
        let done = attempt(|| resolve(&mut self.inner, scratch))??;
        let Resolved { pairs, divided, points_added, rounds, moved_most, .. } = done;
        let text = format!(
            "pairs={pairs},divided={divided},added={points_added},rounds={rounds},moved={moved_most:e}"
        );
        self.record(Origin::Resolved(text));
        Ok((self, done))
    }
}

/// Tries to resolve a copy of a surface; `None` where that fails.
pub(super) fn tried(surface: &surface::Surface, scratch: &ScratchSpace) -> Option<ResolveReport> {
    let mut copy = surface.clone();
    let done = attempt(|| resolve(&mut copy, scratch)).ok()?.ok()?;
    report(&copy, done, scratch).ok()
}

pub(super) fn report(
    surface: &surface::Surface,
    done: Resolved,
    scratch: &ScratchSpace,
) -> Result<ResolveReport, Error> {
    let n_defects = attempt(|| validate_with(surface, scratch))?.n_defects;
    let fits = (surface.n_triangles() * VOLUMES_TRIANGLE) as u64 <= scratch.available();
    let regions = match n_defects == 0 && done.rounds > 0 && fits {
        true => attempt(|| rules(surface, scratch))?,
        false => Vec::new(),
    };
    Ok(ResolveReport { done, n_defects, regions })
}

/// Rules other than parity that fill more of the enclosed volumes.
fn rules(surface: &surface::Surface, scratch: &ScratchSpace) -> Vec<&'static str> {
    let seeker = Seeker::with_filter(surface, scratch, |_| true);
    let volumes = EnclosedVolumes::new_in(&seeker, scratch);
    let (end, walls) = (volumes.n_volumes, volumes.walls());
    let filled = |policy: RegionPolicy| policy.filled(OUTSIDE, end, &walls).ok();
    let by_parity = filled(RegionPolicy::Parity).map_or(0, |f| f.volumes.len());
    let rules = [("by-orientation", RegionPolicy::ByOrientation), ("all", RegionPolicy::All)];
    let fills_more = |(_, policy): &(&str, RegionPolicy)| {
        filled(*policy).is_some_and(|f| f.volumes.len() > by_parity)
    };
    rules.into_iter().filter(fills_more).map(|(word, _)| word).collect()
}

impl From<ResolveError> for Error {
    fn from(e: ResolveError) -> Self {
        let error = Self::new(Code::SelfIntersection, &e)
            .with_help("unite or separate the parts where the surface was made");
        match &e {
            ResolveError::Unsettled { places, .. } => {
                let at: Vec<String> = places.iter().take(4).map(|c| show(c.at)).collect();
                error.at(at.join(", "))
            }
            ResolveError::TooMany => error,
        }
    }
}
