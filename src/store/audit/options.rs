//! What to check, and with how much memory.

use std::path::PathBuf;

use super::report::Level;

/// How to verify.
#[derive(Clone, Debug)]
pub struct VerifyOptions {
    /// The last of the levels to check; those before it are checked too.
    pub level: Level,
    /// Bytes for caches, sort buffers and tables together; the tables alone take some 8 MiB.
    pub memory_bytes: usize,
    /// Folder for sorted runs, which are in a folder of their own below it while they are needed.
    pub temp_dir: PathBuf,
}
