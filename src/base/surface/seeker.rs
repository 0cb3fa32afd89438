//! Distances from points to a surface, and the triangle above a point.

use super::box_pairs::tree_of;
use super::{BoxTree, Surface};
use crate::geom::{Aabb, Point, mix};
use crate::storage::ScratchSpace;

/// Initial capacity of the stack of a tree walk: enough for most, so that it does not grow step by step.
const STACK: usize = 64;

/// A triangle met by a line along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Index of the triangle.
    pub triangle: u32,
    /// Where, in input units.
    pub z: f64,
    /// True if the triangle's front looks up.
    pub front_is_up: bool,
}

impl Crossing {
    /// Its sides from below: `2 * triangle`, and one more for the back.
    pub(super) fn sides(&self) -> [u32; 2] {
        let front = 2 * self.triangle;
        match self.front_is_up {
            true => [front + 1, front],
            false => [front, front + 1],
        }
    }
}

/// Distances to one surface, and crossings of lines with it. The surface must not change. Memory: about 70 bytes per
/// triangle for the tree, less if it spills.
pub struct Seeker<'a> {
    surface: &'a Surface,
    tree: BoxTree,
}

impl<'a> Seeker<'a> {
    /// Sees all triangles of the surface.
    pub fn new(surface: &'a Surface) -> Self {
        Self::with_filter(surface, &ScratchSpace::boundless(), |_| true)
    }

    /// Sees the triangles that `keep` accepts alone.
    ///
    /// A scratch file that fails unwinds, here and later.
    pub fn with_filter(
        surface: &'a Surface,
        scratch: &ScratchSpace,
        keep: impl Fn(u32) -> bool + Sync,
    ) -> Self {
        Self::with_tree(surface, tree_of(surface, scratch, keep))
    }

    /// Sees the triangles that `tree` has.
    pub(super) fn with_tree(surface: &'a Surface, tree: BoxTree) -> Self {
        Self { surface, tree }
    }

    pub(super) fn tree(&self) -> &BoxTree {
        &self.tree
    }

    /// The surface it answers for.
    pub fn surface(&self) -> &'a Surface {
        self.surface
    }

    /// Distance from `p` to the surface; infinite when it is not below `within`.
    pub fn distance(&self, p: Point, within: f64) -> f64 {
        self.nearest(p, within, |corners| (p - nearest_point(corners, p)).length_squared())
    }

    /// Distance from `p` to the surface's vertices; infinite when it is not below `within`.
    pub fn distance_to_vertices(&self, p: Point, within: f64) -> f64 {
        self.nearest(p, within, |corners| {
            let all = corners.map(|c| (p - c).length_squared());
            all.into_iter().fold(f64::INFINITY, f64::min)
        })
    }

    /// Square root of the least value of `reach`, which is not below the squared distance to the triangle's box.
    fn nearest(&self, p: Point, within: f64, reach: impl Fn([Point; 3]) -> f64) -> f64 {
        let mut best = within * within;
        let mut found = f64::INFINITY;
        let Some(top) = self.tree.levels.len().checked_sub(1) else {
            return found;
        };
        let mut stack = Vec::with_capacity(STACK);
        stack.push((top, 0, 0.0));
        while let Some((level, node, least)) = stack.pop() {
            if least >= best {
                continue;
            }
            if level > 0 {
                let below = &self.tree.levels[level - 1];
                let from = stack.len();
                let children = self.tree.children(level, node);
                stack.extend(children.map(|c| (level - 1, c, distance2(&below.get(c), p))));
                // The nearest child is visited first.
                stack[from..].sort_by(|a, b| b.2.total_cmp(&a.2).then(b.1.cmp(&a.1)));
                continue;
            }
            for i in self.tree.members(node) {
                if distance2(&self.tree.boxes.get(i), p) < best {
                    let reach = reach(self.surface.corners(self.tree.order.get(i)));
                    if reach < best {
                        (best, found) = (reach, reach);
                    }
                }
            }
        }
        found.sqrt()
    }

    /// The first triangle above `p`, along z.
    pub fn above(&self, p: Point) -> Option<Crossing> {
        let mut best: Option<Crossing> = None;
        self.each_crossing(p, p.z, |c| {
            let key = |c: &Crossing| (c.z, c.triangle);
            if c.z > p.z && best.is_none_or(|b| key(&c) < key(&b)) {
                best = Some(c);
            }
            best.map_or(f64::INFINITY, |b| b.z)
        });
        best
    }

    /// The triangles on the line through `p` along z, from one of them up to the first where `is_end` holds. If that one
    /// is not on the line, from `p`.
    pub(super) fn upward(
        &self,
        p: Point,
        from: u32,
        is_end: impl Fn(u32) -> bool,
    ) -> Vec<Crossing> {
        let low = self.crossing(from, p).map_or(p.z, |c| c.z);
        let mut high = f64::INFINITY;
        let mut found = Vec::new();
        self.each_crossing(p, low, |c| {
            if (low..=high).contains(&c.z) {
                found.push(c);
                if is_end(c.triangle) {
                    high = c.z;
                }
            }
            high
        });
        found.retain(|c| c.z <= high);
        found.sort_by(|a, b| a.z.total_cmp(&b.z).then(a.triangle.cmp(&b.triangle)));
        found
    }

    /// Mean number of triangles tested per search, from some points: half of all for fans of long thin triangles,
    /// otherwise tens.
    pub fn effort(&self) -> f64 {
        /// Enough probes to distinguish tens from thousands.
        const PROBES: u64 = 64;
        let bounds = self.surface.bounds();
        let looked_at = (0..PROBES).map(|i| {
            let at = |k: u64| (mix(3 * i + k) >> 11) as f64 / (1u64 << 53) as f64;
            let p = bounds.low + (bounds.high - bounds.low) * Point::new(at(0), at(1), at(2));
            self.each_crossing(p, p.z, |_| f64::INFINITY)
        });
        looked_at.sum::<usize>() as f64 / PROBES as f64
    }

    /// Calls `visit` on the crossings in boxes from `low` up, about from below. `visit` returns the largest z of interest.
    /// Returns the number of triangles tested.
    fn each_crossing(&self, p: Point, low: f64, mut visit: impl FnMut(Crossing) -> f64) -> usize {
        let mut high = f64::INFINITY;
        let mut n = 0;
        let Some(top) = self.tree.levels.len().checked_sub(1) else {
            return n;
        };
        let misses = |b: &Aabb, high: f64| {
            p.x < b.low.x
                || p.x > b.high.x
                || p.y < b.low.y
                || p.y > b.high.y
                || b.high.z < low
                || b.low.z > high
        };
        let mut stack = Vec::with_capacity(STACK);
        stack.push((top, 0, f64::NEG_INFINITY));
        while let Some((level, node, bottom)) = stack.pop() {
            if bottom > high {
                continue;
            }
            if level > 0 {
                let below = &self.tree.levels[level - 1];
                let from = stack.len();
                for child in self.tree.children(level, node) {
                    let bounds = below.get(child);
                    if !misses(&bounds, high) {
                        stack.push((level - 1, child, bounds.low.z));
                    }
                }
                // The lowest child is visited first.
                stack[from..].sort_by(|a, b| b.2.total_cmp(&a.2).then(b.1.cmp(&a.1)));
                continue;
            }
            for i in self.tree.members(node) {
                if misses(&self.tree.boxes.get(i), high) {
                    continue;
                }
                n += 1;
                if let Some(c) = self.crossing(self.tree.order.get(i), p) {
                    high = visit(c);
                }
            }
        }
        n
    }

    fn crossing(&self, triangle: u32, p: Point) -> Option<Crossing> {
        let [a, b, c] = self.surface.corners(triangle);
        let (u, v, w) = (turn(b, c, p), turn(c, a, p), turn(a, b, p));
        // Zero counts as the side it has from the edge's smaller end: each edge is decided once for all its triangles.
        let is_left = |(area, swapped): (f64, bool)| (area > 0.0) ^ (area == 0.0 && swapped);
        let front_is_up = is_left(u);
        if is_left(v) != front_is_up || is_left(w) != front_is_up {
            return None;
        }
        let sum = u.0 + v.0 + w.0;
        // Rounded, a mean may lie outside the triangle's box.
        let (least, most) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        let z = match sum == 0.0 {
            true => most,
            false => ((u.0 * a.z + v.0 * b.z + w.0 * c.z) / sum).clamp(least, most),
        };
        Some(Crossing { triangle, z, front_is_up })
    }
}

/// Twice the area of `a b p` seen from above, with the same bits up to the sign for `b a p`; and whether `b` comes first.
fn turn(a: Point, b: Point, p: Point) -> (f64, bool) {
    let swapped = (b.x, b.y) < (a.x, a.y);
    let (low, high) = if swapped { (b, a) } else { (a, b) };
    let area = (high.x - low.x) * (p.y - low.y) - (high.y - low.y) * (p.x - low.x);
    (if swapped { -area } else { area }, swapped)
}

fn distance2(b: &Aabb, p: Point) -> f64 {
    let beyond = (b.low - p).max(p - b.high).max(Point::ZERO);
    beyond.length_squared()
}

/// The point of a triangle nearest to `p`: on its face, an edge or at a corner.
pub fn nearest_point([a, b, c]: [Point; 3], p: Point) -> Point {
    let normal = (b - a).cross(c - a);
    let beyond = |from: Point, to: Point| (to - from).cross(p - from).dot(normal);
    let sides = [beyond(b, c), beyond(c, a), beyond(a, b)];
    let sum: f64 = sides.iter().sum();
    if sum > 0.0 && sides.iter().all(|&s| s >= 0.0) {
        return (a * sides[0] + b * sides[1] + c * sides[2]) / sum;
    }
    let ends = [(a, b), (b, c), (c, a)].map(|(from, to)| nearest_on_edge(from, to, p));
    let nearer = |x: Point, y: Point| if p.distance(y) < p.distance(x) { y } else { x };
    ends.into_iter().reduce(nearer).unwrap_or(a)
}

/// The point of an edge nearest to `p`.
pub(super) fn nearest_on_edge(from: Point, to: Point, p: Point) -> Point {
    let along = to - from;
    let t = (p - from).dot(along) / along.length_squared();
    from + along * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 }
}
