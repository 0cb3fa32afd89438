//! Division of the memory cap among frames, caches and buffers, before the first byte is read.

use tetdb_base::storage::{StorageError, n_threads};

/// Smallest cap of a run; with fewer frames, pages thrash.
pub const MEMORY_MIN: u64 = 64 << 20;
/// Largest useful cache of redb: three batches of 16 MiB. Well below this limit, frames are worth more than cache. A page in
/// neither costs 45 microseconds. 1.8 million tetrahedra with 160 MiB read a tenth as many pages when caches and buffers got half
/// of their usual share.
const REDB_MAX: u64 = 48 << 20;
/// The catalog's cache and other small data of the catalog.
const CATALOG: u64 = 3 << 20;
/// Largest useful scratch of a phase (candidates, sort runs, chunks being encoded): with it 40 million records are sorted in memory.
const BUFFERS_MAX: u64 = 4 << 30;

/// Fewest bytes of frames for each of several workers.
const FRAMES_OF_WORKER: u64 = 24 << 20;

/// Bytes of memory by use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Bytes for the frames of the working mesh.
    pub frames: u64,
    /// Bytes for redb's cache of the file being written. The lease adds half as much for the file being read.
    pub redb: u64,
    /// Bytes for everything else that a phase holds.
    pub buffers: u64,
}

impl Plan {
    /// Divides `cap` bytes, of which `held` bytes stay occupied (surface, size field).
    ///
    /// Errors: [`StorageError::Budget`] when less than a quarter of [`MEMORY_MIN`] would be left for frames.
    pub fn new(cap: u64, held: u64) -> Result<Self, StorageError> {
        let wide = Self::with_shares(cap, held, 1);
        match &wide {
            // The held bytes leave few frames, which need memory more than caches and buffers do.
            Ok(plan) if plan.frames >= cap / 8 => wide,
            _ => Self::with_shares(cap, held, 2),
        }
    }

    /// Divides `cap` with caches and buffers of 1/`narrow` of their usual share.
    fn with_shares(cap: u64, held: u64, narrow: u64) -> Result<Self, StorageError> {
        let redb = (cap / 16 / narrow).min(REDB_MAX);
        let buffers = (cap / 8 / narrow).min(BUFFERS_MAX);
        let rest = cap.saturating_sub(redb + redb / 2 + buffers + CATALOG);
        let least = MEMORY_MIN / 4;
        if rest < held + least {
            return Err(StorageError::Budget {
                what: "the surface, its size field and the least number of frames",
                needed: held + least,
                available: rest,
            });
        }
        Ok(Self { frames: rest - held, redb, buffers })
    }

    /// Returns an equal share for each of `workers`.
    pub fn shared_by(&self, workers: u64) -> Self {
        Self {
            frames: self.frames / workers,
            redb: self.redb / workers,
            buffers: self.buffers / workers,
        }
    }

    /// Returns the plan of a step that writes no file of pages: the bytes of redb's write cache go to frames.
    pub fn without_file(self) -> Self {
        Self { frames: self.frames + self.redb, ..self }
    }

    /// Number of sub-domains meshed at once. It is limited by the threads and by the frames each worker needs.
    pub fn workers(&self) -> usize {
        let by_frames = (self.frames / FRAMES_OF_WORKER).max(1);
        n_threads().min(usize::try_from(by_frames).unwrap_or(usize::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_never_exceed_the_cap() {
        for cap in [MEMORY_MIN, 96 << 20, 1 << 30, 64 << 30] {
            let plan = Plan::new(cap, 1 << 20).expect("room for a small surface");
            let sum = plan.frames + plan.redb + plan.redb / 2 + plan.buffers + CATALOG + (1 << 20);
            assert!(sum <= cap, "{plan:?} of {cap}");
            assert!(plan.redb + plan.redb / 2 + CATALOG <= cap / 4, "{plan:?} of {cap}");
        }
        assert!(Plan::new(MEMORY_MIN, MEMORY_MIN).is_err());
    }
}
