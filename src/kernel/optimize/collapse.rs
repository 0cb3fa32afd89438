//! Edge collapse: a free vertex disappears into a neighbor.

use std::marker::PhantomData;

use super::objective::Objective;
use super::smooth::is_free;
use crate::mesh::{Mesh, Tet};
use crate::reconnect::{Ball, Replacement};
use tetdb_base::storage::Pages;

/// Largest ball that is collapsed.
const BALL_MAX: usize = 64;

/// Scratch of the search.
#[derive(Default)]
pub(super) struct Collapser<J> {
    ball: Ball,
    best_ball: Ball,
    new: Vec<[u32; 4]>,
    best_new: Vec<[u32; 4]>,
    replacement: Replacement,
    objective: PhantomData<J>,
}

impl<J: Objective> Collapser<J> {
    /// Collapses the edge of `t`, whose goodness is `own`, that is worth most, if any is worth enough.
    pub(super) fn collapse_best_edge<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        own: f64,
    ) -> bool {
        let mut best = J::least(own);
        let mut found = false;
        for v in tet.vertices() {
            if !is_free(mesh, v)
                || !self.ball.gather(mesh, v, t, BALL_MAX)
                || !self.ball.closed
                || self.ball.required
            {
                continue;
            }
            let old = J::old(mesh, &self.ball.records);
            let mut taken = false;
            for w in tet.vertices().into_iter().filter(|&w| w != v) {
                if let Some(worth) = self.try_onto(mesh, w, old, best) {
                    best = worth;
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

    /// What it is worth when the ball's vertex goes to `w`, if more than `best`; the new tetrahedra are then in `new`.
    fn try_onto<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        w: u32,
        old: J::Old,
        best: f64,
    ) -> Option<f64> {
        self.new.clear();
        let floor = J::floor(old, best);
        let new = &mut self.new;
        let tets = (self.ball.records.iter().zip(&self.ball.locals))
            .filter(|(record, _)| record.local(w).is_none())
            .map(|(record, &local)| {
                let mut node = record.vertices();
                node[usize::from(local)] = w;
                new.push(node);
                node.map(|v| mesh.point(v))
            });
        let number = J::number(old, floor, tets);
        let better = J::worth(old, number) > best;
        let allowed = better && J::allows(old, self.ball.tets.len(), number, self.new.len());
        allowed.then(|| J::worth(old, number))
    }

    /// Tetrahedra made by the last success.
    pub(super) fn new_tets(&self) -> &[u32] {
        &self.replacement.new_tets
    }
}
