//! How much memory the frames take.

use super::{BATCH_PAGES_MAX, DIRTY, NO_OWNER, Pager, frames_of, zeroed};
use crate::storage::page_files::{Backing, PageFiles};
use crate::storage::page_table::PageTable;
use tetdb_schema::page::{FRAME_BYTES, SLOTS};

impl Pager {
    /// Limits the frames to `bytes`, which must suffice for the frames in use and cannot exceed the initial size.
    pub fn limit(&mut self, bytes: u64) {
        let limit = frames_of(bytes).min(self.frames.len() / SLOTS);
        assert!(self.owners.len() <= limit, "more frames than it may use");
        (self.frames_max, self.frames_limit) = (limit, limit);
    }

    /// [`Pager::limit`], and gives a pool that was created without one a place for pages that leave memory.
    pub fn limit_with_backing(&mut self, bytes: u64, backing: Backing) {
        assert!(!self.files.exist(), "its pages would be in two places");
        self.limit(bytes);
        self.files = PageFiles::new(Some(backing));
    }

    /// Bytes that all pages take in memory, at most what they may use; and that.
    pub(super) fn bytes_of_pages(&self) -> [u64; 2] {
        let n_pages: usize = self.tables.iter().map(PageTable::len).sum();
        [n_pages.min(self.frames_max), self.frames_max].map(|n| (n * FRAME_BYTES) as u64)
    }

    /// See [`Pages::use_at_most`](crate::storage::Pages::use_at_most).
    pub(super) fn limit_for_a_while(&mut self, bytes: u64) {
        if !self.files.exist() {
            return;
        }
        let frames = frames_of(bytes).min(self.frames_limit);
        if frames < self.owners.len() {
            self.leave_memory();
        }
        self.frames_max = frames;
    }

    /// Writes every page that is not elsewhere, and gives all frames back to the system.
    fn leave_memory(&mut self) {
        let mut dirty = Vec::new();
        for frame in 0..self.owners.len() as u32 {
            if self.owners[frame as usize] == NO_OWNER || self.entry(frame) & DIRTY == 0 {
                continue;
            }
            if self.is_output(frame) {
                dirty.push(frame);
            } else {
                self.spill(frame);
            }
        }
        dirty.sort_unstable_by_key(|&frame| self.owners[frame as usize]);
        for batch in dirty.chunks(BATCH_PAGES_MAX) {
            self.write_back(batch);
        }
        for frame in 0..self.owners.len() as u32 {
            if self.owners[frame as usize] != NO_OWNER {
                let place = self.place(frame);
                self.set_entry(frame, place);
            }
        }
        self.owners.clear();
        self.order.clear();
        self.free.clear();
        let n = self.frames.len();
        self.frames = Vec::new();
        self.frames = zeroed(n);
    }
}
