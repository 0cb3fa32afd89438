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
//! What comes of a try is found out on all threads ahead of its turn (`window`), and brought about in order.
//!
//! Deterministic: order follows q or excess, then ids, and neither depends on paging or threads.

mod cavity;
mod face_bounds;
mod kernel;
mod list;
mod operator;
mod refill;
mod stages;
mod star;
mod vertex;
mod window;

use std::collections::{BinaryHeap, HashMap, HashSet};

use super::pages::PageFlags;
use crate::mesh::{Mesh, Tet};
use face_bounds::Measure;
use list::Judges;
pub use operator::MendCounts;
use operator::{Attacks, Operator};
pub use stages::is_to_mend;
use stages::{STAGES, Stage, WORST, judge};
use star::Goal;
use tetdb_base::storage::{Pages, check_cancelled};
use vertex::{LIFTED_MAX, name};
use window::Window;

/// Sweeps of moves for the product at most: where vertices hold each other, heights double in each.
const SWEEPS_MAX: u32 = 60;

/// Scratch and queue of all passes.
#[derive(Default)]
pub(super) struct Mender {
    operator: Operator,
    judges: Judges,
    window: Window,
    /// Of the threads that look ahead.
    operators: Vec<Operator>,
    /// Bits of the badness, which order like it, and the tetrahedron.
    queue: BinaryHeap<(u64, u32)>,
    /// Names of what was tried in vain.
    failed: HashSet<u64>,
    /// Vertices that do not move for the product, the names of their balls, and whether these are flat.
    at_rest: HashMap<u32, (u64, bool)>,
    /// The worst q in the last list's pages that the surface forces.
    forced: f64,
    /// Vertices around which something changed in this pass, and in the one before.
    touched: [HashSet<u32>; 2],
}

impl Mender {
    /// What was done so far.
    pub(super) fn counts(&self) -> MendCounts {
        self.operator.counts
    }

    /// Mends what is bad in the flagged pages. `progress` receives the share done, which never falls.
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
        for (k, stage) in STAGES.iter().enumerate() {
            let mut flags = pages.clone();
            self.failed.clear();
            self.at_rest.clear();
            for pass in 0..stage.passes_max as i32 {
                // A pass takes half as long as the one before, or less.
                let of_all = |share: f64| {
                    let left = (1.0 - 0.5 * share) * 0.5_f64.powi(pass);
                    ((k + 1) as f64 - left) / STAGES.len() as f64
                };
                let before = self.operator.counts.changes();
                if stage.goal == Goal::Quality {
                    self.lift(mesh, &flags, stage);
                }
                let list = self.list(mesh, &mut flags, stage);
                let Some(stage) = stage.at(&list, self.forced) else {
                    break;
                };
                self.pass(mesh, list, &mut flags, &stage, &mut |share| progress(of_all(share)));
                if self.operator.counts.changes() == before {
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
        let listed = self.judged(|judges| list::list(mesh, pages, stage, judges));
        self.forced = listed.forced;
        listed.bad
    }

    /// Does what needs judges, one of whom knows what the operator has met, who is told what that one has.
    fn judged<T>(&mut self, work: impl FnOnce(&Judges) -> T) -> T {
        self.judges.lend(&mut self.operator.bounds);
        let done = work(&self.judges);
        self.judges.take_back(&mut self.operator.bounds);
        done
    }

    /// Moves the inner vertices of the bad tetrahedra in the flagged pages, in sweeps: of the flat ones, however many there are, for each that stays
    /// where it is holds others, and of those listed.
    fn lift<P: Pages>(&mut self, mesh: &mut Mesh<P>, pages: &PageFlags, stage: &Stage) {
        let flat = stage.of_flat();
        let mut vertices = self.judged(|judges| list::list_movable(mesh, pages, &flat, judges));
        let mut seen: HashSet<u32> = vertices.iter().map(|&(v, _)| v).collect();
        for (_, t) in self.list(mesh, &mut pages.clone(), stage) {
            let new = mesh.tet(t).vertices().into_iter().filter(|&v| seen.insert(v));
            vertices.extend(new.map(|v| (v, t)));
        }
        for _ in 0..SWEEPS_MAX {
            check_cancelled();
            let before = self.operator.counts.vertices_moved;
            vertices.retain(|&(v, t)| {
                let Operator { mover, bounds, counts, .. } = &mut self.operator;
                // No triangle's bound counts in a product.
                let mut plain = bounds.by(Measure::Quality(f64::INFINITY));
                if !mover.gather(mesh, v, t, LIFTED_MAX, &mut plain) {
                    return false;
                }
                let around = mover.name(mesh);
                if let Some(&(_, is_flat)) = self.at_rest.get(&v).filter(|rest| rest.0 == around) {
                    return is_flat;
                }
                let is_moved = mover.raise_product(mesh);
                counts.vertices_moved += u64::from(is_moved);
                if is_moved {
                    return true;
                }
                // One that is stuck between others in a cluster may move after them.
                let is_flat = mover.is_flat();
                self.at_rest.insert(v, (around, is_flat));
                is_flat
            });
            if self.operator.counts.vertices_moved == before {
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
        self.window.clear();
        loop {
            self.evaluate_speculatively(mesh, stage);
            let Some((bits, t)) = self.queue.pop() else {
                break;
            };
            check_cancelled();
            let foreseen = self.window.take(t);
            progress(1.0 - (self.queue.len().min(total)) as f64 / total as f64);
            let tet = mesh.tet(t);
            if left == 0 {
                self.queue.clear();
                break;
            }
            if !self.is_current(mesh, &tet, bits, stage) || !self.is_worth_trying(mesh, &tet) {
                continue;
            }
            left -= 1;
            self.failed.remove(&name(mesh.points(&tet)));
            self.operator.counts.tried += 1;
            let operator = &mut self.operator;
            let done = match foreseen {
                Some(outcome) => operator.bring_about(mesh, t, &tet, outcome),
                None => operator.attack(mesh, t, &tet, stage),
            };
            if !done {
                self.failed.insert(name(mesh.points(&tet)));
                continue;
            }
            self.window.tell(mesh, &self.operator.changed);
            for k in 0..self.operator.changed.len() {
                let t = self.operator.changed[k];
                let tet = mesh.tet(t);
                self.touched[0].extend(tet.vertices());
                if let Some(badness) = judge(mesh, &tet, stage, &mut self.operator.bounds).bad() {
                    pages.raise(t);
                    self.queue.push((badness.to_bits(), t));
                }
            }
        }
    }

    /// Whether a tetrahedron is as bad as when it was listed: if it has changed, it was listed anew.
    fn is_current<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        tet: &Tet,
        bits: u64,
        stage: &Stage,
    ) -> bool {
        let bounds = &mut self.operator.bounds;
        tet.is_live()
            && (judge(mesh, tet, stage, bounds).bad()).is_some_and(|b| b.to_bits() == bits)
    }

    /// Whether it was never tried, or something has changed near it in the pass before.
    fn is_worth_trying<P: Pages>(&self, mesh: &mut Mesh<P>, tet: &Tet) -> bool {
        !self.failed.contains(&name(mesh.points(tet)))
            || tet.vertices().iter().any(|v| self.touched[1].contains(v))
    }

    /// Tries the next ones in the queue on all threads.
    fn evaluate_speculatively<P: Pages>(&mut self, mesh: &mut Mesh<P>, stage: &Stage) {
        let room = self.window.room();
        if room == 0 {
            return;
        }
        let mut next = Vec::new();
        // What is not worth trying now is not in this pass: it goes.
        while next.len() < room
            && let Some((bits, t)) = self.queue.pop()
        {
            let tet = mesh.tet(t);
            if self.is_current(mesh, &tet, bits, stage) && self.is_worth_trying(mesh, &tet) {
                next.push((bits, t));
            }
        }
        let tets: Vec<u32> = next.iter().map(|&(_, t)| t).collect();
        self.queue.extend(next);
        (self.window).look(mesh, &tets, &mut self.operators, &Attacks { stage });
    }
}
