//! Lift and mend: the tetrahedra that are far worse than what the surface forces, worst first.
//!
//! Where vertices of the surface are coplanar, or inner vertices of boundary recovery lie on a plane but for rounding, tetrahedra of no
//! volume stay through all rounds before: a flip cannot remove them, and the cavity that a Delaunay kernel would open for a vertex
//! does not fit. Nothing forces them.
//!
//! 1. `vertex`: inner vertices of bad tetrahedra move for the product of their ball, in sweeps; that takes clusters apart, each pass a bit further;
//! 2. then, for each bad tetrahedron in order, the first that makes it good enough, or else the best, of: a flip, or an edge or a vertex
//!    removed; a vertex moved for the worst of its ball; a vertex put into a cavity that grows (`cavity`), or on one of its edges; where all
//!    that gains little, but not for the number of q ≥ 10, a cavity filled anew with tetrahedra of its own vertices (`refill`).
//!
//! The vertex in a cavity gains most. What is tried in vain is remembered until something changes it. All this in
//! several stages, judged differently (`stages`).
//!
//! Deterministic: order follows q or excess, then ids, and neither depends on paging.

mod cavity;
mod face_bounds;
mod kernel;
mod refill;
mod stages;
mod star;
mod vertex;

use std::collections::{BinaryHeap, HashSet};

use super::collapse::Collapser;
use super::objective::Worst;
use super::pages::PageFlags;
use super::quality::quality;
use super::swap::Swapper;
use crate::geom::{Point, STEP, mix};
use crate::mesh::{Mesh, Tet, tets_of_page};
use crate::storage::{Pages, check_cancelled};
use cavity::{Cavity, Proposal};
use face_bounds::{FaceBounds, value_of};
use refill::Refill;
use stages::{Judgment, STAGES, Stage, WORST, judge};
use star::{Aim, Goal};
use vertex::Mover;

/// Searches stop at this value, and an operation that reaches it is done without trying others.
const ENOUGH: f64 = 0.5;
/// Below this value volumes are rounding: what takes the place of such a tetrahedron has to be above.
const NO_VOLUME: f64 = 1e-15;
/// Sweeps of moves for the product at most: where vertices hold each other, heights double in each.
const SWEEPS_MAX: u32 = 60;

/// Accepted operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MendCounts {
    /// Bad tetrahedra tried, over all passes.
    pub tried: u64,
    /// Flips, and edges removed.
    pub reconnected: u64,
    /// Cavities filled anew with tetrahedra of their own vertices.
    pub refilled: u64,
    /// Moves of a vertex, each counted.
    pub vertices_moved: u64,
    /// Vertices put into cavities and on edges.
    pub vertices_inserted: u64,
    /// Vertices taken away with one of their edges.
    pub vertices_removed: u64,
}

impl MendCounts {
    fn changes(&self) -> u64 {
        self.reconnected
            + self.refilled
            + self.vertices_moved
            + self.vertices_inserted
            + self.vertices_removed
    }
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
    refill: Refill,
    bounds: FaceBounds,
    swapper: Swapper<Worst>,
    collapser: Collapser<Worst>,
    /// Bits of the badness, which order like it, and the tetrahedron.
    queue: BinaryHeap<(u64, u32)>,
    /// Names of what was tried in vain.
    failed: HashSet<u64>,
    /// The worst q in the last list's pages that the surface forces.
    forced: f64,
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
        // Nothing else is bad in any stage.
        if self.list(mesh, pages, &WORST).is_empty() {
            return;
        }
        for stage in &STAGES {
            let mut flags = pages.clone();
            self.failed.clear();
            for _ in 0..stage.passes_max {
                let before = self.counts.changes();
                if stage.goal == Goal::Quality {
                    let list = self.list(mesh, &mut flags.clone(), stage);
                    self.lift(mesh, &list);
                }
                let list = self.list(mesh, &mut flags, stage);
                let Some(stage) = stage.at(&list, self.forced) else {
                    break;
                };
                self.pass(mesh, list, &mut flags, &stage, progress);
                if self.counts.changes() == before {
                    break;
                }
            }
            *pages = flags.or(pages);
        }
    }

    /// The bad tetrahedra of the flagged pages, worst first; pages with none lose their flags.
    fn list<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        pages: &mut PageFlags,
        stage: &Stage,
    ) -> Vec<(u64, u32)> {
        let most = stage.tried_max(mesh.n_tets());
        let bounds = &mut self.bounds;
        let mut list = Vec::new();
        let (mut forced, mut worst) = (0.0f64, 0.0f64);
        let mut bad = PageFlags::default();
        let mut from = 0;
        while let Some(page) = pages.take_next(from) {
            check_cancelled();
            from = page + 1;
            tets_of_page(mesh, page, |mesh, t, tet| {
                if stage.is_for_later(mesh, &tet, worst) {
                    bad.raise(t);
                    return;
                }
                match judge(mesh, &tet, stage, bounds) {
                    Judgment::Good => {}
                    // One without volume in doubles says nothing about others.
                    Judgment::Forced(q) if q.is_infinite() => {}
                    Judgment::Forced(q) => forced = forced.max(q),
                    Judgment::Bad(badness) => {
                        list.push((badness.to_bits(), t));
                        bad.raise(t);
                        worst = worst.max(badness);
                    }
                }
            });
            if list.len() >= 2 * most {
                list.sort_unstable_by(|a, b| b.cmp(a));
                list.truncate(most);
            }
        }
        *pages = bad;
        self.forced = forced;
        list.sort_unstable_by(|a, b| b.cmp(a));
        list.truncate(most);
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
            let before = self.counts.vertices_moved;
            vertices.retain(|&(v, t)| {
                if !self.mover.gather(mesh, v, t, &mut self.bounds) {
                    return false;
                }
                let is_moved = self.mover.raise_product(mesh);
                self.counts.vertices_moved += u64::from(is_moved);
                // One that is stuck between others in a cluster may move after them.
                is_moved || self.mover.is_flat()
            });
            if self.counts.vertices_moved == before {
                break;
            }
        }
    }

    fn pass<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        list: Vec<(u64, u32)>,
        pages: &mut PageFlags,
        stage: &Stage,
        progress: &mut dyn FnMut(f64),
    ) {
        self.queue.extend(list);
        self.touched.swap(0, 1);
        self.touched[0].clear();
        let total = self.queue.len();
        // What operations leave bad is followed up, up to a bound.
        let mut left = stage.tried_max(mesh.n_tets());
        while let Some((bits, t)) = self.queue.pop() {
            check_cancelled();
            progress(1.0 - (self.queue.len().min(total)) as f64 / total as f64);
            let tet = mesh.tet(t);
            // Changed since it was listed: then it was listed anew.
            let is_current = tet.is_live()
                && (judge(mesh, &tet, stage, &mut self.bounds).bad())
                    .is_some_and(|b| b.to_bits() == bits);
            if left == 0 {
                self.queue.clear();
                break;
            }
            if !is_current || !self.is_worth_trying(mesh, &tet) {
                continue;
            }
            left -= 1;
            self.counts.tried += 1;
            if !self.attack(mesh, t, &tet, stage) {
                self.failed.insert(name(mesh.points(&tet)));
                continue;
            }
            for &t in &self.changed {
                let tet = mesh.tet(t);
                self.touched[0].extend(tet.vertices());
                if let Some(badness) = judge(mesh, &tet, stage, &mut self.bounds).bad() {
                    pages.raise(t);
                    self.queue.push((badness.to_bits(), t));
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
    fn attack<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet, stage: &Stage) -> bool {
        self.changed.clear();
        self.bounds.measure = stage.goal.measure(quality(mesh.points(tet)));
        let [_, own] = value_of(mesh, tet, &mut self.bounds);
        let own = own.max(NO_VOLUME);
        let enough = ENOUGH.max(2.0 * own);
        let aim = Aim {
            own,
            enough,
            goal: stage.goal,
            more: stage.more,
            tets_max: stage.tets_max,
        };
        if self.reconnect(mesh, t, tet, enough) {
            return true;
        }
        let mut best = stage.gain_min * own;
        let mut way = Way::None;
        for v in tet.vertices() {
            if best < enough && self.mover.gather(mesh, v, t, &mut self.bounds) {
                let found = (self.mover).raise_least(mesh, aim, best, &mut self.bounds);
                if let Some((at, value)) = found.filter(|found| found.1 > best) {
                    (best, way) = (value, Way::Move(v, at));
                }
            }
        }
        if best < enough {
            let proposal = self.cavity.grow(mesh, t, aim, best, &mut self.bounds);
            self.weigh(proposal, &mut best, &mut way);
        }
        for e in 0..6 {
            // An edge's ring is a cavity of its own; it is needed where growing led nowhere.
            if best < 2.0 * own {
                let proposal = (self.cavity).split(mesh, t, e, aim, best, &mut self.bounds);
                self.weigh(proposal, &mut best, &mut way);
            }
        }
        // It takes a quarter of the time, and one success of twenty where the number of q ≥ 10 is to fall.
        if best < 2.0 * own && stage.goal != Goal::Count {
            let found = (self.refill).grow(mesh, t, aim, best, &mut self.bounds);
            if let Some(value) = found {
                (best, way) = (value, Way::Refill);
            }
        }
        let floor = match stage.goal {
            Goal::Worst | Goal::WorstExcess => best,
            Goal::Quality | Goal::Count => own,
        };
        if best < 2.0 * own && self.reconnect(mesh, t, tet, floor) {
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
        let done = self.swapper.remove_best_edge(mesh, t, tet, own, None)
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
            Way::Refill => {
                let done = self.refill.apply(mesh, &mut self.bounds);
                if done {
                    self.counts.refilled += 1;
                    self.changed.extend_from_slice(self.refill.new_tets());
                }
                done
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
    /// The filling found last.
    Refill,
    /// A vertex in the best cavity.
    Insert(Proposal),
}
