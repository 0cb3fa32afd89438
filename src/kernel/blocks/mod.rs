//! Saturation and smoothing in blocks, on all threads.
//!
//! 1. `scaffold`: no tetrahedron is left that would outreach a margin.
//! 2. `partition`: a k-d tree over the predicted load. Leaves are bricks, which hold the mesh; subtrees are blocks.
//! 3. `tasks`: each block is visited twice, to be divided and to be smoothed. A visit checks the block and a margin out into plain
//!    arrays (`region`), works there (`divide`, `smooth`), and checks it in again.
//!
//! What a visit sees and does follows from the partition and from the visits before it, whose order is fixed. So the mesh depends neither on
//! threads nor on memory.

mod brick;
mod convert;
mod divide;
mod flat;
mod insert;
mod lawson;
mod load;
mod partition;
mod recent;
mod region;
mod scaffold;
mod smooth;
mod spawn;
mod tasks;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError, RwLock};

use crate::mesh::{Mesh, dense, sparse};
use crate::refine::{Field, RefineReport};
use brick::Bricks;
use divide::Divider;
use partition::Partition;
use region::Region;
use smooth::Smoother;
use tasks::Graph;
use tetdb_base::storage::Pages;

/// Margins of the phases, as places in `MARGINS`: of division and of smoothing.
const PHASES: [usize; 2] = [0, 1];

/// Divides edges until the mesh is saturated, and smooths it.
///
/// The mesh must hold filled regions only, sizes set at all its vertices. Effects: new vertices and tetrahedra; ids of tetrahedra change,
/// those of vertices stay; `tet_of` is not kept up. Errors: unwinds with those of the disk.
pub fn saturate<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    progress: &mut dyn FnMut(u64),
) -> RefineReport {
    let clock = std::time::Instant::now();
    let lap = |what: &str| {
        if std::env::var_os("TETDB_LAPS").is_some() {
            eprintln!("{:8.3} {what}", clock.elapsed().as_secs_f64());
        }
    };
    let scaffold = scaffold::build(mesh, field);
    lap("scaffold");
    let partition = Partition::new(samples(mesh, field), field.bounds, field.h);
    lap(&format!(
        "partition: {} blocks, {} bricks, {} colors",
        partition.blocks.len(),
        partition.n_bricks(),
        partition.blocks.iter().map(|b| b.color + 1).max().unwrap_or(0)
    ));
    let bricks = RwLock::new(convert::to_bricks(mesh, &partition));
    lap("bricks");
    let graph = Graph::new(&partition, &PHASES);
    let run = Run {
        partition: &partition,
        field,
        bricks,
        report: Mutex::new(RefineReport { inserted: scaffold, ..RefineReport::default() }),
        inserted: AtomicU64::new(scaffold),
    };
    let visit = |visitor: &mut Visitor, task| {
        let (phase, block) = graph.visit(task);
        run.visit(visitor, phase, block);
    };
    graph.run(&Visitor::new, &visit, &mut || progress(run.inserted.load(Ordering::Relaxed)));
    lap("visits");
    let bricks = run.bricks.into_inner().unwrap_or_else(PoisonError::into_inner);
    convert::to_pages(&bricks, mesh);
    lap("pages");
    let report = run.report.into_inner().unwrap_or_else(PoisonError::into_inner);
    lap(&format!("{report:?}"));
    report
}

/// Where the load of the mesh is.
fn samples<P: Pages>(mesh: &mut Mesh<P>, field: &Field) -> Vec<load::Sample> {
    let mut tets = Vec::new();
    for t in (0..dense(mesh.tet_ids_end())).map(sparse) {
        let tet = mesh.tet(t);
        if tet.is_live() {
            let ends = mesh.ends(&tet);
            let mean = ends.iter().map(|e| f64::from(e.h)).sum::<f64>() * 0.25;
            tets.push((ends.map(|e| e.point), mean));
        }
    }
    load::sample(&tets, field.h)
}

/// All that visits share.
struct Run<'a, 'b> {
    partition: &'a Partition,
    field: &'a Field<'b>,
    bricks: RwLock<Bricks>,
    report: Mutex<RefineReport>,
    inserted: AtomicU64,
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

impl Run<'_, '_> {
    fn visit(&self, visitor: &mut Visitor, phase: usize, id: usize) {
        let block = &self.partition.blocks[id];
        let numbers = &block.regions[PHASES[phase]];
        let region = &mut visitor.region;
        {
            let shared =
                self.bricks.read().unwrap_or_else(PoisonError::into_inner).clone_of(numbers);
            let mut outside = |number: u32| {
                let all = self.bricks.read().unwrap_or_else(PoisonError::into_inner);
                all[number as usize].clone()
            };
            region.check_out(numbers, &shared, &mut outside);
        }
        let own = numbers.partition_point(|&b| b < block.bricks.start) as u32;
        let is_own: Vec<bool> = numbers.iter().map(|b| block.bricks.contains(b)).collect();
        if phase == 0 {
            let color = |b: u32| self.partition.blocks[self.partition.owner(b) as usize].color;
            let is_due: Vec<bool> = (numbers.iter().zip(&is_own))
                .map(|(&b, &is_own)| is_own || color(b) < block.color)
                .collect();
            self.divide(visitor, &is_due, own);
        } else {
            if self.has_unexamined(block) {
                self.divide(visitor, &is_own, own);
            }
            visitor.smoother.smooth(&mut visitor.region, &is_own);
        }
        let made = visitor.region.check_in();
        let mut all = self.bricks.write().unwrap_or_else(PoisonError::into_inner);
        for (&number, brick) in numbers.iter().zip(made) {
            all[number as usize] = brick;
        }
    }

    fn has_unexamined(&self, block: &partition::Block) -> bool {
        let all = self.bricks.read().unwrap_or_else(PoisonError::into_inner);
        block.bricks.clone().any(|b| all[b as usize].unexamined > 0)
    }

    fn divide(&self, visitor: &mut Visitor, is_due: &[bool], own: u32) {
        let Visitor { region, divider, .. } = visitor;
        let report = divider.divide(region, self.partition, self.field, is_due, own);
        self.inserted.fetch_add(report.inserted, Ordering::Relaxed);
        self.report.lock().unwrap_or_else(PoisonError::into_inner).add(&report);
    }
}

/// Shared bricks by number.
trait CloneOf {
    fn clone_of(&self, numbers: &[u32]) -> Bricks;
}

impl CloneOf for Bricks {
    fn clone_of(&self, numbers: &[u32]) -> Bricks {
        numbers.iter().map(|&n| self[n as usize].clone()).collect()
    }
}
