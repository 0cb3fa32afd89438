//! A private scratch file for pages that leave memory during a step; it ends with the pool.
//!
//! After a crash a step is repeated from its beginning, so the pages it spills are read by that step alone: they need
//! neither a tree nor commits. A page takes one copy between its frame and the file, where redb takes three.

use tetdb_schema::page::{FRAME_BYTES, Slot};

use super::scratch::ScratchFile;
use super::{DiskPath, StorageError};

/// Places of one frame each in a scratch file.
pub(super) struct Spill {
    file: ScratchFile,
    /// Places below the end that hold nothing.
    free: Vec<u32>,
    pub end: u32,
}

impl Spill {
    /// An empty file in `dir`, which must exist. Errors: the disk.
    pub fn create(dir: &DiskPath) -> Result<Self, StorageError> {
        Ok(Self { file: ScratchFile::create(dir)?, free: Vec::new(), end: 0 })
    }

    /// A place that holds nothing.
    pub fn take(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.end += 1;
            self.end - 1
        })
    }

    /// Frees a slot, which may be overwritten.
    pub fn forget(&mut self, place: u32) {
        self.free.push(place);
    }

    /// Writes a frame. Errors: the disk.
    pub fn write(&self, place: u32, frame: &[Slot]) -> Result<(), StorageError> {
        let at = u64::from(place) * FRAME_BYTES as u64;
        self.file.write(at, bytemuck::cast_slice(frame))
    }

    /// Reads a frame that was written. Errors: the disk.
    pub fn read(&self, place: u32, frame: &mut [Slot]) -> Result<(), StorageError> {
        let at = u64::from(place) * FRAME_BYTES as u64;
        self.file.read(at, bytemuck::cast_slice_mut(frame))
    }

    /// Path of the file.
    pub fn path(&self) -> &DiskPath {
        self.file.path()
    }
}
