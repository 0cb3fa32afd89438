//! Sort more records than memory holds: sorted runs on disk, merged while read.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io::{BufReader, BufWriter, Read, Write};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::slice::ParallelSliceMut;

use super::sort_record::{SortBytes, SortRecord};
use super::{DiskPath, StorageError, check_cancelled, parallel, reserve};

/// Numbers run files within the process.
static RUNS: AtomicU64 = AtomicU64::new(0);
/// A run is read through at least this much buffer.
const READ_BYTES_MIN: usize = 16 << 10;

/// Collects records; [`Sorter::finish`] gives them back in ascending order.
///
/// Memory: `memory_bytes`, whatever is pushed. Equal records stay as many as they
/// were. The result does not depend on the memory, nor on threads.
pub struct Sorter<R: SortRecord> {
    records: Vec<R::Bytes>,
    records_max: usize,
    memory_bytes: usize,
    dir: DiskPath,
    runs: Vec<Run>,
}

/// A sorted file that goes when it is dropped.
struct Run {
    path: DiskPath,
}

impl Drop for Run {
    fn drop(&mut self) {
        // The folder of runs is scratch: what stays here is removed when the store is next opened for writing.
        let _ = self.path.remove_file();
    }
}

/// Compares records by their bytes: the first eight as one number, which is what nearly always decides.
#[inline(always)]
fn order<B: SortBytes>(a: &B, b: &B) -> std::cmp::Ordering {
    let (a, b) = (a.as_ref(), b.as_ref());
    match (a.split_first_chunk::<8>(), b.split_first_chunk::<8>()) {
        (Some((a, a_rest)), Some((b, b_rest))) => u64::from_be_bytes(*a)
            .cmp(&u64::from_be_bytes(*b))
            .then_with(|| a_rest.cmp(b_rest)),
        _ => a.cmp(b),
    }
}

impl<R: SortRecord> Sorter<R> {
    /// A sorter with runs in `dir`, which must exist.
    pub fn new(dir: impl Into<DiskPath>, memory_bytes: u64) -> Self {
        let memory_bytes = usize::try_from(memory_bytes)
            .unwrap_or(usize::MAX)
            .max(1 << 16);
        Self {
            records: Vec::new(),
            records_max: memory_bytes / size_of::<R::Bytes>(),
            memory_bytes,
            dir: dir.into(),
            runs: Vec::new(),
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

    fn spill(&mut self) -> Result<(), StorageError> {
        check_cancelled();
        let records = &mut self.records;
        parallel(|| records.par_sort_unstable_by(order));
        let number = RUNS.fetch_add(1, Ordering::Relaxed);
        let path = self
            .dir
            .join(format!("run-{}-{number}", std::process::id()));
        let run = Run { path };
        let created = run.path.disk().create_stream(run.path.path());
        let written = created.and_then(|file| {
            let mut out = BufWriter::with_capacity(1 << 18, file);
            for record in &self.records {
                out.write_all(record.as_ref())?;
            }
            out.flush()
        });
        run.path.at_path(written)?;
        self.runs.push(run);
        self.records.clear();
        Ok(())
    }

    /// Ends pushing. Errors: the disk.
    pub fn finish(mut self) -> Result<Sorted<R>, StorageError> {
        if self.runs.is_empty() {
            let records = &mut self.records;
            parallel(|| records.par_sort_unstable_by(order));
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
        let buffer = (self.memory_bytes / self.runs.len()).clamp(READ_BYTES_MIN, 1 << 20);
        let mut sorted = Sorted {
            memory: Vec::new().into_iter(),
            heap: BinaryHeap::with_capacity(self.runs.len()),
            readers: Vec::with_capacity(self.runs.len()),
        };
        for (k, run) in self.runs.drain(..).enumerate() {
            let file = run
                .path
                .at_path(run.path.disk().open_stream(run.path.path()))?;
            let mut reader = RunReader {
                bytes: BufReader::with_capacity(buffer, file),
                run,
            };
            if let Some(record) = reader.next()? {
                sorted.heap.push(Reverse((record, k)));
            }
            sorted.readers.push(reader);
        }
        Ok(sorted)
    }
}

struct RunReader {
    bytes: BufReader<Box<dyn Read + Send + Sync>>,
    run: Run,
}

impl RunReader {
    fn next<B: SortBytes>(&mut self) -> Result<Option<B>, StorageError> {
        let mut record = B::ZERO;
        match self.bytes.read_exact(record.as_mut()) {
            Ok(()) => Ok(Some(record)),
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Ok(None),
            Err(e) => self.run.path.at_path(Err(e)),
        }
    }
}

/// Records in ascending order.
pub struct Sorted<R: SortRecord> {
    memory: std::vec::IntoIter<R::Bytes>,
    heap: BinaryHeap<Reverse<(R::Bytes, usize)>>,
    readers: Vec<RunReader>,
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
        let records: Vec<[u8; 12]> = (0..50_000u64)
            .map(|i| {
                let mut record = [0; 12];
                let key = i.wrapping_mul(0x9E37_79B9_7F4A_7C15) % 30_000;
                record[..8].copy_from_slice(&key.to_be_bytes());
                record
            })
            .collect();
        let mut expected = records.clone();
        expected.sort_unstable();
        for memory in [1 << 16, 1 << 18, 1 << 24] {
            let mut sorter = Sorter::new(dir.path(), memory);
            for &record in &records {
                sorter.push(record)?;
            }
            let sorted: Result<Vec<_>, _> = sorter.finish()?.collect();
            assert_eq!(sorted?, expected, "memory {memory}");
        }
        assert_eq!(
            std::fs::read_dir(dir.path())?.count(),
            0,
            "runs are removed"
        );
        Ok(())
    }
}
