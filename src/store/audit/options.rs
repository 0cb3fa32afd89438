//! Options of a verification.

use std::path::PathBuf;
use std::sync::Arc;

use super::report::Level;

/// Options of a verification.
#[derive(Clone)]
pub struct VerifyOptions {
    /// The last of the levels to check; those before it are checked too.
    pub level: Level,
    /// Bytes for caches, sort buffers and tables together; the tables alone take some 8 MiB.
    pub memory_bytes: usize,
    /// Folder for sorted runs, which are kept in a temporary sub-folder.
    pub temp_dir: PathBuf,
    /// Called with the number of tetrahedra of each chunk that is read.
    pub progress: Option<Arc<dyn Fn(u64) + Send + Sync>>,
}

impl VerifyOptions {
    /// Options that report no progress.
    pub fn new(level: Level, memory_bytes: usize, temp_dir: PathBuf) -> Self {
        Self { level, memory_bytes, temp_dir, progress: None }
    }
}
