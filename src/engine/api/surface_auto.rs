//! Repairs that a mesh can begin with, and the choice of the cheapest one.

use serde::Serialize;
use tetdb_schema::code::Code;
use tetdb_schema::source::Origin;
use tetdb_schema::word::Word;

use super::error::Error;
use super::surface::{given, refuse_sheets};
use super::surface_repair::within;
use super::surface_resolve::report as resolve_report;
use super::{
    CloseReport, RepairReport, ResolveReport, Settings, Surface, SurfaceWrap, WrapReport, guarded,
};
use tetdb_base::geom::{counted, short};
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::{self, Repair, closing, validate_with};
use tetdb_repair::close::{CloseError, Watcher, close_bytes};
use tetdb_schema::source::Source;

/// Points farther apart than this share of the box diagonal are not joined unless that is asked for. Coordinates of 32 bits are up to
/// 1e-7 apart; joining within 1e-4 moves what can be seen, and closing moves nothing.
const WELD_SHARE_AUTO: f64 = 1e-5;

/// Repairs that a mesh can begin with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RepairKind {
    /// Crossing triangles are divided where they cross; see [`Surface::resolved`].
    Resolve,
    /// Holes are closed, and overlapping parts united; see [`Surface::closed`].
    Winding,
    /// A closed surface around all triangles takes their place; see [`Surface::wrapped`].
    Wrap,
    /// The first of joining near points, `Resolve`, `Winding` and `Wrap` that leaves no defect. What goes around nothing is not wrapped.
    Auto,
}

impl Word for RepairKind {
    const WORDS: &'static [(Self, &'static str)] = &[
        (Self::Resolve, "resolve"),
        (Self::Winding, "winding"),
        (Self::Wrap, "wrap"),
        (Self::Auto, "auto"),
    ];
}

/// A repair that was done. Serialized, it has one key with the name of the repair.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum RepairStep {
    /// Near points were joined, and what needs no guess was repaired.
    Weld(RepairReport),
    /// Crossing triangles were divided.
    Resolve(ResolveReport),
    /// Holes were closed.
    Winding(CloseReport),
    /// A closed surface was put around all.
    Wrap(WrapReport),
}

impl RepairStep {
    /// What was done, in words.
    pub fn in_words(&self) -> String {
        match self {
            Self::Weld(report) => {
                let done = &report.done;
                let near = match report.weld_distance {
                    Some(distance) => {
                        format!(
                            "[point was|points were] joined to others not farther than {}",
                            short(distance)
                        )
                    }
                    None => "[point was|points were] joined to others".to_owned(),
                };
                let counts = [
                    (done.points_joined, near.as_str()),
                    (
                        done.collapsed_dropped,
                        "[triangle|triangles] without area [was|were] dropped",
                    ),
                    (done.repeated_dropped, "repeated [triangle was|triangles were] dropped"),
                    (
                        done.divided,
                        "[triangle was|triangles were] divided at vertices on open edges",
                    ),
                    (done.turned, "[triangle was|triangles were] turned"),
                ];
                let done = counts.into_iter().filter(|(n, _)| *n > 0);
                done.map(|(n, what)| counted(n as u64, what)).collect::<Vec<_>>().join("; ")
            }
            Self::Resolve(report) => report.done.in_words(),
            Self::Winding(report) => report.in_words(),
            Self::Wrap(report) => report.in_words(),
        }
    }
}

impl Surface {
    /// Repairs the surface in the way of `kind`. Returns what was done, step by step; nothing for a surface that
    /// [`RepairKind::Auto`] finds without defects.
    ///
    /// # Errors
    /// Those of [`Surface::resolve_reported`], [`Surface::closed_reported`] and [`Surface::wrapped`].
    pub fn repaired_by(
        self,
        kind: RepairKind,
        settings: &Settings,
    ) -> Result<(Self, Vec<RepairStep>), Error> {
        match kind {
            RepairKind::Resolve => {
                let (surface, report) = self.resolve_reported(settings)?;
                Ok((surface, vec![RepairStep::Resolve(report)]))
            }
            RepairKind::Winding => {
                let (surface, report) = self.closed_reported(settings)?;
                Ok((surface, vec![RepairStep::Winding(report)]))
            }
            RepairKind::Wrap => {
                let (surface, report) = self.wrapped_with(&SurfaceWrap::default(), settings)?;
                Ok((surface, vec![RepairStep::Wrap(report)]))
            }
            RepairKind::Auto => {
                refuse_sheets(&self.inner, "repaired")?;
                guarded(settings, || {
                    let scratch = within(settings, &self.inner, close_bytes(&self.inner))?;
                    self.auto_in(&scratch, &settings.repair_watcher())
                })
            }
        }
    }

    /// The cheapest repair that leaves no defect: nothing, joining near points, resolving, closing, wrapping.
    fn auto_in(
        mut self,
        scratch: &ScratchSpace,
        watch: &Watcher,
    ) -> Result<(Self, Vec<RepairStep>), Error> {
        let mut steps = Vec::new();
        watch("validate", 0, 0);
        let n_defects = |surface: &Self| -> Result<u64, Error> {
            Ok(attempt(|| validate_with(&surface.inner, scratch))?.n_defects)
        };
        let n_before = n_defects(&self)?;
        if n_before == 0 {
            return Ok((self, steps));
        }
        watch("join near points", 0, 0);
        let tried = attempt(|| closing(&self.inner))?;
        let weld = tried.last().filter(|t| t.closes && t.share <= WELD_SHARE_AUTO);
        if let Some(share) = weld.map(|t| t.share) {
            let report = self.welded_in(share, n_before);
            if report.done != Repair::default() {
                steps.push(RepairStep::Weld(report));
            }
            if n_defects(&self)? == 0 {
                return Ok((self, steps));
            }
        }
        watch("resolve crossings", 0, 0);
        if let Ok((resolved, done)) = self.clone().resolved_in(scratch) {
            let report = resolve_report(&resolved.inner, done, scratch)?;
            // Where another rule fills more than parity, parts overlap, and parity would leave empty what they share.
            let is_enough = report.n_defects == 0 && report.regions.is_empty();
            if done.rounds > 0 || is_enough {
                self = resolved;
                steps.push(RepairStep::Resolve(report));
            }
            if is_enough {
                return Ok((self, steps));
            }
        }
        match self.clone().try_closed_in(scratch, watch)? {
            Ok((closed, report)) => {
                steps.push(RepairStep::Winding(report));
                Ok((closed, steps))
            }
            // A wrap of it would be a solid that nobody meant.
            Err(e @ CloseError::NothingInside) => Err(e.into()),
            Err(_) => {
                let wanted = SurfaceWrap::default().settings(&self.inner);
                let told = |share: f64| watch("wrap", (share * 1000.0) as u64, 1000);
                let (wrap, report) = self.wrapped_in(&wanted, scratch, &told)?;
                steps.push(RepairStep::Wrap(report));
                Ok((wrap, steps))
            }
        }
    }

    /// Joins points nearer than this share of the diagonal, and puts that on record.
    fn welded_in(&mut self, share: f64, n_defects_before: u64) -> RepairReport {
        let report = self.repair_in((share > 0.0).then_some(share), n_defects_before);
        let done = &report.done;
        if *done == Repair::default() {
            return report;
        }
        self.record(Origin::Welded(format!(
            "share={share:e},joined={},dropped={},divided={},turned={}",
            done.points_joined,
            done.collapsed_dropped + done.repeated_dropped,
            done.divided,
            done.turned
        )));
        report
    }

    /// Puts a repair on record; the store keeps a copy of what came from no file.
    pub(super) fn record(&mut self, origin: Origin) {
        if self.sources.iter().any(|s| s.origin == Origin::Copy) {
            self.sources = self.copied(&self.inner);
        }
        self.sources.push(Source { origin, ..given(&self.inner) });
    }

    /// Another surface in place of this one, with what made it on record.
    pub(super) fn replaced_by(&self, inner: surface::Surface, origin: Origin) -> Self {
        let sources = self.sources.clone();
        let mut surface =
            Self { inner, sources, turned: 0, divides: self.divides, snaps: self.snaps };
        surface.record(origin);
        surface
    }

    /// Repeats a repair on record.
    pub(super) fn repaired_again(
        mut self,
        origin: &Origin,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        // A copy is of the repaired surface.
        let is_copy = self.sources.iter().any(|s| s.origin == Origin::Copy);
        match origin {
            Origin::Resolved(_) if !is_copy => return Ok(self.resolved_in(scratch)?.0),
            Origin::Closed(_) if !is_copy => {
                return Ok(self.closed_in(scratch, &|_, _, _| {})?.0);
            }
            Origin::Welded(text) if !is_copy => {
                let share = text.split([',', '=']).nth(1).and_then(|share| share.parse().ok());
                let share = share.ok_or_else(|| {
                    Error::new(Code::Damaged, "the record of a repair cannot be read")
                })?;
                self.welded_in(share, 0);
            }
            _ => self.record(origin.clone()),
        }
        Ok(self)
    }
}
