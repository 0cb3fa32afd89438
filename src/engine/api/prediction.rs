//! Predictions about a mesh before it is created.

use std::path::Path;

use super::Bytes;
use super::preflight::free_at;
use crate::pipeline::{Estimate, Prepared};
use tetdb_kernel::sizing::SizeSummary;

/// The predicted mesh, and the memory, disk and time that a run needs for it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// Predicted number of tetrahedra.
    pub tets: f64,
    /// Predicted number of vertices.
    pub vertices: f64,
    /// Number of triangles of the surface.
    pub triangles: u64,
    /// Number of sub-domains.
    pub subdomains: u32,
    /// Origin and range of the sizes.
    pub sizes: SizeSummary,
    /// Bytes of the finished store.
    pub store: Bytes,
    /// Largest number of bytes on disk during the run.
    pub disk_peak: Bytes,
    /// Bytes free on the disk of the store, if the system reports them.
    pub disk_free: Option<Bytes>,
    /// Bytes of memory that the run holds.
    pub memory: Bytes,
    /// The smallest cap that suffices.
    pub memory_least: Bytes,
    /// The cap beyond which more memory gains nothing.
    pub memory_full: Bytes,
    /// True if the cap is large enough.
    pub fits_memory: bool,
    /// Predicted time in seconds, on a server of 2.6 GHz.
    pub seconds: f64,
    estimate: Estimate,
}

/// Predicted wall time of workers on any number of machines, with one thread each. Unit: seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct WorkersPrediction {
    /// The whole run.
    pub wall_s: f64,
    /// Work before the cuts and after the sub-domains, in one process.
    pub serial_s: f64,
    /// All cuts.
    pub cuts_s: f64,
    /// All sub-domains.
    pub subdomains_s: f64,
    /// Lower bound for any number of workers.
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

    /// Returns whether the disk has enough free space. True if the system does not report it.
    pub fn fits_disk(&self) -> bool {
        self.disk_free.is_none_or(|free| free >= self.disk_peak)
    }

    /// Predicts the wall time with `workers` workers on any number of machines; 0 counts as 1.
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
