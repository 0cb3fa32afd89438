//! Divide edges until saturated, in a zone or everywhere.
//!
//! Edges longer than √2 in the metric of the wanted size are divided equally; the points are inserted
//! by the constrained kernel where no vertex is nearer than 1/√2. What decides is order alone: blocks
//! of tetrahedra in id order, long edges before short ones within a block, then the Hilbert curve. So
//! the result does not depend on which pages are resident, nor on threads.
//!
//! Source: the paper, section 1.1; constants from F. Hecht's rule (BAMG) and measurement: a filter of 1/√2 with
//! a threshold of √2 makes edges of mean length 1.0 and about 10.2 tetrahedra per unit of ∫ h⁻³.

mod candidates;
mod insert;
mod place;

use crate::delaunay::Kernel;
use crate::geom::{Aabb, HilbertFrame, Point};
use crate::mesh::{Mesh, Workspace, dense, renumber, sparse};
use crate::reconnect::Shell;
use crate::storage::{Pages, StorageError, check_cancelled};

use candidates::Candidate;
use insert::Recent;
pub use place::{Everywhere, PlacementRule};

/// Tetrahedra of one block. Small enough that a block's candidates fit a small lease, large enough that
/// sorting along the curve pays; the mesh depends on it, so it is a constant of the format of results.
const BLOCK_TETS: u32 = 32 * 2046;
/// Passes over the mesh; six suffice for a uniform field, graded ones take a few more.
const PASSES_MAX: u32 = 40;

/// A mesh that has grown so much since it was numbered along the curve is numbered again: below, a sweep over its pages
/// jumps between layers made in different passes; above, sorting costs more than it saves.
const GROWTH: f64 = 1.5;

/// Where the wanted length at a point that divides an edge comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lengths {
    /// From the size field.
    #[default]
    Field,
    /// Interpolated between the ends of the edge, hence from the vertices of the coarse mesh: the paper's way, section 1.1.
    /// Kept for comparison: what the vertices of the surface do not know is never seen.
    Ends,
}

/// What is wanted where, and where points may go.
pub struct Field<'a> {
    pub lengths: Lengths,
    /// Wanted edge length at a position.
    pub h: &'a dyn Fn(Point) -> f64,
    /// Where points may go.
    pub place: &'a dyn PlacementRule,
    /// Box of the mesh, which fixes the order along the curve.
    pub bounds: Aabb,
}

/// What saturation did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefineReport {
    pub passes: u32,
    pub candidates: u64,
    pub inserted: u64,
    /// Too near to a vertex or a required face.
    pub near: u64,
    /// No cavity that keeps the required faces, or a walk that left the mesh.
    pub blocked: u64,
    /// Refused for nothing but their place.
    pub out_of_place: u64,
    /// Cavities, made star-shaped and allowed where they lie, that held a tetrahedron frozen beside an interface.
    pub frozen_hits: u64,
    /// Tetrahedra with two required faces or more when the passes ended: none of their edges could be divided. Not counted where
    /// only a part of the mesh is divided.
    pub over_constrained: u64,
}

/// Divides edges until none is left to divide.
///
/// The mesh must hold filled regions only, sizes set at all its vertices. `progress` is told the number of vertices
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
        candidates: Vec::new(),
        recent: Recent::new(),
        shell: Shell::default(),
        active: Activity::all(mesh),
        last: 0,
    };
    let mut numbered = mesh.n_tets();
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
                worker.block(mesh, field, sparse(from), sparse(to - 1), &mut report);
                progress(report.inserted);
            }
        }
        if f64::from(mesh.n_tets()) > GROWTH * f64::from(numbered) {
            renumber(mesh, &worker.order, space)?;
            numbered = mesh.n_tets();
            worker.active = Activity::all(mesh);
            worker.last = 0;
        }
        if report.inserted == before {
            break;
        }
    }
    // Every sweep that follows goes in id order: this costs 0.8 s and saves them 2.2 s on 4 M tetrahedra.
    renumber(mesh, &worker.order, space)?;
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

struct Worker {
    kernel: Kernel,
    order: HilbertFrame,
    /// Scratch: (edge as ordered pair, a tetrahedron that has it).
    edges: Vec<(u64, u32)>,
    candidates: Vec<Candidate>,
    recent: Recent,
    shell: Shell,
    active: Activity,
    /// A tetrahedron in use, where a walk can start when its own start is gone.
    last: u32,
}

impl Worker {
    /// Divides the long edges of the unexamined tetrahedra with ids `first..=last`.
    fn block<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        field: &Field,
        first: u32,
        last: u32,
        report: &mut RefineReport,
    ) {
        let mut from = first;
        while from <= last {
            from = self.collect_edges(mesh, field, from, last);
            self.make_candidates(mesh, field);
            report.candidates += self.candidates.len() as u64;
            let candidates = std::mem::take(&mut self.candidates);
            self.recent.clear();
            for candidate in &candidates {
                self.try_insert(mesh, field, candidate, report);
            }
            self.candidates = candidates;
        }
    }
}

/// Which pages have had tetrahedra made since they were last examined: one byte a page.
struct Activity {
    pages: Vec<bool>,
}

impl Activity {
    fn all<P: Pages>(mesh: &Mesh<P>) -> Self {
        let pages = dense(mesh.tet_ids_end()).div_ceil(2046) as usize;
        Self {
            pages: vec![true; pages],
        }
    }

    fn touch(&mut self, tet: u32) {
        let page = (dense(tet) / 2046) as usize;
        if page >= self.pages.len() {
            self.pages.resize(page + 1, false);
        }
        self.pages[page] = true;
    }

    /// Whether any page of the dense range is active; clears them.
    fn take(&mut self, from: u32, to: u32) -> bool {
        let (first, end) = ((from / 2046) as usize, to.div_ceil(2046) as usize);
        let end = end.min(self.pages.len());
        let mut any = false;
        for page in &mut self.pages[first.min(end)..end] {
            any |= std::mem::take(page);
        }
        any
    }
}

#[cfg(test)]
mod tests;
