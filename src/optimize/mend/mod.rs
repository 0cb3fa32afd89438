//! Lift and mend: the tetrahedra that are far worse than what the surface forces, worst first.
//!
//! Where vertices of the surface are coplanar, or inner vertices of boundary recovery lie on a plane but for rounding, tetrahedra of no
//! volume stay through all rounds before: a flip cannot remove them, and the cavity that a Delaunay kernel would open for a vertex
//! does not fit. Nothing forces them. Four operations, judged by q over the bound (`bound`):
//!
//! 1. `vertex`: inner vertices of bad tetrahedra move for the product of their ball, in sweeps; that takes clusters apart;
//! 2. then, for each bad tetrahedron in order, the first that makes it good enough, or else the best, of: a flip, or an edge or a vertex
//!    removed; a vertex moved for the worst of its ball; a vertex put on one of its edges; a vertex put into a cavity that grows (`cavity`).
//!
//! The last gains most. What is tried in vain is remembered until something changes it.
//!
//! Deterministic: order follows excess, then ids, and neither depends on paging.

mod cavity;
mod star;
mod vertex;

use std::collections::{BinaryHeap, HashSet};

use super::bound::{excess, face_floor};
use super::collapse::Collapser;
use super::objective::Worst;
use super::pages::{PageFlags, tets_of_page};
use super::quality::{is_below, quality};
use super::smooth::raised;
use super::swap::Swapper;
use crate::geom::{Point, STEP, mix};
use crate::mesh::{Mesh, Tet};
use crate::storage::{Pages, check_cancelled};
use cavity::{Cavity, Proposal};
use star::{Aim, FaceBounds, value_of};
use vertex::Mover;

/// Tetrahedra are bad above this q ... A solver fails on the worst ones, which have millions. On balls and even scans the rounds before leave
/// nothing of the kind, so that nothing is touched there. At 8, meshes of CAD surfaces took two to five times as long, and on four of ten
/// more tetrahedra had q of 10 and above, for what surrounds a mended one pays for it.
const QUALITY_MAX: f64 = 50.0;
/// ... and above this excess: what stands on a needle of the surface is as good as it can be.
const EXCESS_MAX: f64 = 2.0;
/// Searches stop at this value, and an operation that reaches it is done without trying others.
const ENOUGH: f64 = 0.5;
/// Sweeps of moves for the product at most.
const SWEEPS_MAX: u32 = 10;
/// Passes over what is still bad; each tries what has changed since it was tried before.
const PASSES_MAX: u32 = 3;
/// Bad tetrahedra listed at most, the worst ones: on a wing of sixteen thousand needles all but a few are bad.
const LISTED_MAX: usize = 1000;
/// Tetrahedra tried in a pass at most, with what operations leave bad: each takes some milliseconds.
const TRIED_MAX: usize = 1500;

/// Accepted operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MendCounts {
    /// Bad tetrahedra tried, over all passes.
    pub tried: u64,
    /// Flips, and edges removed.
    pub reconnected: u64,
    /// Moves of a vertex, each counted.
    pub vertices_moved: u64,
    /// Vertices put into cavities and on edges.
    pub vertices_inserted: u64,
    /// Vertices taken away with one of their edges.
    pub vertices_removed: u64,
}

impl MendCounts {
    fn changes(&self) -> u64 {
        self.reconnected + self.vertices_moved + self.vertices_inserted + self.vertices_removed
    }
}

/// The excess of a tetrahedron where it is a bad one.
fn bad_excess<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet) -> Option<f64> {
    let points = mesh.points(tet);
    if !is_below(points, 1.0 / QUALITY_MAX) {
        return None;
    }
    let q = quality(points);
    let required = [0, 1, 2, 3].map(|i| tet.is_required(i));
    for i in (0..4).filter(|&i| required[i]) {
        if q <= EXCESS_MAX * face_floor(tet.face(i).map(|v| mesh.point(v))) {
            return None;
        }
    }
    let excess = excess(points, required);
    (excess > EXCESS_MAX).then_some(excess)
}

/// A tetrahedron by its vertices' positions.
fn name(points: [Point; 4]) -> u64 {
    let words = points.into_iter().flat_map(|p| p.to_array());
    words.fold(0, |name, x| mix(name.wrapping_add(STEP) ^ x.to_bits()))
}

/// Scratch and queue of all passes.
#[derive(Default)]
pub(super) struct Mender {
    mover: Mover,
    cavity: Cavity,
    /// The cavity of the best proposal so far.
    best_cavity: Cavity,
    bounds: FaceBounds,
    swapper: Swapper<Worst>,
    collapser: Collapser<Worst>,
    /// Bits of the excess, which order like it, and the tetrahedron.
    queue: BinaryHeap<(u64, u32)>,
    /// Names of what was tried in vain.
    failed: HashSet<u64>,
    /// Vertices around which something changed in this pass, and in the one before.
    touched: [HashSet<u32>; 2],
    changed: Vec<u32>,
    pub(super) counts: MendCounts,
}

impl Mender {
    /// Mends what is bad in the flagged pages. `progress` is told the share done of a pass.
    pub(super) fn run<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        pages: &mut PageFlags,
        progress: &mut dyn FnMut(f64),
    ) {
        let list = self.list(mesh, pages);
        if list.is_empty() {
            return;
        }
        self.lift(mesh, &list);
        for _ in 0..PASSES_MAX {
            let before = self.counts.changes();
            let list = self.list(mesh, pages);
            self.queue.extend(list);
            self.pass(mesh, pages, progress);
            if self.counts.changes() == before {
                break;
            }
        }
    }

    /// The bad tetrahedra of the flagged pages, worst first; pages with none lose their flags.
    fn list<P: Pages>(&mut self, mesh: &mut Mesh<P>, pages: &mut PageFlags) -> Vec<(u64, u32)> {
        let mut list = Vec::new();
        let mut bad = PageFlags::default();
        let mut from = 0;
        while let Some(page) = pages.take_next(from) {
            check_cancelled();
            from = page + 1;
            tets_of_page(mesh, page, |mesh, t, tet| {
                if let Some(excess) = bad_excess(mesh, &tet) {
                    list.push((excess.to_bits(), t));
                    bad.raise(t);
                }
            });
            if list.len() >= 2 * LISTED_MAX {
                list.sort_unstable_by(|a, b| b.cmp(a));
                list.truncate(LISTED_MAX);
            }
        }
        *pages = bad;
        list.sort_unstable_by(|a, b| b.cmp(a));
        list.truncate(LISTED_MAX);
        list
    }

    /// Moves the inner vertices of the listed tetrahedra, in sweeps.
    fn lift<P: Pages>(&mut self, mesh: &mut Mesh<P>, list: &[(u64, u32)]) {
        let mut seen = HashSet::new();
        let mut vertices = Vec::new();
        for &(_, t) in list {
            let tet = mesh.tet(t);
            let new = tet.vertices().into_iter().filter(|&v| seen.insert(v));
            vertices.extend(new.map(|v| (v, t)));
        }
        for _ in 0..SWEEPS_MAX {
            check_cancelled();
            vertices.retain(|&(v, t)| {
                self.mover.gather(mesh, v, t, &mut self.bounds) && self.mover.raise_product(mesh)
            });
            self.counts.vertices_moved += vertices.len() as u64;
        }
    }

    fn pass<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        pages: &mut PageFlags,
        progress: &mut dyn FnMut(f64),
    ) {
        self.touched.swap(0, 1);
        self.touched[0].clear();
        let total = self.queue.len();
        // What operations leave bad is followed up, up to a bound.
        let mut left = TRIED_MAX;
        while let Some((bits, t)) = self.queue.pop() {
            check_cancelled();
            progress(1.0 - (self.queue.len().min(total)) as f64 / total as f64);
            let tet = mesh.tet(t);
            // Changed since it was listed: then it was listed anew.
            let is_current = tet.is_live()
                && bad_excess(mesh, &tet).is_some_and(|excess| excess.to_bits() == bits);
            if left == 0 || !is_current || !self.is_worth_trying(mesh, &tet) {
                continue;
            }
            left -= 1;
            self.counts.tried += 1;
            if !self.attack(mesh, t, &tet) {
                self.failed.insert(name(mesh.points(&tet)));
                continue;
            }
            for &t in &self.changed {
                let tet = mesh.tet(t);
                self.touched[0].extend(tet.vertices());
                if let Some(excess) = bad_excess(mesh, &tet) {
                    pages.raise(t);
                    self.queue.push((excess.to_bits(), t));
                }
            }
        }
    }

    /// Whether it was never tried, or something has changed near it in the pass before.
    fn is_worth_trying<P: Pages>(&mut self, mesh: &mut Mesh<P>, tet: &Tet) -> bool {
        let name = name(mesh.points(tet));
        let changed = tet.vertices().iter().any(|v| self.touched[1].contains(v));
        !self.failed.contains(&name) || changed && self.failed.remove(&name)
    }

    /// Tries everything on the bad tetrahedron `t`; after success `changed` lists the tetrahedra that are new or moved.
    fn attack<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet) -> bool {
        self.changed.clear();
        let [_, own] = value_of(mesh, tet, &mut self.bounds);
        let enough = ENOUGH.max(2.0 * own);
        let aim = Aim { own, enough };
        if self.reconnect(mesh, t, tet, enough) {
            return true;
        }
        let mut best = raised(own);
        let mut way = Way::None;
        for v in tet.vertices() {
            if best < enough && self.mover.gather(mesh, v, t, &mut self.bounds) {
                let found = self.mover.raise_least(mesh, aim, &mut self.bounds);
                if let Some((at, value)) = found.filter(|found| found.1 > best) {
                    (best, way) = (value, Way::Move(v, at));
                }
            }
        }
        if best < enough {
            let proposal = self.cavity.grow(mesh, t, aim, &mut self.bounds);
            self.weigh(proposal, &mut best, &mut way);
        }
        for e in 0..6 {
            // An edge's ring is a cavity of its own; it is needed where growing led nowhere.
            if best < 2.0 * own {
                let proposal = (self.cavity).split(mesh, t, e, aim, &mut self.bounds);
                self.weigh(proposal, &mut best, &mut way);
            }
        }
        if best < 2.0 * own && self.reconnect(mesh, t, tet, own) {
            return true;
        }
        self.go(mesh, t, way)
    }

    /// Keeps a proposal that is better than the best so far.
    fn weigh(&mut self, proposal: Option<Proposal>, best: &mut f64, way: &mut Way) {
        if let Some(proposal) = proposal.filter(|p| p.value > *best) {
            (*best, *way) = (proposal.value, Way::Insert(proposal));
            std::mem::swap(&mut self.cavity, &mut self.best_cavity);
        }
    }

    /// A flip, or an edge or a vertex removed, that leaves no new tetrahedron of 1 / q below `own` and a bit.
    fn reconnect<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet, own: f64) -> bool {
        let done = self.swapper.remove_best_edge(mesh, t, tet, own)
            || self.swapper.swap_best_face(mesh, t, tet, own);
        if done {
            self.counts.reconnected += 1;
            self.changed.extend_from_slice(self.swapper.new_tets());
        } else if self.collapser.collapse_best_edge(mesh, t, tet, own) {
            self.counts.vertices_removed += 1;
            self.changed.extend_from_slice(self.collapser.new_tets());
            return true;
        }
        done
    }

    /// Does what was found best.
    fn go<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, way: Way) -> bool {
        match way {
            Way::None => false,
            Way::Move(v, at) => {
                let found = self.mover.ball.gather(mesh, v, t, usize::MAX);
                assert!(found, "tetrahedron {t} has vertex {v}");
                mesh.set_point(v, at);
                self.counts.vertices_moved += 1;
                self.changed.extend_from_slice(&self.mover.ball.tets);
                true
            }
            Way::Insert(proposal) => {
                let done = self.best_cavity.apply(mesh, proposal);
                if done {
                    self.counts.vertices_inserted += 1;
                    self.changed.extend_from_slice(self.best_cavity.new_tets());
                }
                done
            }
        }
    }
}

/// The best operation found.
#[derive(Clone, Copy)]
enum Way {
    None,
    Move(u32, Point),
    /// A vertex in the best cavity.
    Insert(Proposal),
}
