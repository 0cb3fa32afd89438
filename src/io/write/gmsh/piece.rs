//! The part of the mesh in one file.

use super::super::error::Result;
use super::super::midpoints::Midpoints;
use super::ghosts::{Ghost, Ghosts};

/// The part of the mesh in one file.
pub(super) struct GmshPiece<'a> {
    /// Places of its partitions among all.
    pub which: &'a [usize],
    pub midpoints: Option<&'a Midpoints>,
    /// In files of one partition, the ghosts of that partition.
    pub foreign: Option<&'a Ghosts>,
}

impl GmshPiece<'_> {
    /// Calls `each` with the tetrahedra of other partitions that are in the file too.
    pub fn each_ghost(&self, mut each: impl FnMut(&Ghost) -> Result<()>) -> Result<()> {
        let Some(ghosts) = self.foreign else {
            return Ok(());
        };
        (self.which.iter()).try_for_each(|&p| ghosts.each(p, &mut each))
    }
}
