//! Rounds over the pages that hold bad tetrahedra.

use super::bad_fraction::BadFraction;
use super::goals::{Means, OperationCounts, RoundGoal};
use super::objective::Worst;
use super::pages::{PageFlags, clear_marks, is_examined, reopen};
use super::smooth::{Star, is_free, raised};
use super::stuck::Stuck;
use super::swap::Swapper;
use super::vertex_operations::VertexOperations;
use crate::mesh::anatomy::MARK;
use crate::mesh::anatomy::mark::{EXAMINED, RESCUED};
use crate::mesh::{Mesh, Tet, tets_of_page};
use tetdb_base::shape::{CONTENT, face_bound, inverse_quality, is_below};
use tetdb_base::storage::{Pages, check_cancelled};

/// Rounds end after this many even if they still gain.
const ROUNDS_MAX: u32 = 8;
/// A round that improves less than this share of the bad tetrahedra it looked at is the last.
const GAIN_MIN: f64 = 1e-3;
/// Largest ball that is smoothed.
const BALL_MAX: usize = 128;

/// Scratch and queues of all rounds.
pub(super) struct Rounds {
    /// Pages to look at.
    pub(super) flags: PageFlags,
    /// Pages with marks.
    marked: PageFlags,
    swapper: Swapper<Worst>,
    star: Star,
    rescue: VertexOperations,
    share: BadFraction,
    /// What gains nothing.
    stuck: Stuck,
    /// The page's bad tetrahedra, worst first, then what its operations left bad.
    work: Vec<(f64, u32)>,
    changed: Vec<u32>,
    pub(super) counts: OperationCounts,
}

/// Whether a required face keeps the tetrahedron from getting much better.
fn is_forced<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet, good: f64) -> bool {
    (0..4).any(|i| {
        tet.is_required(i) && good >= CONTENT * face_bound(tet.face(i).map(|v| mesh.point(v)))
    })
}

impl Rounds {
    pub(super) fn new(flags: PageFlags) -> Self {
        Self {
            flags,
            marked: PageFlags::default(),
            swapper: Swapper::default(),
            star: Star::default(),
            rescue: VertexOperations::default(),
            share: BadFraction::default(),
            stuck: Stuck::default(),
            work: Vec::new(),
            changed: Vec::new(),
            counts: OperationCounts::default(),
        }
    }

    /// Rounds until one gains nothing worth it.
    pub(super) fn run<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        target: RoundGoal,
        progress: &mut dyn FnMut(u32, u32),
    ) {
        self.stuck.clear();
        for _ in 0..ROUNDS_MAX {
            let before = self.counts;
            self.counts.rounds += 1;
            let mut page = 0;
            while let Some(found) = self.flags.take_next(page) {
                page = found + 1;
                progress(page, mesh.tet_ids_end() >> tetdb_schema::page::SLOT_BITS);
                self.page(mesh, found, target);
            }
            let attacked = self.counts.attacked - before.attacked;
            let gained = self.counts.changes() - before.changes();
            if (gained as f64) <= GAIN_MIN * attacked as f64 {
                break;
            }
        }
    }

    /// Takes all marks down. Returns the pages that had any or are still to be looked at: no others hold anything below the target.
    pub(super) fn finish<P: Pages>(&mut self, mesh: &mut Mesh<P>) -> PageFlags {
        let mut pages = std::mem::take(&mut self.flags);
        let mut from = 0;
        while let Some(page) = self.marked.take_next(from) {
            from = page + 1;
            pages.raise_page(page);
            tets_of_page(mesh, page, |mesh, t, tet| clear_marks(mesh, t, &tet));
        }
        pages
    }

    /// Marks tetrahedra that still exist as if all had failed on them.
    pub(super) fn pass_over<P: Pages>(&mut self, mesh: &mut Mesh<P>, tets: &[u32]) {
        for &t in tets {
            if mesh.tet(t).is_live() {
                self.mark(mesh, t, EXAMINED);
            }
        }
    }

    fn mark<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, note: usize) {
        mesh.set_mark(t, note, true);
        self.marked.raise(t);
    }

    fn page<P: Pages>(&mut self, mesh: &mut Mesh<P>, page: u32, target: RoundGoal) {
        check_cancelled();
        let mut work = std::mem::take(&mut self.work);
        work.clear();
        tets_of_page(mesh, page, |mesh, t, tet| {
            if !is_examined(&tet) {
                let points = mesh.points(&tet);
                if is_below(points, target.below) {
                    work.push((inverse_quality(points), t));
                }
            }
        });
        work.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // What operations leave bad is followed up here while it is near, up to a bound.
        let follow_max = 2 * work.len() + 64;
        let mut next = 0;
        while next < work.len() {
            let t = work[next].1;
            next += 1;
            let tet = mesh.tet(t);
            if !tet.is_live() || is_examined(&tet) {
                continue;
            }
            let good = inverse_quality(mesh.points(&tet));
            if good >= target.below {
                continue;
            }
            self.counts.attacked += 1;
            self.changed.clear();
            if is_forced(mesh, &tet, good) || !self.attack(mesh, t, &tet, good, target) {
                self.mark(mesh, t, EXAMINED);
                continue;
            }
            self.stuck.forget(mesh, &self.changed);
            for k in 0..self.changed.len() {
                let t = self.changed[k];
                let tet = mesh.tet(t);
                if is_examined(&tet) {
                    mesh.set_mark(t, EXAMINED, false);
                }
                for across in tet.neighbor {
                    if across.exists() {
                        reopen(mesh, &mut self.flags, across.tet());
                    }
                }
                if is_below(mesh.points(&tet), target.below) {
                    if work.len() < follow_max {
                        work.push((0.0, t));
                    } else {
                        self.flags.raise(t);
                    }
                }
            }
        }
        self.work = work;
    }

    /// Tries everything on the bad tetrahedron `t`; after success `changed` lists the tetrahedra that are new or moved.
    fn attack<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        good: f64,
        target: RoundGoal,
    ) -> bool {
        if target.means == Means::Sum {
            let dear = tet.node[RESCUED] & MARK == 0;
            if dear {
                self.mark(mesh, t, RESCUED);
            }
            return (self.share).attack(
                mesh,
                t,
                (tet, good),
                dear,
                &mut self.stuck,
                &mut self.counts,
                &mut self.changed,
            );
        }
        if (self.swapper).remove_best_edge(mesh, t, tet, good, Some(&mut self.stuck)) {
            self.counts.edges_removed += 1;
            self.changed.extend_from_slice(self.swapper.new_tets());
            return true;
        }
        if self.swapper.swap_best_face(mesh, t, tet, good) {
            self.counts.faces_swapped += 1;
            self.changed.extend_from_slice(self.swapper.new_tets());
            return true;
        }
        for (i, v) in tet.vertices().into_iter().enumerate() {
            // The face opposite the vertex stays, and may forbid what is wanted.
            let face = tet.face(i).map(|v| mesh.point(v));
            if self.stuck.has_vertex(v) || !is_free(mesh, v) || face_bound(face) <= raised(good) {
                continue;
            }
            if self.star.gather(mesh, v, t, BALL_MAX) && self.star.improve(mesh, target.enough) {
                self.counts.vertices_smoothed += 1;
                self.changed.extend_from_slice(&self.star.ball.tets);
                return true;
            }
            self.stuck.add_vertex(v);
        }
        // Rescue is dear: once a tetrahedron, whatever changes around it.
        if target.means == Means::Connections || tet.node[RESCUED] & MARK != 0 {
            return false;
        }
        self.mark(mesh, t, RESCUED);
        self.rescue.attack(mesh, t, tet, good, target.enough, &mut self.counts, &mut self.changed)
    }
}
