//! Backends of redb: a file of a disk whose commits are synced, one whose commits are not, and a private copy in
//! memory.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::ops::Bound;
use std::sync::{Mutex, MutexGuard, PoisonError};

use redb::{BackendError, StorageBackend};

/// A file of a [`Disk`](super::Disk) as redb takes it.
///
/// Without syncing it serves one process alone: it takes no lock, and a commit reaches only the system. A file that the
/// catalog does not list yet is worthless after a crash; the commit that lists it first syncs it as a whole. Syncing each
/// batch instead was most of the time of a cut with very few frames. Is not, unsynced: for files that change in place once
/// they are listed.
#[derive(Debug)]
pub(super) struct DiskFile {
    pub file: Box<dyn StorageBackend>,
    pub is_synced: bool,
}

type LockResult<T> = Result<T, BackendError>;

impl DiskFile {
    /// The file, if it takes locks.
    fn locks(&self) -> LockResult<&dyn StorageBackend> {
        match self.is_synced {
            true => Ok(&*self.file),
            false => Err(BackendError::Unsupported),
        }
    }
}

impl StorageBackend for DiskFile {
    fn len(&self) -> io::Result<u64> {
        self.file.len()
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.file.read(offset, out)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.file.set_len(len)
    }

    fn sync_data(&self) -> io::Result<()> {
        match self.is_synced {
            true => self.file.sync_data(),
            false => Ok(()),
        }
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.file.write(offset, data)
    }

    fn close(&self) -> io::Result<()> {
        self.file.close()
    }

    fn try_lock_range(&self, start: Bound<u64>, end: Bound<u64>) -> LockResult<bool> {
        self.locks()?.try_lock_range(start, end)
    }

    fn try_lock_shared_range(&self, start: Bound<u64>, end: Bound<u64>) -> LockResult<bool> {
        self.locks()?.try_lock_shared_range(start, end)
    }

    fn lock_range(&self, start: Bound<u64>, end: Bound<u64>) -> LockResult<()> {
        self.locks()?.lock_range(start, end)
    }

    fn lock_shared_range(&self, start: Bound<u64>, end: Bound<u64>) -> LockResult<()> {
        self.locks()?.lock_shared_range(start, end)
    }

    fn unlock_range(&self, start: Bound<u64>, end: Bound<u64>) -> LockResult<()> {
        self.locks()?.unlock_range(start, end)
    }

    fn query_lock_range(&self, start: Bound<u64>, end: Bound<u64>) -> LockResult<bool> {
        self.locks()?.query_lock_range(start, end)
    }
}

const BLOCK: u64 = 4096;

/// A file as it would be if it were written to: changes stay in memory.
///
/// For a database that must not change, which redb can open only for writing. Memory: the bytes written.
#[derive(Debug)]
pub(super) struct Private {
    file: Box<dyn StorageBackend>,
    changes: Mutex<PrivateChanges>,
}

#[derive(Debug)]
struct PrivateChanges {
    len: u64,
    /// Length of the valid part of the file; bytes beyond it that are in no block are zero.
    len_of_file: u64,
    blocks: BTreeMap<u64, [u8; BLOCK as usize]>,
}

impl Private {
    pub fn new(file: Box<dyn StorageBackend>) -> io::Result<Self> {
        let len = file.len()?;
        let changes = Mutex::new(PrivateChanges { len, len_of_file: len, blocks: BTreeMap::new() });
        Ok(Self { file, changes })
    }

    fn changes(&self) -> MutexGuard<'_, PrivateChanges> {
        self.changes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads past the changes.
    fn read_file(&self, changes: &PrivateChanges, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let within = changes.len_of_file.saturating_sub(offset);
        let n = out.len().min(usize::try_from(within).unwrap_or(usize::MAX));
        let (inside, beyond) = out.split_at_mut(n);
        beyond.fill(0);
        match inside.is_empty() {
            true => Ok(()),
            false => self.file.read(offset, inside),
        }
    }
}

/// The part of a block that a range of bytes covers: block, range in the block, range in the bytes.
fn parts(
    offset: u64,
    bytes: usize,
) -> impl Iterator<Item = (u64, std::ops::Range<usize>, std::ops::Range<usize>)> {
    let end = offset + bytes as u64;
    (offset / BLOCK..end.div_ceil(BLOCK)).map(move |block| {
        let (from, to) = (offset.max(block * BLOCK), end.min((block + 1) * BLOCK));
        let at = |start: u64| (from - start) as usize..(to - start) as usize;
        (block, at(block * BLOCK), at(offset))
    })
}

impl StorageBackend for Private {
    fn len(&self) -> io::Result<u64> {
        Ok(self.changes().len)
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let changes = self.changes();
        if offset + out.len() as u64 > changes.len {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        self.read_file(&changes, offset, out)?;
        for (block, there, here) in parts(offset, out.len()) {
            if let Some(bytes) = changes.blocks.get(&block) {
                out[here].copy_from_slice(&bytes[there]);
            }
        }
        Ok(())
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        let mut changes = self.changes();
        if len < changes.len {
            changes.len_of_file = changes.len_of_file.min(len);
            changes.blocks.split_off(&len.div_ceil(BLOCK));
            let from = (len % BLOCK) as usize;
            if let (1.., Some(last)) = (from, changes.blocks.get_mut(&(len / BLOCK))) {
                last[from..].fill(0);
            }
        }
        changes.len = len;
        Ok(())
    }

    fn sync_data(&self) -> io::Result<()> {
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        let mut changes = self.changes();
        for (block, there, here) in parts(offset, data.len()) {
            if !changes.blocks.contains_key(&block) {
                let mut bytes = [0; BLOCK as usize];
                self.read_file(&changes, block * BLOCK, &mut bytes)?;
                changes.blocks.insert(block, bytes);
            }
            if let Some(bytes) = changes.blocks.get_mut(&block) {
                bytes[there].copy_from_slice(&data[here]);
            }
        }
        changes.len = changes.len.max(offset + data.len() as u64);
        Ok(())
    }

    fn close(&self) -> io::Result<()> {
        self.file.close()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use redb::backends::InMemoryBackend;

    #[test]
    fn changes_stay_in_memory() -> io::Result<()> {
        let file = InMemoryBackend::new();
        file.set_len(10_000)?;
        file.write(0, &[1; 10_000])?;
        let private = Private::new(Box::new(file))?;
        let mut expected = vec![1u8; 10_000];
        let mut write = |at: usize, n: usize, byte: u8| {
            private.write(at as u64, &vec![byte; n])?;
            expected.resize(expected.len().max(at + n), 0);
            expected[at..at + n].fill(byte);
            let mut found = vec![0; expected.len()];
            private.read(0, &mut found)?;
            assert!(found == expected, "after {n} bytes at {at}");
            Ok::<_, io::Error>(())
        };
        write(4000, 200, 2)?;
        write(0, 4096, 3)?;
        write(9_990, 20_000, 4)?;
        for len in [5_000, 12_000] {
            private.set_len(len)?;
        }
        let mut found = vec![9; 12_000];
        private.read(0, &mut found)?;
        expected.truncate(5_000);
        expected.resize(12_000, 0);
        assert!(found == expected, "shorter, then longer");
        assert!(private.read(11_999, &mut [0; 2]).is_err());
        let mut below = [0; 3];
        private.file.read(4000, &mut below)?;
        assert_eq!(below, [1; 3], "the file is as it was");
        Ok(())
    }
}
