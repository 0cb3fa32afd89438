//! Sort more records than memory holds: sorted runs on disk, merged while read.
//!
//! All runs are in one file, because a process may open only some hundreds. If memory has too few buffers for all runs,
//! some are merged first.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::sync::Arc;

use super::scratch::ScratchFile;
use super::sort_record::{SortBytes, SortRecord};
use super::{DiskPath, StorageError, check_cancelled, reserve, sort_unstable_by};

/// A run is read through at least this much buffer.
const READ_BYTES_MIN: usize = 16 << 10;
/// Largest read buffer of a run.
const READ_BYTES_MAX: usize = 1 << 20;
/// A run is written through this much.
const WRITE_BYTES: usize = 1 << 18;
/// Runs merged at once, however little memory there is.
const MERGED_MIN: usize = 8;

/// Collects records; [`Sorter::finish`] gives them back in ascending order.
///
/// Memory: `memory_bytes` for any number of records, but 128 KiB at least, and 256 KiB while a run is written. Equal
/// records are all kept. The result does not depend on the memory, nor on threads.
pub struct Sorter<R: SortRecord> {
    records: Vec<R::Bytes>,
    records_max: usize,
    memory_bytes: usize,
    dir: DiskPath,
    runs: VecDeque<SortedRun>,
}

/// Sorted records in a part of a file.
struct SortedRun {
    file: Arc<ScratchFile>,
    /// Bytes from here on.
    at: u64,
    /// Up to here.
    end: u64,
}

/// Compares records by their bytes: the first sixteen, or eight, as one number, which nearly always decides.
#[inline(always)]
fn order<B: SortBytes>(a: &B, b: &B) -> std::cmp::Ordering {
    let (a, b) = (a.as_ref(), b.as_ref());
    if let (Some((a, a_rest)), Some((b, b_rest))) =
        (a.split_first_chunk::<16>(), b.split_first_chunk::<16>())
    {
        let first = u128::from_be_bytes(*a).cmp(&u128::from_be_bytes(*b));
        return first.then_with(|| a_rest.cmp(b_rest));
    }
    match (a.split_first_chunk::<8>(), b.split_first_chunk::<8>()) {
        (Some((a, a_rest)), Some((b, b_rest))) => {
            u64::from_be_bytes(*a).cmp(&u64::from_be_bytes(*b)).then_with(|| a_rest.cmp(b_rest))
        }
        _ => a.cmp(b),
    }
}

impl<R: SortRecord> Sorter<R> {
    /// A sorter with runs in `dir`, which must exist.
    pub fn new(dir: impl Into<DiskPath>, memory_bytes: u64) -> Self {
        let memory_bytes = usize::try_from(memory_bytes).unwrap_or(usize::MAX).max(1 << 16);
        Self {
            records: Vec::new(),
            records_max: memory_bytes / size_of::<R::Bytes>(),
            memory_bytes,
            dir: dir.into(),
            runs: VecDeque::new(),
        }
    }

    /// Adds a record. Errors: the disk, when a run is written.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<(), StorageError> {
        if self.records.len() == self.records_max {
            self.spill()?;
        }
        if self.records.len() == self.records.capacity() {
            // Grow by halves up to the exact bound: doubling would hold three times the records while it copies.
            let more = (self.records.len() / 2).max(4096);
            let more = more.min(self.records_max - self.records.len());
            reserve(&mut self.records, more);
        }
        self.records.push(record.to_bytes());
        Ok(())
    }

    /// Adds records that are bytes already. Errors: the disk, when a run is written.
    pub fn extend(&mut self, mut records: &[R::Bytes]) -> Result<(), StorageError> {
        while !records.is_empty() {
            if self.records.len() == self.records_max {
                self.spill()?;
            }
            let room = self.records_max - self.records.len();
            let (now, later) = records.split_at(records.len().min(room));
            if self.records.len() + now.len() > self.records.capacity() {
                let more = (self.records.len() / 2).min(room).max(now.len());
                reserve(&mut self.records, more);
            }
            self.records.extend_from_slice(now);
            records = later;
        }
        Ok(())
    }

    fn spill(&mut self) -> Result<(), StorageError> {
        check_cancelled();
        sort_unstable_by(&mut self.records, order);
        let mut run = RunWriter::after(self.runs.back(), &self.dir)?;
        for record in &self.records {
            run.push(record)?;
        }
        self.runs.push_back(run.done()?);
        self.records.clear();
        Ok(())
    }

    /// Ends pushing. Errors: the disk.
    pub fn finish(mut self) -> Result<Sorted<R>, StorageError> {
        if self.runs.is_empty() {
            sort_unstable_by(&mut self.records, order);
            return Ok(Sorted {
                memory: std::mem::take(&mut self.records).into_iter(),
                heap: BinaryHeap::new(),
                readers: Vec::new(),
            });
        }
        if !self.records.is_empty() {
            self.spill()?;
        }
        self.records = Vec::new();
        let at_once = (self.memory_bytes / READ_BYTES_MIN).max(MERGED_MIN);
        self.merge_down_to(at_once)?;
        Sorted::new(self.runs, self.memory_bytes)
    }

    /// Merges the oldest runs, which are the shortest, until so many are left.
    fn merge_down_to(&mut self, at_once: usize) -> Result<(), StorageError> {
        while self.runs.len() > at_once {
            check_cancelled();
            let n = at_once.min(self.runs.len() - at_once + 1);
            let oldest: VecDeque<SortedRun> = self.runs.drain(..n).collect();
            // Each round writes to a new file, so that the previous file is freed when all its runs are read.
            let is_read = |file| oldest.iter().any(|run| Arc::ptr_eq(&run.file, file));
            let beside = self.runs.back().filter(|last| !is_read(&last.file));
            let mut run = RunWriter::after(beside, &self.dir)?;
            for record in Sorted::<R>::new(oldest, self.memory_bytes)? {
                run.push(&record?.to_bytes())?;
            }
            self.runs.push_back(run.done()?);
        }
        Ok(())
    }
}

/// Writes a run.
struct RunWriter {
    run: SortedRun,
    buffer: Vec<u8>,
}

impl RunWriter {
    /// Starts a run after another one in its file, or in a new file. Errors: the disk.
    fn after(last: Option<&SortedRun>, dir: &DiskPath) -> Result<Self, StorageError> {
        let (file, at) = match last {
            Some(run) => (Arc::clone(&run.file), run.end),
            None => (Arc::new(ScratchFile::create(dir)?), 0),
        };
        let run = SortedRun { file, at, end: at };
        let buffer = Vec::with_capacity(WRITE_BYTES);
        Ok(Self { run, buffer })
    }

    fn push<B: SortBytes>(&mut self, record: &B) -> Result<(), StorageError> {
        let bytes = record.as_ref();
        if self.buffer.len() + bytes.len() > WRITE_BYTES {
            self.flush()?;
        }
        self.buffer.extend_from_slice(bytes);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), StorageError> {
        self.run.file.write(self.run.end, &self.buffer)?;
        self.run.end += self.buffer.len() as u64;
        self.buffer.clear();
        Ok(())
    }

    fn done(mut self) -> Result<SortedRun, StorageError> {
        self.flush()?;
        Ok(self.run)
    }
}

struct RunReader {
    run: SortedRun,
    buffer: Vec<u8>,
    /// Bytes of the buffer already given.
    given: usize,
    /// Bytes read at a time: whole records.
    at_once: usize,
}

impl RunReader {
    fn next<B: SortBytes>(&mut self) -> Result<Option<B>, StorageError> {
        if self.given == self.buffer.len() {
            let left = self.run.end - self.run.at;
            if left == 0 {
                return Ok(None);
            }
            self.buffer.resize(left.min(self.at_once as u64) as usize, 0);
            self.run.file.read(self.run.at, &mut self.buffer)?;
            self.run.at += self.buffer.len() as u64;
            self.given = 0;
        }
        let mut record = B::ZERO;
        let bytes = record.as_mut();
        bytes.copy_from_slice(&self.buffer[self.given..][..bytes.len()]);
        self.given += bytes.len();
        Ok(Some(record))
    }
}

/// Records in ascending order.
pub struct Sorted<R: SortRecord> {
    memory: std::vec::IntoIter<R::Bytes>,
    heap: BinaryHeap<Reverse<(R::Bytes, usize)>>,
    readers: Vec<RunReader>,
}

impl<R: SortRecord> Sorted<R> {
    /// Merges runs while they are read, each through its share of so much memory.
    fn new(runs: VecDeque<SortedRun>, memory_bytes: usize) -> Result<Self, StorageError> {
        let share = (memory_bytes / runs.len()).clamp(READ_BYTES_MIN, READ_BYTES_MAX);
        let mut sorted = Self {
            memory: Vec::new().into_iter(),
            heap: BinaryHeap::with_capacity(runs.len()),
            readers: Vec::with_capacity(runs.len()),
        };
        for (k, run) in runs.into_iter().enumerate() {
            let mut reader = RunReader {
                run,
                buffer: Vec::new(),
                given: 0,
                at_once: share / size_of::<R::Bytes>() * size_of::<R::Bytes>(),
            };
            if let Some(record) = reader.next()? {
                sorted.heap.push(Reverse((record, k)));
            }
            sorted.readers.push(reader);
        }
        Ok(sorted)
    }
}

impl<R: SortRecord> Iterator for Sorted<R> {
    type Item = Result<R, StorageError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.readers.is_empty() {
            return self.memory.next().map(|bytes| Ok(R::from_bytes(&bytes)));
        }
        let mut least = self.heap.peek_mut()?;
        let Reverse((record, k)) = *least;
        match self.readers[k].next() {
            Ok(Some(following)) => *least = Reverse((following, k)),
            Ok(None) => {
                std::collections::binary_heap::PeekMut::pop(least);
            }
            Err(e) => return Some(Err(e)),
        }
        Some(Ok(R::from_bytes(&record)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_come_back_sorted_whatever_the_memory() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        // With the least memory 92 runs, which is more than are merged at once.
        let records: Vec<[u8; 12]> = (0..500_000u64)
            .map(|i| {
                let mut record = [0; 12];
                let key = i.wrapping_mul(0x9E37_79B9_7F4A_7C15) % 300_000;
                record[..8].copy_from_slice(&key.to_be_bytes());
                record
            })
            .collect();
        let mut expected = records.clone();
        expected.sort_unstable();
        for memory in [1 << 16, 1 << 18, 1 << 24] {
            let mut sorter = Sorter::new(dir.path(), memory);
            let (one_by_one, at_once) = records.split_at(70_000);
            for &record in one_by_one {
                sorter.push(record)?;
            }
            sorter.extend(at_once)?;
            let files: Vec<_> = sorter.runs.iter().map(|run| Arc::as_ptr(&run.file)).collect();
            assert!(files.windows(2).all(|pair| pair[0] == pair[1]), "one file");
            let sorted: Result<Vec<_>, _> = sorter.finish()?.collect();
            assert_eq!(sorted?, expected, "memory {memory}");
        }
        assert_eq!(std::fs::read_dir(dir.path())?.count(), 0, "runs are removed");
        Ok(())
    }
}
