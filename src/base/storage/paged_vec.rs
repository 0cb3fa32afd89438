//! Arrays in scratch files, read and written through frames.

use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::Pod;

use super::scratch::ScratchFile;
use super::{DiskPath, Lease, OrRaise, check_cancelled, reserve};

/// Bytes of a page. Pages are small, because neighbors in an array are only mostly neighbors in space.
pub(super) const PAGE_BYTES: usize = 1 << 14;
/// Frames a paged array has at least: sweeps along a space-filling curve touch some dozens of pages at a time.
pub(super) const FRAMES_MIN: usize = 32;
/// Parts of a paged array that threads read without waiting for each other.
const SHARDS: usize = 16;

/// Records in a page: a power of two.
pub(super) const fn per_page<T>() -> usize {
    let n = PAGE_BYTES / size_of::<T>();
    1 << n.ilog2()
}

/// A paged array in parts, each with frames of its own.
pub struct SharedPagedVec<T> {
    pub(super) len: usize,
    pub(super) bytes: usize,
    shards: Vec<Mutex<PagedVec<T>>>,
    _lease: Option<Lease>,
}

impl<T: Pod> SharedPagedVec<T> {
    pub(super) fn new(mut paged: PagedVec<T>, lease: Option<Lease>) -> Self {
        paged.flush();
        let frames = (paged.frames_max / SHARDS).max(2);
        let n_pages = paged.table.len();
        let shard = |k: usize| {
            let mut shard = PagedVec::over(paged.file.clone(), paged.initial, frames);
            shard.len = paged.len;
            // Page p of the whole is page p / SHARDS of its shard.
            let pages = (k..n_pages).step_by(SHARDS);
            shard.table = pages.map(|p| paged.table[p] & STORED | ABSENT).collect();
            (shard.first, shard.step) = (k, SHARDS);
            Mutex::new(shard)
        };
        Self {
            len: paged.len,
            bytes: SHARDS * frames * PAGE_BYTES + 4 * n_pages,
            shards: (0..SHARDS).map(shard).collect(),
            _lease: lease,
        }
    }

    #[inline]
    pub(super) fn get(&self, i: usize) -> T {
        let (page, slot) = (i / per_page::<T>(), i % per_page::<T>());
        let shard = &self.shards[page % SHARDS];
        // A read that failed left the frames as they were.
        let mut shard = shard.lock().unwrap_or_else(PoisonError::into_inner);
        *shard.at(page / SHARDS * per_page::<T>() + slot)
    }
}

/// In a page's entry: it is in the file; without it all its records are the initial one.
const STORED: u32 = 1 << 31;
/// The rest of a page's entry: no frame has it.
const ABSENT: u32 = STORED - 1;
/// Of a frame: used since the clock's hand went by; differs from the file.
const USED: u8 = 1;
const DIRTY: u8 = 2;

/// An array in a file, read and written through frames that a clock hands round.
pub(super) struct PagedVec<T> {
    file: Arc<ScratchFile>,
    initial: T,
    /// Elements.
    pub len: usize,
    /// By page: its frame, and whether it is stored.
    table: Vec<u32>,
    frames: Vec<T>,
    frames_max: usize,
    /// By frame: the page in it, and flags.
    pages: Vec<(u32, u8)>,
    hand: usize,
    /// Page p of the table is page `first + step * p` of the file.
    first: usize,
    step: usize,
}

impl<T: Pod> PagedVec<T> {
    const PER: usize = per_page::<T>();

    pub fn new(dir: &DiskPath, initial: T, frames_max: usize) -> Self {
        let file = ScratchFile::create(dir).or_raise();
        Self::over(Arc::new(file), initial, frames_max)
    }

    fn over(file: Arc<ScratchFile>, initial: T, frames_max: usize) -> Self {
        Self {
            file,
            initial,
            len: 0,
            table: Vec::new(),
            frames: Vec::new(),
            frames_max,
            pages: Vec::new(),
            hand: 0,
            first: 0,
            step: 1,
        }
    }

    pub fn resize(&mut self, n: usize) {
        self.len = n;
        self.table.resize(n.div_ceil(Self::PER), ABSENT);
    }

    pub fn push(&mut self, value: T) {
        let i = self.len;
        self.resize(i + 1);
        *self.at_mut(i) = value;
    }

    pub fn fill(&mut self, value: T) {
        self.initial = value;
        self.table.fill(ABSENT);
        self.pages.clear();
        self.frames.clear();
        self.hand = 0;
    }

    #[inline]
    pub fn at(&mut self, i: usize) -> &T {
        let frame = self.frame(i / Self::PER);
        &self.frames[frame * Self::PER + i % Self::PER]
    }

    #[inline]
    pub fn at_mut(&mut self, i: usize) -> &mut T {
        let frame = self.frame(i / Self::PER);
        self.pages[frame].1 |= DIRTY;
        &mut self.frames[frame * Self::PER + i % Self::PER]
    }

    /// Copies a page to `out`, from its frame if it has one. `out` is empty or as long as a page. Unwinds when the scratch file fails.
    pub fn copy_page(&self, page: usize, out: &mut Vec<T>) {
        if out.is_empty() {
            out.resize(Self::PER, self.initial);
        }
        let frame = (self.table[page] & ABSENT) as usize;
        if frame != ABSENT as usize {
            out.copy_from_slice(&self.frames[frame * Self::PER..(frame + 1) * Self::PER]);
            return;
        }
        check_cancelled();
        match self.table[page] & STORED {
            0 => out.fill(self.initial),
            _ => self.file.read(self.offset(page), bytemuck::cast_slice_mut(out)).or_raise(),
        }
    }

    #[inline]
    fn frame(&mut self, page: usize) -> usize {
        let frame = self.table[page] & ABSENT;
        if frame == ABSENT {
            return self.load(page);
        }
        self.pages[frame as usize].1 |= USED;
        frame as usize
    }

    #[cold]
    #[inline(never)]
    fn load(&mut self, page: usize) -> usize {
        check_cancelled();
        let frame = self.free_frame();
        let range = frame * Self::PER..(frame + 1) * Self::PER;
        if self.table[page] & STORED != 0 {
            let at = self.offset(page);
            let bytes = bytemuck::cast_slice_mut(&mut self.frames[range]);
            self.file.read(at, bytes).or_raise();
        } else {
            self.frames[range].fill(self.initial);
        }
        self.pages[frame] = (page as u32, USED);
        self.table[page] = self.table[page] & STORED | frame as u32;
        frame
    }

    /// A frame that has no page.
    fn free_frame(&mut self) -> usize {
        if self.pages.len() < self.frames_max {
            let more = (self.pages.len() / 2).clamp(1, self.frames_max - self.pages.len());
            let n = self.pages.len() + 1;
            if self.frames.capacity() < n * Self::PER {
                reserve(&mut self.frames, more * Self::PER);
            }
            self.frames.resize(n * Self::PER, self.initial);
            self.pages.push((u32::MAX, 0));
            return n - 1;
        }
        loop {
            let frame = self.hand;
            self.hand = (self.hand + 1) % self.pages.len();
            if self.pages[frame].1 & USED == 0 {
                self.write_back(frame);
                self.table[self.pages[frame].0 as usize] |= ABSENT;
                return frame;
            }
            self.pages[frame].1 &= !USED;
        }
    }

    fn offset(&self, page: usize) -> u64 {
        ((self.first + self.step * page) * Self::PER * size_of::<T>()) as u64
    }

    fn write_back(&mut self, frame: usize) {
        let (page, flags) = self.pages[frame];
        if flags & DIRTY == 0 {
            return;
        }
        let at = self.offset(page as usize);
        let records = &self.frames[frame * Self::PER..(frame + 1) * Self::PER];
        self.file.write(at, bytemuck::cast_slice(records)).or_raise();
        self.pages[frame].1 &= !DIRTY;
        self.table[page as usize] |= STORED;
    }

    fn flush(&mut self) {
        (0..self.pages.len()).for_each(|frame| self.write_back(frame));
    }
}
