//! The result of an export.

use std::path::PathBuf;

/// The result of an export.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ExportReport {
    /// Each file with its length in bytes.
    pub files: Vec<(PathBuf, u64)>,
    /// Vertices written.
    pub vertices: u64,
    /// Tetrahedra written.
    pub tets: u64,
    /// Boundary faces.
    pub triangles: u64,
}

/// Numbers of written elements.
#[derive(Clone, Copy, Default)]
pub(super) struct FileCounts {
    pub vertices: u64,
    pub tets: u64,
    pub triangles: u64,
}

impl std::ops::AddAssign for FileCounts {
    fn add_assign(&mut self, other: Self) {
        self.vertices += other.vertices;
        self.tets += other.tets;
        self.triangles += other.triangles;
    }
}
