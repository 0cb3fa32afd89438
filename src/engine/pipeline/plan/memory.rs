//! How the cap is shared out before the first byte is read.

use tetdb_base::storage::{StorageError, n_threads};

/// No run fits less: fewer frames than this thrash.
pub const MEMORY_MIN: u64 = 64 << 20;
/// redb's cache beyond this brings nothing: three batches of 16 MiB. Frames are worth more than it long before: pages that are in neither cost
/// 45 microseconds each, and 1.8 million tetrahedra with 160 MiB read a tenth as many when caches and buffers got half of what they had.
const REDB_MAX: u64 = 48 << 20;
/// The catalog's cache and what small things the catalog holds.
const CATALOG: u64 = 3 << 20;
/// Scratch of a phase (candidates, sort runs, chunks being encoded) beyond this brings nothing.
const BUFFERS_MAX: u64 = 384 << 20;

/// Frames one of several workers needs at least.
const FRAMES_OF_WORKER: u64 = 24 << 20;

/// Bytes for each use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Frames of the working mesh.
    pub frames: u64,
    /// redb's cache of the file being written; half as much again is leased for the one being read.
    pub redb: u64,
    /// Everything else a phase holds.
    pub buffers: u64,
}

impl Plan {
    /// Shares out `cap` bytes beside `held` bytes that stay (surface, size field).
    ///
    /// Errors: [`StorageError::Budget`] when less than half of [`MEMORY_MIN`] would be left for frames.
    pub fn new(cap: u64, held: u64) -> Result<Self, StorageError> {
        let wide = Self::with_shares(cap, held, 1);
        match &wide {
            // What is held leaves few frames: they need it more than caches and buffers.
            Ok(plan) if plan.frames >= cap / 8 => wide,
            _ => Self::with_shares(cap, held, 2),
        }
    }

    /// With caches and buffers of the `narrow`th part of their usual share.
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

    /// An equal share for each of `workers`.
    pub fn shared_by(&self, workers: u64) -> Self {
        Self {
            frames: self.frames / workers,
            redb: self.redb / workers,
            buffers: self.buffers / workers,
        }
    }

    /// For a step that makes no file of pages: what redb would hold of it goes to frames.
    pub fn without_file(self) -> Self {
        Self { frames: self.frames + self.redb, ..self }
    }

    /// How many sub-domains can be meshed at once: a worker needs frames of its own.
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
