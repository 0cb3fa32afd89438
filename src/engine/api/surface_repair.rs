//! Repairs of a surface: dropping, dividing, orienting and joining.

use serde::Serialize;
use serde_json::{Value, json};
use tetdb_schema::code::Code;

use super::error::{Error, Remedy};
use super::surface::refuse_sheets;
use super::{Bytes, Event, Settings, Surface, guarded};
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::{self, Repair, repair, repair_bytes, validate_with};

/// Largest share of the box diagonal within which points are joined. Beyond it a surface loses its shape.
pub const WELD_SHARE_MAX: f64 = 0.01;

/// Counts of a repair. Serialized, it is the key `repair` of `tetdb check --json`.
#[derive(Clone, Debug, Serialize)]
#[serde(into = "Value")]
#[non_exhaustive]
pub struct RepairReport {
    /// Points closer than this share of the box diagonal were joined; `None` if none were.
    pub weld: Option<f64>,
    /// The joining distance in input units.
    pub weld_distance: Option<f64>,
    /// Numbers of points joined and of triangles dropped, divided and turned.
    pub done: Repair,
    /// Number of triangles before the repair.
    pub triangles_before: usize,
    /// Number of vertices before the repair.
    pub vertices_before: usize,
    /// Number of defects before the repair.
    pub n_defects_before: u64,
}

impl From<RepairReport> for Value {
    fn from(report: RepairReport) -> Self {
        let done = &report.done;
        json!({
            "weld": report.weld, "weld_distance": report.weld_distance, "points_joined": done.points_joined,
            "collapsed_dropped": done.collapsed_dropped, "repeated_dropped": done.repeated_dropped,
            "divided": done.divided, "turned": done.turned,
            "before": {
                "triangles": report.triangles_before, "vertices": report.vertices_before,
                "n_defects": report.n_defects_before,
            },
        })
    }
}

impl Surface {
    /// Repairs the surface.
    ///
    /// Drops repeated triangles and triangles without area, divides triangles where vertices lie exactly on open edges, and orients all
    /// alike. With `weld`, joins points closer than this share of the box diagonal, at most 0.01.
    ///
    /// Errors: as [`Surface::repair_reported`].
    pub fn repaired(self, weld: Option<f64>) -> Result<Self, Error> {
        Ok(self.repair_reported(weld, &Settings::new())?.0)
    }

    /// [`Surface::repaired`] within the memory of `settings`. Also returns the counts of the repair.
    ///
    /// # Errors
    /// `bad-size` for a share that is too large; `memory`; `usage` if anything is embedded.
    pub fn repair_reported(
        mut self,
        weld: Option<f64>,
        settings: &Settings,
    ) -> Result<(Self, RepairReport), Error> {
        if let Some(share) = weld.filter(|share| !(*share > 0.0 && *share <= WELD_SHARE_MAX)) {
            let message = format!(
                "{share} is not a share of the box diagonal, expected above 0 and at most {WELD_SHARE_MAX}"
            );
            return Err(Error::new(Code::BadSize, message));
        }
        refuse_sheets(&self.inner, "repaired")?;
        guarded(settings, || {
            let scratch = within(settings, &self.inner, repair_bytes(&self.inner))?;
            let n_defects_before = attempt(|| validate_with(&self.inner, &scratch))?.n_defects;
            let mut report = self.repair_in(weld, n_defects_before);
            // Triangles turned while the surface was read count as well.
            report.done.turned += self.turned;
            self.turned = report.done.turned;
            self.sources = self.copied(&self.inner);
            Ok((self, report))
        })
    }

    /// Joins points nearer than a share of the diagonal, and repairs what needs no guess.
    pub(super) fn repair_in(&mut self, weld: Option<f64>, n_defects_before: u64) -> RepairReport {
        let (triangles_before, vertices_before) =
            (self.inner.n_triangles(), self.inner.n_vertices());
        let weld_distance = weld.map(|share| share * self.inner.bounds().diagonal());
        let done = repair(&mut self.inner, weld_distance);
        RepairReport {
            weld,
            weld_distance,
            done,
            triangles_before,
            vertices_before,
            n_defects_before,
        }
    }
}

impl Settings {
    /// A listener for the steps of a repair.
    pub(super) fn repair_watcher(&self) -> impl Fn(&'static str, u64, u64) + '_ {
        |stage, done, total| {
            let total = (total > 0).then_some(total);
            self.say(&Event::Progress { stage, done, total, unit: "steps" });
        }
    }
}

/// Scratch space for the repair of a surface that takes `least` bytes of memory.
pub(super) fn within(
    settings: &Settings,
    surface: &surface::Surface,
    least: u64,
) -> Result<ScratchSpace, Error> {
    if settings.cap()? < least {
        let message = format!(
            "a surface of {} triangles is repaired in {} of memory",
            surface.n_triangles(),
            Bytes(least)
        );
        return Err(Error::new(Code::Memory, message).with_remedy(Remedy::Memory(least)));
    }
    settings.scratch_space(surface.bytes() as u64)
}
