//! What to expect of a mesh before it is begun.

use std::path::Path;

use super::Bytes;
use super::preflight::free_at;
use crate::pipeline::{Estimate, Prepared};
use tetdb_kernel::sizing::SizeSummary;

/// The mesh that surface and sizes predict, and what a run takes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// Tetrahedra.
    pub tets: f64,
    /// Vertices.
    pub vertices: f64,
    /// Triangles of the surface.
    pub triangles: u64,
    /// Sub-domains.
    pub subdomains: u32,
    /// Where the sizes come from, and their range.
    pub sizes: SizeSummary,
    /// Bytes of the finished store.
    pub store: Bytes,
    /// Most bytes on disk while it is meshed.
    pub disk_peak: Bytes,
    /// Bytes free on the disk of the store, where the system says.
    pub disk_free: Option<Bytes>,
    /// Bytes of memory that the run holds.
    pub memory: Bytes,
    /// The smallest cap that would do.
    pub memory_least: Bytes,
    /// A larger cap than this gains nothing.
    pub memory_full: Bytes,
    /// Whether the cap is large enough.
    pub fits_memory: bool,
    /// Seconds on a server of 2.6 GHz.
    pub seconds: f64,
    estimate: Estimate,
}

/// Wall seconds of workers on any number of machines, with a thread each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct WorkersPrediction {
    /// All of it.
    pub wall_s: f64,
    /// Before the cuts and after the sub-domains, in one process.
    pub serial_s: f64,
    /// The cuts.
    pub cuts_s: f64,
    /// The sub-domains.
    pub subdomains_s: f64,
    /// Wall seconds that no number of workers falls below.
    pub wall_least_s: f64,
}

impl Prediction {
    pub(super) fn new(prepared: Prepared, cap: u64, threads: usize, store: &Path) -> Self {
        let estimate = prepared.estimate;
        Self {
            tets: estimate.tets(),
            vertices: estimate.vertices,
            triangles: estimate.triangles,
            subdomains: estimate.subdomains,
            sizes: prepared.sizes,
            store: Bytes(estimate.store_bytes()),
            disk_peak: Bytes(estimate.disk_peak_bytes(cap, threads)),
            disk_free: free_at(store).map(Bytes),
            memory: Bytes(estimate.memory_bytes(cap, threads)),
            memory_least: Bytes(estimate.memory_least_bytes()),
            memory_full: Bytes(estimate.memory_full_bytes(threads)),
            fits_memory: cap >= estimate.memory_least_bytes(),
            seconds: estimate.seconds(threads),
            estimate,
        }
    }

    /// Whether the disk has room for the run, as far as the system says.
    pub fn fits_disk(&self) -> bool {
        self.disk_free.is_none_or(|free| free >= self.disk_peak)
    }

    /// Seconds of `workers`, of any number of machines; 0 counts as 1.
    pub fn workers(&self, workers: u32) -> WorkersPrediction {
        let forecast = self.estimate.forecast(workers);
        WorkersPrediction {
            wall_s: forecast.wall_s(),
            serial_s: forecast.serial_s,
            cuts_s: forecast.cuts_s,
            subdomains_s: forecast.subdomains_s,
            wall_least_s: self.estimate.forecast(u32::MAX).wall_s(),
        }
    }
}
