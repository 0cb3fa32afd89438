//! Saturation and smoothing in blocks, on all threads.
//!
//! 1. `scaffold`: no tetrahedron is left that would outreach a margin. A large void is first saturated at coarser lengths, by all these
//!    steps.
//! 2. `part`: where points go to a part of space alone, the rest of the mesh stays where it is.
//! 3. `partition`: a k-d tree over the predicted load. Leaves are bricks, which hold the mesh; subtrees are blocks.
//! 4. `tasks`: each block is visited twice, to be divided and to be smoothed. A visit checks the block and a margin out into plain
//!    arrays (`region`), works there (`divide`, `smooth`), and checks it in again.
//!
//! Each visit depends on the partition and on earlier visits alone, and their order is fixed. So the mesh depends neither on threads nor
//! on memory.

mod brick;
mod convert;
mod divide;
mod field;
mod finish;
mod flat;
mod improve;
mod insert;
mod lawson;
mod load;
mod part;
mod partition;
mod placement;
mod recent;
mod region;
mod report;
mod scaffold;
mod side_by_side;
mod smooth;
mod spawn;
mod tasks;

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::mesh::anatomy::MARK;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::{Mesh, Tet};
use crate::optimize::{Mode, OperationCounts};
use brick::Bricks;
use divide::Divider;
pub use field::Field;
pub use finish::{Finished, FinishedTet, FinishedVertex};
use part::Part;
use partition::{KdPartition, TOO_STEEP};
pub use placement::{Everywhere, PlacementRule};
use region::Region;
pub use report::RefineReport;
use scaffold::COARSER;
use smooth::Smoother;
use tasks::Graph;
use tetdb_base::storage::{DiskPath, Pages, StorageError, raise, spare_threads};

/// The first of two visits of a block; the second smooths and improves it. Each has the margin in that place of `MARGINS`.
const DIVIDE: usize = 0;

/// Counts of one saturation in blocks.
#[derive(Clone, Copy, Debug, Default)]
pub struct BlockReport {
    /// Points tried and inserted.
    pub refine: RefineReport,
    /// Operations on bad tetrahedra.
    pub operations: OperationCounts,
}

/// Fewest tetrahedra of the scaffold's lengths that are worth a saturation of their own.
const COARSE_TETS: f64 = 20_000.0;
/// Rings of bricks, each those that the bricks before refer to, around what was put off by all blocks.
const RINGS: [u32; 4] = [1, 2, 4, 8];
/// Rings of tetrahedra around what a partial field reaches; more if something in the middle could not be divided for want of them.
const PART_RINGS: [u32; 3] = [3, 8, 24];
/// No further ring is begun with so many bricks: the region would be several times that of a visit.
const RING_BRICKS_MAX: usize = 1_024;

/// Divides tetrahedra until the mesh is saturated; smooths it unless `mode` is `None`, and improves bad tetrahedra if it is `Full`.
///
/// The mesh must hold filled regions only, sizes set at all its vertices. `dir` takes bricks that leave memory. `progress` receives the
/// number of vertices inserted so far. Effects: new vertices and tetrahedra; ids of tetrahedra change, those of vertices stay; `tet_of` is
/// not kept up. Unwinds with errors of the disk.
pub fn saturate<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    mode: Mode,
    dir: &DiskPath,
    progress: &mut dyn FnMut(u64),
) -> BlockReport {
    if !field.place.is_partial() {
        return saturate_all(mesh, field, mode, dir, progress).into_pages(mesh);
    }
    let mut report = BlockReport::default();
    for rings in PART_RINGS {
        let before = report.refine.inserted;
        let how = How { mode, is_final: true, rings: Some(rings) };
        let told = &mut |n| progress(before + n);
        let made = saturate_at(mesh, field, how, dir, told).into_pages(mesh);
        report.operations.add(&made.operations);
        report.refine.add(&made.refine);
        report.refine.unexamined = made.refine.unexamined;
        if report.refine.unexamined == 0 {
            break;
        }
    }
    report
}

/// Like [`saturate`] without bounds, for a mesh that is sealed next: where nothing is to be mended it stays in bricks, and `mesh` has
/// vertices, facets and faces of interfaces alone.
pub fn saturate_to_seal<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    mode: Mode,
    dir: &DiskPath,
    progress: &mut dyn FnMut(u64),
) -> (BlockReport, Option<Finished>) {
    let mut saturated = saturate_all(mesh, field, mode, dir, progress);
    let Some(look) = finish::look(&saturated.bricks, saturated.n_bricks) else {
        return (saturated.into_pages(mesh), None);
    };
    saturated.report.refine.over_constrained = look.over_constrained;
    let finished = Finished::new(saturated.bricks, saturated.n_bricks, look);
    (saturated.report, Some(finished))
}

/// Saturates the whole mesh, at coarser lengths first where it is a large void.
fn saturate_all<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    mode: Mode,
    dir: &DiskPath,
    progress: &mut dyn FnMut(u64),
) -> Saturated {
    let load = load::predict(mesh, field);
    load::check(load.tets);
    let is_void = load.in_voids > COARSE_TETS.max(f64::from(mesh.n_tets()));
    let coarser = if is_void { saturate_coarser(mesh, field, dir) } else { 0 };
    let how = How { mode, is_final: true, rings: None };
    let mut made = saturate_at(mesh, field, how, dir, &mut |n| progress(coarser + n));
    made.report.refine.inserted += coarser;
    made
}

/// A mesh, or a part of it, in bricks; the pages have the rest.
struct Saturated {
    bricks: Bricks,
    n_bricks: u32,
    part: Option<Part>,
    /// Bytes of bricks and pages while the one becomes the other.
    memory: [u64; 2],
    report: BlockReport,
}

impl Saturated {
    /// Puts all tetrahedra into pages.
    fn into_pages<P: Pages>(mut self, mesh: &mut Mesh<P>) -> BlockReport {
        let [bricks, pages] = self.memory;
        self.bricks.limit(bricks as usize);
        mesh.pages_mut().use_at_most(pages);
        let is_whole = self.part.is_none();
        let over_constrained = convert::to_pages(&self.bricks, self.n_bricks, mesh, self.part);
        mesh.pages_mut().use_at_most(u64::MAX);
        if is_whole {
            self.report.refine.over_constrained = over_constrained;
        }
        self.report
    }
}

/// Settings of one saturation.
#[derive(Clone, Copy)]
struct How {
    mode: Mode,
    /// True if tetrahedra that no block could divide are tried again in wider regions.
    is_final: bool,
    /// Rings of tetrahedra around a part; `None` for the whole mesh.
    rings: Option<u32>,
}

/// Scaffold, partition, visits.
fn saturate_at<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    How { mode, is_final, rings }: How,
    dir: &DiskPath,
    progress: &mut dyn FnMut(u64),
) -> Saturated {
    let scaffold = scaffold::build(mesh, field);
    let part = rings.map(|rings| Part::around(mesh, field, rings));
    if let Some([_, most]) = mesh.pages().bytes_used() {
        // Pages make room for the samples, and for what is sorted of them.
        let rest = most.saturating_sub(2 * load::SAMPLES_BYTES).max(most / 2);
        mesh.pages_mut().use_at_most(rest);
    }
    let samples = load::sample(mesh, field, part.as_ref());
    let partition = KdPartition::new(samples, field.bounds, field.h);
    mesh.pages_mut().use_at_most(u64::MAX);
    load::check(partition.load());
    let n_bricks = partition.n_bricks();
    let memory = Memory::of(mesh, &partition);
    let bricks = Bricks::new(n_bricks, memory.bricks / 2, Some(dir.clone()));
    mesh.pages_mut().use_at_most(memory.pages_at_first);
    convert::to_bricks(mesh, field, &partition, part.as_ref(), &bricks);
    if part.is_none() {
        mesh.clear_tets();
    }
    bricks.limit(memory.bricks);
    mesh.pages_mut().use_at_most(memory.pages);
    let mut graph = Graph::new(&partition, if mode == Mode::None { 1 } else { 2 });
    if memory.bricks < usize::MAX {
        graph.go_along_the_tree();
    }
    let visits = Visits {
        partition: &partition,
        field,
        mode,
        bricks,
        report: Mutex::new(BlockReport {
            refine: RefineReport { inserted: scaffold, ..RefineReport::default() },
            ..BlockReport::default()
        }),
        inserted: AtomicU64::new(scaffold),
        left: partition.blocks.iter().map(|_| AtomicBool::new(false)).collect(),
        unexamined: (0..n_bricks).map(|_| AtomicU32::new(0)).collect(),
    };
    let mut told = || progress(visits.inserted.load(Ordering::Relaxed));
    let visit = |visitor: &mut Visitor, task| {
        let (phase, block) = graph.visit(task);
        visits.visit(visitor, phase, block, false);
    };
    graph.run(memory.threads, &Visitor::new, &visit, &mut told);
    // Shorter lengths divide what coarser ones leave.
    let unexamined = if is_final { visits.finish_rest() } else { 0 };
    if mode != Mode::None && visits.left.iter().any(|left| left.load(Ordering::Relaxed)) {
        let visit = |visitor: &mut Visitor, task| match graph.visit(task) {
            (DIVIDE, _) => {}
            (_, block) if !visits.left[block].load(Ordering::Relaxed) => {}
            (phase, block) => visits.visit(visitor, phase, block, true),
        };
        graph.run(memory.threads, &Visitor::new, &visit, &mut told);
    }
    let mut report = visits.report.into_inner().unwrap_or_else(PoisonError::into_inner);
    report.refine.unexamined = unexamined;
    Saturated {
        bricks: visits.bricks,
        n_bricks: n_bricks as u32,
        part,
        memory: [(memory.bricks / 2) as u64, memory.pages_at_first],
        report,
    }
}

/// Saturates the mesh for lengths of the scaffold: in a large void that takes less work than inserting its points one by one into
/// tetrahedra from wall to wall, and it is done in blocks. Returns the number of new vertices.
fn saturate_coarser<P: Pages>(mesh: &mut Mesh<P>, field: &Field, dir: &DiskPath) -> u64 {
    for v in mesh.vertex_ids() {
        let size = mesh.size(v);
        mesh.set_size(v, COARSER as f32 * size);
    }
    let h = |p| COARSER * (field.h)(p);
    let coarser = Field { h: &h, place: field.place, bounds: field.bounds };
    let how = How { mode: Mode::None, is_final: false, rings: None };
    let made = saturate_at(mesh, &coarser, how, dir, &mut |_| ()).into_pages(mesh);
    for v in mesh.vertex_ids() {
        let p = mesh.point(v);
        mesh.set_size(v, (field.h)(p) as f32);
    }
    made.refine.inserted
}

/// All that visits share.
struct Visits<'a, 'b> {
    partition: &'a KdPartition,
    field: &'a Field<'b>,
    mode: Mode,
    bricks: Bricks,
    report: Mutex<BlockReport>,
    inserted: AtomicU64,
    /// Blocks whose second visit waits until all is divided.
    left: Vec<AtomicBool>,
    /// [`brick::Brick::unexamined`] of each brick since its last visit: bricks need not be in memory to be asked.
    unexamined: Vec<AtomicU32>,
}

/// Scratch of a thread.
struct Visitor {
    region: Region,
    divider: Divider,
    smoother: Smoother,
}

impl Visitor {
    fn new() -> Self {
        Self { region: Region::default(), divider: Divider::new(), smoother: Smoother::new() }
    }
}

impl Visits<'_, '_> {
    /// Visits a block; `is_last` tells whether nothing more will be divided.
    fn visit(&self, visitor: &mut Visitor, phase: usize, id: usize, is_last: bool) {
        let block = &self.partition.blocks[id];
        let numbers = &block.regions[phase];
        let is_own = |b| block.bricks.contains(&b);
        self.within(visitor, numbers, is_own, |visitor, is_own, own| {
            let color = |b: u32| self.partition.blocks[self.partition.owner(b) as usize].color;
            let is_left = |b| self.left[self.partition.owner(b) as usize].load(Ordering::Relaxed);
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
                let counts = improve::improve(&mut visitor.region, self.partition, &is_due, own);
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
    fn finish_rest(&self) -> u64 {
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

    fn n_unexamined(&self, block: &partition::Block) -> u64 {
        block.bricks.clone().map(|b| u64::from(self.unexamined_in(b))).sum()
    }

    fn unexamined_in(&self, brick: u32) -> u32 {
        self.unexamined[brick as usize].load(Ordering::Relaxed)
    }

    fn divide(&self, visitor: &mut Visitor, is_due: &[bool], own: u32) {
        let Visitor { region, divider, .. } = visitor;
        let report = divider.divide(region, self.partition, self.field, is_due, own);
        self.inserted.fetch_add(report.inserted, Ordering::Relaxed);
        self.report.lock().unwrap_or_else(PoisonError::into_inner).refine.add(&report);
    }
}

/// Bytes of memory by use, and threads.
struct Memory {
    /// Of the bricks.
    bricks: usize,
    /// Of the pages while blocks are visited, and while bricks are made of them or they of bricks.
    pages: u64,
    pages_at_first: u64,
    threads: usize,
}

/// Bytes of a visit, and per predicted tetrahedron of a large region: its arrays, and its bricks twice. Regions are large in large
/// sub-domains, since the number of blocks is bounded, and where lengths change steeply.
const VISIT_BYTES: u64 = 16 << 20;
const VISIT_TET_BYTES: f64 = 160.0;
/// Bytes of bricks per predicted tetrahedron.
const TET_BYTES: u64 = 50;

impl Memory {
    /// Divides what the pages may use.
    fn of<P: Pages>(mesh: &Mesh<P>, partition: &KdPartition) -> Self {
        let threads = spare_threads();
        let Some([used, most]) = mesh.pages().bytes_used() else {
            return Self { bricks: usize::MAX, pages: u64::MAX, pages_at_first: u64::MAX, threads };
        };
        let load = partition.load();
        let visit = VISIT_BYTES.max((partition.largest_region() * VISIT_TET_BYTES) as u64);
        // Where lengths change steeply, predictions of regions are several times too high.
        if visit > VISIT_BYTES && visit / 8 > most {
            raise(StorageError::Budget { what: TOO_STEEP, needed: visit, available: most });
        }
        let wanted = (1.5 * load) as u64 * TET_BYTES;
        if used + 2 * wanted + threads as u64 * visit <= most {
            return Self { bricks: usize::MAX, pages: most, pages_at_first: most, threads };
        }
        let threads = threads.min((most / 2 / visit).max(1) as usize);
        let rest = most.saturating_sub(threads as u64 * visit).max(most / 4);
        Self {
            bricks: (rest - rest / 8) as usize,
            pages: rest / 8,
            pages_at_first: most / 2,
            threads,
        }
    }
}
