//! The place of each page of one kind: a frame or a file.

use tetdb_schema::page::{SLOT_BITS, SLOT_MASK};

pub(super) const RESIDENT: u32 = 1 << 31;
pub(super) const REFERENCED: u32 = 1 << 30;
pub(super) const DIRTY: u32 = 1 << 29;
const FRAME_MASK: u32 = DIRTY - 1;
/// An entry with these flags can be read at once, and with [`DIRTY`] changed at once.
const READABLE: u32 = RESIDENT | REFERENCED;
/// Entries of pages that are not resident: in the base file, in the output file, or from here on in the scratch file.
pub(super) const IN_BASE: u32 = 0;
pub(super) const IN_OUTPUT: u32 = 1;
pub(super) const IN_SPILL: u32 = 2;
/// Begin of the frame of a page that cannot be accessed at once: beyond every pool.
const BEYOND: u32 = !SLOT_MASK;
/// Frames whose slots all have a position below [`BEYOND`]: 128 GiB.
pub(super) const FRAMES_LIMIT: usize = (BEYOND >> SLOT_BITS) as usize;

/// Low bit of a quick word whose page must not be changed yet.
const CLEAN: u32 = 1;

/// One entry per page, and the quick words of the hot path.
#[derive(Default)]
pub(super) struct PageTable {
    /// Resident frame with flags, or where the page is.
    entries: Vec<u32>,
    /// First slot of the page if it may be read at once, else [`BEYOND`]; with [`CLEAN`] if it may not be changed at
    /// once. Four bytes a page: the words of a few thousand pages stay in the fastest cache.
    quick: Vec<u32>,
}

impl PageTable {
    /// `n` pages in the base file.
    pub fn in_base(n: usize) -> Self {
        Self { entries: vec![IN_BASE; n], quick: vec![BEYOND | CLEAN; n] }
    }

    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Position in the pool of record `id`, beyond it when its page may not be read at once.
    #[inline(always)]
    pub fn to_read(&self, id: u32) -> usize {
        let quick = self.quick[(id >> SLOT_BITS) as usize];
        (quick & !SLOT_MASK | id & SLOT_MASK) as usize
    }

    /// Position in the pool of record `id`, beyond it when its page may not be changed at once.
    #[inline(always)]
    pub fn to_write(&self, id: u32) -> usize {
        let quick = self.quick[(id >> SLOT_BITS) as usize];
        if quick & CLEAN != 0 {
            return usize::MAX;
        }
        (quick | id & SLOT_MASK) as usize
    }

    pub fn entry(&self, page: u32) -> u32 {
        self.entries[page as usize]
    }

    pub fn set(&mut self, page: u32, entry: u32) {
        let first = match entry & READABLE {
            READABLE => (entry & FRAME_MASK) << SLOT_BITS,
            _ => BEYOND,
        };
        let clean = if first == BEYOND || entry & DIRTY == 0 { CLEAN } else { 0 };
        self.entries[page as usize] = entry;
        self.quick[page as usize] = first | clean;
    }

    /// Lets every page be read at once; `false` when one is not in memory.
    pub fn make_readable(&mut self) -> bool {
        for page in 0..self.entries.len() {
            let entry = self.entries[page];
            if entry & RESIDENT == 0 {
                return false;
            }
            if entry & REFERENCED == 0 {
                self.set(page as u32, entry | REFERENCED);
            }
        }
        true
    }

    /// Adds a page at the end.
    pub fn push(&mut self, entry: u32) {
        self.entries.push(IN_BASE);
        self.quick.push(BEYOND | CLEAN);
        self.set(self.entries.len() as u32 - 1, entry);
    }

    /// Forgets the first `n` pages; returns their frames.
    pub fn drop_front(&mut self, n: usize) -> Vec<u32> {
        self.quick.drain(..n);
        self.entries.drain(..n).filter_map(frame_of).collect()
    }

    /// The frames of all resident pages.
    pub fn frames(&self) -> Vec<u32> {
        self.entries.iter().copied().filter_map(frame_of).collect()
    }
}

/// The frame of an entry, if its page is resident.
pub(super) fn frame_of(entry: u32) -> Option<u32> {
    (entry & RESIDENT != 0).then_some(entry & FRAME_MASK)
}
