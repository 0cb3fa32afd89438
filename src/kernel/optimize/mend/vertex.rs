//! Moves of inner vertices: first for all of the ball together, then for its worst.

use super::super::smooth::is_free;
use super::face_bounds::{Weights, value_of};
use super::star::{Aim, Cost, Goal, Side, Star};
use crate::mesh::Mesh;
use crate::reconnect::Ball;
use tetdb_base::geom::{Point, STEP, mix};
use tetdb_base::shape::Climb;
use tetdb_base::storage::Pages;

/// Largest ball whose vertex moves for the product: in a fan of needles one vertex sees thousands of them.
pub(super) const LIFTED_MAX: usize = 1 << 14;
/// Largest ball whose vertex moves for its worst, which many tetrahedra ask for.
pub(super) const BALL_MAX: usize = 1024;
/// Steps of a search.
const STEPS: u32 = 60;
/// Places tried on the way back to where a vertex is, each half as far.
const HALVINGS: u32 = 12;
/// A move for the product must raise it by at least this much, in powers of two.
const GAIN_MIN: f64 = 0.1;
/// It must also raise it by this much for each tetrahedron of the ball. A ball of thousands can always gain a few powers that no single
/// tetrahedron notices, and after each such move the neighbors were searched again for nothing.
const GAIN_EACH: f64 = 0.003;

/// A tetrahedron below this value is flat but for rounding.
pub(super) const FLAT: f64 = 1e-4;

/// A tetrahedron, or another set of points in order, by their positions.
pub(super) fn name(points: impl IntoIterator<Item = Point>) -> u64 {
    let words = points.into_iter().flat_map(|p| p.to_array());
    words.fold(0, |name, x| mix(name.wrapping_add(STEP) ^ x.to_bits()))
}

/// Scratch of moves.
#[derive(Default)]
pub(super) struct Mover {
    pub(super) ball: Ball,
    star: Star,
    /// Whether the ball had a tetrahedron without volume but for rounding when it was looked at last.
    was_flat: bool,
}

impl Mover {
    /// Gathers the star of `v` from its tetrahedron `t`; `false` when it may not move or its ball is too large.
    pub(super) fn gather<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        v: u32,
        t: u32,
        tets_max: usize,
        weights: &mut Weights,
    ) -> bool {
        if !is_free(mesh, v)
            || !self.ball.gather(mesh, v, t, tets_max)
            || !self.ball.closed
            || self.ball.required
        {
            return false;
        }
        self.star.sides.clear();
        for (record, &local) in self.ball.records.iter().zip(&self.ball.locals) {
            let side = Side::new(mesh, record, local.into(), weights);
            self.star.sides.push(side);
        }
        true
    }

    /// Where vertex and ball gathered are.
    pub(super) fn name(&self, mesh: &mut Mesh<impl Pages>) -> u64 {
        let corners = self.star.sides.iter().flat_map(|side| side.points);
        name(std::iter::once(mesh.point(self.ball.v)).chain(corners))
    }

    /// Moves the vertex gathered to where the product of its ball's values is largest.
    ///
    /// What the worst value of a ball cannot do, this can: in clusters of flat tetrahedra each move for the worst is stopped by
    /// the next one, while their product still has a slope.
    pub(super) fn raise_product<P: Pages>(&mut self, mesh: &mut Mesh<P>) -> bool {
        let (v, start) = (self.ball.v, mesh.point(self.ball.v));
        // A mere needle must not become worse; in a cluster some have to, for a while.
        let least = self.star.least(start, f64::NEG_INFINITY);
        self.was_flat = least < FLAT;
        let floor = if self.was_flat { f64::MIN_POSITIVE } else { least };
        let before = self.star.product(start, f64::MIN_POSITIVE);
        let (lifted, value) = (self.star.lift(start, floor)).unwrap_or((start, before));
        let climb = Climb {
            start: lifted,
            step: 0.2 * self.star.radius(start),
            steps: STEPS,
            enough: f64::INFINITY,
        };
        let found = climb.run(value, |p, _| self.star.product(p, floor));
        let (p, value) = found.unwrap_or((lifted, value));
        let gain_min = GAIN_MIN.max(GAIN_EACH * self.star.sides.len() as f64);
        let is_better = value > before + gain_min;
        if is_better {
            mesh.set_point(v, p);
        }
        is_better
    }

    /// Whether the ball last looked at by [`Mover::raise_product`] was flat before.
    pub(super) fn is_flat(&self) -> bool {
        self.was_flat
    }

    /// Where the worst of the ball gathered is best, and its value there, where the ball gets better. For the worst excess, where that place costs the
    /// worst q too much, a place on the way there. `None` where no place is above `floor`.
    pub(super) fn raise_least<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        aim: Aim,
        floor: f64,
        weights: &mut Weights,
    ) -> Option<(Point, f64)> {
        if self.star.most() <= floor {
            return None;
        }
        let start = mesh.point(self.ball.v);
        let value = self.star.least(start, f64::NEG_INFINITY);
        let (at, value) = (self.star).raise_least(start, value, STEPS, aim.enough);
        let mut old = Cost::default();
        for record in &self.ball.records {
            let [good, value] = value_of(mesh, record, weights);
            old.add(good, value);
        }
        let is_better =
            |star: &Star, at, value| value > 0.0 && star.cost(at).is_better(&old, value, aim);
        if is_better(&self.star, at, value) {
            return Some((at, value));
        }
        if aim.goal != Goal::WorstExcess {
            return None;
        }
        let mut way = at - start;
        (0..HALVINGS).find_map(|_| {
            way *= 0.5;
            let at = start + way;
            let value = self.star.least(at, f64::NEG_INFINITY);
            is_better(&self.star, at, value).then_some((at, value))
        })
    }
}
