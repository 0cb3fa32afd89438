//! Divide triangles until their edges have a wanted length, without moving the surface.
//!
//! The longest edge of all (in units of the wanted length) is divided at its middle, together with every triangle that has it, and
//! so on, as Rivara does; the surface stays closed. Edges inside an input triangle wait for those around them, and are swapped
//! where that makes the least angle larger, at once around each new vertex: this changes no point of the surface. Without it a needle would become three
//! needles of half its length, each of them three of a quarter, and so on, where some triangles in a row are enough.
//!
//! Source: M.-C. Rivara, "New longest-edge algorithms for the refinement and/or improvement of unstructured triangulations"
//! (1997).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{Surface, SurfaceError};
use crate::geom::{IdMap, Point};

/// Edges longer than this, in units of the wanted length, are divided: halves are then as much too short as it was too long.
const LONG: f64 = std::f64::consts::SQRT_2;
/// Edges inside an input triangle have this share of their length in the order: halves of the triangle's own edges come before the edges to their ends.
const INSIDE: f64 = 0.7;
/// Passes of swaps end after this many even if they still gain.
const SWAP_PASSES: u32 = 12;
/// Triangles have 32-bit numbers; a wanted length that needs more is refused before memory runs out.
const TRIANGLES_MAX: usize = 1 << 30;

/// Bytes held for a triangle: itself, its input triangle, and one and a half edges in a table that doubles. Measured with the sizes it is divided by:
/// 226 to 235.
const BYTES_TRIANGLE: u64 = 240;

/// Counts of a split.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct SplitReport {
    /// Edges divided.
    pub edges_divided: u64,
    /// Edges swapped.
    pub edges_swapped: u64,
    /// Greatest distance of a new vertex from the input triangle it lies on: rounding of its coordinates.
    pub deviation_max: f64,
}

/// Mean area of the divided triangles in squares of the wanted length: 0.42 on a cube, 0.26 to 0.35 on a slat.
const AREA_MEAN: f64 = 0.4;
/// A prediction below this share of the true number never refuses what would fit.
const PREDICTION_LEAST: f64 = 0.7;
/// A triangle is sampled in at most 4 to the power of this many parts: where lengths differ inside it.
const SAMPLE_DEPTH: u32 = 5;

/// An edge as its vertices, the smaller first.
type EdgeKey = (u32, u32);

fn edge(a: u32, b: u32) -> EdgeKey {
    (a.min(b), a.max(b))
}

/// Divides the triangles of `surface`; `h` is the wanted edge length at a position.
///
/// New triangles keep label and orientation. They stand in the place of the triangle they came from and behind the
/// others. Embedded edges are divided with the triangles at them; support triangles are dropped, see
/// [`Surface::add_support_triangles`]. Memory: `bytes_max` at most. Errors: more triangles than fit, or than can be
/// numbered.
pub fn split(
    surface: &Surface,
    h: &dyn Fn(Point) -> f64,
    bytes_max: u64,
) -> Result<(Surface, SplitReport), SurfaceError> {
    let fits = |surface: &Surface| match bytes_max / BYTES_TRIANGLE < surface.n_triangles() as u64 {
        false => Ok(()),
        true => Err(SurfaceError::Memory {
            bytes_max,
            triangles: surface.n_triangles(),
            vertices: surface.n_vertices(),
        }),
    };
    fits(surface)?;
    let n = predict_split(surface, h);
    if PREDICTION_LEAST * n > TRIANGLES_MAX as f64 {
        return Err(SurfaceError::TooLarge { what: "triangles", limit: TRIANGLES_MAX });
    }
    if PREDICTION_LEAST * n * BYTES_TRIANGLE as f64 > bytes_max as f64 {
        let bytes = (n * BYTES_TRIANGLE as f64) as u64;
        return Err(SurfaceError::SplitMemory { bytes_max, bytes, triangles: n as u64 });
    }
    let mut plain = surface.clone();
    plain.drop_support_triangles();
    let parent = (0..plain.triangles.len() as u32).collect();
    let mut splitter = Splitter::new(plain, parent, |_| true);
    let mut heap = BinaryHeap::new();
    let edges: Vec<EdgeKey> = splitter.around.keys().copied().collect();
    for e in edges {
        splitter.consider(e, h, &mut heap);
    }
    // A heap by length and then by vertices: the order does not depend on that of a table.
    while let Some((_, Reverse(e))) = heap.pop() {
        if splitter.surface.triangles.len() > TRIANGLES_MAX {
            return Err(SurfaceError::TooLarge { what: "triangles", limit: TRIANGLES_MAX });
        }
        fits(&splitter.surface)?;
        match splitter.swap_edge(e) {
            Some(new) => splitter.consider(new, h, &mut heap),
            None => splitter.divide(e, h, &mut heap),
        }
    }
    splitter.swap_until_best();
    splitter.report.deviation_max = splitter.deviation(surface);
    splitter.surface.notes.clear();
    Ok((splitter.surface, splitter.report))
}

/// Predicts the number of triangles after [`split`], from areas over squares of wanted lengths. Support triangles are left out.
pub fn predict_split(surface: &Surface, h: &dyn Fn(Point) -> f64) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|v| surface.points[v as usize]);
    let triangles = (0u32..).zip(&surface.triangles);
    let own = triangles.filter(|(t, _)| !surface.is_support_triangle(*t));
    own.map(|(_, t)| predicted(corners(t), h, SAMPLE_DEPTH).max(1.0)).sum()
}

/// Predicted number of triangles in a part of a triangle.
fn predicted([a, b, c]: [Point; 3], h: &dyn Fn(Point) -> f64, depth: u32) -> f64 {
    let middle = (a + b + c) / 3.0;
    let wanted = [a, b, c, middle].map(h);
    let (low, high) =
        wanted.iter().fold((f64::INFINITY, 0.0f64), |(l, u), &h| (l.min(h), u.max(h)));
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    if depth == 0 || longest <= low || high <= 1.1 * low && depth < SAMPLE_DEPTH - 1 {
        return 0.5 * (b - a).cross(c - a).length() / (AREA_MEAN * wanted[3] * wanted[3]);
    }
    let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
    let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    parts.into_iter().map(|part| predicted(part, h, depth - 1)).sum()
}

/// Swaps edges inside the triangles for which `is_divided` holds, if that raises the least angle. `parent`: the
/// triangle that each triangle is a part of. Embedded edges stay.
pub(super) fn swap_inside(
    surface: Surface,
    parent: Vec<u32>,
    is_divided: impl Fn(u32) -> bool,
) -> Surface {
    let mut splitter = Splitter::new(surface, parent, is_divided);
    splitter.swap_until_best();
    splitter.surface
}

struct Splitter {
    surface: Surface,
    /// Input triangle of each triangle.
    parent: Vec<u32>,
    around: IdMap<EdgeKey, Vec<u32>>,
    /// Embedded edges, with their positions in the list. They are not swapped, and are divided with their triangles.
    embedded: IdMap<EdgeKey, usize>,
    report: SplitReport,
}

/// Length as bits, which order like the positive numbers they represent.
type Ordered = (u64, Reverse<EdgeKey>);

impl Splitter {
    /// A splitter over the edges of the triangles whose parents `is_meant` accepts.
    fn new(surface: Surface, parent: Vec<u32>, is_meant: impl Fn(u32) -> bool) -> Self {
        let mut around: IdMap<EdgeKey, Vec<u32>> = IdMap::default();
        let triangles = (0u32..).zip(&surface.triangles);
        for (t, &[a, b, c]) in triangles.filter(|(t, _)| is_meant(parent[*t as usize])) {
            for e in [edge(a, b), edge(b, c), edge(c, a)] {
                around.entry(e).or_default().push(t);
            }
        }
        let wires = surface.embedded.edges.iter().map(|&[a, b, _]| edge(a, b));
        Self {
            embedded: wires.zip(0..).collect(),
            surface,
            parent,
            around,
            report: SplitReport::default(),
        }
    }

    fn point(&self, v: u32) -> Point {
        self.surface.points[v as usize]
    }

    fn consider(&self, e: EdgeKey, h: &dyn Fn(Point) -> f64, heap: &mut BinaryHeap<Ordered>) {
        let (a, b) = (self.point(e.0), self.point(e.1));
        let length = a.distance(b) / h((a + b) * 0.5);
        if length > LONG {
            let share = if self.is_inside(e) { INSIDE } else { 1.0 };
            heap.push(((share * length).to_bits(), Reverse(e)));
        }
    }

    /// Returns whether the triangles at an edge are parts of one input triangle, or of both sides of one.
    fn is_inside(&self, e: EdgeKey) -> bool {
        let parent = |t: &u32| self.parent[*t as usize];
        let Some(at) = self.around.get(&e) else {
            return false;
        };
        // Two for each side of a wall that is given from both.
        at.iter().all(|x| at.iter().filter(|y| parent(y) == parent(x)).count() == 2)
    }

    /// Swaps `e`, if it is inside an input triangle and that raises the least angle; returns the new edge.
    fn swap_edge(&mut self, e: EdgeKey) -> Option<EdgeKey> {
        let &t = self.around.get(&e)?.first()?;
        let corners = self.surface.triangles[t as usize];
        let k = (0..3).find(|&k| edge(corners[k], corners[(k + 1) % 3]) == e)?;
        self.swap(t, k)
    }

    /// Divides every triangle at `e`, if it is still there.
    fn divide(&mut self, e: EdgeKey, h: &dyn Fn(Point) -> f64, heap: &mut BinaryHeap<Ordered>) {
        let Some(triangles) = self.around.remove(&e) else {
            return;
        };
        let (a, b) = (self.point(e.0), self.point(e.1));
        let middle = (a + b) * 0.5;
        if middle == a || middle == b {
            // No number lies between: nothing to divide.
            self.around.insert(e, triangles);
            return;
        }
        self.report.edges_divided += 1;
        let mut opposite = Vec::new();
        let m = self.surface.points.len() as u32;
        self.surface.points.push(middle);
        if let Some(i) = self.embedded.remove(&e) {
            let wires = &mut self.surface.embedded.edges;
            let [from, to, label] = wires[i];
            self.embedded.extend([(edge(from, m), i), (edge(m, to), wires.len())]);
            wires[i] = [from, m, label];
            wires.push([m, to, label]);
        }
        for t in triangles {
            let corners = self.surface.triangles[t as usize];
            let k = (0..3).find(|&k| edge(corners[k], corners[(k + 1) % 3]) == e);
            let k = k.expect("the edge is of the triangle");
            let [p, q, r] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
            let new = self.surface.triangles.len() as u32;
            self.surface.triangles[t as usize] = [p, m, r];
            self.surface.triangles.push([m, q, r]);
            let label = self.surface.labels[t as usize];
            self.surface.labels.push(label);
            if self.surface.has_sheets() {
                let is_sheet = self.surface.is_sheet(t);
                self.surface.sheets.push(is_sheet);
            }
            self.parent.push(self.parent[t as usize]);
            let beside = self.around.get_mut(&edge(q, r)).expect("an edge of it");
            for other in beside.iter_mut().filter(|o| **o == t) {
                *other = new;
            }
            self.around.entry(edge(p, m)).or_default().push(t);
            self.around.entry(edge(m, q)).or_default().push(new);
            // A wall given from both sides has two triangles here with one opposite corner.
            self.around.entry(edge(m, r)).or_default().extend([t, new]);
            self.consider(edge(m, r), h, heap);
            opposite.extend([edge(p, r), edge(q, r)]);
        }
        for v in [e.0, e.1] {
            self.consider(edge(v, m), h, heap);
        }
        self.swap_around(m, opposite, h, heap);
    }

    /// Swaps the edges opposite a new vertex, and those that are opposite it then.
    fn swap_around(
        &mut self,
        m: u32,
        mut opposite: Vec<EdgeKey>,
        h: &dyn Fn(Point) -> f64,
        heap: &mut BinaryHeap<Ordered>,
    ) {
        while let Some(e) = opposite.pop() {
            let Some(new) = self.swap_edge(e) else {
                continue;
            };
            self.consider(new, h, heap);
            let far = if new.0 == m { new.1 } else { new.0 };
            opposite.extend([edge(e.0, far), edge(e.1, far)]);
        }
    }

    /// Swaps edges within input triangles where that raises the least angle.
    fn swap_until_best(&mut self) {
        for _ in 0..SWAP_PASSES {
            let mut swapped = 0;
            for t in 0..self.surface.triangles.len() as u32 {
                for k in 0..3 {
                    swapped += u64::from(self.swap(t, k).is_some());
                }
            }
            if swapped == 0 {
                return;
            }
        }
    }

    /// Swaps the edge from corner `k` of a triangle to the next, under the conditions of [`Splitter::swap_edge`]; returns the new one.
    fn swap(&mut self, t: u32, k: usize) -> Option<EdgeKey> {
        let corners = self.surface.triangles[t as usize];
        let [a, b, c] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
        let &[x, y] = self.around.get(&edge(a, b))?.as_slice() else {
            return None;
        };
        if self.embedded.contains_key(&edge(a, b)) {
            return None;
        }
        let other = if x == t { y } else { x };
        if self.parent[t as usize] != self.parent[other as usize] {
            return None;
        }
        let beyond = self.surface.triangles[other as usize];
        let d = beyond.into_iter().find(|&v| v != a && v != b)?;
        if self.around.contains_key(&edge(c, d)) {
            return None;
        }
        let least = |triangles: [[u32; 3]; 2]| {
            let angles = triangles.map(|t| self.least_sine(t));
            angles[0].min(angles[1])
        };
        // The other diagonal of the quadrilateral a d b c; both new triangles must turn as the old ones do.
        let (old, new) = ([[a, b, c], [b, a, d]], [[a, d, c], [d, b, c]]);
        let normal = self.normal([a, b, c]);
        if new.iter().any(|&t| self.normal(t).dot(normal) <= 0.0)
            || least(new) <= least(old) * 1.000_001
        {
            return None;
        }
        self.surface.triangles[t as usize] = new[0];
        self.surface.triangles[other as usize] = new[1];
        self.around.remove(&edge(a, b));
        self.around.insert(edge(c, d), vec![t, other]);
        for (e, from, to) in [(edge(a, d), other, t), (edge(b, c), t, other)] {
            let list = self.around.get_mut(&e).expect("a side of the quadrilateral");
            for side in list.iter_mut().filter(|s| **s == from) {
                *side = to;
            }
        }
        self.report.edges_swapped += 1;
        Some(edge(c, d))
    }

    fn normal(&self, [a, b, c]: [u32; 3]) -> Point {
        let (a, b, c) = (self.point(a), self.point(b), self.point(c));
        (b - a).cross(c - a)
    }

    /// A measure of the least angle: twice the area over the square of the longest edge.
    fn least_sine(&self, t: [u32; 3]) -> f64 {
        let [a, b, c] = t.map(|v| self.point(v));
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        self.normal(t).length() / longest
    }

    /// Greatest distance of a vertex from the plane of the input triangle it came from.
    fn deviation(&self, input: &Surface) -> f64 {
        let mut most = 0.0f64;
        for (t, &parent) in self.surface.triangles.iter().zip(&self.parent) {
            let [a, b, c] = input.corners(parent);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for &v in t {
                most = most.max((self.point(v) - a).dot(normal).abs());
            }
        }
        most
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::validate;

    fn cube() -> Surface {
        let mut points = Vec::new();
        for i in 0..8u32 {
            points.push(Point::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)));
        }
        let triangles = vec![
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
            [2, 6, 3],
            [3, 6, 7],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
        ];
        Surface {
            points,
            labels: vec![0; triangles.len()],
            triangles,
            label_names: vec!["all".to_owned()],
            ..Surface::default()
        }
    }

    #[test]
    fn edges_get_the_wanted_length_and_the_surface_stays() {
        let h = |p: Point| 0.05 + 0.1 * p.x;
        let (fine, report) = split(&cube(), &h, u64::MAX).expect("few triangles");
        assert!(validate(&fine).accept().is_ok());
        assert_eq!(report.deviation_max, 0.0);
        assert!(report.edges_divided > 1000 && report.edges_swapped > 0);
        let area: f64 = (0..fine.n_triangles() as u32)
            .map(|t| {
                let [a, b, c] = fine.corners(t);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        assert!((area - 6.0).abs() < 1e-12);
        for &[a, b, c] in &fine.triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let (a, b) = (fine.points[a as usize], fine.points[b as usize]);
                // Swaps may leave the longer diagonal of a good quadrilateral.
                assert!(a.distance(b) < 1.5 * LONG * h((a + b) * 0.5));
            }
        }
        assert!(split(&cube(), &h, 1000 * BYTES_TRIANGLE).is_err());
        assert_eq!(split(&cube(), &h, u64::MAX).expect("the same").0.triangles, fine.triangles);
    }

    #[test]
    fn a_slat_is_cut_into_a_row_of_triangles() {
        let mut slat = cube();
        for p in &mut slat.points {
            *p *= Point::new(100.0, 0.01, 0.02);
        }
        let (fine, _) = split(&slat, &|_| 1.0, u64::MAX).expect("few triangles");
        assert!(validate(&fine).accept().is_ok());
        // Four long sides with 128 pieces of each long edge; in halves of halves there would be seventeen times as many.
        let n = fine.n_triangles();
        assert!((4 * 256..4 * 600).contains(&n), "{n}");
    }

    #[test]
    fn a_wall_given_from_both_sides_stays_one() {
        let mut both = cube();
        for [a, b, c] in both.triangles.clone() {
            both.triangles.push([a, c, b]);
            both.labels.push(0);
        }
        let (fine, _) = split(&both, &|p| 0.05 + 0.1 * p.x, u64::MAX).expect("few triangles");
        let found = validate(&fine);
        assert!(found.is_valid(), "{:?}", found.defects.first());
        assert_eq!(2 * found.closedness.two_sided.len(), fine.n_triangles());
    }

    /// A cube and a slat, with lengths even, graded, and fine in one place.
    #[test]
    fn predictions_are_near_and_what_does_not_fit_is_refused_at_once() {
        let mut slat = cube();
        slat.points.iter_mut().for_each(|p| *p *= Point::new(1.0, 0.03, 0.2));
        let place = Point::new(0.9, 0.0, 0.1);
        let lengths: [(&str, &dyn Fn(Point) -> f64); 4] = [
            ("even", &|_| 0.01),
            ("coarse", &|_| 0.07),
            ("graded", &|p| 0.005 + 0.1 * p.x),
            ("place", &|p| 0.002 + 0.2 * p.distance(place)),
        ];
        for (name, surface) in [("cube", cube()), ("slat", slat)] {
            for (of, h) in lengths {
                let predicted = predict_split(&surface, h);
                let (fine, _) = split(&surface, h, u64::MAX).unwrap();
                let ratio = fine.n_triangles() as f64 / predicted;
                assert!((0.75..1.6).contains(&ratio), "{name}, {of}: {ratio}");
            }
        }
        let asked = std::cell::Cell::new(0u64);
        let h = |_: Point| {
            asked.set(asked.get() + 1);
            2e-4
        };
        let error = split(&cube(), &h, 1 << 30).unwrap_err();
        assert!(matches!(error, SurfaceError::SplitMemory { .. }), "{error}");
        assert!(asked.get() < 2000, "asked {} times", asked.get());
    }
}
