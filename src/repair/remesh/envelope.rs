//! The distance bound: no change of the surface may leave the tolerance, either way.
//!
//! From new to old: a new triangle must be covered by inner regions of input triangles. From old to new: at first every point of
//! the input lies in the thickened triangle of its own. Where triangles are replaced, those parts of the input that lie in the outer
//! regions of the old ones must be covered by inner regions of triangles there afterwards. So every point of the input stays in a
//! thickened triangle of the surface. Both are decided by cutting polygons, not by samples.
//!
//! Source of the idea: Wang, Schneider, Hu, Attene and Panozzo, "Exact and efficient polyhedral envelope containment check" (2020).

use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{BoxTree, Surface, nearest_point};

use super::region::{Polygon, Region, is_covered};

/// The input and the tolerance.
pub struct Envelope<'a> {
    input: &'a Surface,
    tree: BoxTree,
    /// Greatest distance either way.
    pub tolerance: f64,
}

/// Box of a triangle, grown on all sides.
pub fn box_around(t: &[Point; 3], by: f64) -> Aabb {
    let Aabb { low, high } = Aabb::around(*t);
    Aabb { low: low - Point::splat(by), high: high + Point::splat(by) }
}

impl<'a> Envelope<'a> {
    /// An envelope of that tolerance around `input`.
    pub fn new(input: &'a Surface, tolerance: f64, scratch: &ScratchSpace) -> Self {
        let box_of = |t: u32| Aabb::around(input.corners(t));
        let n = input.n_triangles() as u32;
        let tree = BoxTree::new(&input.bounds(), n, scratch, |_| true, box_of);
        Self { input, tree, tolerance }
    }

    /// Returns whether every point of a triangle is within the tolerance of the input.
    pub fn holds(&self, t: &[Point; 3]) -> bool {
        let mut regions = Vec::new();
        self.tree.meeting(&box_around(t, self.tolerance), |s| {
            regions.extend(Region::inner(self.input.corners(s), self.tolerance));
        });
        is_covered(&Polygon::new(*t), &regions)
    }

    /// The parts of the input that may rely on triangle `t`.
    pub fn relying(&self, t: &[Point; 3]) -> Vec<Polygon> {
        let region = Region::outer(*t, self.tolerance);
        let mut parts = Vec::new();
        self.tree.meeting(&box_around(t, self.tolerance), |s| {
            parts.extend(region.part_of(&Polygon::new(self.input.corners(s))));
        });
        parts
    }

    /// The input point nearest to `p` and its triangle; `None` if there is none within `within`.
    pub fn nearest(&self, p: Point, within: f64) -> Option<(Point, u32)> {
        let mut best: Option<(f64, u32, Point)> = None;
        let reach = Point::splat(within);
        self.tree.meeting(&Aabb { low: p - reach, high: p + reach }, |s| {
            let at = nearest_point(self.input.corners(s), p);
            let d = at.distance_squared(p);
            if d <= within * within && best.is_none_or(|(e, t, _)| (d, s) < (e, t)) {
                best = Some((d, s, at));
            }
        });
        best.map(|(_, s, at)| (at, s))
    }

    /// Normal of an input triangle, of length one; not a number where there is no area.
    pub fn normal(&self, s: u32) -> Point {
        let [a, b, c] = self.input.corners(s);
        let n = (b - a).cross(c - a);
        n / n.length()
    }

    /// Distance from `p` along `direction` (of length one) to the first triangle that is met from behind, up to `most`.
    pub fn thickness(&self, p: Point, direction: Point, least: f64, most: f64) -> Option<f64> {
        let mut best = most;
        let mut stack: Vec<(usize, usize)> = vec![(self.tree.levels.len() - 1, 0)];
        while let Some((level, node)) = stack.pop() {
            if !is_hit(&self.tree.levels[level].get(node), p, direction, best) {
                continue;
            }
            if level > 0 {
                stack.extend(self.tree.children(level, node).map(|c| (level - 1, c)));
                continue;
            }
            for i in self.tree.members(node) {
                let [a, b, c] = self.input.corners(self.tree.order.get(i));
                let normal = (b - a).cross(c - a);
                let along = direction.dot(normal);
                // Met under a flat angle, a triangle is a side wall.
                if along <= 0.5 * normal.length() {
                    continue;
                }
                let t = (a - p).dot(normal) / along;
                let x = p + direction * t;
                let is_in = [(a, b), (b, c), (c, a)]
                    .iter()
                    .all(|&(from, to)| (to - from).cross(x - from).dot(normal) >= 0.0);
                if t > least && t < best && is_in {
                    best = t;
                }
            }
        }
        (best < most).then_some(best)
    }
}

fn is_hit(b: &Aabb, p: Point, direction: Point, most: f64) -> bool {
    let (mut from, mut to) = (0.0f64, most);
    for k in 0..3 {
        if direction[k].abs() < 1e-12 {
            if p[k] < b.low[k] || p[k] > b.high[k] {
                return false;
            }
            continue;
        }
        let (x, y) = ((b.low[k] - p[k]) / direction[k], (b.high[k] - p[k]) / direction[k]);
        (from, to) = (from.max(x.min(y)), to.min(x.max(y)));
    }
    from <= to
}
