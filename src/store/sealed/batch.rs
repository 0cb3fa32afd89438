//! Values of a file, written some at a time.

use super::SealedError;
use tetdb_base::storage::StoreFile;

/// Most bytes of one commit; redb's cache is three times a batch, or every page is written twice.
const BATCH_BYTES_MAX: usize = 16 << 20;

/// Largest useful cache of redb, for a file that is written with so much memory.
pub(super) fn cache_bytes(memory_bytes: usize) -> usize {
    (memory_bytes / 2).min(3 * BATCH_BYTES_MAX)
}

/// Values waiting for a commit.
pub(super) struct Batch {
    values: Vec<(u64, Vec<u8>)>,
    bytes: usize,
    bytes_max: usize,
}

impl Batch {
    /// A batch that fits redb's cache ([`cache_bytes`]).
    pub(super) fn new(memory_bytes: usize) -> Self {
        Self { values: Vec::new(), bytes: 0, bytes_max: (memory_bytes / 6).min(BATCH_BYTES_MAX) }
    }

    pub(super) fn push(
        &mut self,
        file: &mut StoreFile,
        key: u64,
        value: Vec<u8>,
    ) -> Result<(), SealedError> {
        self.bytes += value.len();
        self.values.push((key, value));
        if self.bytes >= self.bytes_max {
            self.flush(file)?;
        }
        Ok(())
    }

    pub(super) fn flush(&mut self, file: &mut StoreFile) -> Result<(), SealedError> {
        file.write(self.values.iter().map(|(key, value)| (*key, &value[..])))?;
        self.values.clear();
        self.bytes = 0;
        Ok(())
    }
}
