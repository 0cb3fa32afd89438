//! Sizes from a background mesh: linear in its tetrahedra, none outside of it. Without tetrahedra, those of the nearest point.

use super::SizingError;
use super::constraint::SizeConstraint;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::BoxTree;

/// Sizes in a cell are taken as equal when they differ by less than this share.
const SPREAD_MAX: f64 = 0.1;
/// Cells are at most this many of the sizes in them wide, where these differ.
const CELLS_PER_SIZE: f64 = 2.0;
/// A point this far outside a tetrahedron, as a share of its height, is still in it: so none falls between two.
const OUTSIDE_MAX: f64 = 1e-9;

/// Sizes read from a file.
#[derive(Clone, Debug)]
pub enum Background {
    /// At the vertices of a tetrahedral mesh.
    Mesh(Box<BackgroundMesh>),
    /// At the vertices of the surface itself, in their order.
    AtVertices(Vec<f64>),
}

/// A tetrahedral mesh with a size at each vertex. Memory: about 80 bytes per vertex and 90 per tetrahedron.
#[derive(Clone, Debug)]
pub struct BackgroundMesh {
    points: Vec<Point>,
    tets: Vec<[u32; 4]>,
    h: Vec<f64>,
    tree: BoxTree,
    vertices: BoxTree,
    /// Least and greatest size below each node of `vertices`, in the shape of its levels.
    ranges: Vec<Vec<[f64; 2]>>,
}

impl BackgroundMesh {
    /// Shape: `h` runs parallel to `points`, which `tets` index; sizes are above zero.
    pub fn new(points: Vec<Point>, tets: Vec<[u32; 4]>, h: Vec<f64>) -> Self {
        let scratch = &ScratchSpace::boundless();
        let bounds = Aabb::around(points.iter().copied());
        let around = |t: u32| Aabb::around(tets[t as usize].map(|v| points[v as usize]));
        let tree = BoxTree::new(&bounds, tets.len() as u32, scratch, |_| true, around);
        let at = |v: u32| Aabb::around([points[v as usize]]);
        let vertices = BoxTree::new(&bounds, points.len() as u32, scratch, |_| true, at);
        let join = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.min(c), b.max(d)];
        let mut ranges: Vec<Vec<[f64; 2]>> = Vec::new();
        for (level, nodes) in vertices.levels.iter().enumerate() {
            let range = |node: usize| match level {
                0 => (vertices.members(node))
                    .map(|i| [h[vertices.order.get(i) as usize]; 2])
                    .fold(NONE, join),
                _ => (vertices.children(level, node))
                    .map(|child| ranges[level - 1][child])
                    .fold(NONE, join),
            };
            let level = (0..nodes.len()).map(range).collect();
            ranges.push(level);
        }
        Self { points, tets, h, tree, vertices, ranges }
    }

    /// Memory held, in bytes, for so many vertices and tetrahedra.
    pub fn bytes(vertices: u64, tets: u64) -> u64 {
        80 * vertices + 90 * tets
    }

    /// Least and greatest size of the vertices in a box.
    fn range_in(&self, cell: &Aabb) -> [f64; 2] {
        let [mut low, mut high] = NONE;
        let mut add = |[a, b]: [f64; 2]| (low, high) = (low.min(a), high.max(b));
        let holds = |b: &Aabb| cell.low.cmple(b.low).all() && b.high.cmple(cell.high).all();
        let top = self.vertices.levels.len() - 1;
        let mut stack: Vec<(usize, usize)> =
            (0..self.vertices.levels[top].len()).map(|n| (top, n)).collect();
        while let Some((level, node)) = stack.pop() {
            let bounds = &self.vertices.levels[level].get(node);
            if holds(bounds) {
                add(self.ranges[level][node]);
            } else if !cell.meets(bounds) {
            } else if level > 0 {
                let children = self.vertices.children(level, node);
                stack.extend(children.map(|child| (level - 1, child)));
            } else {
                for i in self.vertices.members(node) {
                    if holds(&self.vertices.boxes.get(i)) {
                        add([self.h[self.vertices.order.get(i) as usize]; 2]);
                    }
                }
            }
        }
        [low, high]
    }

    /// The size at the vertex nearest to `p`.
    fn nearest(&self, p: Point) -> Option<f64> {
        let distance = |b: &Aabb| p.distance_squared(p.clamp(b.low, b.high));
        let mut best: Option<(f64, u32)> = None;
        let top = self.vertices.levels.len() - 1;
        let mut stack: Vec<(f64, usize, usize)> =
            (0..self.vertices.levels[top].len()).map(|n| (0.0, top, n)).collect();
        while let Some((least, level, node)) = stack.pop() {
            if best.is_some_and(|(known, _)| least > known) {
                continue;
            }
            if level > 0 {
                let children = self.vertices.children(level, node);
                let child = |n| (distance(&self.vertices.levels[level - 1].get(n)), level - 1, n);
                let from = stack.len();
                stack.extend(children.map(child));
                // The nearest one is looked at first.
                stack[from..].sort_by(|a, b| b.0.total_cmp(&a.0));
                continue;
            }
            for i in self.vertices.members(node) {
                let v = self.vertices.order.get(i);
                let found = (p.distance_squared(self.points[v as usize]), v);
                // Of vertices at one distance the first: the size depends on no order of the tree.
                if best.is_none_or(|known| found < known) {
                    best = Some(found);
                }
            }
        }
        best.map(|(_, v)| self.h[v as usize])
    }

    /// The size at `p`: of the tetrahedron that holds it, if any, or without tetrahedra of the nearest vertex.
    fn at(&self, p: Point) -> Option<f64> {
        if self.tets.is_empty() {
            return self.nearest(p);
        }
        let mut found = None;
        self.tree.at(p, |t| {
            let tet = self.tets[t as usize];
            found = shares(tet.map(|v| self.points[v as usize]), p).map(|shares| {
                let parts = tet.iter().zip(shares);
                parts.map(|(&v, share)| share * self.h[v as usize]).sum()
            });
            found.is_some()
        });
        found
    }
}

const NONE: [f64; 2] = [f64::INFINITY, 0.0];

/// Barycentric coordinates of `p` in a tetrahedron of either orientation that holds it.
fn shares([a, b, c, d]: [Point; 4], p: Point) -> Option<[f64; 4]> {
    let volume = |a: Point, b: Point, c: Point, d: Point| (b - a).cross(c - a).dot(d - a);
    let whole = volume(a, b, c, d);
    let parts = [volume(p, b, c, d), volume(a, p, c, d), volume(a, b, p, d), volume(a, b, c, p)];
    let shares = parts.map(|part| part / whole);
    let holds = shares.iter().all(|s| *s >= -OUTSIDE_MAX);
    holds.then(|| shares.map(|s| s.clamp(0.0, 1.0)))
}

impl SizeConstraint for BackgroundMesh {
    fn h(&self, p: Point) -> Result<f64, SizingError> {
        Ok(self.at(p).unwrap_or(f64::INFINITY))
    }

    fn option(&self) -> Option<&'static str> {
        Some("size_field")
    }

    /// Linear pieces have their extremes at vertices. So the vertices in the cell are examined besides its corners and
    /// middle.
    fn divides(&self, middle: Point, width: f64) -> Option<bool> {
        let half = Point::splat(0.5 * width);
        let cell = Aabb { low: middle - half, high: middle + half };
        let corner = |c: usize| {
            let at = |axis: usize| if c >> axis & 1 == 1 { 0.5 } else { -0.5 };
            middle + Point::new(at(0), at(1), at(2)) * width
        };
        let [vertex_low, vertex_high] = self.range_in(&cell);
        let (mut low, mut high) = (vertex_low, vertex_high);
        let mut sum = 0.0;
        let mut is_outside = false;
        for c in 0..8 {
            let Some(h) = self.at(corner(c)) else {
                is_outside = true;
                continue;
            };
            (low, high) = (low.min(h), high.max(h));
            sum += h;
        }
        if !low.is_finite() || width <= CELLS_PER_SIZE * low {
            return Some(false);
        }
        // At the end of the mesh the cell's outer corners have no sizes.
        if is_outside {
            return Some(true);
        }
        let bends = |h: f64| (h - sum / 8.0).abs() > SPREAD_MAX * low;
        let has_vertices = vertex_low.is_finite();
        Some(
            (has_vertices && high > low * (1.0 + SPREAD_MAX)) || self.at(middle).is_some_and(bends),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unit cube as a grid of `n³` cells of six tetrahedra.
    pub(super) fn grid(n: u32, h: impl Fn(Point) -> f64) -> BackgroundMesh {
        let m = n + 1;
        let (mut points, mut tets) = (Vec::new(), Vec::new());
        for k in 0..m * m * m {
            let p = Point::new(f64::from(k % m), f64::from(k / m % m), f64::from(k / m / m));
            points.push(p / f64::from(n));
        }
        for k in 0..n * n * n {
            let low = k % n + k / n % n * m + k / n / n * m * m;
            let steps = [1, m, m * m];
            for [i, j, l] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                let a = low + steps[i];
                let b = a + steps[j];
                tets.push([low, a, b, b + steps[l]]);
            }
        }
        let h = points.iter().map(|&p| h(p)).collect();
        BackgroundMesh::new(points, tets, h)
    }

    #[test]
    fn linear_sizes_come_back() {
        let linear = |p: Point| 0.1 + 0.3 * p.x + 0.2 * p.y + 0.05 * p.z;
        let mesh = grid(5, linear);
        for k in 0..3000 {
            let at = |step: i32| f64::from(k * step % 997) / 996.0;
            let p = Point::new(at(7), at(31), at(57));
            let h = mesh.h(p).expect("sizes everywhere");
            assert!((h - linear(p)).abs() < 1e-9, "{p} {h}");
            let outside = mesh.h(p + Point::new(1.001, 0.0, 0.0));
            assert_eq!(outside, Ok(f64::INFINITY));
        }
    }

    #[test]
    fn without_tetrahedra_the_nearest_point_has_the_size() {
        let at = |k: usize, step: usize| (k * step % 97) as f64 / 96.0;
        let points: Vec<Point> =
            (0..300).map(|k| Point::new(at(k, 7), at(k, 31), at(k, 57))).collect();
        let h: Vec<f64> = (0..300).map(|k| 0.01 + 0.001 * k as f64).collect();
        let sizes = BackgroundMesh::new(points.clone(), Vec::new(), h.clone());
        for k in 0..500 {
            let p = Point::new(at(k, 11), at(k, 3), at(k, 5)) * 1.3 - 0.1;
            let nearest = (0..300).min_by(|&a, &b| {
                points[a].distance_squared(p).total_cmp(&points[b].distance_squared(p))
            });
            assert_eq!(sizes.h(p), Ok(h[nearest.expect("there are points")]));
        }
        let one = BackgroundMesh::new(vec![Point::ONE], Vec::new(), vec![0.25]);
        assert_eq!(one.h(Point::ZERO), Ok(0.25));
        assert_eq!(one.divides(Point::ZERO, 0.4), Some(false));
    }

    #[test]
    fn cells_are_divided_where_sizes_differ() {
        let mesh = grid(40, |p| if p.distance(Point::splat(0.3)) < 0.02 { 0.001 } else { 0.2 });
        assert_eq!(mesh.divides(Point::splat(0.5), 1.0), Some(true));
        assert_eq!(mesh.divides(Point::splat(0.3), 0.01), Some(true));
        assert_eq!(mesh.divides(Point::splat(0.3), 0.0015), Some(false));
        assert_eq!(mesh.divides(Point::splat(0.8), 0.1), Some(false));
        assert_eq!(mesh.divides(Point::splat(3.0), 1.0), Some(false));
    }
}
