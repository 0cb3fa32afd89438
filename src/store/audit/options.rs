//! Options of a verification.

use std::path::PathBuf;

use super::report::Level;

/// Options of a verification.
#[derive(Clone, Debug)]
pub struct VerifyOptions {
    /// The last of the levels to check; those before it are checked too.
    pub level: Level,
    /// Bytes for caches, sort buffers and tables together; the tables alone take some 8 MiB.
    pub memory_bytes: usize,
    /// Folder for sorted runs, which are kept in a temporary sub-folder.
    pub temp_dir: PathBuf,
}
