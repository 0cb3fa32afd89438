//! Moving one vertex so that the worst tetrahedron of its ball gets better.

use super::deficit::AcceptanceFloor;
use crate::mesh::Mesh;
use crate::reconnect::Ball;
use tetdb_base::geom::Point;
use tetdb_base::shape::{CONTENT, face_bound, inverse_quality};
use tetdb_base::storage::Pages;

/// Positions tried on the way to the average of the star.
const FRACTIONS: [f64; 5] = [0.1, 0.25, 0.45, 0.7, 1.0];
/// A change must raise the worst goodness by this factor and as much again in absolute terms, or double it: smaller
/// steps keep queues full around tetrahedra that the surface spoils, and end lower, for each takes the room of the next.
const GAIN_MIN: f64 = 1.03;
const GAIN_LEAST: f64 = 0.003;
/// More than rounding makes of sums and of bounds.
pub(super) const ROUNDING: f64 = 1e-9;
/// Steps of the search per vertex.
const SEARCH_STEPS: usize = 12;
/// A search without any gain so far ends after this many halvings of its step: what is nearer gains too little.
const HALVINGS_MAX: u32 = 3;

/// Whether `v` may move as far as its tag tells: it is no vertex of the surface, of an interface or of the box.
#[inline]
pub(super) fn is_free<P: Pages>(mesh: &mut Mesh<P>, v: u32) -> bool {
    !mesh.is_fixed(v)
}

/// The star of a vertex: its position and the faces opposite it.
#[derive(Default)]
pub(super) struct Star {
    pub(super) ball: Ball,
    pub(super) v: u32,
    pub(super) at: Point,
    /// Face f of a tetrahedron makes it (v, f0, f1, f2), positive.
    pub(super) faces: Vec<[Point; 3]>,
    /// With a bar, positions are judged by the sum of what is missing there and not by the worst goodness.
    pub(super) bar: Option<AcceptanceFloor>,
}

impl Star {
    /// Gathers the star of `v` from its tetrahedron `t`; `false` when it touches the hull or a required face or is too large.
    pub(super) fn gather<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        v: u32,
        t: u32,
        tets_max: usize,
    ) -> bool {
        if !self.ball.gather(mesh, v, t, tets_max) || !self.ball.closed || self.ball.required {
            return false;
        }
        self.v = v;
        self.at = mesh.point(v);
        self.faces.clear();
        for k in 0..self.ball.tets.len() {
            let [a, b, c] = self.ball.records[k].face(self.ball.locals[k].into());
            let face = [mesh.point(a), mesh.point(b), mesh.point(c)];
            self.faces.push(face);
        }
        true
    }

    /// What the star is worth with the vertex at `p`, its least goodness or the sum that its bar tells, or any value of at most `floor`
    /// when it is not above `floor`.
    ///
    /// Effects: a face that decides early moves forward, to decide earlier next time.
    #[inline]
    pub(super) fn value(&mut self, p: Point, floor: f64) -> f64 {
        if let Some(bar) = self.bar {
            return self.sum(p, floor, bar);
        }
        let mut least = f64::INFINITY;
        for k in 0..self.faces.len() {
            let [a, b, c] = self.faces[k];
            let good = inverse_quality([p, a, b, c]);
            if good <= floor {
                self.faces.swap(k, k / 2);
                return good;
            }
            if good < least {
                least = good;
            }
        }
        least
    }

    fn sum(&mut self, p: Point, floor: f64, bar: AcceptanceFloor) -> f64 {
        let mut sum = 0.0;
        for k in 0..self.faces.len() {
            let [a, b, c] = self.faces[k];
            sum += bar.worth(inverse_quality([p, a, b, c]));
            if sum <= floor {
                self.faces.swap(k, k / 2);
                break;
            }
        }
        sum
    }

    /// Looks for a position worth more than `floor`; stops early at `enough`.
    pub(super) fn search(&mut self, floor: f64, enough: f64) -> Option<(Point, f64)> {
        let n = self.faces.len() as f64;
        let mut middle = Point::ZERO;
        for [a, b, c] in &self.faces {
            middle += *a + *b + *c;
        }
        middle /= 3.0 * n;
        let mut best = floor;
        let mut at = self.at;
        for f in FRACTIONS {
            let p = self.at + (middle - self.at) * f;
            let value = self.value(p, best);
            if value > best {
                (best, at) = (value, p);
            }
        }
        let mut step = 0.0;
        for [a, ..] in &self.faces {
            step += (*a - middle).length();
        }
        step *= 0.2 / n;
        let mut halvings = 0;
        for _ in 0..SEARCH_STEPS {
            if best >= enough {
                break;
            }
            let (before, center) = (best, at);
            for direction in [Point::X, Point::Y, Point::Z] {
                for p in [center + direction * step, center - direction * step] {
                    let value = self.value(p, best);
                    if value > best {
                        (best, at) = (value, p);
                    }
                }
            }
            if best == before {
                halvings += 1;
                if best == floor && halvings > HALVINGS_MAX {
                    break;
                }
                step *= 0.5;
            }
        }
        (best > floor).then_some((at, best))
    }

    /// What the star is not worth more than with the vertex anywhere; of at most `f64::INFINITY`.
    pub(super) fn most(&self) -> f64 {
        let Some(bar) = self.bar else {
            return self.bound() * (1.0 + ROUNDING);
        };
        let mut most = 0.0;
        for &face in &self.faces {
            most += bar.worth(face_bound(face) * (1.0 + ROUNDING));
        }
        most + ROUNDING
    }

    /// What no position of the vertex can exceed, given the faces opposite it.
    fn bound(&self) -> f64 {
        let bounds = self.faces.iter().map(|&face| face_bound(face));
        bounds.fold(f64::INFINITY, f64::min)
    }

    /// Moves the vertex when that raises the worst goodness of its ball; the mesh is changed only then.
    pub(super) fn improve<P: Pages>(&mut self, mesh: &mut Mesh<P>, enough: f64) -> bool {
        let worst = self.value(self.at, f64::NEG_INFINITY);
        if worst >= enough {
            return false;
        }
        let bound = self.bound();
        if worst >= bound / GAIN_MIN {
            return false;
        }
        match self.search(raised(worst), enough.min(bound * CONTENT)) {
            Some((p, _)) => {
                mesh.set_point(self.v, p);
                true
            }
            None => false,
        }
    }
}

/// What a new worst goodness must exceed to count as better than `worst`.
#[inline]
pub(super) fn raised(worst: f64) -> f64 {
    (worst * GAIN_MIN + GAIN_LEAST).min(worst * 2.0 + 1e-9)
}

#[cfg(test)]
mod tests {
    use super::super::deficit::Deficit;
    use super::*;
    use crate::optimize::tests::random;

    #[test]
    fn no_place_is_worth_more_than_faces_allow() {
        let mut next = random(5);
        for flat in [1.0, 0.1, 1e-3] {
            let mut point = || Point::new(next(), next(), flat * next());
            let mut star = Star {
                faces: (0..6).map(|_| [point(), point(), point()]).collect(),
                ..Star::default()
            };
            let mut old = Deficit::default();
            old.add(0.0);
            for bar in [None, Some(old.bar())] {
                star.bar = bar;
                for _ in 0..200 {
                    let value = star.value(point(), f64::NEG_INFINITY);
                    assert!(value <= star.most(), "{value}, at most {}", star.most());
                }
            }
        }
    }
}
