//! What of the mesh a file holds.

use super::super::error::Result;
use super::super::midpoints::Midpoints;
use super::ghosts::{Ghost, Ghosts};

/// What a file is of.
pub(super) struct GmshPiece<'a> {
    /// Places of its partitions among all.
    pub which: &'a [usize],
    pub midpoints: Option<&'a Midpoints>,
    /// In files of one partition, tetrahedra of others that it sees.
    pub foreign: Option<&'a Ghosts>,
}

impl GmshPiece<'_> {
    /// Every tetrahedron of another partition that is in the file too.
    pub fn each_ghost(&self, mut each: impl FnMut(&Ghost) -> Result<()>) -> Result<()> {
        let Some(ghosts) = self.foreign else {
            return Ok(());
        };
        (self.which.iter()).try_for_each(|&p| ghosts.each(p, &mut each))
    }
}
