//! A cavity filled anew with tetrahedra of its own vertices: the best filling, by search.
//!
//! The cavity grows from a bad tetrahedron by one vertex at a time, with all tetrahedra between its vertices, and after each vertex the search
//! begins anew. It puts a tetrahedron on that open face which has the fewest vertices to choose from, best first, until no face is open; what
//! is no better than the best so far, and what can no longer be closed, ends a branch.
//!
//! Whether tetrahedra cross is never asked. All are exactly positive, each face between two of them is seen from both sides, and all others
//! are the cavity's: then they cover every point inside as often as the cavity's surface winds around it, once.
//!
//! Sources: J. Liu, B. Chen, S. Sun, "Small polyhedron reconnection for mesh improvement and its implementation based on advancing
//! front technique" (2009); C. Marot, K. Verhetsel, J.-F. Remacle, "Reviving the search for optimal tetrahedralizations" (2019), for the
//! order of branches.

use super::super::smooth::is_free;
use super::cavity::Cavity;
use super::face_bounds::Weights;
use super::star::{Aim, Cost};
use crate::mesh::Mesh;
use tetdb_base::geom::{Point, orient};
use tetdb_base::shape::inverse_quality;
use tetdb_base::storage::Pages;

/// Corners of a cavity at most; more take too long to search.
const CORNERS_MAX: usize = 16;
/// Tetrahedra put in a search at most: nearly all that succeed need fewer.
const STEPS_MAX: u32 = 500;
/// Part of the cavity's volume that sums of volumes may differ by: rounding.
const ROUNDING: f64 = 1e-9;

/// Sets of three and of four among [`CORNERS_MAX`].
const TRIPLES: usize = 560;
const QUADRUPLES: usize = 1820;

/// What is known of four corners.
#[derive(Clone, Copy)]
struct Four {
    /// Whether they are positive in ascending order.
    ascending: bool,
    inverse_quality: f64,
    value: f64,
    /// Six times.
    volume: f64,
}

/// A face while the cavity is filled.
#[derive(Clone, Copy, PartialEq)]
enum Seen {
    Never,
    /// Still to be filled on one side; whether it turns as its corners ascend.
    Open(bool),
    Closed,
}

/// Corners of an open face, counter-clockwise seen from outside of what is still to be filled.
type Face = [u8; 3];

/// A filling in progress.
#[derive(Clone, Copy)]
struct Progress {
    cost: Cost,
    /// The least value so far.
    least: f64,
    /// Volume left, six times.
    volume: f64,
    /// Corners in use, as bits.
    used: u32,
}

/// Scratch of the search and the filling found.
#[derive(Default)]
pub(super) struct Refill {
    cavity: Cavity,
    corners: Vec<u32>,
    points: Vec<Point>,
    /// Corners inside, and those of them that may be left out, as bits.
    inside: u32,
    optional: u32,
    fours: Vec<Option<Four>>,
    seen: Vec<Seen>,
    /// Of required faces; see `Measure::weight`.
    weights: Vec<f64>,
    open: Vec<Face>,
    filling: Vec<[u8; 4]>,
    steps_left: u32,
    old: Cost,
    /// What a filling is to be better than: values must be above the floor.
    floor: f64,
    /// The best filling found, and how many of the cavity's tetrahedra it takes the place of.
    best: Vec<[u32; 4]>,
    n_best: usize,
}

impl Refill {
    /// The best filling of the cavities that grow from `t`, of least value above `floor`: that value.
    pub(super) fn grow<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        aim: Aim,
        floor: f64,
        weights: &mut Weights,
    ) -> Option<f64> {
        (self.floor, self.n_best) = (floor, 0);
        self.cavity.begin(mesh, t, weights);
        while (self.cavity).grow_by_vertex(mesh, aim.tets_max, CORNERS_MAX, weights) {
            let start = self.begin(mesh);
            self.search(aim, start);
            if self.n_best > 0 && self.floor >= aim.enough {
                break;
            }
        }
        (self.n_best > 0).then_some(self.floor)
    }

    /// The filling returned last: the tetrahedra that go, and those that come.
    pub(super) fn found(&self) -> (Vec<u32>, Vec<[u32; 4]>) {
        let (gone, _) = self.cavity.outline();
        (gone[..self.n_best].to_vec(), self.best.clone())
    }

    /// Numbers the cavity's corners and opens its faces.
    fn begin<P: Pages>(&mut self, mesh: &mut Mesh<P>) -> Progress {
        self.corners = self.cavity.corners();
        let corners = &self.corners;
        self.points = corners.iter().map(|&v| mesh.point(v)).collect();
        self.fours.clear();
        self.fours.resize(QUADRUPLES, None);
        self.seen.clear();
        self.seen.resize(TRIPLES, Seen::Never);
        self.weights.clear();
        self.weights.resize(TRIPLES, 1.0);
        self.open.clear();
        self.filling.clear();
        self.steps_left = STEPS_MAX;
        self.inside = (1 << corners.len()) - 1;
        for side in self.cavity.sides() {
            let face = side.vertices.map(|v| {
                let place = corners.binary_search(&v);
                place.expect("a side's vertices are the cavity's") as u8
            });
            let (ascending, is_even) = sorted(face);
            self.seen[triple(ascending)] = Seen::Open(is_even);
            self.weights[triple(ascending)] = side.weight;
            self.open.push(face);
            face.iter().for_each(|&v| self.inside &= !(1 << v));
        }
        self.optional = 0;
        for (k, &v) in corners.iter().enumerate() {
            if self.inside & 1 << k != 0 && is_free(mesh, v) {
                self.optional |= 1 << k;
            }
        }
        self.old = self.cavity.cost();
        let volumes = self.cavity.records().iter().map(|record| {
            let [a, b, c, d] = mesh.points(record);
            orient(a, b, c, d)
        });
        Progress {
            cost: Cost::default(),
            least: f64::INFINITY,
            volume: volumes.sum::<f64>() * (1.0 + ROUNDING),
            used: 0,
        }
    }

    /// Fills what is open in all ways; `true` when there is no need or no time to look further.
    fn search(&mut self, aim: Aim, progress: Progress) -> bool {
        if self.open.is_empty() {
            return self.end(aim, progress);
        }
        let Some((face, choices)) = self.tightest_face(progress) else {
            return false;
        };
        for (v, four) in choices {
            if self.steps_left == 0 {
                return true;
            }
            // The floor may have risen.
            if four.value <= self.floor {
                continue;
            }
            self.steps_left -= 1;
            let mut next = progress;
            next.cost.add(four.inverse_quality, four.value);
            next.least = next.least.min(four.value);
            next.volume -= four.volume;
            let [a, b, c] = face;
            let tet = [v, a, b, c];
            tet.iter().for_each(|&v| next.used |= 1 << v);
            let open = self.open.clone();
            let before = self.put(tet);
            if self.search(aim, next) {
                return true;
            }
            self.open = open;
            self.filling.pop();
            before.into_iter().for_each(|(k, seen)| self.seen[k] = seen);
        }
        false
    }

    /// The open face with the fewest vertices to choose from, and these, best first; `None` when there is one without any.
    fn tightest_face(&mut self, progress: Progress) -> Option<(Face, Vec<(u8, Four)>)> {
        let bits = |face: &Face| face.iter().fold(0, |bits, &v| bits | 1 << v);
        let front = self.open.iter().fold(0, |all, face| all | bits(face));
        let allowed = front | self.inside & !progress.used;
        // Those of the tightest face so far, and room for those of another.
        let (mut tightest, mut choices) = (Vec::new(), Vec::new());
        let mut face_of = None;
        for k in 0..self.open.len() {
            let face = self.open[k];
            choices.clear();
            let mut left = allowed & !bits(&face);
            // As many as the tightest face has are too many.
            while left != 0 && (face_of.is_none() || choices.len() < tightest.len()) {
                let v = left.trailing_zeros() as u8;
                left &= left - 1;
                choices.extend(self.choice(progress, face, v).map(|four| (v, four)));
            }
            if choices.is_empty() {
                return None;
            }
            if face_of.is_none() || choices.len() < tightest.len() {
                face_of = Some(face);
                std::mem::swap(&mut tightest, &mut choices);
                if tightest.len() == 1 {
                    break;
                }
            }
        }
        tightest.sort_by(|a, b| b.1.value.total_cmp(&a.1.value));
        face_of.map(|face| (face, tightest))
    }

    /// The tetrahedron of `v` on an open face, where it may be put.
    fn choice(&mut self, progress: Progress, [a, b, c]: Face, v: u8) -> Option<Four> {
        for outward in [[v, c, b], [v, a, c], [v, b, a]] {
            let (ascending, is_even) = sorted(outward);
            match self.seen[triple(ascending)] {
                Seen::Never => {}
                Seen::Open(turns) if turns == is_even => {}
                _ => return None,
            }
        }
        let (ascending, is_even) = sorted([v, a, b, c]);
        let four = self.four(ascending);
        let worst = self.old.worst_goodness.min(0.1);
        let fits = four.ascending == is_even
            && four.value > self.floor
            && four.inverse_quality >= worst
            && four.volume <= progress.volume;
        fits.then_some(four)
    }

    fn four(&mut self, corners: [u8; 4]) -> Four {
        let k = quadruple(corners);
        if let Some(known) = self.fours[k] {
            return known;
        }
        let [a, b, c, d] = corners.map(|v| self.points[usize::from(v)]);
        let det = orient(a, b, c, d);
        let good = match det > 0.0 {
            true => inverse_quality([a, b, c, d]),
            false => inverse_quality([b, a, c, d]),
        };
        let [e, f, g, h] = corners;
        let faces = [[e, f, g], [e, f, h], [e, g, h], [f, g, h]];
        let weights = faces.map(|face| self.weights[triple(face)]);
        let four = Four {
            ascending: det > 0.0,
            inverse_quality: good,
            value: good * weights.into_iter().fold(1.0, f64::max),
            volume: det.abs(),
        };
        self.fours[k] = Some(four);
        four
    }

    /// Puts a tetrahedron on the open face opposite its first corner. Returns how its faces were seen before.
    fn put(&mut self, tet: [u8; 4]) -> [(usize, Seen); 4] {
        self.filling.push(tet);
        let [v, a, b, c] = tet;
        [[a, b, c], [v, c, b], [v, a, c], [v, b, a]].map(|[p, q, r]| {
            let (ascending, is_even) = sorted([p, q, r]);
            let k = triple(ascending);
            let before = self.seen[k];
            if before == Seen::Never {
                self.seen[k] = Seen::Open(!is_even);
                self.open.push([p, r, q]);
            } else {
                self.seen[k] = Seen::Closed;
                self.open.retain(|&face| sorted(face).0 != ascending);
            }
            (k, before)
        })
    }

    /// Keeps a filling that is better than what there is.
    fn end(&mut self, aim: Aim, progress: Progress) -> bool {
        let Progress { cost, least, used, .. } = progress;
        let left_out = self.inside & !used;
        if left_out & !self.optional != 0 || !cost.is_better(&self.old, least, aim) {
            return false;
        }
        let corners = &self.corners;
        self.best.clear();
        (self.best).extend((self.filling.iter()).map(|tet| tet.map(|v| corners[usize::from(v)])));
        self.n_best = self.cavity.n_tets();
        self.floor = least;
        least >= aim.enough
    }
}

/// The number of a set of corners among all of its size; corners ascend.
fn triple(corners: [u8; 3]) -> usize {
    let [a, b, c] = corners.map(usize::from);
    a + choose2(b) + choose3(c)
}

fn quadruple([a, b, c, d]: [u8; 4]) -> usize {
    let d = usize::from(d);
    triple([a, b, c]) + choose3(d) * d.saturating_sub(3) / 4
}

fn choose2(n: usize) -> usize {
    n * n.saturating_sub(1) / 2
}

fn choose3(n: usize) -> usize {
    choose2(n) * n.saturating_sub(2) / 3
}

/// In ascending order, and whether an even number of swaps leads there.
fn sorted<const N: usize>(mut corners: [u8; N]) -> ([u8; N], bool) {
    let mut is_even = true;
    for i in 1..N {
        for j in (1..=i).rev() {
            if corners[j - 1] > corners[j] {
                corners.swap(j - 1, j);
                is_even = !is_even;
            }
        }
    }
    (corners, is_even)
}

#[cfg(test)]
mod tests {
    use super::super::face_bounds::{FaceBounds, Measure, value_of};
    use super::super::star::Goal;
    use super::*;
    use crate::optimize::measure;
    use crate::optimize::tests::{checked, delaunay, live, random};
    use tetdb_base::storage::FlatPages;

    #[test]
    fn sets_of_corners_have_numbers_of_their_own() {
        let n = CORNERS_MAX as u8;
        let (mut triples, mut quadruples) = (Vec::new(), Vec::new());
        for a in 0..n {
            for b in a + 1..n {
                for c in b + 1..n {
                    triples.push(triple([a, b, c]));
                    quadruples.extend((c + 1..n).map(|d| quadruple([a, b, c, d])));
                }
            }
        }
        for (mut numbers, count) in [(triples, TRIPLES), (quadruples, QUADRUPLES)] {
            numbers.sort_unstable();
            assert_eq!(numbers, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn fillings_found_are_better_and_the_same_polyhedra() {
        let mut n_found = 0;
        for seed in 0..60 {
            let mut next = random(seed);
            let points: Vec<Point> = (0..11)
                .map(|_| Point::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize())
                .map(|p| Point::new(p.x, p.y, 0.4 * p.z))
                .collect();
            let mut mesh = delaunay(Mesh::new(FlatPages::default()), &points, points.len(), 1.0);
            let (hull, volume) = checked(&mut mesh);
            let before = measure(&mut mesh).worst;
            let mut bounds = FaceBounds::default();
            let plain = Measure::Quality(1.0);
            let values = live(&mut mesh).into_iter().map(|(t, tet)| {
                let [_, value] = value_of(&mut mesh, &tet, &mut bounds.by(plain));
                (value, t)
            });
            let (own, worst) = values.min_by(|a, b| a.0.total_cmp(&b.0)).expect("not empty");
            let aim = Aim { own, enough: 1.0, goal: Goal::Quality, more: 0, tets_max: 40 };
            let mut refill = Refill::default();
            let Some(value) = refill.grow(&mut mesh, worst, aim, own, &mut bounds.by(plain)) else {
                continue;
            };
            assert!(value > own);
            let (gone, new) = refill.found();
            assert!(Cavity::default().exchange(&mut mesh, &gone, &new));
            let after = checked(&mut mesh);
            assert!(after.0 == hull && (after.1 - volume).abs() < 1e-12);
            // One that is there again has its vertices in another order.
            assert!(measure(&mut mesh).worst <= before.max(10.0) * (1.0 + 1e-9));
            n_found += 1;
        }
        assert!(n_found >= 10, "{n_found} of 60");
    }
}
