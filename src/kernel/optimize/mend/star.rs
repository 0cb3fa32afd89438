//! A vertex and the faces it is joined to: what its tetrahedra are worth, and where it should be.

use super::face_bounds::{Measure, Weights};
use super::kernel::{self, farthest_inside};
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::geom::{Point, orient};
use tetdb_base::shape::Climb;
use tetdb_base::shape::{ALPHA, face_bound};
use tetdb_base::storage::Pages;

/// A face of the star and the tetrahedron of the vertex on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// Counter-clockwise seen from outside: (v, 0, 1, 2) is positive.
    pub(super) vertices: [u32; 3],
    pub(super) points: [Point; 3],
    /// Twice the area, outward.
    normal: Point,
    area: f64,
    longest_squared: f64,
    /// Square of the volume below which rounding may decide, over the squared distance of the vertex.
    doubt: f64,
    /// See [`Measure::weight`].
    pub(super) weight: f64,
    /// The value is not above this, wherever the vertex is.
    most: f64,
    /// The face beyond, or none.
    pub(super) across: FaceRef,
    pub(super) required: bool,
}

impl Side {
    /// Face `i` of a tetrahedron.
    pub(super) fn new<P: Pages>(
        mesh: &mut Mesh<P>,
        record: &Tet,
        i: usize,
        weights: &mut Weights,
    ) -> Self {
        let vertices = record.face(i);
        let points = vertices.map(|v| mesh.point(v));
        let [a, b, c] = points;
        let (u, v, w) = (b - a, c - a, c - b);
        let normal = u.cross(v);
        let required = record.is_required(i);
        let weight = if required { weights.of_face(vertices, points) } else { 1.0 };
        Self {
            vertices,
            points,
            normal,
            area: normal.length(),
            longest_squared: u.dot(u).max(v.dot(v)).max(w.dot(w)),
            doubt: 1e-28 * u.dot(u) * v.dot(v),
            weight,
            most: if weight < f64::MAX {
                weight * face_bound(points) * (1.0 + ROUNDING)
            } else {
                f64::INFINITY
            },
            across: record.neighbor[i],
            required,
        }
    }

    /// Weight over q with the vertex at `p`; zero or less where the tetrahedron is not exactly positive.
    #[inline]
    pub(super) fn value(&self, p: Point) -> f64 {
        let good = self.inverse_quality(p);
        if good > 0.0 { self.weight * good } else { good }
    }

    /// How far in front of the plane `p` is.
    fn height(&self, p: Point) -> f64 {
        let [a, b, c] = self.points;
        orient(p, a, b, c) / self.area
    }

    /// Radius of the inscribed circle.
    fn radius(&self) -> f64 {
        let [a, b, c] = self.points;
        self.area / ((b - a).length() + (c - a).length() + (c - b).length())
    }

    /// 1 / q of the tetrahedron with the vertex at `p`, or how far behind the face that is, in lengths of its longest edge: the ratio that is
    /// 1 / q in front of it would send a vertex behind several faces to infinity, where it is nearest to zero.
    #[inline]
    pub(super) fn inverse_quality(&self, p: Point) -> f64 {
        let [a, b, c] = self.points;
        let u = a - p;
        let squared = |x: Point| x.dot(x);
        let mut det = self.normal.dot(u);
        if det * det <= self.doubt * squared(u) {
            det = orient(p, a, b, c);
        }
        if det <= 0.0 {
            return det / (self.area * self.longest_squared.sqrt());
        }
        let (v, w) = (b - p, c - p);
        let longest = (squared(u).max(squared(v))).max(squared(w)).max(self.longest_squared);
        let areas = u.cross(v).length() + v.cross(w).length() + w.cross(u).length() + self.area;
        det / (ALPHA * longest.sqrt() * areas)
    }
}

/// More than rounding makes of bounds.
const ROUNDING: f64 = 1e-9;

/// What a set of tetrahedra costs: the worst q, and the sum over the bad ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    pub(super) worst_goodness: f64,
    /// Σ value^(-1/2) · goodness^(-1/4) over values below 1/2: a very bad one is worth many that are less bad, but not any number of them.
    /// By values alone a needle of twice its bound would weigh as little as a q of 2, and it is the worst of the mesh.
    pub(super) sum: f64,
    /// Those of q ≥ 10.
    pub(super) n_poor: u32,
}

impl Default for Cost {
    fn default() -> Self {
        Self { worst_goodness: f64::INFINITY, sum: 0.0, n_poor: 0 }
    }
}

impl Cost {
    pub(super) fn add(&mut self, inverse_quality: f64, value: f64) {
        self.worst_goodness = self.worst_goodness.min(inverse_quality);
        self.n_poor += u32::from(inverse_quality < 0.1);
        if value < 0.5 {
            let (value, inverse_quality) = (value.max(1e-30), inverse_quality.max(1e-30));
            self.sum += 1.0 / (value * inverse_quality.sqrt()).sqrt();
        }
    }

    /// Whether this, of least value `value`, may take the place of `old`: the worst q does not rise above 10 (hardly, for the worst excess), and
    /// - to have fewer of q ≥ 10: there are fewer;
    /// - for the worst of the mesh, of q or of excess: there are not many more of them;
    /// - else the sum falls or what is aimed at was very bad and becomes much better, and there are hardly more of them.
    ///   Without the sum, tetrahedra just over the threshold would be divided for little; with it alone, needles near their bound keep
    ///   their neighbors from being mended.
    pub(super) fn is_better(&self, old: &Self, value: f64, aim: Aim) -> bool {
        let is_much = aim.own < VERY_BAD && value > MUCH * aim.own;
        let gain = (value / aim.own).max(1.0);
        let more = if is_much { aim.more * exponent(gain) } else { 0 };
        let is_wanted = match aim.goal {
            Goal::Quality => (is_much || self.sum < old.sum) && self.n_poor <= old.n_poor + more,
            Goal::Count => (self.n_poor, self.sum) < (old.n_poor, old.sum),
            Goal::Worst | Goal::WorstExcess => self.n_poor <= old.n_poor + aim.more,
        };
        // Where needles are forced to a q of millions, five in a thousand of it are the difference between millions and ten for what is not forced.
        let least = match aim.goal {
            Goal::WorstExcess => 0.995 * old.worst_goodness,
            Goal::Quality | Goal::Count | Goal::Worst => old.worst_goodness,
        };
        self.worst_goodness >= least.min(0.1) && value > aim.own && is_wanted
    }
}

/// Tetrahedra below this value may be replaced by more bad ones than before, if each is better by the factor.
const VERY_BAD: f64 = 0.02;
const MUCH: f64 = 1.5;

/// What is to become better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// q, where triangles of the surface do not force it, and the sum over its neighbors.
    Quality,
    /// The number of those of q ≥ 10.
    Count,
    /// The worst q of the mesh, whatever becomes of those that are not the worst.
    Worst,
    /// The worst excess, q over the bound, likewise.
    WorstExcess,
}

impl Goal {
    /// What is judged by while a tetrahedron of this q is mended.
    pub(super) fn measure(self, q: f64) -> Measure {
        match self {
            Self::Quality | Self::Count => Measure::Quality(q),
            Self::WorstExcess => Measure::Excess,
            // No triangle's bound counts.
            Self::Worst => Measure::Quality(f64::INFINITY),
        }
    }
}

/// What an operation on a bad tetrahedron is to reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    /// The tetrahedron's value.
    pub(super) own: f64,
    /// Where searches stop.
    pub(super) enough: f64,
    pub(super) goal: Goal,
    /// How many more of q ≥ 10 there may be for each time that the value doubles; for the worst of the mesh, in all.
    pub(super) more: u32,
    /// Tetrahedra of a cavity at most.
    pub(super) tets_max: usize,
}

/// The faces that a vertex is, or is to be, joined to.
#[derive(Default)]
pub(super) struct Star {
    pub(super) sides: Vec<Side>,
    scratch: kernel::Scratch,
}

impl Star {
    /// What the least value of the sides is not above, wherever the vertex is.
    pub(super) fn most(&self) -> f64 {
        let sides = self.sides.iter().map(|side| side.most);
        sides.fold(f64::INFINITY, f64::min)
    }

    /// The same with the required sides alone.
    pub(super) fn most_required(&self) -> f64 {
        let required = self.sides.iter().filter(|side| side.required);
        (required.map(|side| side.most)).fold(f64::INFINITY, f64::min)
    }

    /// The least value of the sides with the vertex at `p`, or any value of at most `floor` when it is not above `floor`.
    ///
    /// Effects: a side that decides early moves forward, to decide earlier next time.
    pub(super) fn least(&mut self, p: Point, floor: f64) -> f64 {
        let mut least = f64::INFINITY;
        for k in 0..self.sides.len() {
            let value = self.sides[k].value(p);
            if value <= floor || value.is_nan() {
                self.sides.swap(k, k / 2);
                return value;
            }
            least = least.min(value);
        }
        least
    }

    /// A number that grows with the product of the sides' values, whatever their number and however small they are, or
    /// `f64::NEG_INFINITY` when a tetrahedron is not positive or its 1 / q is below `floor`.
    ///
    /// The product is kept as mantissa and exponent; exponent plus mantissa is the logarithm with straight lines between the powers of
    /// two, from basic operations, equal on every machine.
    pub(super) fn product(&self, p: Point, floor: f64) -> f64 {
        let (mut mantissa, mut exponent) = (1.0f64, 0.0);
        for side in &self.sides {
            let good = side.inverse_quality(p);
            if good.is_nan() || good < floor.max(f64::MIN_POSITIVE) {
                return f64::NEG_INFINITY;
            }
            mantissa *= unit(good, &mut exponent);
            mantissa = unit(mantissa, &mut exponent);
        }
        exponent + mantissa
    }

    /// The corner, its place and the least value of the sides that do not have it, where that is largest and above `floor`; not one that `is_passed_over`.
    pub(super) fn best_corner(
        &self,
        floor: f64,
        is_passed_over: impl Fn(u32) -> bool,
    ) -> Option<(u32, Point, f64)> {
        let mut corners: Vec<(u32, Point)> = (self.sides.iter())
            .flat_map(|side| side.vertices.into_iter().zip(side.points))
            .collect();
        corners.sort_unstable_by_key(|corner| corner.0);
        corners.dedup_by_key(|corner| corner.0);
        let mut best = None;
        let mut most = floor;
        // What ruled the corner before out often rules out the next one.
        let mut blocking = &self.sides[0];
        for (v, p) in corners {
            if is_passed_over(v) {
                continue;
            }
            let mut least = f64::INFINITY;
            for side in std::iter::once(blocking).chain(&self.sides) {
                if side.vertices.contains(&v) {
                    continue;
                }
                least = least.min(side.value(p));
                if least <= most || least.is_nan() {
                    blocking = side;
                    break;
                }
            }
            if least > most && least.is_finite() {
                most = least;
                best = Some((v, p, least));
            }
        }
        best
    }

    /// The cost with the vertex at `p`; sides that have it are faces of the others' tetrahedra.
    pub(super) fn cost(&self, p: Point) -> Cost {
        let mut cost = Cost::default();
        for side in self.sides.iter().filter(|side| !side.points.contains(&p)) {
            cost.add(side.inverse_quality(p), side.value(p));
        }
        cost
    }

    /// How far the sides' corners are from `p` in the mean.
    pub(super) fn radius(&self, p: Point) -> f64 {
        let corners = self.sides.iter().flat_map(|side| side.points);
        let sum: f64 = corners.map(|c| (c - p).length()).sum();
        sum / (3.0 * self.sides.len() as f64)
    }

    /// The least height of `p` over a side, negative behind one.
    fn height(&self, p: Point) -> f64 {
        let heights = self.sides.iter().map(|side| side.height(p));
        heights.fold(f64::INFINITY, f64::min)
    }

    /// The point that is farthest in front of all sides, in radii of their inscribed circles, up to one: what is nearer makes a flat
    /// tetrahedron. Behind some, where no point is in front of all; `p` where rounding leaves no answer. And what the least value of the sides
    /// is not above, wherever the vertex is.
    pub(super) fn moved_into_kernel(&mut self, p: Point) -> (Point, f64) {
        let reach = 4.0 * self.radius(p);
        let mut most = 0.0f64;
        self.sides.iter().for_each(|side| most = most.max(side.most));
        let sides = (self.sides.iter()).filter(|side| side.area > 0.0);
        let planes = sides.map(|side| {
            let n = side.normal / side.area;
            (n, n.dot(side.points[0] - p), side.radius())
        });
        match farthest_inside(p, reach, planes, &mut self.scratch) {
            // An inscribed sphere fits between a face and the apex over it.
            Some((at, radii)) if radii < 1.0 => (at, 0.5 * radii * most + ROUNDING),
            Some((at, _)) => (at, f64::INFINITY),
            None => (p, f64::INFINITY),
        }
    }

    /// The best of moves of `p` away from the nearest sides, in steps from the least of the heights to the size of the star, each twice the one
    /// before: between planes a rounding error apart, no search finds room that starts with steps of the size of the star.
    ///
    /// The direction is the gradient of the sum of the heights' logarithms.
    pub(super) fn lift(&self, p: Point, floor: f64) -> Option<(Point, f64)> {
        let mut gradient = Point::ZERO;
        for side in &self.sides {
            gradient -= side.normal / (side.area * side.height(p));
        }
        let least = self.height(p);
        let direction = gradient / gradient.length();
        if least <= 0.0 || !direction.is_finite() {
            return None;
        }
        let (mut step, end) = (0.5 * least, self.radius(p));
        let mut best: Option<(Point, f64)> = None;
        while step < end {
            let at = p + direction * step;
            let value = self.product(at, floor);
            if value > best.map_or(f64::NEG_INFINITY, |b| b.1) {
                best = Some((at, value));
            }
            step *= 2.0;
        }
        best
    }

    /// Moves from `start`, where the least value is `value`, to where it is largest; stops at `enough`. Returns where and what it is there.
    pub(super) fn raise_least(
        &mut self,
        start: Point,
        value: f64,
        steps: u32,
        enough: f64,
    ) -> (Point, f64) {
        // Between planes that are near each other, only short steps lead anywhere.
        for step in [0.2 * self.radius(start), self.height(start)] {
            let climb = Climb { start, step, steps, enough };
            let found = climb.run(value, |p, floor| self.least(p, floor));
            if let Some(found) = found {
                return found;
            }
        }
        (start, value)
    }
}

/// The power of two below a number of at least 1.
fn exponent(x: f64) -> u32 {
    (x.to_bits() >> 52) as u32 - 1023
}

/// A positive number as one in [1, 2), the power of two added to `exponent`.
fn unit(x: f64, exponent: &mut f64) -> f64 {
    let bits = x.to_bits();
    *exponent += (bits >> 52) as f64 - 1023.0;
    f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52)
}

#[cfg(test)]
mod tests {
    use super::super::face_bounds::FaceBounds;
    use super::*;
    use crate::optimize::tests::{delaunay, live, random};
    use tetdb_base::shape::inverse_quality;
    use tetdb_base::shape::least;
    use tetdb_base::storage::FlatPages;

    #[test]
    fn no_place_is_worth_more_than_the_bounds_of_a_star() {
        for flat in [1.0, 1e-3] {
            let mut next = random(11);
            let points: Vec<Point> =
                (0..30).map(|_| Point::new(next(), next(), flat * next())).collect();
            let mut mesh = delaunay(Mesh::new(FlatPages::default()), &points, points.len(), 1.0);
            let mut bounds = FaceBounds::default();
            let measure = Measure::Quality(20.0);
            for (t, tet) in live(&mut mesh) {
                let across = tet.neighbor.into_iter().find(|across| across.exists());
                let mut star = Star::default();
                for record in [tet, across.map_or(tet, |across| mesh.tet(across.tet()))] {
                    (0..4).for_each(|i| {
                        star.sides.push(Side::new(&mut mesh, &record, i, &mut bounds.by(measure)))
                    });
                }
                let center = star.sides[0].points[0];
                let (_, most) = star.moved_into_kernel(center);
                for _ in 0..20 {
                    let p = Point::new(next(), next(), flat * next());
                    let least = star.least(p, f64::NEG_INFINITY);
                    assert!(least <= star.most() && star.most() <= star.most_required());
                    assert!(least <= most.max(0.0), "{t}: {least} at {p}, at most {most}");
                }
                let points = mesh.points(&tet);
                let own = 1.0 / inverse_quality(points);
                let excess = own / bounds.of_tet(&tet, points);
                if bounds.is_surely_above(&tet, points, own, 1.3) {
                    assert!(excess > 1.3);
                }
                let several = bounds.of_several(&tet, points);
                let required = [0, 1, 2, 3].map(|i| tet.is_required(i));
                // Searched from other corners.
                assert!((several / least(points, required) - 1.0).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn products_of_any_size_are_ordered() {
        let values = |list: &[f64]| {
            let (mut mantissa, mut exponent) = (1.0, 0.0);
            for &value in list {
                mantissa *= unit(value, &mut exponent);
                mantissa = unit(mantissa, &mut exponent);
            }
            exponent + mantissa
        };
        assert!(values(&[1e-200, 1e-200, 1e-200]) < values(&[1e-200, 1e-200, 1.1e-200]));
        assert!(values(&[0.5, 0.5]) < values(&[0.5, 0.51]) && values(&[0.25]) == values(&[0.5; 2]));
        assert!(values(&[0.999]) < values(&[1.0]) && values(&[]) == values(&[1.0]));
    }
}
