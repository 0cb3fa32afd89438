//! Divide edges until saturated, in a zone or everywhere.
//!
//! Where there is room, pieces of a relaxed pattern are set in whole (`graft`). Then edges longer than √2 in the metric of the wanted
//! size are divided equally; the points are inserted by the constrained kernel where no vertex is nearer than 1/√2. First they move to
//! the nearest place of the pattern, as long as there are any (`pattern`); then they stay where they divide. Places of a piece are at
//! least 1/√2 apart in the size of its grain, which may be less by a seventh. What decides is order alone: grains in the order of
//! their cells; blocks of tetrahedra in id order, long edges before short ones within a block, then the Hilbert curve. So the result
//! does not depend on which pages are resident, nor on threads.
//!
//! Source: the paper, section 1.1; constants from F. Hecht's rule (BAMG) and measurement: a filter of 1/√2 with
//! a threshold of √2 makes edges of mean length 1.0 and about 10.2 tetrahedra per unit of ∫ h⁻³.

mod activity;
mod candidate;
mod edge_cache;
mod field;
mod graft;
mod grain;
mod insert;
mod long_edges;
mod pattern;
mod placement;
mod recent;
mod report;
mod tile;
mod worker;

use tetdb_schema::page::SLOT_BITS;

use crate::delaunay::Kernel;
use crate::mesh::{Mesh, Workspace, dense, renumber, sparse};
use tetdb_base::geom::HilbertFrame;
use tetdb_base::storage::{Pages, StorageError, check_cancelled};

use activity::Activity;
use candidate::Candidates;
use edge_cache::EdgeCache;
pub use field::{Field, Lengths};
pub use graft::{PATTERN_BYTES, find_pattern};
pub use placement::{Everywhere, PlacementRule};
pub(crate) use recent::Recent;
pub use report::RefineReport;
use worker::Worker;

/// Tetrahedra of one block. Small enough that a block's candidates fit a small lease, large enough that
/// sorting along the curve pays; the mesh depends on it, so it is a constant of the format of results.
const BLOCK_TETS: u32 = 32 * 2046;
/// Passes over the mesh; six suffice for a uniform field, graded ones take a few more.
const PASSES_MAX: u32 = 40;

/// A pass that inserts less than this share of all vertices is the last one that moves points to places of the pattern.
const FEW: f64 = 0.02;

/// A mesh that has grown so much since it was numbered along the curve is numbered again: below, a sweep over its pages
/// jumps between layers created in different passes; above, sorting costs more than it saves.
const GROWTH: f64 = 1.5;

/// A mesh that has grown by less than this since then is not numbered again in the end.
const GROWTH_LAST: f64 = 1.10;

/// Places for edges that are settled: three for each facet, which has one and a half edges, and 4 MB at most.
const SETTLED_MAX: usize = 1 << 19;

/// Divides edges until none is left to divide.
///
/// The mesh must hold filled regions only, sizes set at all its vertices. `progress` receives the number of vertices
/// inserted so far. Effects: new vertices and tetrahedra; all ids may change; `tet_of` is not kept up. Errors: the disk.
pub fn saturate<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    space: &Workspace,
    progress: &mut dyn FnMut(u64),
) -> Result<RefineReport, StorageError> {
    let mut report = RefineReport::default();
    let mut worker = Worker {
        kernel: Kernel::default(),
        order: HilbertFrame::new(&field.bounds),
        edges: Vec::new(),
        candidates: Candidates::default(),
        recent: Recent::new(),
        active: Activity::all(mesh),
        settled: EdgeCache::new((3 * mesh.n_facets() as usize).min(SETTLED_MAX)),
        last: 0,
        placing: true,
        examined_too: false,
    };
    let mut numbered = mesh.n_tets();
    if field.lengths == Lengths::Field {
        graft::set_in(&mut worker, mesh, field, space, &mut report, progress)?;
        if f64::from(mesh.n_tets()) > GROWTH * f64::from(numbered) {
            renumber(mesh, &worker.order, space)?;
            numbered = mesh.n_tets();
            worker.last = 0;
            worker.active = Activity::all(mesh);
        } else {
            worker.active.again(mesh);
        }
    }
    for _ in 0..PASSES_MAX {
        let before = report.inserted;
        report.passes += 1;
        let end = dense(mesh.tet_ids_end());
        let n_blocks = end.div_ceil(BLOCK_TETS);
        // Every other pass goes down: it begins with the pages that the pass before has left in memory.
        let up = report.passes % 2 == 1;
        for i in 0..n_blocks {
            let from = BLOCK_TETS * if up { i } else { n_blocks - 1 - i };
            check_cancelled();
            let to = end.min(from + BLOCK_TETS);
            if worker.active.take(from, to) {
                let (first, last) = (sparse(from) >> SLOT_BITS, sparse(to - 1) >> SLOT_BITS);
                let near = |&page: &u32| !worker.active.is_far(page);
                let pages: Vec<u32> = (first..=last).filter(near).collect();
                worker.block(mesh, field, &pages, &mut report);
                progress(report.inserted);
            }
        }
        if f64::from(mesh.n_tets()) > GROWTH * f64::from(numbered) {
            renumber(mesh, &worker.order, space)?;
            numbered = mesh.n_tets();
            worker.active = Activity::all(mesh);
            worker.settled.clear();
            worker.last = 0;
        }
        let inserted = report.inserted - before;
        worker.examined_too = false;
        if worker.placing && inserted as f64 <= FEW * report.inserted as f64 {
            // What is long still has no place of the pattern near enough: near the surface, and where sizes vary.
            worker.placing = false;
            worker.examined_too = true;
            worker.active.again(mesh);
        } else if !worker.placing && inserted == 0 {
            break;
        }
    }
    // Every sweep that follows goes in id order: this costs 0.8 s and saves them 2.2 s on 4 M tetrahedra.
    if f64::from(mesh.n_tets()) > GROWTH_LAST * f64::from(numbered) {
        renumber(mesh, &worker.order, space)?;
    }
    if !field.place.is_partial() {
        report.over_constrained = count_over_constrained(mesh);
    }
    Ok(report)
}

fn count_over_constrained<P: Pages>(mesh: &mut Mesh<P>) -> u64 {
    let mut n = 0;
    // Down, from the pages that are still in memory.
    for t in (0..dense(mesh.tet_ids_end())).rev().map(sparse) {
        let tet = mesh.tet(t);
        let several = (0..4).filter(|&i| tet.is_required(i)).count() > 1;
        n += u64::from(tet.is_live() && several);
    }
    n
}

impl Worker {
    /// Divides the long edges of the unexamined tetrahedra of some pages.
    fn block<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        field: &Field,
        pages: &[u32],
        report: &mut RefineReport,
    ) {
        self.collect_edges(mesh, field, pages);
        self.make_candidates(mesh, field);
        let candidates = std::mem::take(&mut self.candidates);
        self.recent.clear();
        for candidate in candidates.iter() {
            report.candidates += 1;
            self.try_insert(mesh, field, candidate, report);
        }
        self.candidates = candidates;
    }
}

#[cfg(test)]
mod tests;
