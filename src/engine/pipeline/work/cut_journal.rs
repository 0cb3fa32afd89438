//! The journal row of a cut.

use crate::pipeline::seal::totals::{by_threads, journal};
use tetdb_base::storage::{PagerStats, StepClock};
use tetdb_kernel::bisect::CutReport;
use tetdb_schema::catalog::{JournalRow, StoreState};

/// The data of a cut for its journal row.
pub struct CutJournal<'a> {
    pub cut: u32,
    /// The child on the low side.
    pub subdomain: u32,
    pub report: &'a CutReport,
    pub pages: PagerStats,
    pub frames_used: usize,
}

impl CutJournal<'_> {
    /// Returns the row of a cut that began at `clock`.
    pub fn row(&self, clock: &StepClock) -> JournalRow {
        let (report, interface) = (self.report, &self.report.interface);
        let (natural, chosen) = (&interface.natural, &interface.chosen);
        let layers_least = report.layers_least.map_or(f64::INFINITY, f64::from);
        let measures = [
            ("cut", f64::from(self.cut)),
            ("zone_vertices", report.refine.inserted as f64),
            ("zone_rejects", report.refine.out_of_place as f64),
            ("frozen_hits", report.refine.frozen_hits as f64),
            ("free_tets", interface.free_tets as f64),
            ("moves", interface.moves as f64),
            ("natural_faces", natural.faces as f64),
            ("minimum_faces", interface.minimum.faces as f64),
            ("interface_faces", chosen.faces as f64),
            ("natural_face_quality", natural.quality_mean()),
            ("interface_face_quality", chosen.quality_mean()),
            ("natural_over_constrained", natural.over_constrained as f64),
            ("over_constrained", chosen.over_constrained as f64),
            ("at_surface", chosen.at_surface as f64),
            ("natural_pinched", natural.pinched as f64),
            ("pinched", chosen.pinched as f64),
            ("z_tets", report.z_tets as f64),
            ("z_enclosed", report.z_enclosed as f64),
            ("layers_least", layers_least),
            ("choice_bytes", interface.bytes as f64),
            ("plane_s", report.seconds.plane),
            ("zone_s", report.seconds.zone),
            ("core_s", report.seconds.core),
            ("interface_s", report.seconds.interface),
            ("load_low", report.plane.load[0]),
            ("load", report.plane.load[1]),
            ("pages_read", self.pages.pages_read as f64),
            ("pages_written", self.pages.pages_written as f64),
            ("frames_used", self.frames_used as f64),
        ];
        let measures: Vec<_> = measures.into_iter().chain(by_threads(clock)).collect();
        let mut row = journal(StoreState::Bisected, "bisect", clock.begun(), &measures);
        row.subdomain = Some(self.subdomain);
        row
    }
}
