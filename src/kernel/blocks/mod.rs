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
mod memory;
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
mod visits;

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64};
use std::sync::{Mutex, PoisonError};

use crate::mesh::Mesh;
use crate::optimize::Mode;
use brick::Bricks;
pub use field::Field;
pub use finish::{Finished, FinishedTet, FinishedVertex};
use memory::Memory;
use part::Part;
use partition::KdPartition;
pub use partition::block_tets;
pub use placement::{Everywhere, PlacementRule};
pub use report::{BlockReport, RefineReport};
use scaffold::COARSER;
use tetdb_base::storage::{DiskPath, Pages};
use visits::{DIVIDE, SMOOTH, Visits};

/// Fewest tetrahedra of the scaffold's lengths that are worth a saturation of their own.
const COARSE_TETS: f64 = 20_000.0;
/// Rings of tetrahedra around what a partial field reaches; more if something in the middle could not be divided for want of them.
const PART_RINGS: [u32; 3] = [3, 8, 24];

/// Divides tetrahedra until the mesh is saturated; smooths it unless `mode` is `None`, and improves bad tetrahedra if it is `Full`.
///
/// The mesh must hold filled regions only, sizes set at all its vertices. `dir` takes bricks that leave memory. `progress` receives
/// predicted tetrahedra: those of blocks that are done, and all. Effects: new vertices and tetrahedra; ids of tetrahedra change, those of
/// vertices stay; `tet_of` is not kept up. Unwinds with errors of the disk.
pub fn saturate<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    mode: Mode,
    dir: &DiskPath,
    progress: &mut dyn FnMut(u64, u64),
) -> BlockReport {
    if !field.place.is_partial() {
        return saturate_all(mesh, field, mode, dir, progress).into_pages(mesh);
    }
    let mut report = BlockReport::default();
    for rings in PART_RINGS {
        let how = How { mode, is_final: true, rings: Some(rings) };
        let made = saturate_at(mesh, field, how, dir, progress).into_pages(mesh);
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
    progress: &mut dyn FnMut(u64, u64),
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
    progress: &mut dyn FnMut(u64, u64),
) -> Saturated {
    let load = load::predict(mesh, field);
    load::check(load.tets);
    let is_void = load.in_voids > COARSE_TETS.max(f64::from(mesh.n_tets()));
    let coarser = if is_void { saturate_coarser(mesh, field, dir) } else { 0 };
    let how = How { mode, is_final: true, rings: None };
    let mut made = saturate_at(mesh, field, how, dir, progress);
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
    progress: &mut dyn FnMut(u64, u64),
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
    let blocks = 0..partition.blocks.len();
    let mut visits = Visits {
        partition,
        field,
        mode,
        bricks,
        report: Mutex::new(BlockReport {
            refine: RefineReport { inserted: scaffold, ..RefineReport::default() },
            ..BlockReport::default()
        }),
        done: AtomicU64::new(0),
        left: blocks.map(|_| AtomicBool::new(false)).collect(),
        unexamined: (0..n_bricks).map(|_| AtomicU32::new(0)).collect(),
    };
    let is_smoothed = mode != Mode::None;
    let phases = DIVIDE..if is_smoothed { SMOOTH + 1 } else { SMOOTH };
    visits.run(phases, false, &memory, progress);
    // Shorter lengths divide what coarser ones leave.
    let unexamined = if is_final { visits.finish_rest() } else { 0 };
    if is_smoothed && visits.is_any_left() {
        visits.narrow();
        visits.run(SMOOTH..SMOOTH + 1, true, &memory, progress);
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
    let made = saturate_at(mesh, &coarser, how, dir, &mut |_, _| ()).into_pages(mesh);
    for v in mesh.vertex_ids() {
        let p = mesh.point(v);
        mesh.set_size(v, (field.h)(p) as f32);
    }
    made.refine.inserted
}
