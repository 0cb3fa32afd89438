//! More good tetrahedra beside those that the surface spoils: the sum of what is missing falls.
//!
//! Edges are removed, faces swapped, vertices moved, removed and added as in the rounds before, but for their [`Deficit`]. Most of
//! what is still bad then is held only by a neighbor that nothing can mend: `netgen_hinge.stl` goes from 26 to 51 % of q in
//! [1,2[, `cheese.off` from 33 to 54 %, tetrahedra with forced triangles left out. On good surfaces little is left to do and most of it is done.

use super::collapse::Collapser;
use super::deficit::{Deficit, GAIN};
use super::goals::OperationCounts;
use super::insertion::{Better, Inserter};
use super::objective::Sum;
use super::smooth::{Star, is_free};
use super::stuck::Stuck;
use super::swap::Swapper;
use crate::mesh::{Mesh, Tet};
use tetdb_base::storage::Pages;

/// Largest ball that is smoothed: as in the rounds before.
const BALL_MAX: usize = 128;

/// Scratch of the search.
#[derive(Default)]
pub(super) struct BadFraction {
    swapper: Swapper<Sum>,
    star: Star,
    collapser: Collapser<Sum>,
    inserter: Inserter,
}

impl BadFraction {
    /// Does the first thing that lowers what is missing around the bad tetrahedron `t`; what changes vertices' number only when
    /// `dear`. After success `changed` lists the tetrahedra that are new or moved.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn attack<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        (tet, good): (&Tet, f64),
        dear: bool,
        stuck: &mut Stuck,
        counts: &mut OperationCounts,
        changed: &mut Vec<u32>,
    ) -> bool {
        if (self.swapper).remove_best_edge(mesh, t, tet, good, Some(&mut *stuck)) {
            counts.edges_removed += 1;
            changed.extend_from_slice(self.swapper.new_tets());
        } else if self.swapper.swap_best_face(mesh, t, tet, good) {
            counts.faces_swapped += 1;
            changed.extend_from_slice(self.swapper.new_tets());
        } else if (tet.vertices().into_iter()).any(|v| self.smooth(mesh, v, t, stuck)) {
            counts.vertices_smoothed += 1;
            changed.extend_from_slice(&self.star.ball.tets);
        } else if dear && self.collapser.collapse_best_edge(mesh, t, tet, good) {
            counts.edges_collapsed += 1;
            changed.extend_from_slice(self.collapser.new_tets());
        } else if dear && self.inserter.insert(mesh, t, tet, Better::Sum) {
            counts.vertices_inserted += 1;
            changed.extend_from_slice(self.inserter.new_tets());
        } else {
            return false;
        }
        true
    }

    /// Moves `v`, a vertex of `t`, unless it is stuck or fixed.
    fn smooth<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32, t: u32, stuck: &mut Stuck) -> bool {
        if stuck.has_vertex(v) || !is_free(mesh, v) {
            return false;
        }
        let is_moved = self.search(mesh, v, t);
        if !is_moved {
            stuck.add_vertex(v);
        }
        is_moved
    }

    fn search<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32, t: u32) -> bool {
        if !self.star.gather(mesh, v, t, BALL_MAX) {
            return false;
        }
        let old = Deficit::of(mesh, &self.star.ball.records);
        self.star.bar = Some(old.bar());
        // Where the faces around it make the ball what it is, no place helps.
        if self.star.most() <= old.sum + GAIN {
            return false;
        }
        let Some((p, _)) = self.star.search(old.sum + GAIN, 0.0) else {
            return false;
        };
        mesh.set_point(v, p);
        true
    }
}
