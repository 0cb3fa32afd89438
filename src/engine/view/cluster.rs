//! Simplification of triangles: vertices in the same cell of a grid are joined.
//!
//! The grid starts as fine as possible. When the number of triangles exceeds the limit, cells grow by a quarter until few enough
//! remain. So any number of triangles passes through a table of fixed size, and the result depends on their order alone. A joined
//! vertex lies where the planes of its triangles meet best, so edges stay sharp and walls flat.
//!
//! Sources: J. Rossignac and P. Borrel, "Multi-resolution 3D approximations for rendering complex scenes" (1993); P. Lindstrom,
//! "Out-of-core simplification of large polygonal models" (2000).

use std::collections::hash_map::Entry;

use glam::{DMat3, DVec3};

use tetdb_base::geom::{Aabb, IdMap, IdSet, Point};

/// Bits of the initial number of cells along an axis: no two vertices that a screen can separate share a cell.
const BITS: u32 = 21;
/// When cells first grow, they start from this share of the mean edge; each growth multiplies them by `GROWTH`.
const FIRST: f64 = 0.5;
const GROWTH: f64 = 1.25;
/// Share of the allowed triangles that may remain after a join; above it, cells grow further.
const LEFT: f64 = 0.9;
/// Weight of the mean of a cell's vertices relative to the planes of its triangles. The mean decides where the planes leave a
/// freedom.
const TO_MEAN: f64 = 1e-3;
/// Bytes of a triangle in the table, with its vertices.
pub(super) const TRIANGLE_BYTES: u64 = 150;

/// The vertices of one cell. Lengths are shares of the longest side of the box.
#[derive(Clone, Copy)]
struct ClusterCell {
    /// Sum of the positions, and their number.
    sum: Point,
    n: u32,
    /// Sums over the triangles, with n the normal whose length is twice the area: n times itself (xx xy xz yy yz zz), and n times
    /// n·p for a point p of the triangle.
    planes: [f32; 6],
    offsets: [f32; 3],
}

impl ClusterCell {
    fn mean(&self) -> Point {
        self.sum / f64::from(self.n)
    }

    fn add(&mut self, other: &Self) {
        self.sum += other.sum;
        self.n = self.n.saturating_add(other.n);
        let own = self.planes.iter_mut().chain(&mut self.offsets);
        let others = other.planes.iter().chain(&other.offsets);
        own.zip(others).for_each(|(a, b)| *a += b);
    }

    /// Returns the point nearest to the planes of the triangles, or the mean if that point is farther from it than `cell`.
    fn best(&self, cell: f64) -> Point {
        let mean = self.mean();
        let [xx, xy, xz, yy, yz, zz] = self.planes.map(f64::from);
        let planes = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let pull = TO_MEAN * (xx + yy + zz);
        let offsets = DVec3::from_array(self.offsets.map(f64::from));
        let system = planes + DMat3::from_diagonal(DVec3::splat(pull));
        let step = system.inverse() * (offsets - planes * mean);
        match step.length() <= cell {
            true => mean + step,
            false => mean,
        }
    }
}

/// Triangles with a value each.
///
/// Shape: `triangles[i]` = places in `points`; `tags[i]` runs parallel to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch<T> {
    /// Positions of the vertices.
    pub points: Vec<Point>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Value of each triangle.
    pub tags: Vec<T>,
    /// Side of the cells in which vertices were joined; 0 if none were.
    pub cell: f64,
    /// Number of input triangles.
    pub of: u64,
}

/// A patch under construction.
pub(super) struct Cluster<T> {
    low: Point,
    side: f64,
    /// Side of a cell; `is_joined` is true once vertices were joined.
    cell: f64,
    is_joined: bool,
    most: usize,
    /// Cells by number.
    cells: Vec<ClusterCell>,
    numbers: IdMap<u64, u32>,
    triangles: Vec<[u32; 3]>,
    tags: Vec<T>,
    seen: IdSet<[u32; 3]>,
    of: u64,
}

impl<T: Copy> Cluster<T> {
    /// Creates a table for at most `most` triangles within `bounds`.
    pub fn new(bounds: &Aabb, most: usize) -> Self {
        let side = (bounds.high - bounds.low).max_element();
        Self {
            low: bounds.low,
            side: if side > 0.0 { side } else { 1.0 },
            cell: 1.0 / f64::from((1u32 << BITS) - 1),
            is_joined: false,
            most,
            cells: Vec::new(),
            numbers: IdMap::default(),
            triangles: Vec::new(),
            tags: Vec::new(),
            seen: IdSet::default(),
            of: 0,
        }
    }

    /// Adds a triangle. Of triangles that become equal, the first stays.
    pub fn push(&mut self, corners: [Point; 3], tag: T) {
        self.of += 1;
        let corners = corners.map(|p| (p - self.low) / self.side);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let [x, y, z] = normal.to_array();
        let planes = [x * x, x * y, x * z, y * y, y * z, z * z].map(|x| x as f32);
        let offsets = (normal * normal.dot(a)).to_array().map(|x| x as f32);
        let nodes = corners.map(|sum| {
            let n = 1;
            self.number(&ClusterCell { sum, n, planes, offsets })
        });
        if self.is_new(nodes) {
            self.triangles.push(nodes);
            self.tags.push(tag);
            if self.triangles.len() > self.most {
                self.join();
            }
        }
    }

    fn is_new(&mut self, nodes: [u32; 3]) -> bool {
        let [a, b, c] = nodes;
        let mut sorted = nodes;
        sorted.sort_unstable();
        a != b && b != c && c != a && self.seen.insert(sorted)
    }

    /// Adds vertices to the cell of their mean; returns the number of the cell.
    fn number(&mut self, vertices: &ClusterCell) -> u32 {
        let at = (vertices.mean() / self.cell).to_array();
        let last = f64::from((1u32 << BITS) - 1);
        let key = at.into_iter().fold(0, |key, x| key << BITS | x.clamp(0.0, last) as u64);
        match self.numbers.entry(key) {
            Entry::Occupied(entry) => {
                self.cells[*entry.get() as usize].add(vertices);
                *entry.get()
            }
            Entry::Vacant(entry) => {
                let number = self.cells.len() as u32;
                self.cells.push(*vertices);
                *entry.insert(number)
            }
        }
    }

    /// Lets cells grow until few enough triangles remain.
    fn join(&mut self) {
        if !self.is_joined {
            self.is_joined = true;
            let edge = |t: &[u32; 3]| {
                let [a, b, _] = t.map(|v| self.cells[v as usize].mean());
                a.distance(b)
            };
            let sum: f64 = self.triangles.iter().map(edge).sum();
            let mean = sum / self.triangles.len() as f64;
            self.cell = self.cell.max(FIRST / GROWTH * mean);
        }
        while self.triangles.len() as f64 > LEFT * self.most as f64 {
            self.cell *= GROWTH;
            self.sort_again();
        }
    }

    fn sort_again(&mut self) {
        let cells = std::mem::take(&mut self.cells);
        self.numbers.clear();
        let now: Vec<u32> = cells.iter().map(|cell| self.number(cell)).collect();
        let triangles = std::mem::take(&mut self.triangles);
        let tags = std::mem::take(&mut self.tags);
        self.seen.clear();
        for (nodes, tag) in triangles.into_iter().zip(tags) {
            let nodes = nodes.map(|v| now[v as usize]);
            if self.is_new(nodes) {
                self.triangles.push(nodes);
                self.tags.push(tag);
            }
        }
    }

    /// Returns the triangles in the order of their input, with vertices numbered by first use.
    pub fn finish(self) -> Patch<T> {
        let mut places = vec![u32::MAX; self.cells.len()];
        let mut points = Vec::new();
        let triangles = self.triangles.into_iter().map(|nodes| {
            nodes.map(|v| {
                let place = &mut places[v as usize];
                if *place == u32::MAX {
                    *place = points.len() as u32;
                    let cell = &self.cells[v as usize];
                    let at = match self.is_joined {
                        true => cell.best(self.cell),
                        false => cell.mean(),
                    };
                    points.push(self.low + at * self.side);
                }
                *place
            })
        });
        let triangles: Vec<[u32; 3]> = triangles.collect();
        Patch {
            points,
            triangles,
            tags: self.tags,
            cell: if self.is_joined { self.cell * self.side } else { 0.0 },
            of: self.of,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit() -> Aabb {
        Aabb { low: Point::ZERO, high: Point::ONE }
    }

    /// The unit square as `n` by `n` squares of two triangles each.
    fn square(n: u32, most: usize) -> Patch<u32> {
        let mut cluster = Cluster::new(&unit(), most);
        let at = |i: u32, j: u32| {
            let [x, y] = [i, j].map(|k| f64::from(k) / f64::from(n));
            Point::new(x, y, 0.5)
        };
        for i in 0..n {
            for j in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                cluster.push([a, b, c], i);
                cluster.push([a, c, d], i);
            }
        }
        cluster.finish()
    }

    fn area(patch: &Patch<u32>) -> f64 {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| patch.points[v as usize]);
            (b - a).cross(c - a).z / 2.0
        };
        patch.triangles.iter().map(area).sum()
    }

    #[test]
    fn what_fits_stays_as_it_is() {
        let patch = square(20, 800);
        assert_eq!((patch.triangles.len(), patch.points.len()), (800, 441));
        assert_eq!((patch.cell, patch.of), (0.0, 800));
        assert!((area(&patch) - 1.0).abs() < 1e-12);
        let near = |p: &Point| p.distance(Point::new(0.05, 0.5, 0.5)) < 1e-12;
        assert!(patch.points.iter().any(near));
    }

    #[test]
    fn of_many_triangles_few_are_left_and_they_cover_the_same() {
        let patch = square(300, 5000);
        let n = patch.triangles.len();
        assert!((1000..=5000).contains(&n), "{n}");
        assert_eq!((patch.of, patch.tags.len()), (180_000, n));
        assert!(patch.cell > 0.005 && patch.cell < 0.1, "{}", patch.cell);
        assert!((area(&patch) - 1.0).abs() < 0.1, "{}", area(&patch));
        assert!(patch.tags.is_sorted());
        assert_eq!(patch, square(300, 5000));
    }

    #[test]
    fn edges_stay_sharp() {
        // Two walls that meet at a right angle along y.
        let mut cluster = Cluster::new(&unit(), 3000);
        let n = 100;
        let step = 1.0 / f64::from(n);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [u, v] = [i, j].map(|k| f64::from(k) * step);
            let at = |u: f64, v: f64| [Point::new(u, v, 0.0), Point::new(0.0, v, u)];
            let corners = [at(u, v), at(u + step, v), at(u + step, v + step), at(u, v + step)];
            for wall in 0..2 {
                let [a, b, c, d] = corners.map(|both| both[wall]);
                cluster.push([a, b, c], 0);
                cluster.push([a, c, d], 0);
            }
        }
        let patch = cluster.finish();
        assert!(patch.triangles.len() > 1000);
        // Every vertex still lies in one of the walls, those of the edge in both.
        let off = |p: &Point| p.x.min(p.z);
        let worst = patch.points.iter().map(off).fold(0.0, f64::max);
        assert!(worst < 0.05 * patch.cell, "{worst} of {}", patch.cell);
    }
}
