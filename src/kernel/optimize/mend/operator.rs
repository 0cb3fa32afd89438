//! Everything that is tried on one bad tetrahedron, and the best of it done.

use super::super::collapse::Collapser;
use super::super::objective::Worst;
use super::super::swap::Swapper;
use super::cavity::{Cavity, Proposal};
use super::face_bounds::{FaceBounds, value_of};
use super::refill::Refill;
use super::stages::Stage;
use super::star::{Aim, Goal};
use super::vertex::{BALL_MAX, Mover};
use crate::mesh::{DraftState, Mesh, Speculation, Tet};
use tetdb_base::geom::Point;
use tetdb_base::shape::quality;
use tetdb_base::storage::Pages;

/// Searches stop at this value, and an operation that reaches it is done without trying others.
const ENOUGH: f64 = 0.5;

/// Below this value volumes are rounding: what takes the place of such a tetrahedron has to be above.
pub(super) const NO_VOLUME: f64 = 1e-15;

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
    pub(super) fn changes(&self) -> u64 {
        self.reconnected
            + self.refilled
            + self.vertices_moved
            + self.vertices_inserted
            + self.vertices_removed
    }
}

/// Scratch of all operations. What comes of them does not depend on what was done before.
#[derive(Default)]
pub(super) struct Operator {
    pub(super) mover: Mover,
    cavity: Cavity,
    /// The cavity of the best proposal so far.
    best_cavity: Cavity,
    refill: Refill,
    pub(super) bounds: FaceBounds,
    swapper: Swapper<Worst>,
    collapser: Collapser<Worst>,
    /// After success the tetrahedra that are new or moved.
    pub(super) changed: Vec<u32>,
    pub(super) counts: MendCounts,
}

/// What comes of an attack, as anyone can bring it about as long as nothing has changed where it was found.
pub(super) enum Outcome {
    Nothing,
    /// A flip, or an edge or a vertex removed, for values above this.
    Reconnection(f64),
    Move(u32, Point),
    /// Tetrahedra filled anew with these.
    Refill(Vec<u32>, Vec<[u32; 4]>),
    /// A vertex joined to the outer faces of tetrahedra.
    Insertion(Vec<u32>, Vec<[u32; 3]>, Proposal),
}

/// The best operation found so far.
#[derive(Clone, Copy)]
enum Way {
    None,
    Move(u32, Point),
    /// The filling found last.
    Refill,
    /// A vertex in the best cavity.
    Insert(Proposal),
}

impl Operator {
    /// One of those that try ahead, each thread has one: they remember less.
    pub(super) fn ahead() -> Self {
        Self { bounds: FaceBounds::remembering(7 << 12), ..Self::default() }
    }

    /// Tries everything on the bad tetrahedron `t`; after success `changed` lists the tetrahedra that are new or moved.
    pub(super) fn attack<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        stage: &Stage,
    ) -> bool {
        self.changed.clear();
        match self.try_all(mesh, t, tet, stage) {
            Outcome::Reconnection(_) => true,
            outcome => self.bring_about(mesh, t, tet, outcome),
        }
    }

    /// What comes of trying everything on the bad tetrahedron `t`; where that is a reconnection, it is done already, and else nothing is.
    fn try_all<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        stage: &Stage,
    ) -> Outcome {
        let measure = stage.goal.measure(quality(mesh.points(tet)));
        let [_, own] = value_of(mesh, tet, &mut self.bounds.by(measure));
        let own = own.max(NO_VOLUME);
        let enough = ENOUGH.max(2.0 * own);
        let aim = Aim { own, enough, goal: stage.goal, more: stage.more, tets_max: stage.tets_max };
        if self.reconnect(mesh, t, tet, enough) {
            return Outcome::Reconnection(enough);
        }
        let mut best = stage.gain_min * own;
        let mut way = Way::None;
        for v in tet.vertices() {
            if best < enough
                && (self.mover).gather(mesh, v, t, BALL_MAX, &mut self.bounds.by(measure))
            {
                let found = (self.mover).raise_least(mesh, aim, best, &mut self.bounds.by(measure));
                if let Some((at, value)) = found.filter(|found| found.1 > best) {
                    (best, way) = (value, Way::Move(v, at));
                }
            }
        }
        if best < enough {
            let proposal = self.cavity.grow(mesh, t, aim, best, &mut self.bounds.by(measure));
            self.weigh(proposal, &mut best, &mut way);
        }
        for e in 0..6 {
            // An edge's ring is a cavity of its own; it is needed where growing led nowhere.
            if best < 2.0 * own {
                let proposal =
                    (self.cavity).split(mesh, t, e, aim, best, &mut self.bounds.by(measure));
                self.weigh(proposal, &mut best, &mut way);
            }
        }
        // It takes a quarter of the time, and one success of twenty where the number of q ≥ 10 is to fall.
        if best < 2.0 * own && stage.goal != Goal::Count {
            let found = (self.refill).grow(mesh, t, aim, best, &mut self.bounds.by(measure));
            if let Some(value) = found {
                (best, way) = (value, Way::Refill);
            }
        }
        let floor = match stage.goal {
            Goal::Worst | Goal::WorstExcess => best,
            Goal::Quality | Goal::Count => own,
        };
        if best < 2.0 * own && self.reconnect(mesh, t, tet, floor) {
            return Outcome::Reconnection(floor);
        }
        match way {
            Way::None => Outcome::Nothing,
            Way::Move(v, at) => Outcome::Move(v, at),
            Way::Refill => {
                let (tets, new) = self.refill.found();
                Outcome::Refill(tets, new)
            }
            Way::Insert(proposal) => {
                let (tets, faces) = self.best_cavity.outline();
                Outcome::Insertion(tets, faces, proposal)
            }
        }
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

    /// Does what was found; `false`, with nothing changed, where that is nothing or cannot be done. After success `changed` lists the tetrahedra that are
    /// new or moved.
    pub(super) fn bring_about<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        outcome: Outcome,
    ) -> bool {
        self.changed.clear();
        match outcome {
            Outcome::Nothing => false,
            Outcome::Reconnection(floor) => {
                let done = self.reconnect(mesh, t, tet, floor);
                assert!(done, "tetrahedron {t} could be reconnected");
                true
            }
            Outcome::Move(v, at) => {
                let found = self.mover.ball.gather(mesh, v, t, usize::MAX);
                assert!(found, "tetrahedron {t} has vertex {v}");
                mesh.set_point(v, at);
                self.counts.vertices_moved += 1;
                self.changed.extend_from_slice(&self.mover.ball.tets);
                true
            }
            Outcome::Refill(tets, new) => {
                let done = self.cavity.exchange(mesh, &tets, &new);
                self.counts.refilled += u64::from(done);
                self.list_new(done)
            }
            Outcome::Insertion(tets, faces, proposal) => {
                let done = self.cavity.insert(mesh, &tets, &faces, proposal);
                self.counts.vertices_inserted += u64::from(done);
                self.list_new(done)
            }
        }
    }

    fn list_new(&mut self, done: bool) -> bool {
        if done {
            self.changed.extend_from_slice(self.cavity.new_tets());
        }
        done
    }
}

/// Attacks before their turn.
pub(super) struct Attacks<'a> {
    pub(super) stage: &'a Stage,
}

impl Speculation for Attacks<'_> {
    type Item = u32;
    type Scratch = Operator;
    type Outcome = Outcome;

    fn attempt<P: Pages>(
        &self,
        operator: &mut Operator,
        mesh: &mut Mesh<P>,
        &t: &u32,
    ) -> Option<(Outcome, DraftState)> {
        let tet = mesh.tet(t);
        let outcome = operator.try_all(mesh, t, &tet, self.stage);
        let left = match outcome {
            Outcome::Reconnection(_) => DraftState::Used,
            _ => DraftState::Unchanged,
        };
        Some((outcome, left))
    }
}
