//! Volume cells of a file: left out, or a mesh whose boundary is the surface.

use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::CellBoundary;

/// The volume cells of the file being read.
#[derive(Default)]
pub struct VolumeCells {
    /// Number of cells left out.
    pub(super) n_left_out: u64,
    /// Their boundary, where it is the surface.
    pub(super) boundary: Option<CellBoundary>,
    /// Number of faces left out.
    pub(super) n_faces: u64,
    /// Number of cells with nodes beside their corners.
    pub(super) n_curved: u64,
}

impl VolumeCells {
    /// Cells whose boundary is the surface.
    pub(super) fn bounding(space: &ScratchSpace) -> Self {
        Self { boundary: Some(CellBoundary::new(space)), ..Self::default() }
    }

    /// Returns whether the boundary of cells is the surface, and other faces are not.
    pub(super) fn are_wanted(&self) -> bool {
        self.boundary.is_some()
    }
}
