//! The pattern itself: points of a cube that repeats in all directions.

use std::sync::OnceLock;

use tetdb_base::geom::Point;

/// Cells along each axis of the pattern: one for each point.
pub(super) const CELLS: usize = 16;
/// Bytes of the pattern: three words for each point.
const BYTES: usize = 6 * CELLS * CELLS * CELLS;
/// Cells along an axis, with one layer around.
const AROUND: usize = CELLS + 2;

/// The pattern with side 1 and one layer of cells around it, cell by cell.
pub(super) struct Tile {
    points: Vec<Point>,
    /// Of each cell where its points begin, and the end of the last.
    starts: Vec<u32>,
}

impl Tile {
    pub fn get() -> &'static Self {
        static TILE: OnceLock<Tile> = OnceLock::new();
        TILE.get_or_init(|| Self::read(include_bytes!("pattern.bin")))
    }

    fn read(bytes: &[u8; BYTES]) -> Self {
        let word = |k: usize| f64::from(u16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]));
        let mut points = Vec::new();
        for k in 0..BYTES / 6 {
            let p = Point::new(word(3 * k), word(3 * k + 1), word(3 * k + 2)) / 65536.0;
            for shift in 0..27 {
                let of = |n: i32| f64::from(n % 3 - 1);
                let q = p + Point::new(of(shift), of(shift / 3), of(shift / 9));
                if cell_of(q) < AROUND * AROUND * AROUND {
                    points.push(q);
                }
            }
        }
        points.sort_by_key(|&p| cell_of(p));
        let starts = (0..=AROUND * AROUND * AROUND)
            .map(|cell| points.partition_point(|&p| cell_of(p) < cell) as u32)
            .collect();
        Self { points, starts }
    }

    /// The points of a cell of the cube, given by its place along each axis.
    pub fn points_of(&self, [x, y, z]: [usize; 3]) -> &[Point] {
        let cell = ((z + 1) * AROUND + y + 1) * AROUND + x + 1;
        &self.points[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The nearest point of the repeated pattern: none is farther away than a cell is wide.
    pub fn nearest(&self, p: Point) -> Point {
        let period = p.floor();
        // What is negative by less than rounding would come to 1, where the next period begins.
        let local = (p - period).min(Point::splat(1.0 - f64::EPSILON / 2.0));
        let middle = cell_of(local);
        let mut best = (f64::INFINITY, local);
        for dz in 0..3 {
            for dy in 0..3 {
                let row = middle + (dz * AROUND + dy) * AROUND - (AROUND + 1) * AROUND - 1;
                let (from, to) = (self.starts[row] as usize, self.starts[row + 3] as usize);
                for &q in &self.points[from..to] {
                    let squared = (q - local).length_squared();
                    if squared < best.0 {
                        best = (squared, q);
                    }
                }
            }
        }
        period + best.1
    }
}

/// Number of the cell that holds a point of the pattern or beside it; too large for points farther away.
fn cell_of(p: Point) -> usize {
    let at = (p * CELLS as f64).floor() + Point::ONE;
    let inside = |x: f64| (0.0..AROUND as f64).contains(&x);
    if !(inside(at.x) && inside(at.y) && inside(at.z)) {
        return usize::MAX;
    }
    (at.z as usize * AROUND + at.y as usize) * AROUND + at.x as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::grain::{PERIOD, random};
    use tetdb_base::geom::mix;

    fn all_nearest(tile: &Tile, p: Point) -> f64 {
        let q = tile.points.iter().map(|q| q.distance(p - p.floor()));
        q.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn no_two_places_are_nearer_than_vertices_may_be() {
        let tile = Tile::get();
        for (k, p) in tile.points.iter().enumerate() {
            let others = tile.points[k + 1..].iter();
            let near = others.map(|q| q.distance(*p)).fold(1.0, f64::min);
            assert!(near * PERIOD > std::f64::consts::FRAC_1_SQRT_2, "{p}");
        }
    }

    #[test]
    fn the_place_found_is_the_nearest_and_its_own_nearest() {
        let tile = Tile::get();
        for k in 0..2000 {
            let p = random(mix(k)) * 3.0;
            let found = tile.nearest(p);
            assert!((found.distance(p) - all_nearest(tile, p)).abs() < 1e-12);
            assert!(found.distance(p) < 1.0 / CELLS as f64);
            assert!(tile.nearest(found).distance(found) < 1e-12);
        }
    }

    #[test]
    fn a_point_below_zero_by_less_than_rounding_is_at_the_end_of_a_period() {
        let tile = Tile::get();
        for tiny in [-1e-17, -1e-300] {
            for p in [Point::new(tiny, 0.4, 0.7), Point::new(0.2, tiny, tiny), Point::splat(tiny)] {
                assert_eq!(tile.nearest(p), tile.nearest(p.max(Point::ZERO)));
            }
        }
    }
}
