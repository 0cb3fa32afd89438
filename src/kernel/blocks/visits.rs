//! Visits of blocks: what is done with one while nobody else has its bricks.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use super::brick::Bricks;
use super::divide::Divider;
use super::field::Field;
use super::improve;
use super::memory::Memory;
use super::partition::{Block, KdPartition};
use super::region::Region;
use super::report::BlockReport;
use super::smooth::Smoother;
use super::tasks::Graph;
use crate::mesh::Tet;
use crate::mesh::anatomy::MARK;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::optimize::Mode;

/// The first visit of a block, which divides it. Each visit has the margin in that place of `MARGINS`.
pub(super) const DIVIDE: usize = 0;
/// The second, which smooths and improves it.
pub(super) const SMOOTH: usize = 1;

/// Rings of bricks, each those that the bricks before refer to, around what was put off by all blocks.
const RINGS: [u32; 4] = [1, 2, 4, 8];
/// No further ring is begun with so many bricks: the region would be several times that of a visit.
const RING_BRICKS_MAX: usize = 1_024;

/// All that visits share.
pub(super) struct Visits<'a> {
    pub partition: KdPartition,
    pub field: &'a Field<'a>,
    pub mode: Mode,
    pub bricks: Bricks,
    pub report: Mutex<BlockReport>,
    /// Loads of all visits that are over, but for those that wait.
    pub done: AtomicU64,
    /// Blocks whose second visit waits until all is divided.
    pub left: Vec<AtomicBool>,
    /// [`super::brick::Brick::unexamined`] of each brick since its last visit: bricks need not be in memory to be asked.
    pub unexamined: Vec<AtomicU32>,
}

/// Scratch of a thread.
pub(super) struct Visitor {
    region: Region,
    divider: Divider,
    smoother: Smoother,
}

impl Visitor {
    pub fn new() -> Self {
        Self { region: Region::default(), divider: Divider::new(), smoother: Smoother::new() }
    }
}

impl Visits<'_> {
    /// Does all visits of some phases; of the last ones, only those that wait. `progress` receives predicted tetrahedra: those done, and all.
    pub fn run(
        &self,
        phases: Range<usize>,
        is_last: bool,
        memory: &Memory,
        progress: &mut dyn FnMut(u64, u64),
    ) {
        let mut graph = Graph::new(&self.partition, phases);
        if memory.bricks < usize::MAX {
            graph.go_along_the_tree();
        }
        let visit = |visitor: &mut Visitor, task| {
            let (phase, block) = graph.visit(task);
            if is_last && !self.is_left(block) {
                return;
            }
            self.visit(visitor, phase, block, is_last);
            if is_last || phase == DIVIDE || !self.is_left(block) {
                let load = self.partition.blocks[block].load as u64;
                self.done.fetch_add(load, Ordering::Relaxed);
            }
        };
        let n_visits = if self.mode == Mode::None { 1.0 } else { 2.0 };
        let load = self.partition.load();
        let mut told = || {
            let done = self.done.load(Ordering::Relaxed) as f64 / n_visits;
            progress(done.min(load) as u64, load as u64);
        };
        graph.run(memory.threads, &Visitor::new, &visit, &mut told);
        // The last tasks may have been other threads'.
        told();
    }

    /// Visits a block; `is_last` tells whether nothing more will be divided.
    pub fn visit(&self, visitor: &mut Visitor, phase: usize, id: usize, is_last: bool) {
        let block = &self.partition.blocks[id];
        let numbers = &block.regions[phase];
        let is_own = |b| block.bricks.contains(&b);
        self.within(visitor, numbers, is_own, |visitor, is_own, own| {
            let color = |b: u32| self.partition.blocks[self.partition.owner(b) as usize].color;
            let is_left = |b| self.is_left(self.partition.owner(b) as usize);
            // What a block could not do, for want of margin, those do that come later.
            let is_before = |b| color(b) < block.color || is_last && !is_left(b);
            let is_due: Vec<bool> =
                (numbers.iter().zip(is_own)).map(|(&b, &is_own)| is_own || is_before(b)).collect();
            if phase == DIVIDE {
                self.divide(visitor, &is_due, own);
                return;
            }
            if self.n_unexamined(block) > 0 {
                self.divide(visitor, is_own, own);
            }
            // Flips would take tetrahedra that wait for a wider region for divided ones.
            if !is_last && visitor.region.mesh.has_unexamined() {
                self.left[id].store(true, Ordering::Relaxed);
                return;
            }
            visitor.smoother.smooth(&mut visitor.region, is_own);
            if self.mode == Mode::Full {
                let counts = improve::improve(&mut visitor.region, &self.partition, &is_due, own);
                self.report.lock().unwrap_or_else(PoisonError::into_inner).operations.add(&counts);
            }
        });
    }

    /// Runs `work` on the arrays of some bricks. Its arguments say which bricks are the block's own, and where the first of these is in the list.
    fn within(
        &self,
        visitor: &mut Visitor,
        numbers: &[u32],
        is_own: impl Fn(u32) -> bool,
        work: impl FnOnce(&mut Visitor, &[bool], u32),
    ) {
        let bricks = self.bricks.get_all(numbers);
        visitor.region.check_out(numbers, bricks, &mut |n| self.bricks.get(n));
        let is_own: Vec<bool> = numbers.iter().map(|&b| is_own(b)).collect();
        let own = is_own.iter().position(|&own| own).expect("its own bricks are among them") as u32;
        work(visitor, &is_own, own);
        debug_assert!(visitor.region.mesh.is_sound());
        let made = visitor.region.check_in(own);
        for (&number, brick) in numbers.iter().zip(&made) {
            self.unexamined[number as usize].store(brick.unexamined, Ordering::Relaxed);
        }
        self.bricks.put_all(numbers.iter().copied().zip(made));
    }

    /// Divides what no block could, in wider and wider regions. There is little of it, if any; returns how many tetrahedra are left.
    ///
    /// A point changes connected tetrahedra alone, so regions are grown from brick to brick. Margins in lengths would take the whole of a scan:
    /// where lengths grow from a fine surface inwards, much lies within a few of the lengths inside.
    pub fn finish_rest(&self) -> u64 {
        let mut visitor = Visitor::new();
        for rings in RINGS {
            for block in &self.partition.blocks {
                let left: Vec<u32> =
                    block.bricks.clone().filter(|&b| self.n_needed(b) > 0).collect();
                if left.is_empty() {
                    continue;
                }
                let is_left = |b: u32| left.binary_search(&b).is_ok();
                let numbers = self.rings_around(&left, rings);
                self.within(&mut visitor, &numbers, is_left, |visitor, is_own, own| {
                    let before = visitor.region.mesh.vertices.len() as u32;
                    self.divide(visitor, is_own, own);
                    for brick in visitor.region.bricks_around(before) {
                        let owner = self.partition.owner(brick) as usize;
                        self.left[owner].store(true, Ordering::Relaxed);
                    }
                });
            }
        }
        (0..self.partition.n_bricks() as u32).map(|b| self.n_needed(b)).sum()
    }

    /// Tetrahedra of a brick that are not examined, and that the field's place needs to be.
    fn n_needed(&self, number: u32) -> u64 {
        let n = u64::from(self.unexamined_in(number));
        if n == 0 || !self.field.place.is_partial() {
            return n;
        }
        let brick = self.bricks.get(number);
        let is_needed = |tet: &&Tet| {
            let corners = tet.vertices().map(|v| {
                let at = brick.resolve(v);
                self.bricks.get(at.brick).vertices[at.slot as usize]
            });
            self.field.place.needs(&corners.map(|v| v.point), &corners.map(|v| v.h()))
        };
        let waits = |tet: &&Tet| tet.is_live() && tet.node[EXAMINED] & MARK == 0;
        brick.tets.iter().filter(waits).filter(is_needed).count() as u64
    }

    /// These bricks and those around them, ascending.
    fn rings_around(&self, bricks: &[u32], rings: u32) -> Vec<u32> {
        let mut all = bricks.to_vec();
        let mut last = all.clone();
        for _ in 0..rings {
            if all.len() >= RING_BRICKS_MAX {
                break;
            }
            let mut next: Vec<u32> =
                last.iter().flat_map(|&b| self.bricks.get(b).near.clone()).collect();
            next.sort_unstable();
            next.dedup();
            next.retain(|b| all.binary_search(b).is_err());
            all.extend_from_slice(&next);
            all.sort_unstable();
            last = next;
        }
        all
    }

    /// True if a block's second visit waits.
    pub fn is_left(&self, block: usize) -> bool {
        self.left[block].load(Ordering::Relaxed)
    }

    pub fn is_any_left(&self) -> bool {
        (0..self.left.len()).any(|block| self.is_left(block))
    }

    /// Narrows the regions of second visits that wait to their blocks and the bricks next to them, and takes away those of the others.
    ///
    /// Where lengths grow steeply, as in parts with fine details, regions by lengths are several times a block, and all blocks would wait
    /// for each other. A first visit needs them for points that reach far; smoothing and mending need what is next to a tetrahedron alone.
    pub fn narrow(&mut self) {
        let n_bricks = self.partition.n_bricks() as u32;
        // Of two bricks that touch, one may refer to the other alone.
        let mut pairs = Vec::new();
        for b in 0..n_bricks {
            let near = &self.bricks.get(b).near;
            let both = near.iter().flat_map(|&to| [[b, to], [to, b]]);
            pairs.extend(both.filter(|&[b, _]| self.is_left(self.partition.owner(b) as usize)));
        }
        pairs.sort_unstable();
        pairs.dedup();
        let regions = self.partition.blocks.iter().enumerate().map(|(id, block)| {
            if !self.is_left(id) {
                return Vec::new();
            }
            let from = pairs.partition_point(|pair| pair[0] < block.bricks.start);
            let to = pairs.partition_point(|pair| pair[0] < block.bricks.end);
            let mut region: Vec<u32> = pairs[from..to].iter().map(|pair| pair[1]).collect();
            region.extend(block.bricks.clone());
            region.sort_unstable();
            region.dedup();
            region
        });
        let regions = regions.collect();
        self.partition.narrow(SMOOTH, regions);
    }

    fn n_unexamined(&self, block: &Block) -> u64 {
        block.bricks.clone().map(|b| u64::from(self.unexamined_in(b))).sum()
    }

    fn unexamined_in(&self, brick: u32) -> u32 {
        self.unexamined[brick as usize].load(Ordering::Relaxed)
    }

    fn divide(&self, visitor: &mut Visitor, is_due: &[bool], own: u32) {
        let Visitor { region, divider, .. } = visitor;
        let report = divider.divide(region, &self.partition, self.field, is_due, own);
        self.report.lock().unwrap_or_else(PoisonError::into_inner).refine.add(&report);
    }
}
