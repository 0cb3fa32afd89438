//! More good tetrahedra beside those that the surface spoils: the sum of what is missing falls.
//!
//! Edges are removed, faces swapped, vertices moved, removed and added as in the rounds before, but for their [`Missing`]. Most of
//! what is still bad then is held only by a neighbor that nothing can mend: `netgen_hinge.stl` goes from 26 to 51 % of q in
//! [1,2[, `cheese.off` from 33 to 54 %, tetrahedra with forced triangles left out. On good surfaces little is left to do and most of it is done.

use super::insertion::{Better, Inserter};
use super::missing::{GAIN, Missing};
use super::quality::{GOODNESS_WANTED, goodness};
use super::rounds::{Means, OperationCounts, Target};
use super::smooth::{Star, is_free};
use crate::mesh::{FaceRef, Mesh, Tet};
use crate::reconnect::{Ball, FaceSwap, Replacement, RingTriangulation, Shell, remove_edge};
use crate::store::Pages;

/// The third aim: what is still at q >= 2 after the others.
pub(super) const SHARE: Target = Target {
    below: GOODNESS_WANTED,
    enough: GOODNESS_WANTED,
    means: Means::Sum,
};

/// Longest ring, and largest balls that are smoothed and collapsed: as in the rounds before.
const RING_MAX: usize = 10;
const BALL_MAX: usize = 128;
const COLLAPSED_MAX: usize = 64;

/// Scratch of the search.
#[derive(Default)]
pub(super) struct Share {
    shell: Shell,
    triangulation: RingTriangulation,
    /// The best so far.
    best_shell: Shell,
    best_triangulation: RingTriangulation,
    ring: Vec<crate::geom::Point>,
    star: Star,
    ball: Ball,
    new: Vec<[u32; 4]>,
    best_ball: Ball,
    best_new: Vec<[u32; 4]>,
    replacement: Replacement,
    inserter: Inserter,
    new_tets: Vec<u32>,
}

impl Share {
    /// Does the first thing that lowers what is missing around the bad tetrahedron `t`; what changes vertices' number only when
    /// `dear`. After success `changed` lists the tetrahedra that are new or moved.
    pub(super) fn attack<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        dear: bool,
        counts: &mut OperationCounts,
        changed: &mut Vec<u32>,
    ) -> bool {
        if self.remove_edge(mesh, t, tet) {
            counts.edges_removed += 1;
            changed.extend_from_slice(&self.new_tets);
        } else if self.swap_face(mesh, t, tet) {
            counts.faces_swapped += 1;
            changed.extend_from_slice(&self.new_tets);
        } else if (tet.vertices().into_iter()).any(|v| is_free(mesh, v) && self.smooth(mesh, v, t))
        {
            counts.vertices_smoothed += 1;
            changed.extend_from_slice(&self.star.ball.tets);
        } else if dear && self.collapse_edge(mesh, t, tet) {
            counts.edges_collapsed += 1;
            changed.extend_from_slice(&self.replacement.new_tets);
        } else if dear && self.inserter.insert(mesh, t, tet, Better::Sum) {
            counts.vertices_inserted += 1;
            changed.extend_from_slice(self.inserter.new_tets());
        } else {
            return false;
        }
        true
    }

    /// Removes the edge of `t` whose shell gains most.
    fn remove_edge<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet) -> bool {
        let (mut gain, mut found) = (GAIN, false);
        for e in 0..6 {
            let shell = &mut self.shell;
            if !shell.gather_from(mesh, t, tet, e, RING_MAX) || !shell.closed || shell.required {
                continue;
            }
            self.ring.clear();
            self.ring.extend(shell.ring.iter().map(|&v| mesh.point(v)));
            let (ring, a, b) = (&self.ring, mesh.point(shell.a), mesh.point(shell.b));
            let old = Missing::of(mesh, &shell.records);
            let bar = old.bar();
            let cone = |i: usize, j: usize, k: usize| {
                let above = bar.worth(goodness([ring[i], ring[j], ring[k], b]));
                if above == f64::NEG_INFINITY {
                    return above;
                }
                above + bar.worth(goodness([a, ring[i], ring[j], ring[k]]))
            };
            if (self.triangulation).solve_sum(shell.n_ring(), old.sum + gain, cone) {
                gain = self.triangulation.worst - old.sum;
                found = true;
                std::mem::swap(&mut self.shell, &mut self.best_shell);
                std::mem::swap(&mut self.triangulation, &mut self.best_triangulation);
            }
        }
        if found {
            let (shell, triangulation) = (&self.best_shell, &self.best_triangulation);
            remove_edge(mesh, shell, triangulation, &mut self.new_tets);
        }
        found
    }

    /// Swaps the face of `t` that gains most.
    fn swap_face<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet) -> bool {
        let (mut gain, mut found) = (GAIN, None);
        for i in 0..4 {
            let Some(swap) = FaceSwap::gather_from(mesh, FaceRef::new(t, i), tet) else {
                continue;
            };
            let other = mesh.tet(tet.neighbor[i].tet());
            let old = Missing::of(mesh, &[*tet, other]);
            let bar = old.bar();
            let (p, q, [x, y, z]) = swap.points(mesh);
            let mut sum = 0.0;
            for (x, y) in [(x, y), (y, z), (z, x)] {
                sum += bar.worth(goodness([p, q, x, y]));
            }
            if sum - old.sum > gain {
                gain = sum - old.sum;
                found = Some(swap);
            }
        }
        let Some(swap) = found else {
            return false;
        };
        self.new_tets.clear();
        self.new_tets.extend(swap.apply(mesh));
        true
    }

    /// Moves `v`, a vertex of `t`.
    fn smooth<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32, t: u32) -> bool {
        if !self.star.gather(mesh, v, t, BALL_MAX) {
            return false;
        }
        let old = Missing::of(mesh, &self.star.ball.records);
        self.star.bar = Some(old.bar());
        let Some((p, _)) = self.star.search(old.sum + GAIN, 0.0) else {
            return false;
        };
        mesh.set_point(v, p);
        true
    }

    /// Collapses the edge of `t` that gains most.
    fn collapse_edge<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet) -> bool {
        let (mut gain, mut found) = (GAIN, false);
        for v in tet.vertices() {
            if !is_free(mesh, v)
                || !self.ball.gather(mesh, v, t, COLLAPSED_MAX)
                || !self.ball.closed
                || self.ball.required
            {
                continue;
            }
            let old = Missing::of(mesh, &self.ball.records);
            let mut taken = false;
            for w in tet.vertices().into_iter().filter(|&w| w != v) {
                if let Some(gained) = self.try_onto(mesh, w, old, gain) {
                    gain = gained;
                    std::mem::swap(&mut self.new, &mut self.best_new);
                    taken = true;
                }
            }
            if taken {
                found = true;
                std::mem::swap(&mut self.ball, &mut self.best_ball);
            }
        }
        let ball = &self.best_ball;
        let done =
            found && (self.replacement).apply(mesh, &ball.tets, &ball.records, &self.best_new);
        if done {
            mesh.free_vertex(ball.v);
        }
        done
    }

    /// What is gained when the ball's vertex goes to `w`, if more than `gain`; the new tetrahedra are then in `new`.
    fn try_onto<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        w: u32,
        old: Missing,
        gain: f64,
    ) -> Option<f64> {
        self.new.clear();
        let (bar, mut sum) = (old.bar(), 0.0);
        for (record, &local) in self.ball.records.iter().zip(&self.ball.locals) {
            if record.local(w).is_some() {
                continue;
            }
            let mut node = record.vertices();
            node[usize::from(local)] = w;
            sum += bar.worth(goodness(node.map(|v| mesh.point(v))));
            if sum - old.sum <= gain {
                return None;
            }
            self.new.push(node);
        }
        // Where all are bad, fewer of them are no gain by themselves: what is missing has to fall in the mean, too. Without that, `tray_bottom.stl`
        // loses two thirds of its tetrahedra, the good ones among them.
        let (n_old, n_new) = (self.ball.tets.len() as f64, self.new.len() as f64);
        let gains = n_new > 0.0 && sum / n_new > old.sum / n_old;
        gains.then_some(sum - old.sum)
    }
}
