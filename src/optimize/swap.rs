//! The best reconnection around a bad tetrahedron: one of its edges removed, or one of its faces swapped.

use super::quality::goodness;
use super::smooth::raised;
use crate::geom::Point;
use crate::mesh::{FaceRef, Mesh, Tet};
use crate::reconnect::{FaceSwap, Forced, RingTriangulation, Shell, remove_edge};
use crate::store::Pages;

/// Longest ring: 9 finds 1 % fewer removals than 12 and costs a third less.
const RING_MAX: usize = 10;

/// Scratch of the search; after success [`Swapper::new_tets`] lists what was made.
#[derive(Default)]
pub(super) struct Swapper {
    shell: Shell,
    triangulation: RingTriangulation,
    /// The best so far.
    best_shell: Shell,
    best_triangulation: RingTriangulation,
    pub(super) new_tets: Vec<u32>,
}

impl Swapper {
    /// Removes the edge of `t` that leaves the best worst goodness, if that is better than now.
    pub(super) fn remove_best_edge<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        own: f64,
    ) -> bool {
        // Nothing at or below what `t` itself has can be an improvement.
        let mut best = raised(own);
        let mut found = false;
        for e in 0..6 {
            if let Some(worst) = self.try_edge(mesh, t, tet, e, best) {
                best = worst;
                found = true;
                std::mem::swap(&mut self.shell, &mut self.best_shell);
                std::mem::swap(&mut self.triangulation, &mut self.best_triangulation);
            }
        }
        if found {
            remove_edge(
                mesh,
                &self.best_shell,
                &self.best_triangulation,
                &mut self.new_tets,
            );
        }
        found
    }

    /// The best worst goodness without edge `e`, if above `floor`.
    fn try_edge<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        e: usize,
        floor: f64,
    ) -> Option<f64> {
        let shell = &mut self.shell;
        if !shell.gather_from(mesh, t, tet, e, RING_MAX) || !shell.closed || shell.required {
            return None;
        }
        let n = shell.n_ring();
        let mut ring = [Point::ZERO; RING_MAX];
        for (point, &v) in ring.iter_mut().zip(&shell.ring) {
            *point = mesh.point(v);
        }
        let (a, b) = (mesh.point(shell.a), mesh.point(shell.b));
        // The worst of the shell is at most that of `t`, and the floor is above it already.
        let cone = |i: usize, j: usize, k: usize| {
            let above = goodness([ring[i], ring[j], ring[k], b]);
            if above <= floor {
                return f64::NEG_INFINITY;
            }
            let below = goodness([a, ring[i], ring[j], ring[k]]);
            if above < below { above } else { below }
        };
        let solved = self.triangulation.solve(n, floor, Forced::Nothing, cone);
        solved.then_some(self.triangulation.worst)
    }

    /// Swaps the face of `t` that leaves the best worst goodness, if that is better than now.
    pub(super) fn swap_best_face<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        own: f64,
    ) -> bool {
        let mut best = raised(own);
        let mut found = None;
        for i in 0..4 {
            let Some(swap) = FaceSwap::gather_from(mesh, FaceRef::new(t, i), tet) else {
                continue;
            };
            let (p, q, [x, y, z]) = swap.points(mesh);
            let mut least = f64::INFINITY;
            for (x, y) in [(x, y), (y, z), (z, x)] {
                least = least.min(goodness([p, q, x, y]));
                if least <= best {
                    break;
                }
            }
            if least > best {
                best = least;
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
}
