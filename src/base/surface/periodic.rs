//! Two labels with the same triangles at two places: the motion from one to the other, and the pairs of vertices and triangles.
//!
//! Candidates are the translation between the centroids of area, and the rotations that bring the centroid, the vertex farthest from it and
//! the vertex farthest from the line of both to vertices at the same distances. Each is tried on all vertices and triangles, in the order of
//! [`Motion::rank`]; the first that pairs all of them is taken. Is not: a search for screws or mirror images.

use std::collections::HashMap;

use glam::DMat3;

use super::point_tree::PointTree;
use crate::geom::{Aabb, Point};
use crate::storage::check_cancelled;

/// Default tolerance as a share of the diagonal around both labels. Files of 32-bit coordinates round by up to 6e-8 of a coordinate, which a
/// motion found from three vertices enlarges a few times; vertices of a mesh are 1e-4 of the diagonal apart and more.
const TOLERANCE: f64 = 1e-6;
/// Distances of the vertices that a candidate is found from, as a share of the label's radius. It only limits the candidates: one that is a
/// little off is tried, and says which vertex is.
const ALIKE: f64 = 1e-3;
/// Rotations by less, in radians, are taken for translations.
const ANGLE_MIN: f64 = 1e-6;
/// Candidates that are looked at to say what is wrong, where none is right, and vertices of each.
const EXPLAINED: usize = 16;
const LOST_MAX: usize = 100;
/// Rotations that are tried at most: a sphere of equal triangles has more than memory holds.
const TURNS_MAX: usize = 100_000;
/// The sum of the normals of a label that bounds a domain on one side is longer, as a share of its area.
const CLOSED: f64 = 1e-6;

/// A triangle of a label: its number in the input, and its vertices.
#[derive(Clone, Copy, Debug)]
pub struct PatchTriangle {
    /// Number of the triangle.
    pub number: u64,
    /// Numbers of its vertices, in the input's order.
    pub vertices: [u32; 3],
    /// Their positions.
    pub points: [Point; 3],
}

/// All triangles of a label.
///
/// Shape: `points` runs parallel to `vertices`, `triangles` to `numbers`. Both lists of numbers ascend; triangles name places in `vertices`.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    vertices: Vec<u32>,
    points: Vec<Point>,
    numbers: Vec<u64>,
    triangles: Vec<[u32; 3]>,
}

impl Patch {
    /// Bytes for each triangle while two labels are compared: the list it comes from, the patch, the tables of vertices and triangles.
    pub const BYTES_EACH: u64 = 400;

    /// The patch of a list of triangles, some of which may occur twice.
    pub fn new(mut list: Vec<PatchTriangle>) -> Self {
        list.sort_unstable_by_key(|triangle| triangle.number);
        list.dedup_by_key(|triangle| triangle.number);
        let corners = list.iter().flat_map(|t| t.vertices.into_iter().zip(t.points));
        let mut corners: Vec<(u32, Point)> = corners.collect();
        corners.sort_unstable_by_key(|corner| corner.0);
        corners.dedup_by_key(|corner| corner.0);
        let (vertices, points): (Vec<u32>, Vec<Point>) = corners.into_iter().unzip();
        let place = |v| vertices.binary_search(&v).expect("the list has it") as u32;
        Self {
            numbers: list.iter().map(|t| t.number).collect(),
            triangles: list.iter().map(|t| t.vertices.map(place)).collect(),
            vertices,
            points,
        }
    }

    /// Number of triangles.
    pub fn n_triangles(&self) -> usize {
        self.triangles.len()
    }

    fn corners(&self, t: usize) -> [Point; 3] {
        self.triangles[t].map(|v| self.points[v as usize])
    }

    /// The centroid of area; the sum of the triangles' normals, each as long as its doubled area; and the sum of the doubled areas.
    fn center(&self) -> (Point, Point, f64) {
        let (mut center, mut total, mut normal) = (Point::ZERO, 0.0, Point::ZERO);
        let origin = self.points[0];
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t).map(|p| p - origin);
            let doubled = (b - a).cross(c - a);
            center += (a + b + c) * (doubled.length() / 3.0);
            total += doubled.length();
            normal += doubled;
        }
        (origin + center / total, normal, total)
    }
}

/// A translation or a rotation. Words of it on the command line and in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionKind {
    /// Nothing is turned.
    Translation,
    /// About an axis, without a shift along it.
    Rotation,
}

/// A motion: x becomes `turn` · x + `shift`.
#[derive(Clone, Copy, Debug)]
struct Motion {
    turn: DMat3,
    shift: Point,
    /// In radians; 0 for a translation.
    angle: f64,
    /// True if moved normals point as those of the other label do: the domain lies on the same side of both, which is seldom meant.
    is_alike: bool,
}

impl Motion {
    fn apply(&self, p: Point) -> Point {
        self.turn * p + self.shift
    }

    /// Order of candidates: labels that bound the domain from opposite sides first, then translations, then small angles.
    fn rank(&self) -> (bool, u64) {
        (self.is_alike, (self.angle / ANGLE_MIN) as u64)
    }
}

/// The pairs of two labels.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicMatch {
    /// Three rows of four: the motion from the first label to the second, x of it = row · (x, y, z, 1).
    pub map: [[f64; 4]; 3],
    /// Angle of the rotation in radians; 0 for a translation.
    pub angle: f64,
    /// Greatest distance between a moved vertex and its partner.
    pub deviation: f64,
    /// Allowed distance.
    pub tolerance: f64,
    /// A vertex of the first label and its partner, ascending. A vertex on the axis of a rotation, its own partner, is left out.
    pub vertices: Vec<[u32; 2]>,
    /// A triangle of the first label and its partner, ascending.
    pub triangles: Vec<[u64; 2]>,
}

/// A vertex or triangle without a partner.
#[derive(Clone, Debug, PartialEq)]
pub struct Unpaired {
    /// True if it is of the second label, and the motion leads to the first.
    pub is_second: bool,
    /// The vertex or triangle.
    pub what: UnpairedPart,
}

/// Kinds of what has no partner.
#[derive(Clone, Debug, PartialEq)]
pub enum UnpairedPart {
    /// A vertex without a partner: of the first ones, the farthest from one.
    Vertex {
        /// Number of the vertex in the input.
        number: u32,
        /// Its position.
        at: Point,
        /// Where the motion brings it.
        moved: Point,
        /// Distance from there to the nearest vertex of the other label.
        distance: f64,
        /// Allowed distance.
        tolerance: f64,
    },
    /// The first triangle whose vertices have partners that are no triangle.
    Triangle {
        /// Number of the triangle in the input.
        number: u64,
        /// Its corners.
        at: [Point; 3],
    },
}

/// Finds the motion that brings all triangles of `first` onto those of `second`, both not empty.
///
/// Without a `kind`, translations come before rotations unless the domain lies on the same side of both, and rotations that leave it so are
/// not tried. Without a `tolerance`, a millionth of the diagonal around both. Errors: a vertex or triangle without a partner.
pub fn match_patches(
    first: &Patch,
    second: &Patch,
    kind: Option<MotionKind>,
    tolerance: Option<f64>,
) -> Result<PeriodicMatch, Unpaired> {
    let bounds = Aabb::around(first.points.iter().chain(&second.points).copied());
    let tolerance = tolerance.unwrap_or(TOLERANCE * bounds.diagonal());
    let size = |patch: &Patch| (patch.vertices.len(), patch.triangles.len());
    let is_second = size(second) > size(first);
    let (from, to) = if is_second { (second, first) } else { (first, second) };
    let matcher = Matcher::new(from, to, tolerance);
    let candidates = matcher.candidates(kind);
    let mut lost = None;
    for motion in &candidates {
        check_cancelled();
        match matcher.pairs(motion) {
            Ok(Some(partners)) => return Ok(matcher.finish(*motion, &partners)),
            Ok(None) => {}
            Err(triangle) => lost = lost.or(Some(triangle)),
        }
    }
    Err(Unpaired { is_second, what: lost.unwrap_or_else(|| matcher.explain(&candidates)) })
}

/// Two labels being compared.
struct Matcher<'a> {
    from: &'a Patch,
    to: &'a Patch,
    tree: PointTree,
    /// Triangles of `to` by their ascending vertices.
    triangles: HashMap<[u32; 3], usize>,
    tolerance: f64,
}

impl<'a> Matcher<'a> {
    fn new(from: &'a Patch, to: &'a Patch, tolerance: f64) -> Self {
        let triangles = to.triangles.iter().enumerate().map(|(t, &v)| (ascending(v), t));
        Self {
            tree: PointTree::new((0..).zip(to.points.iter().copied()).collect()),
            triangles: triangles.collect(),
            from,
            to,
            tolerance,
        }
    }

    /// The motions to try, in their order.
    fn candidates(&self, kind: Option<MotionKind>) -> Vec<Motion> {
        let [(a, normal_a, _), (b, normal_b, area)] = [self.from.center(), self.to.center()];
        // Of a closed label nothing but rounding is left.
        let has_side = normal_b.length() > CLOSED * area;
        let motion = |turn: DMat3, angle| Motion {
            turn,
            shift: b - turn * a,
            angle,
            is_alike: has_side && (turn * normal_a).dot(normal_b) > 0.5 * normal_b.length_squared(),
        };
        let mut all = Vec::new();
        if kind != Some(MotionKind::Rotation) {
            let translation = motion(DMat3::IDENTITY, 0.0);
            if !translation.is_alike && matches!(self.pairs(&translation), Ok(Some(_))) {
                return vec![translation];
            }
            all.push(translation);
        }
        if kind != Some(MotionKind::Translation) {
            let (radius, turns) = self.turns(a, b);
            for turn in turns {
                let (axis, angle) = axis_and_angle(turn);
                let found = motion(turn, angle);
                let is_meant = !found.is_alike || kind.is_some();
                if is_meant && angle >= ANGLE_MIN && found.shift.dot(axis).abs() <= ALIKE * radius {
                    all.push(found);
                }
            }
        }
        all.sort_by_key(Motion::rank);
        all
    }

    /// Turns that bring the frame of `from` at its center to a frame of `to`, and the radius of `from`.
    fn turns(&self, a: Point, b: Point) -> (f64, Vec<DMat3>) {
        let farthest = |measure: &dyn Fn(Point) -> f64| {
            let far = |best: Point, &p: &Point| if measure(p) > measure(best) { p } else { best };
            self.from.points.iter().fold(self.from.points[0], far)
        };
        let v = farthest(&|p| p.distance(a));
        let w = farthest(&|p| (p - a).cross(v - a).length());
        let (radius, alike) = (v.distance(a), ALIKE * v.distance(a));
        let at = |length: f64| {
            let is_there = move |p: &&Point| (p.distance(b) - length).abs() <= alike;
            self.to.points.iter().filter(is_there).copied().collect::<Vec<Point>>()
        };
        let own = frame(v - a, w - a).transpose();
        let mut turns = Vec::new();
        let seconds = at(w.distance(a));
        for p in at(radius) {
            check_cancelled();
            let seconds = seconds.iter().filter(|q| (q.distance(p) - w.distance(v)).abs() <= alike);
            let left = TURNS_MAX - turns.len();
            turns.extend(seconds.take(left).map(|&q| frame(p - b, q - b) * own));
            if turns.len() == TURNS_MAX {
                break;
            }
        }
        (radius, turns)
    }

    /// The place in `to` of each vertex of `from`; `None` where a vertex has none. Errors: a triangle without a partner.
    fn pairs(&self, motion: &Motion) -> Result<Option<Vec<u32>>, UnpairedPart> {
        let mut partners = Vec::with_capacity(self.from.points.len());
        let mut is_taken = vec![false; self.to.points.len()];
        for &p in &self.from.points {
            match self.nearest(motion.apply(p), self.tolerance) {
                Some((v, _)) if !is_taken[v as usize] => {
                    is_taken[v as usize] = true;
                    partners.push(v);
                }
                _ => return Ok(None),
            }
        }
        let is_lost = |&t: &usize| self.partner(&partners, t).is_none();
        match (0..self.from.triangles.len()).find(is_lost) {
            None => Ok(Some(partners)),
            Some(t) => Err(UnpairedPart::Triangle {
                number: self.from.numbers[t],
                at: self.from.corners(t),
            }),
        }
    }

    fn partner(&self, partners: &[u32], t: usize) -> Option<usize> {
        let moved = self.from.triangles[t].map(|v| partners[v as usize]);
        self.triangles.get(&ascending(moved)).copied()
    }

    /// The nearest vertex of `to` within `radius`, the first of several, and its distance.
    fn nearest(&self, p: Point, radius: f64) -> Option<(u32, f64)> {
        let mut best = None;
        let around = Aabb { low: p - radius, high: p + radius };
        self.tree.within(&around, |v, q| {
            let found = (p.distance(q), v);
            if found.0 <= radius && best.is_none_or(|best| found < best) {
                best = Some(found);
            }
        });
        best.map(|(distance, v)| (v, distance))
    }

    /// A vertex without a partner under the candidate that leaves the fewest without; of the first ones the farthest.
    fn explain(&self, candidates: &[Motion]) -> UnpairedPart {
        let lost = |motion: &Motion| {
            let mut is_taken = vec![false; self.to.points.len()];
            let is_lost = |&v: &usize| {
                check_cancelled();
                let found = self.nearest(motion.apply(self.from.points[v]), self.tolerance);
                found.is_none_or(|(v, _)| std::mem::replace(&mut is_taken[v as usize], true))
            };
            (0..self.from.points.len()).filter(is_lost).collect::<Vec<usize>>()
        };
        let still =
            Motion { turn: DMat3::IDENTITY, shift: Point::ZERO, angle: 0.0, is_alike: false };
        let tried = candidates.iter().take(EXPLAINED).map(|motion| (motion, lost(motion)));
        let (motion, lost) =
            tried.min_by_key(|(_, lost)| lost.len()).unwrap_or_else(|| (&still, lost(&still)));
        let far = lost.into_iter().take(LOST_MAX);
        let far = far.map(|v| (v, self.distance(motion.apply(self.from.points[v]))));
        let (v, distance) = far.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
        let at = self.from.points[v];
        UnpairedPart::Vertex {
            number: self.from.vertices[v],
            at,
            moved: motion.apply(at),
            distance,
            tolerance: self.tolerance,
        }
    }

    /// The distance to the nearest vertex of `to`.
    fn distance(&self, p: Point) -> f64 {
        self.to.points.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// The pairs as numbers of the input, and a translation as the mean of all pairs.
    fn finish(&self, mut motion: Motion, partners: &[u32]) -> PeriodicMatch {
        let points = || {
            let partners = partners.iter().map(|&v| self.to.points[v as usize]);
            self.from.points.iter().copied().zip(partners)
        };
        if motion.angle == 0.0 {
            let sum: Point = points().map(|(p, q)| q - p).sum();
            motion.shift = sum / partners.len() as f64;
        }
        let vertices = (self.from.vertices.iter().zip(partners))
            .map(|(&v, &partner)| [v, self.to.vertices[partner as usize]]);
        let triangles = (0..self.from.triangles.len()).filter_map(|t| {
            Some([self.from.numbers[t], self.to.numbers[self.partner(partners, t)?]])
        });
        let [x, y, z] = [0, 1, 2].map(|i| motion.turn.row(i).extend(motion.shift[i]).to_array());
        PeriodicMatch {
            map: [x, y, z],
            angle: motion.angle,
            deviation: points().map(|(p, q)| motion.apply(p).distance(q)).fold(0.0, f64::max),
            tolerance: self.tolerance,
            vertices: vertices.filter(|[a, b]| a != b).collect(),
            triangles: triangles.collect(),
        }
    }
}

fn ascending(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort_unstable();
    triangle
}

/// The right-handed frame whose first axis is along `a` and whose second is in the plane of `a` and `b`.
fn frame(a: Point, b: Point) -> DMat3 {
    let first = a.normalize_or_zero();
    let second = (b - first * first.dot(b)).normalize_or_zero();
    DMat3::from_cols(first, second, first.cross(second))
}

/// A rotation by an angle is cos I + (1 − cos) a aᵀ and an antisymmetric part, so the symmetric part has the axis a.
fn axis_and_angle(turn: DMat3) -> (Point, f64) {
    let cosine = (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0) / 2.0;
    let doubled = turn + turn.transpose() - DMat3::from_diagonal(Point::splat(2.0 * cosine));
    let axes = [doubled.x_axis, doubled.y_axis, doubled.z_axis];
    let longest = axes.into_iter().max_by(|a, b| a.length().total_cmp(&b.length()));
    let axis = longest.unwrap_or(Point::X).normalize_or_zero();
    let sine = Point::new(
        turn.y_axis.z - turn.z_axis.y,
        turn.z_axis.x - turn.x_axis.z,
        turn.x_axis.y - turn.y_axis.x,
    );
    (axis, (sine.length() / 2.0).atan2(cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: u32 = 4;

    /// A square of N × N cells, the diagonals by `slash`, its corners shaken inside, moved by `place`; numbers from `first` on, backwards.
    fn square(first: u32, place: impl Fn(Point) -> Point, slash: impl Fn(u32) -> bool) -> Patch {
        let vertex = |i: u32, j: u32| first + N * N + 2 * N - (i * (N + 1) + j);
        let point = |i: u32, j: u32| {
            let is_inside = |k| k > 0 && k < N;
            let shake =
                if is_inside(i) && is_inside(j) { f64::from(i * 7 % 5 + j) / 99.0 } else { 0.0 };
            place(Point::new(f64::from(i) / f64::from(N), f64::from(j) / f64::from(N) + shake, 0.0))
        };
        let mut list = Vec::new();
        for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
            let [a, b, c, d] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
            let cut =
                if slash(i * N + j) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            for corners in cut {
                let number = u64::from(first) + 1000 - list.len() as u64;
                let vertices = corners.map(|[i, j]| vertex(i, j));
                let points = corners.map(|[i, j]| point(i, j));
                list.push(PatchTriangle { number, vertices, points });
            }
        }
        Patch::new(list)
    }

    /// Pairs by comparing every vertex with every other.
    fn by_force(
        from: &Patch,
        to: &Patch,
        near: f64,
        place: impl Fn(Point) -> Point,
    ) -> Vec<[u32; 2]> {
        let partner =
            |p: Point| to.points.iter().position(|q| q.distance(place(p)) < near).unwrap();
        let pairs = from.vertices.iter().zip(&from.points);
        let pairs = pairs.map(|(&v, &p)| [v, to.vertices[partner(p)]]);
        pairs.filter(|[a, b]| a != b).collect()
    }

    #[test]
    fn motions_are_found_as_by_brute_force_at_any_scale() {
        let turned = |p: Point| DMat3::from_axis_angle(Point::new(0.6, 0.0, 0.8), 1.1) * p;
        for scale in [1e-9, 1.0, 1e9] {
            let start = |p: Point| scale * (turned(p) + Point::new(5.0, -3.0, 0.1));
            let from = square(0, start, |k| k % 3 == 0);
            let axis = Point::new(1.0, 2.0, -0.5).normalize();
            let turn = DMat3::from_axis_angle(axis, 2.0);
            let foot = scale * Point::new(1.0, 0.0, 0.0);
            let moves: [(f64, &dyn Fn(Point) -> Point); 2] = [
                (0.0, &|p| p + scale * Point::new(0.0, 3.0, 0.25)),
                (2.0, &|p| turn * (p - foot) + foot),
            ];
            for (angle, moved) in moves {
                let to = square(100, |p| moved(start(p)), |k| k % 3 == 0);
                let kind = (angle != 0.0).then_some(MotionKind::Rotation);
                let found = match_patches(&from, &to, kind, None).unwrap();
                assert!((found.angle - angle).abs() < 1e-12, "{}", found.angle);
                assert!(found.deviation < 1e-14 * 20.0 * scale, "{}", found.deviation / scale);
                assert_eq!(found.vertices, by_force(&from, &to, 1e-9 * scale, moved));
                assert_eq!(found.triangles.len(), from.n_triangles());
                assert!(found.triangles.iter().all(|[a, b]| b - a == 100));
            }
        }
    }

    #[test]
    fn a_sector_turns_and_its_axis_stays() {
        // The half of a cylinder of square section: its two faces lie in one plane, and the domain on the same side of both.
        let from = square(0, |p| Point::new(p.x, 0.0, p.y), |_| true);
        let mut back = square(0, |p| Point::new(-p.x, 0.0, p.y), |_| true);
        // One orientation, and other numbers but on the axis.
        back.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        for (v, p) in back.vertices.iter_mut().zip(&back.points) {
            *v += if p.x == 0.0 { 0 } else { 500 };
        }
        let found = match_patches(&from, &back, None, None).unwrap();
        assert!((found.angle - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(found.vertices.len() as u32, N * (N + 1));
        let found = match_patches(&from, &back, Some(MotionKind::Translation), None);
        assert!(found.is_err(), "the shaken vertices are no translation");
    }

    #[test]
    fn what_has_no_partner_is_named() {
        let from = square(0, |p| p, |_| true);
        let up = Point::new(0.0, 0.0, 1.0);
        let other = square(100, |p| p + up, |k| k != 5);
        let Err(Unpaired { is_second: false, what: UnpairedPart::Triangle { number, .. } }) =
            match_patches(&from, &other, None, None)
        else {
            panic!("a diagonal lies otherwise");
        };
        assert_eq!(number, 1000 - 11);
        let mut moved = square(100, |p| p + up, |_| true);
        moved.points[7].x += 1e-4;
        let Err(Unpaired { what: UnpairedPart::Vertex { number, distance, .. }, .. }) =
            match_patches(&from, &moved, None, None)
        else {
            panic!("a vertex was moved");
        };
        assert_eq!(number, moved.vertices[7] - 100);
        assert!((distance - 1e-4).abs() < 1e-5, "{distance}");
        assert!(match_patches(&from, &moved, None, Some(1e-3)).is_ok());
        let mut larger = moved.clone();
        larger.points.push(Point::splat(9.0));
        larger.vertices.push(1 << 20);
        larger.numbers.push(1 << 20);
        larger.triangles.push([0, 1, larger.points.len() as u32 - 1]);
        let unpaired = match_patches(&from, &larger, None, Some(1e-3)).unwrap_err();
        assert!(unpaired.is_second);
    }
}
