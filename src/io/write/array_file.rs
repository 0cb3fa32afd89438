//! Many arrays of one file, filled side by side through one handle.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::error::{Result, WriteError};

/// Bytes gathered for an array before a write: fewer cost a write for every few numbers, more gain nothing.
const BUFFER_BYTES: [usize; 2] = [64, 256 << 10];

/// A file of arrays of known places and lengths.
pub(super) struct ArrayFile {
    path: PathBuf,
    file: File,
    arrays: Vec<OpenArray>,
    buffer_bytes: usize,
}

/// An array being filled.
struct OpenArray {
    /// The place of the next byte that is written to the file.
    at: u64,
    left: u64,
    buffer: Vec<u8>,
}

impl ArrayFile {
    /// Opens a file of `file_bytes`, which exists, to fill `arrays`: first byte and length of each. Holds about `memory` bytes. Errors: the disk.
    pub fn open(path: &Path, file_bytes: u64, arrays: &[[u64; 2]], memory: usize) -> Result<Self> {
        let io = |e| WriteError::io(path, e);
        let file = OpenOptions::new().write(true).open(path).map_err(io)?;
        file.set_len(file_bytes).map_err(io)?;
        let [least, most] = BUFFER_BYTES;
        let buffer_bytes = (memory / arrays.len().max(1)).clamp(least, most);
        let arrays = arrays.iter().map(|&[at, left]| OpenArray { at, left, buffer: Vec::new() });
        Ok(Self { path: path.to_owned(), file, arrays: arrays.collect(), buffer_bytes })
    }

    /// Appends bytes to an array, which has space for them. Errors: the disk.
    #[inline]
    pub fn put(&mut self, array: usize, bytes: &[u8]) -> Result<()> {
        let open = &mut self.arrays[array];
        let left = open.left.checked_sub(bytes.len() as u64);
        open.left = left.expect("arrays were measured by the same counts");
        if open.buffer.len() + bytes.len() > self.buffer_bytes {
            self.flush(array)?;
        }
        let buffer = &mut self.arrays[array].buffer;
        if buffer.capacity() == 0 {
            buffer.reserve_exact(self.buffer_bytes);
        }
        buffer.extend_from_slice(bytes);
        Ok(())
    }

    fn flush(&mut self, array: usize) -> Result<()> {
        let OpenArray { at, buffer, .. } = &mut self.arrays[array];
        let moved = self.file.seek(SeekFrom::Start(*at));
        let written = moved.and_then(|_| self.file.write_all(buffer));
        *at += buffer.len() as u64;
        buffer.clear();
        written.map_err(|e| WriteError::io(&self.path, e))
    }

    /// Ends the arrays, which must be full. Errors: the disk.
    pub fn finish(mut self) -> Result<()> {
        for array in 0..self.arrays.len() {
            assert_eq!(self.arrays[array].left, 0, "bytes missing in {}", self.path.display());
            self.flush(array)?;
        }
        Ok(())
    }
}
