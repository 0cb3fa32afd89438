//! Long arrays: in memory while they fit their share of it, else in a scratch file behind a few frames.
//!
//! The results of an algorithm do not depend on where its arrays are. A failing disk unwinds, as in the pager.

use std::fmt;
use std::sync::Arc;

use bytemuck::Pod;

use super::paged_vec::{FRAMES_MIN, PAGE_BYTES, PagedVec, SharedPagedVec, per_page};
use super::{Budget, DiskPath, Lease, SortRecord, Sorter, filled, reserve};

/// Memory for arrays and sorts, and a folder for those it does not hold.
#[derive(Clone)]
pub struct ScratchSpace {
    budget: Budget,
    dir: Option<DiskPath>,
}

impl fmt::Debug for ScratchSpace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ScratchSpace({} bytes, {:?})", self.budget.cap(), self.dir)
    }
}

impl ScratchSpace {
    /// All in memory, however much that is.
    pub fn boundless() -> Self {
        Self { budget: Budget::new(u64::MAX), dir: None }
    }

    /// At most `bytes` of memory; the rest goes to scratch files in `dir`, which must exist.
    pub fn new(bytes: u64, dir: impl Into<DiskPath>) -> Self {
        Self { budget: Budget::new(bytes), dir: Some(dir.into()) }
    }

    /// Bytes in all.
    pub fn cap(&self) -> u64 {
        self.budget.cap()
    }

    /// Bytes not taken at the moment.
    pub fn available(&self) -> u64 {
        self.budget.available()
    }

    /// Leases bytes held outside the arrays created here, at most the bytes left: arrays take shares of the rest.
    pub fn lease(&self, bytes: usize) -> Option<Lease> {
        let bytes = (bytes as u64).min(self.available());
        self.budget.lease(bytes, "what is held beside arrays").ok()
    }

    /// `n` copies of `value`. An array in memory takes a quarter of the free bytes at most.
    pub fn vec<T: Pod>(&self, n: usize, value: T) -> SpillVec<T> {
        let bytes = (n * size_of::<T>()) as u64;
        match &self.dir {
            Some(dir) if bytes > self.available() / 4 => {
                let bytes = self.available() / 16;
                let lease = self.budget.lease(bytes, "frames").ok();
                // The least number of frames is always taken: half a megabyte.
                let frames = ((bytes / PAGE_BYTES as u64) as usize).max(FRAMES_MIN);
                let mut paged = PagedVec::new(dir, value, frames);
                paged.resize(n);
                SpillVec { place: Residence::Disk(Box::new(paged)), lease }
            }
            _ => SpillVec {
                place: Residence::Memory(filled(n, value)),
                lease: self.budget.lease(bytes, "an array").ok(),
            },
        }
    }

    /// An empty array that grows.
    pub fn builder<T: Pod>(&self) -> SpillVecBuilder<T> {
        self.builder_within(self.available() / 8)
    }

    /// An empty array that grows and takes at most `bytes`, in memory or as frames.
    pub fn builder_within<T: Pod>(&self, bytes: u64) -> SpillVecBuilder<T> {
        let frames = ((bytes / PAGE_BYTES as u64) as usize).max(FRAMES_MIN);
        SpillVecBuilder {
            memory: Vec::new(),
            memory_max: match &self.dir {
                Some(_) => frames * per_page::<T>(),
                None => usize::MAX,
            },
            paged: None,
            lease: self.budget.lease(bytes, "an array").ok(),
            dir: self.dir.clone(),
        }
    }

    /// A sorter with a quarter of the free bytes.
    pub fn sorter<R: SortRecord>(&self) -> Sorter<R> {
        self.sorter_within(self.available() / 4)
    }

    /// A sorter with so many bytes, which are not leased.
    pub fn sorter_within<R: SortRecord>(&self, bytes: u64) -> Sorter<R> {
        match &self.dir {
            Some(dir) => Sorter::new(dir, bytes),
            None => Sorter::new("", u64::MAX),
        }
    }
}

/// An array of `T`, in memory while its share lasts and in an unnamed scratch file beyond it.
///
/// An access that fails on disk unwinds as the pager's do.
pub struct SpillVec<T> {
    place: Residence<T>,
    lease: Option<Lease>,
}

enum Residence<T> {
    Memory(Vec<T>),
    Disk(Box<PagedVec<T>>),
}

impl<T: Pod> SpillVec<T> {
    /// Element `i`.
    #[inline(always)]
    pub fn get(&mut self, i: usize) -> T {
        match &mut self.place {
            Residence::Memory(all) => all[i],
            Residence::Disk(paged) => *paged.at(i),
        }
    }

    /// Sets element `i` to `value`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, value: T) {
        match &mut self.place {
            Residence::Memory(all) => all[i] = value,
            Residence::Disk(paged) => *paged.at_mut(i) = value,
        }
    }

    /// Changes one.
    #[inline(always)]
    pub fn change(&mut self, i: usize, change: impl FnOnce(&mut T)) {
        match &mut self.place {
            Residence::Memory(all) => change(&mut all[i]),
            Residence::Disk(paged) => change(paged.at_mut(i)),
        }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        match &self.place {
            Residence::Memory(all) => all.len(),
            Residence::Disk(paged) => paged.len,
        }
    }

    /// Returns whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sets all to `value`.
    pub fn fill(&mut self, value: T) {
        match &mut self.place {
            Residence::Memory(all) => all.fill(value),
            Residence::Disk(paged) => paged.fill(value),
        }
    }

    /// All elements, if they are in memory.
    pub fn as_slice(&self) -> Option<&[T]> {
        match &self.place {
            Residence::Memory(all) => Some(all),
            Residence::Disk(_) => None,
        }
    }

    /// Reads elements beside other readers; [`FrozenSpillVec`] does so where the array never changes again.
    pub fn reader(&self) -> SpillVecReader<'_, T> {
        let place = match &self.place {
            Residence::Memory(all) => ReaderPlace::Memory(all),
            Residence::Disk(paged) => {
                let (least, most) = PAGES_OF_READER;
                let n = (PAGES_READ / rayon::current_num_threads()).clamp(least, most);
                ReaderPlace::Disk(paged, vec![(usize::MAX, Vec::new()); n])
            }
        };
        SpillVecReader { place }
    }

    /// The array for reading by many threads.
    pub fn freeze(self) -> FrozenSpillVec<T> {
        match self.place {
            Residence::Memory(all) => FrozenSpillVec::Memory(all),
            Residence::Disk(paged) => {
                FrozenSpillVec::Disk(Arc::new(SharedPagedVec::new(*paged, self.lease)))
            }
        }
    }
}

/// Pages all threads' readers of an array keep, and the least and most of one of them.
const PAGES_READ: usize = 128;
const PAGES_OF_READER: (usize, usize) = (4, 16);

/// Reads elements of an array that does not change meanwhile. Memory: 64 to 256 KiB if the array is in a scratch file.
pub struct SpillVecReader<'a, T> {
    place: ReaderPlace<'a, T>,
}

enum ReaderPlace<'a, T> {
    Memory(&'a [T]),
    /// Copies of pages with their numbers, each at its number's remainder.
    Disk(&'a PagedVec<T>, Vec<(usize, Vec<T>)>),
}

impl<T: Pod> SpillVecReader<'_, T> {
    /// Element `i`. Unwinds when the scratch file fails.
    #[inline(always)]
    pub fn get(&mut self, i: usize) -> T {
        match &mut self.place {
            ReaderPlace::Memory(all) => all[i],
            ReaderPlace::Disk(paged, pages) => {
                let (page, slot) = (i / per_page::<T>(), i % per_page::<T>());
                let place = page % pages.len();
                let (known, copy) = &mut pages[place];
                if *known != page {
                    paged.copy_page(page, copy);
                    *known = page;
                }
                copy[slot]
            }
        }
    }
}

/// An array of `T` that grows at its end.
pub struct SpillVecBuilder<T> {
    memory: Vec<T>,
    memory_max: usize,
    paged: Option<Box<PagedVec<T>>>,
    lease: Option<Lease>,
    dir: Option<DiskPath>,
}

impl<T: Pod> SpillVecBuilder<T> {
    /// Adds an element at the end. Unwinds when a scratch file fails.
    #[inline]
    pub fn push(&mut self, value: T) {
        if let Some(paged) = &mut self.paged {
            paged.push(value);
            return;
        }
        if self.memory.len() == self.memory.capacity() {
            if self.memory.len() >= self.memory_max {
                self.spill();
                return self.push(value);
            }
            let more = (self.memory.len() / 2).max(1024);
            let more = more.min(self.memory_max - self.memory.len());
            reserve(&mut self.memory, more);
        }
        self.memory.push(value);
    }

    /// Element `i`.
    pub fn get(&mut self, i: usize) -> T {
        match &mut self.paged {
            Some(paged) => *paged.at(i),
            None => self.memory[i],
        }
    }

    /// Sets element `i` to `value`.
    pub fn set(&mut self, i: usize, value: T) {
        match &mut self.paged {
            Some(paged) => *paged.at_mut(i) = value,
            None => self.memory[i] = value,
        }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        match &self.paged {
            Some(paged) => paged.len,
            None => self.memory.len(),
        }
    }

    /// Returns whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Moves the elements to a scratch file.
    fn spill(&mut self) {
        let Some(dir) = &self.dir else { return };
        let all = std::mem::take(&mut self.memory);
        let mut paged = PagedVec::new(dir, T::zeroed(), (self.memory_max / per_page::<T>()).max(1));
        for value in all {
            paged.push(value);
        }
        self.paged = Some(Box::new(paged));
    }

    /// The array, as long as it is now.
    pub fn finish(mut self) -> SpillVec<T> {
        let place = match self.paged {
            Some(paged) => Residence::Disk(paged),
            None => {
                self.memory.shrink_to_fit();
                Residence::Memory(self.memory)
            }
        };
        SpillVec { place, lease: self.lease }
    }
}

/// An array that no longer changes, read by many threads.
#[derive(Clone)]
pub enum FrozenSpillVec<T> {
    /// In memory.
    Memory(Vec<T>),
    /// In a scratch file, in parts, each with frames of its own.
    Disk(Arc<SharedPagedVec<T>>),
}

impl<T: Pod> FrozenSpillVec<T> {
    /// Element `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> T {
        match self {
            Self::Memory(all) => all[i],
            Self::Disk(shared) => shared.get(i),
        }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Self::Memory(all) => all.len(),
            Self::Disk(shared) => shared.len,
        }
    }

    /// Returns whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Memory(all) => all.capacity() * size_of::<T>(),
            Self::Disk(shared) => shared.bytes,
        }
    }
}

impl<T> fmt::Debug for FrozenSpillVec<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Memory(_) => "an array in memory",
            Self::Disk(_) => "an array on disk",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::attempt;

    /// Counts with steps that jump and stay near by turns.
    fn places(n: usize) -> impl Iterator<Item = usize> {
        (0..4 * n).map(move |k| (k / 7 * 7919 + k % 7) % n)
    }

    #[test]
    fn an_array_is_the_same_wherever_it_is() {
        let dir = tempfile::tempdir().expect("a folder");
        let n = 300_000;
        let mut found = Vec::new();
        for scratch in [ScratchSpace::boundless(), ScratchSpace::new(1 << 20, dir.path())] {
            let mut array = scratch.vec(n, [7u32, 0]);
            let is_paged = matches!(array.place, Residence::Disk(_));
            assert_eq!(is_paged, scratch.dir.is_some());
            for i in places(n) {
                let [a, b] = array.get(i);
                array.set(i, [a.wrapping_mul(3), b + 1]);
            }
            let known: Vec<[u32; 2]> = (0..n).map(|i| array.get(i)).collect();
            let mut reader = array.reader();
            assert!(places(n).chain(0..n).all(|i| reader.get(i) == known[i]));
            let mut builder = scratch.builder();
            for i in 0..n {
                builder.push(array.get(i));
            }
            let fixed = builder.finish().freeze();
            assert_eq!(fixed.len(), n);
            let sums: Vec<u64> =
                rayon::iter::ParallelIterator::collect(rayon::iter::ParallelIterator::map(
                    rayon::iter::IntoParallelIterator::into_par_iter(0..n),
                    |i| fixed.get(i).map(u64::from).iter().sum(),
                ));
            array.fill([1, 2]);
            array.set(5, [3, 4]);
            let mut reader = array.reader();
            let filled = |i| if i == 5 { [3, 4] } else { [1, 2] };
            assert!((0..n).all(|i| reader.get(i) == filled(i)));
            assert!((0..n).all(|i| array.get(i) == filled(i)));
            found.push(sums);
        }
        assert!(found[0] == found[1]);
        let left = std::fs::read_dir(dir.path()).expect("the folder").count();
        assert_eq!(left, 0, "scratch files are removed");
    }

    #[test]
    fn a_folder_that_is_not_there_is_an_error() {
        let dir = tempfile::tempdir().expect("a folder");
        let scratch = ScratchSpace::new(1 << 20, dir.path().join("missing"));
        let output = attempt(|| drop(scratch.vec(1 << 20, 0u64)));
        assert!(matches!(output, Err(crate::storage::StorageError::Io { .. })), "{output:?}");
    }
}
