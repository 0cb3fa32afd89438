//! The frame pool: pages resident in memory, the rest in the sub-domain's file.
//!
//! The hot path reads one word, where the page's frame begins, adds the slot, and is within the pool or not: a page
//! that needs anything first has a beginning beyond it. It touches no list. Recency is one bit of the
//! page's entry, set by the first access after it was cleared. The `lru` crate orders frames
//! only when a page is missed: the least recent frame without the bit is evicted, one with the bit is
//! given a second chance. A list touched at each change of page costs 70 % (measured), a bit a few.

mod memory;

use lru::LruCache;
use tetdb_schema::page::{FRAME_BYTES, PageAddress, SLOT_BITS, SLOTS, Slot, u32_le};

use super::page_files::{Backing, PageFiles};
use super::page_table::{
    DIRTY, FRAMES_LIMIT, IN_BASE, IN_OUTPUT, PageTable, REFERENCED, RESIDENT, frame_of,
};
use super::{DiskPath, OrRaise, Pages, SharedPages, StorageError, check_cancelled, kind, raise};

/// Dirty pages written in one commit; a quarter of redb's cache.
const BATCH_PAGES_MAX: usize = 256;
/// Owner of a frame that holds no page.
const NO_OWNER: (u8, u32) = (u8::MAX, u32::MAX);
const FRAMES_MIN: usize = 16;

/// Page traffic so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PagerStats {
    /// Pages that came from a file.
    pub pages_read: u64,
    /// Pages that went to a file.
    pub pages_written: u64,
    /// Transactions of redb.
    pub commits: u64,
}

impl PagerStats {
    /// Adds the traffic of another pager.
    pub fn add(&mut self, other: Self) {
        self.pages_read += other.pages_read;
        self.pages_written += other.pages_written;
        self.commits += other.commits;
    }
}

/// Pages of one sub-domain under a fixed number of frames.
///
/// Is not: shared. Each worker owns its pager, so the hot path takes no lock.
pub struct Pager {
    /// `frames_max * SLOTS` slots, zero until a frame is taken: memory that is not touched is not there.
    frames: Vec<Slot>,
    frames_max: usize,
    /// The most `frames_max` may be, but for a while.
    frames_limit: usize,
    free: Vec<u32>,
    tables: [PageTable; kind::ALL.len()],
    /// Number in the file of each kind's first page; grows when pages are dropped from the front.
    first: [u32; kind::ALL.len()],
    /// Kind and page of each frame, or [`NO_OWNER`].
    owners: Vec<(u8, u32)>,
    order: LruCache<u32, ()>,
    files: PageFiles,
    stats: PagerStats,
}

/// Frames in a pool of `bytes`.
fn frames_of(bytes: u64) -> usize {
    usize::try_from(bytes / FRAME_BYTES as u64)
        .unwrap_or(usize::MAX)
        .clamp(FRAMES_MIN, FRAMES_LIMIT)
}

/// Slots of frames, which are there when they are touched.
fn zeroed(n: usize) -> Vec<Slot> {
    bytemuck::allocation::try_zeroed_vec(n).unwrap_or_else(|()| {
        raise(StorageError::NoMemory { bytes: (n * size_of::<Slot>()) as u64 })
    })
}

impl Pager {
    /// A pool of `bytes / 64 KiB` frames (at least 16) over `backing`; without one, more pages than frames are an error.
    pub fn new(bytes: u64, backing: Option<Backing>) -> Self {
        let frames_max = frames_of(bytes);
        Self {
            frames: zeroed(frames_max * SLOTS),
            frames_max,
            frames_limit: frames_max,
            free: Vec::new(),
            tables: Default::default(),
            first: Default::default(),
            owners: Vec::new(),
            order: LruCache::unbounded(),
            files: PageFiles::new(backing),
            stats: PagerStats::default(),
        }
    }

    /// Reads and writes so far.
    pub fn stats(&self) -> PagerStats {
        self.stats
    }

    /// Frames touched so far.
    pub fn frames_used(&self) -> usize {
        self.owners.len()
    }

    /// Sets the pages of the base file: [`Pager::extents`] of the pager that wrote it.
    pub fn adopt(&mut self, extents: [[u32; 2]; kind::ALL.len()]) {
        for (kind, [first, n]) in extents.into_iter().enumerate() {
            self.first[kind] = first;
            self.tables[kind] = PageTable::in_base(n as usize);
        }
    }

    /// Number in the file of the first page of each kind, and how many there are.
    pub fn extents(&self) -> [[u32; 2]; kind::ALL.len()] {
        std::array::from_fn(|kind| [self.first[kind], self.tables[kind].len() as u32])
    }

    /// Address of a page.
    fn address(&self, kind: usize, page: u32) -> PageAddress {
        PageAddress {
            kind: kind::ALL[kind],
            subdomain: self.files.subdomain(),
            page: self.first[kind] + page,
        }
    }

    /// Writes every dirty page to the output file, and closes it. Returns the traffic of all. Unwinds on errors.
    pub fn finish(mut self) -> PagerStats {
        let mut dirty: Vec<u32> = (0..self.owners.len() as u32)
            .filter(|&frame| self.is_output(frame) && self.entry(frame) & DIRTY != 0)
            .collect();
        dirty.sort_unstable_by_key(|&frame| self.owners[frame as usize]);
        for batch in dirty.chunks(BATCH_PAGES_MAX) {
            self.write_back(batch);
        }
        self.stats
    }

    /// Ends a generation: writes all pages, wherever they are, to a file at `path` and goes on from it, as `generation`.
    ///
    /// The file is closed after writing: once the catalog lists it, it is never written again, not even by redb on
    /// closing. Such a write would not be synced, and a loss of power could tear the file. Unwinds on errors.
    pub fn end_generation(&mut self, path: DiskPath, generation: u32) {
        self.files.begin_file(path);
        assert_eq!(self.tables[kind::SCRATCH].len(), 0, "a map of this step");
        let n_batch = (self.frames_max / 4).clamp(1, BATCH_PAGES_MAX);
        let mut batch = Vec::with_capacity(n_batch);
        for kind in 0..self.tables.len() {
            for page in 0..self.tables[kind].len() as u32 {
                // Evicted pages are written already.
                if self.tables[kind].entry(page) == IN_OUTPUT {
                    continue;
                }
                batch.push(self.fault_in(kind, page));
                if batch.len() == n_batch {
                    self.write_back(&batch);
                    batch.clear();
                }
            }
        }
        self.write_back(&batch);
        self.files.end_file(generation).or_raise();
        for table in &mut self.tables {
            for page in 0..table.len() as u32 {
                if table.entry(page) & RESIDENT == 0 {
                    table.set(page, IN_BASE);
                }
            }
        }
        for frame in 0..self.owners.len() as u32 {
            self.set_place(frame, IN_BASE);
        }
    }

    /// Makes a page the most recent one and returns its frame.
    fn fault_in(&mut self, kind: usize, page: u32) -> u32 {
        let entry = self.tables[kind].entry(page);
        let entry = match frame_of(entry) {
            Some(frame) => {
                self.order.put(frame, ());
                entry | REFERENCED
            }
            None => self.load(kind, page, entry),
        };
        self.tables[kind].set(page, entry);
        frame_of(entry).expect("resident")
    }

    /// The entry of the page in `frame`.
    fn entry(&self, frame: u32) -> u32 {
        let (kind, page) = self.owners[frame as usize];
        self.tables[usize::from(kind)].entry(page)
    }

    fn set_entry(&mut self, frame: u32, entry: u32) {
        let (kind, page) = self.owners[frame as usize];
        self.tables[usize::from(kind)].set(page, entry);
    }

    fn frame(&mut self, frame: u32) -> &mut [Slot] {
        let at = frame as usize * SLOTS;
        &mut self.frames[at..at + SLOTS]
    }

    /// Makes the page of `id` readable (or writable) and returns the position of `id` in the pool.
    #[cold]
    #[inline(never)]
    fn open_slow<const K: usize>(&mut self, id: u32, flags: u32) -> usize {
        let page = id >> SLOT_BITS;
        let entry = self.tables[K].entry(page);
        let opened =
            if entry & RESIDENT != 0 { entry | flags } else { self.load(K, page, entry) | flags };
        self.tables[K].set(page, opened);
        self.tables[K].to_read(id)
    }

    /// Makes the pages of four records readable together and returns the positions of the records.
    #[cold]
    #[inline(never)]
    fn open_four_slow<const K: usize>(&mut self, ids: [u32; 4]) -> [usize; 4] {
        // One may push another out only while the bits of recency are taken down all around, which happens once.
        for _ in 0..ids.len() {
            for id in ids {
                self.open_slow::<K>(id, REFERENCED);
            }
            let at = ids.map(|id| self.tables[K].to_read(id));
            if at.iter().all(|&at| at < self.frames.len()) {
                return at;
            }
        }
        unreachable!("a pool of {} frames holds four pages", self.frames_max)
    }

    fn load(&mut self, kind: usize, page: u32, place: u32) -> u32 {
        check_cancelled();
        let (frame, _) = self.take_frame();
        let address = self.address(kind, page);
        let at = frame as usize * SLOTS;
        let slots = &mut self.frames[at..at + SLOTS];
        self.files.read(place, address, slots).or_raise();
        self.stats.pages_read += 1;
        self.set_place(frame, place);
        self.owners[frame as usize] = (kind as u8, page);
        self.order.put(frame, ());
        frame | RESIDENT | REFERENCED
    }

    /// A frame without a page: a free one, a fresh one (which is zero), or an evicted one.
    fn take_frame(&mut self) -> (u32, bool) {
        if let Some(frame) = self.free.pop() {
            return (frame, false);
        }
        if self.owners.len() < self.frames_max {
            let frame = self.owners.len() as u32;
            self.owners.push(NO_OWNER);
            return (frame, true);
        }
        (self.evict(), false)
    }

    fn evict(&mut self) -> u32 {
        let frame = loop {
            let (frame, ()) = self.order.pop_lru().expect("frames in use are ordered");
            let entry = self.entry(frame);
            if entry & REFERENCED == 0 {
                break frame;
            }
            self.set_entry(frame, entry & !REFERENCED);
            self.order.put(frame, ());
        };
        if self.entry(frame) & DIRTY != 0 {
            if self.is_output(frame) {
                let mut batch = vec![frame];
                batch.extend(self.cold_dirty_frames());
                batch.sort_unstable_by_key(|&f| self.owners[f as usize]);
                self.write_back(&batch);
            } else {
                self.spill(frame);
            }
        }
        let place = self.place(frame);
        self.set_entry(frame, place);
        frame
    }

    /// Returns whether the page in `frame` belongs to the output file.
    fn is_output(&self, frame: u32) -> bool {
        let owner = self.owners[frame as usize];
        owner != NO_OWNER && self.files.goes_to_output(usize::from(owner.0))
    }

    /// The next eviction candidates that must be written, so that one commit serves many misses.
    fn cold_dirty_frames(&self) -> Vec<u32> {
        let n = (self.frames_max / 4).clamp(1, BATCH_PAGES_MAX - 1);
        let cold = self.order.iter().rev().map(|(&frame, ())| frame);
        cold.filter(|&frame| {
            self.entry(frame) & (REFERENCED | DIRTY) == DIRTY && self.is_output(frame)
        })
        .take(n)
        .collect()
    }

    /// Writes a page to the spill.
    fn spill(&mut self, frame: u32) {
        if !self.files.exist() {
            raise(StorageError::Budget {
                what: "a mesh without a store",
                needed: (self.owners.len() as u64 + 1) * FRAME_BYTES as u64,
                available: self.frames_max as u64 * FRAME_BYTES as u64,
            });
        }
        let (address, place) = (self.address_of(frame), self.place(frame));
        let at = frame as usize * SLOTS;
        let slots = &mut self.frames[at..at + SLOTS];
        let place = self.files.spill(place, address, slots).or_raise();
        self.stats.pages_written += 1;
        self.mark_clean_at(frame, place);
    }

    /// Writes pages to the output file, in one commit.
    fn write_back(&mut self, batch: &[u32]) {
        for &frame in batch {
            let address = self.address_of(frame);
            let at = frame as usize * SLOTS;
            self.files.seal(address, &mut self.frames[at..at + SLOTS]);
        }
        let addresses: Vec<PageAddress> = batch.iter().map(|&f| self.address_of(f)).collect();
        let frames = &self.frames;
        let pages = addresses.into_iter().zip(batch).map(|(address, &frame)| {
            let at = frame as usize * SLOTS;
            (address, &frames[at..at + SLOTS])
        });
        self.files.write(pages).or_raise();
        self.stats.pages_written += batch.len() as u64;
        self.stats.commits += 1;
        for &frame in batch {
            self.mark_clean_at(frame, IN_OUTPUT);
        }
    }

    /// Address of the page in `frame`.
    fn address_of(&self, frame: u32) -> PageAddress {
        let (kind, page) = self.owners[frame as usize];
        self.address(usize::from(kind), page)
    }

    /// The page in `frame` is at `place` as it is.
    fn mark_clean_at(&mut self, frame: u32, place: u32) {
        self.set_entry(frame, self.entry(frame) & !DIRTY);
        self.set_place(frame, place);
    }

    /// The slot that no file counts on remembers where the page is when it is clean.
    fn set_place(&mut self, frame: u32, place: u32) {
        self.frame(frame)[SLOTS - 1][0] = u32_le::from_native(place);
    }

    fn place(&mut self, frame: u32) -> u32 {
        self.frame(frame)[SLOTS - 1][0].to_native()
    }
}

impl Pages for Pager {
    #[inline(always)]
    fn read<const K: usize>(&mut self, id: u32) -> &Slot {
        let at = self.tables[K].to_read(id);
        if at < self.frames.len() {
            return &self.frames[at];
        }
        let at = self.open_slow::<K>(id, REFERENCED);
        &self.frames[at]
    }

    #[inline(always)]
    fn read_four<const K: usize>(&mut self, ids: [u32; 4]) -> [&Slot; 4] {
        let table = &self.tables[K];
        let (a, b) = (table.to_read(ids[0]), table.to_read(ids[1]));
        let (c, d) = (table.to_read(ids[2]), table.to_read(ids[3]));
        let n = self.frames.len();
        if a < n && b < n && c < n && d < n {
            let frames = &self.frames;
            return [&frames[a], &frames[b], &frames[c], &frames[d]];
        }
        let [a, b, c, d] = self.open_four_slow::<K>(ids);
        let frames = &self.frames;
        [&frames[a], &frames[b], &frames[c], &frames[d]]
    }

    #[inline(always)]
    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot {
        let at = self.tables[K].to_write(id);
        if at < self.frames.len() {
            return &mut self.frames[at];
        }
        let at = self.open_slow::<K>(id, REFERENCED | DIRTY);
        &mut self.frames[at]
    }

    fn n_pages<const K: usize>(&self) -> u32 {
        self.tables[K].len() as u32
    }

    fn append_page<const K: usize>(&mut self) -> u32 {
        check_cancelled();
        let (frame, is_zero) = self.take_frame();
        if !is_zero {
            self.frame(frame).fill([u32_le::from_native(0); 8]);
        }
        let page = self.tables[K].len() as u32;
        self.tables[K].push(frame | RESIDENT | REFERENCED | DIRTY);
        self.owners[frame as usize] = (K as u8, page);
        self.order.put(frame, ());
        page
    }

    fn drop_front<const K: usize>(&mut self, n: u32) {
        self.forget(K, n);
        let dropped = self.tables[K].drop_front(n as usize);
        self.release(dropped);
        self.first[K] += n;
        for (_, page) in self.owners.iter_mut().filter(|(kind, _)| usize::from(*kind) == K) {
            *page -= n;
        }
    }

    fn clear<const K: usize>(&mut self) {
        self.forget(K, self.n_pages::<K>());
        let dropped = std::mem::take(&mut self.tables[K]).frames();
        self.release(dropped);
    }

    fn bytes_used(&self) -> Option<[u64; 2]> {
        Some(self.bytes_of_pages())
    }

    fn use_at_most(&mut self, bytes: u64) {
        self.limit_for_a_while(bytes);
    }

    fn shared(&mut self) -> Option<SharedPages<'_>> {
        let mut all = self.tables.iter_mut().all(PageTable::make_readable);
        if !all && self.load_all() {
            all = self.tables.iter_mut().all(PageTable::make_readable);
        }
        all.then(|| SharedPages::new(&self.frames, &self.tables))
    }
}

impl Pager {
    /// Loads all pages that are not in memory, such as pages of a newly opened mesh. `false` if there are too few
    /// frames.
    fn load_all(&mut self) -> bool {
        let pages: usize = self.tables.iter().map(PageTable::len).sum();
        if pages > self.frames_max {
            return false;
        }
        for kind in 0..self.tables.len() {
            for page in 0..self.tables[kind].len() as u32 {
                self.fault_in(kind, page);
            }
        }
        true
    }

    /// Leaves the places of the first `n` pages of a kind in the spill to others.
    fn forget(&mut self, kind: usize, n: u32) {
        assert!(!self.files.goes_to_output(kind), "written once, and kept");
        for page in 0..n {
            let entry = self.tables[kind].entry(page);
            let place = frame_of(entry).map_or(entry, |frame| self.place(frame));
            self.files.forget(place);
        }
    }

    /// Gives the frames of forgotten pages back.
    fn release(&mut self, frames: Vec<u32>) {
        for frame in frames {
            self.order.pop(&frame);
            self.owners[frame as usize] = NO_OWNER;
            self.free.push(frame);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::StoreFile;

    const PER_PAGE: u32 = 1 << SLOT_BITS;

    fn fill(pager: &mut Pager, first: u32, n: u32) {
        for page in first..first + n {
            let page = match page {
                page if page < pager.n_pages::<{ kind::TETS }>() => page,
                _ => pager.append_page::<{ kind::TETS }>(),
            };
            pager.write::<{ kind::TETS }>(page * PER_PAGE)[0] = u32_le::from_native(page);
        }
    }

    /// Threads may read all pages of a mesh opened from its file, if all pages fit.
    #[test]
    fn pages_of_a_file_are_shared_where_they_fit() -> Result<(), Box<dyn std::error::Error>> {
        const N: u32 = 24;
        let dir = tempfile::tempdir()?;
        let path: DiskPath = dir.path().join("pages").into();
        let backing = |generation, base| Backing {
            subdomain: 0,
            generation,
            spill: dir.path().into(),
            output: None,
            base,
            cache_bytes: 1 << 20,
        };
        let frames = |n: u32| u64::from(n) * FRAME_BYTES as u64;
        let mut pager = Pager::new(frames(N), Some(backing(1, None)));
        fill(&mut pager, 0, N);
        let extents = pager.extents();
        pager.end_generation(path.clone(), 2);
        for (n, fit) in [(N - 1, false), (N, true)] {
            let base = StoreFile::open_repaired(&path, 1 << 20, false)?;
            let mut pager = Pager::new(frames(n), Some(backing(2, Some(base))));
            pager.adopt(extents);
            pager.read::<{ kind::TETS }>(3 * PER_PAGE);
            let Some(shared) = pager.shared() else {
                assert!(!fit, "{n} frames");
                continue;
            };
            assert!(fit, "{n} frames");
            for page in 0..N {
                let found = shared.read_of(kind::TETS, page * PER_PAGE)[0].to_native();
                assert_eq!(found, page);
            }
        }
        Ok(())
    }

    /// Pages written behind the old ones, which are then dropped, take their places: files never hold more than both.
    #[test]
    fn files_hold_no_pages_that_were_dropped() -> Result<(), Box<dyn std::error::Error>> {
        const N: u32 = 400;
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("pages");
        let backing = Backing {
            subdomain: 0,
            generation: 1,
            spill: dir.path().into(),
            output: None,
            base: None,
            cache_bytes: 1 << 20,
        };
        let mut pager = Pager::new(32 * FRAME_BYTES as u64, Some(backing));
        fill(&mut pager, 0, N);
        let once = u64::from(N) * FRAME_BYTES as u64;
        for _ in 0..6 {
            fill(&mut pager, N, N);
            pager.drop_front::<{ kind::TETS }>(N);
            // A map that comes and goes, as long as half of the pages.
            for _ in 0..N / 2 {
                pager.append_page::<{ kind::SCRATCH }>();
            }
            pager.clear::<{ kind::SCRATCH }>();
            assert!((1..=2 * N + N / 2).contains(&pager.files.spilled()));
        }
        pager.end_generation(path.clone().into(), 2);
        let kept = std::fs::metadata(&path)?.len();
        assert!(kept < once + once / 8, "{kept} for {once}");
        for page in 0..N {
            let found = pager.read::<{ kind::TETS }>(page * PER_PAGE)[0].to_native();
            assert_eq!(found, page + N);
        }
        Ok(())
    }
}
