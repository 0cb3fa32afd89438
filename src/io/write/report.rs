//! What was written.

use std::path::PathBuf;

/// What was exported.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ExportReport {
    /// Each file with its length in bytes.
    pub files: Vec<(PathBuf, u64)>,
    pub vertices: u64,
    pub tets: u64,
    /// Boundary faces.
    pub triangles: u64,
}

/// How many of each were written.
#[derive(Clone, Copy, Default)]
pub(super) struct FileCounts {
    pub vertices: u64,
    pub tets: u64,
    pub triangles: u64,
}
