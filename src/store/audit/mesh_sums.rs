//! The sums of a verification over all sub-domains, and the checks of the whole mesh.

use super::against::Input;
use super::embedded::EmbeddedSearch;
use super::part_report::PartReport;
use super::pass::Audit;
use super::rows::check_regions;
use super::{Finding, Level, Report};
use crate::store::StoreError;
use tetdb_schema::catalog::{InterfaceRow, RegionRow};
use tetdb_schema::digest::Digest;

/// Relative tolerance of volumes, to the sum of the absolute summands: sums of
/// millions of terms lose some six of sixteen digits at most.
const VOLUME_TOLERANCE: f64 = 1e-9;

impl Audit<'_> {
    /// Returns the findings, for [`add`](Self::add) in another process. Errors: the disk.
    pub(super) fn into_part(mut self) -> Result<PartReport, StoreError> {
        Ok(PartReport {
            digests: self.digests.map(|digest| digest.lanes),
            regions: (self.regions.iter())
                .map(|(&region, sum)| (region, sum.tets, sum.volume))
                .collect(),
            volumes: self.volumes,
            interfaces: self.interfaces.into_sides()?,
            triangles: self.input.take().map(Input::into_found),
            embedded: self.embedded.take().map(EmbeddedSearch::into_found),
            report: self.report,
        })
    }

    /// Adds the findings of the next sub-domain. Errors: the disk.
    pub(super) fn add(&mut self, part: PartReport) -> Result<(), StoreError> {
        self.report.add(part.report);
        for (sum, lanes) in self.digests.iter_mut().zip(part.digests) {
            sum.merge(&Digest { lanes });
        }
        for (region, tets, volume) in part.regions {
            let sum = self.regions.entry(region).or_default();
            sum.tets += tets;
            sum.volume += volume;
        }
        self.volumes = self.volumes.and(&part.volumes);
        self.interfaces.add(part.interfaces)?;
        if let (Some(input), Some(seen)) = (&mut self.input, part.triangles) {
            input.add(seen);
        }
        if let (Some(embedded), Some(seen)) = (&mut self.embedded, part.embedded) {
            embedded.add(&seen);
        }
        Ok(())
    }

    pub(super) fn finish(
        mut self,
        interfaces: &[InterfaceRow],
        regions: &[RegionRow],
    ) -> Result<Report, StoreError> {
        if self.level(Level::Topology) {
            self.interfaces.finish(interfaces, &mut self.report)?;
        }
        check_regions(regions, &self.regions, &mut self.report);
        self.report.volume = self.volumes.of_tets;
        self.report.volume_within_boundary = self.volumes.within_boundary;
        if self.options.level >= Level::Geometry {
            let (found, expected) = (self.report.volume, self.report.volume_within_boundary);
            let tolerance =
                VOLUME_TOLERANCE * self.volumes.scale.max(found) + self.volumes.rounding;
            if (found - expected).abs() > tolerance {
                let what = format_args!(
                    "the tetrahedra have volume {found}, their boundary encloses {expected}"
                );
                self.report.find(Finding::VolumeDiffers, None, what);
            }
            if let Some(input) = self.input.take() {
                input.finish(&mut self.report);
            }
            if let Some(embedded) = self.embedded.take() {
                embedded.finish(&mut self.report);
            }
        }
        self.report.digest = self.digests[0].to_string();
        self.report.interface_digest = self.digests[1].to_string();
        Ok(self.report)
    }
}
