//! Edge collapse: a free vertex disappears into a neighbor.

use super::quality::goodness;
use super::smooth::{is_free, raised};
use crate::mesh::{Mesh, Tet};
use crate::reconnect::{Ball, Replacement};
use crate::store::Pages;

/// Largest ball that is collapsed.
const BALL_MAX: usize = 64;

/// Scratch of the search.
#[derive(Default)]
pub(super) struct Collapser {
    ball: Ball,
    best_ball: Ball,
    new: Vec<[u32; 4]>,
    best_new: Vec<[u32; 4]>,
    pub(super) replacement: Replacement,
}

impl Collapser {
    /// Collapses the edge of `t` that leaves the best worst goodness, if that is better than now.
    pub(super) fn collapse_best_edge<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        own: f64,
    ) -> bool {
        let mut best = raised(own);
        let mut found = false;
        for v in tet.vertices() {
            if !is_free(mesh, v)
                || !self.ball.gather(mesh, v, t, BALL_MAX)
                || !self.ball.closed
                || self.ball.required
            {
                continue;
            }
            let mut taken = false;
            for w in tet.vertices().into_iter().filter(|&w| w != v) {
                if let Some(worst) = self.try_onto(mesh, w, best) {
                    best = worst;
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
        let done = found
            && self
                .replacement
                .apply(mesh, &ball.tets, &ball.records, &self.best_new);
        if done {
            mesh.free_vertex(ball.v);
        }
        done
    }

    /// The least goodness when the ball's vertex goes to `w`, if above `floor`; the new tetrahedra are then in `new`.
    fn try_onto<P: Pages>(&mut self, mesh: &mut Mesh<P>, w: u32, floor: f64) -> Option<f64> {
        self.new.clear();
        let mut least = f64::INFINITY;
        for (record, &local) in self.ball.records.iter().zip(&self.ball.locals) {
            if record.local(w).is_some() {
                continue;
            }
            let mut node = record.vertices();
            node[usize::from(local)] = w;
            least = least.min(goodness(node.map(|v| mesh.point(v))));
            if least <= floor {
                return None;
            }
            self.new.push(node);
        }
        (!self.new.is_empty()).then_some(least)
    }
}
