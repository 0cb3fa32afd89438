//! Moves vertices that left the surface apart, until exact positions can be rounded to doubles.
//!
//! ```text
//!      a'---X---b'        A vertex that replaces X lies in a wedge near X, and the next one, which replaces a neighbor of X,
//!       \  P   /          near that: each sees less than the one before, down to less than the last bit of a double. Off the
//!        \ | Q/           surface they are free: the ones nobody needs go, each of the others moves to where it sees its
//!         \|/ /           ball best, which makes room for its neighbors, and takes a double as soon as one will do.
//!          c--            Between facets nearer to each other than the last bits of their corners there is none.
//! ```

use super::chain::PatchFailure;
use super::complex::TetComplex;
use super::exact::ExactPoint;
use super::free_vertex::remove_free;
use super::inscribed_ball::{HalfSpace, ball_center, clearance};
use super::patch::RecoveryPatch;
use super::suppress::half_space;
use super::walk::ball;
use tetdb_base::geom::{Dyadic, IdSet, Point};
use tetdb_base::storage::Pages;

/// Rounds over all vertices: the clearance grows by a factor each time.
const ROUNDS_MAX: usize = 60;

/// Least factor by which a move must raise the clearance.
const GAIN_MIN: f64 = 1.25;

/// Precision at the narrowest place, as a share of the clearance: coordinates keep so many bits below it.
const FINE: f64 = 1.0 / 1024.0;

impl<P: Pages> RecoveryPatch<'_, P> {
    /// Takes away or moves the new vertices until all are doubles. They must be off the surface.
    pub(super) fn round_to_doubles(&mut self) -> Result<(), PatchFailure> {
        for _ in 0..ROUNDS_MAX {
            let mut exact = false;
            let mut changed = false;
            for v in 0..self.n_vertices() {
                if !self.is_new(v) || !self.is_in_use(v) {
                    continue;
                }
                self.thin_out(v);
                if remove_free(self, v, 0.0) {
                    changed = true;
                    continue;
                }
                changed |= self.move_apart(v);
                exact |= self.is_exact(v);
            }
            if !exact {
                return Ok(());
            }
            if !changed {
                break;
            }
        }
        Err(PatchFailure::Precision("doubles leave no place beside its neighbors"))
    }

    /// Moves free vertex `v` to the middle of the region that sees its ball, to a double if one sees it.
    fn move_apart(&mut self, v: u32) -> bool {
        let ball = ball(self, v);
        let mut reach = 0.0f64;
        let mut planes: Vec<HalfSpace> = Vec::new();
        let mut neighbors: IdSet<u32> = IdSet::default();
        for &t in &ball {
            let tet = self.tet(t);
            let Some(i) = tet.local(v) else { continue };
            let corners = tet.face(i).map(|u| self.offset(v, u));
            neighbors.extend(tet.face(i));
            reach = corners.iter().map(|c| c.length()).fold(reach, f64::max);
            planes.extend(half_space(corners));
        }
        let was_exact = self.is_exact(v);
        if !was_exact && !neighbors.iter().any(|&u| self.is_exact(u)) {
            return false;
        }
        let Some(best) = ball_center(&planes, reach) else {
            return false;
        };
        let old = self.placement(v);
        let (now, then) = (clearance(&planes, Point::ZERO), clearance(&planes, best));
        // As a double, at best in the middle, else on the way there.
        for share in [1.0, 0.5, 0.25, 0.0] {
            let place = self.position(v) + best * share;
            let gains = was_exact || clearance(&planes, best * share) > now * GAIN_MIN;
            if gains && self.try_place(v, &ball, (place, None)) {
                return true;
            }
        }
        if !was_exact || then <= now * GAIN_MIN {
            return false;
        }
        let mut share = 1.0;
        while share > 1e-3 {
            let exact = self.exact_place(v).moved(best * share, &Dyadic::from(then * share * FINE));
            if self.try_place(v, &ball, (exact.rounded(), Some(exact))) {
                return true;
            }
            share *= 0.5;
        }
        self.place(v, old);
        false
    }

    /// Moves `v` if the volumes of its ball stay positive.
    fn try_place(&mut self, v: u32, ball: &[u32], place: (Point, Option<ExactPoint>)) -> bool {
        let old = self.placement(v);
        self.place(v, place);
        let holds = ball.iter().all(|&t| {
            let q = self.tet(t).vertices();
            self.orient(q) > 0.0
        });
        if !holds {
            self.place(v, old);
        }
        holds
    }
}
