//! Where vertices had better be: grains of an arrangement that is relaxed already.
//!
//! Points that divide edges stand anywhere; smoothing takes many sweeps to spread them evenly. So each moves to the nearest place of
//! a pattern before it is tried: points at distances of one wanted length that repeat in all directions, with no tetrahedron of
//! q ≥ 2 between them (`pattern.bin`, from `tools/pattern.py`). They are a glass, not a lattice: a lattice is as good, and its
//! directions can be seen. Space is divided into grains, each with the pattern turned and shifted at random and with one size, so
//! that nothing repeats and sizes may vary. A place depends on position and size alone: zones and sub-domains agree about it.

use std::sync::OnceLock;

use super::field::Field;
use crate::geom::{Point, mix};

/// Cells along each axis of the pattern: one for each point.
const CELLS: usize = 16;
/// Bytes of the pattern: three words for each point.
const BYTES: usize = 6 * CELLS * CELLS * CELLS;
/// Side of the pattern in units of h. With it meshes have as many tetrahedra as by dividing edges alone, with a fortieth more 2 % fewer.
const PERIOD: f64 = 13.2;
/// Width of grains in units of the power of two below h, 12 to 24 h. At half of that, balls need one more sweep of
/// smoothing; much larger ones have sizes of their own and are left to dividing edges.
const GRAIN: f64 = 24.0;
/// Greatest difference of a grain's size from the wanted one. With 0.15 and 0.2 the mesh is as good.
const MISMATCH: f64 = 0.3;

/// A part of space with one direction and one size.
#[derive(Clone, Copy, Debug)]
struct Grain {
    site: Point,
    axes: [Point; 3],
    shift: Point,
    h: f64,
}

/// Finds places of the pattern, and remembers the grains around the last points.
pub(super) struct Pattern {
    tile: &'static Tile,
    /// By the last bit of the octave: where sizes vary, points of two octaves take turns.
    around: [Around; 2],
}

/// Grains that may hold points of one cell's width: the same ones for many points in a row.
struct Around {
    octave: u32,
    base: Point,
    sites: [Site; 8],
}

/// The displaced middle of a cell, in units of the grains' width, its seed, and its grain once a point was in it.
#[derive(Clone, Copy, Default)]
struct Site {
    at: Point,
    seed: u64,
    grain: Option<Grain>,
}

impl Pattern {
    pub fn new() -> Self {
        let none = || Around {
            octave: u32::MAX,
            base: Point::ZERO,
            sites: [Site::default(); 8],
        };
        Self {
            tile: Tile::get(),
            around: [none(), none()],
        }
    }

    /// The place nearest to `p`, where `h` is wanted; none where the grain's size is another.
    pub fn nearest(&mut self, field: &Field, p: Point, h: f64) -> Option<Point> {
        // Grains follow the size in steps of two.
        let octave = (h.to_bits() >> 52) as u32;
        let width = GRAIN * f64::from_bits(u64::from(octave) << 52);
        let at = (p - field.bounds.low) / width;
        let around = &mut self.around[octave as usize & 1];
        let site = around.nearest(at, octave);
        let grain = *site.grain.get_or_insert_with(|| {
            let (at, seed) = (field.bounds.low + site.at * width, site.seed);
            Grain {
                site: at,
                axes: axes(seed),
                shift: random(seed ^ 1),
                h: (field.h)(at),
            }
        });
        if (grain.h - h).abs() > MISMATCH * h {
            return None;
        }
        let unit = PERIOD * grain.h;
        let [x, y, z] = grain.axes;
        let d = (p - grain.site) / unit;
        let local = Point::new(d.dot(x), d.dot(y), d.dot(z)) + grain.shift;
        let found = self.tile.nearest(local) - grain.shift;
        Some(grain.site + (x * found.x + y * found.y + z * found.z) * unit)
    }
}

impl Around {
    /// The nearest of the eight displaced middles of cells around a point.
    fn nearest(&mut self, at: Point, octave: u32) -> &mut Site {
        let base = (at - Point::splat(0.5)).floor();
        if (self.octave, self.base) != (octave, base) {
            (self.octave, self.base) = (octave, base);
            for (k, site) in (0..).zip(&mut self.sites) {
                *site = Site::of(base, k, octave);
            }
        }
        let mut best = (f64::INFINITY, 0);
        for (k, site) in self.sites.iter().enumerate() {
            let squared = (site.at - at).length_squared();
            if squared < best.0 {
                best = (squared, k);
            }
        }
        &mut self.sites[best.1]
    }
}

impl Site {
    fn of(base: Point, k: u32, octave: u32) -> Self {
        let corner = base + Point::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let cell = [corner.x as i64, corner.y as i64, corner.z as i64];
        let mix_in = |seed, &c: &i64| mix(seed ^ c as u64);
        let seed = cell.iter().fold(u64::from(octave), mix_in);
        Self {
            at: corner + Point::splat(0.5) + random(seed) * 0.4,
            seed,
            grain: None,
        }
    }
}

/// The pattern with side 1 and one layer of cells around it, cell by cell.
struct Tile {
    points: Vec<Point>,
    /// Of each cell where its points begin, and the end of the last.
    starts: Vec<u32>,
}

/// Cells along an axis, with those around.
const AROUND: usize = CELLS + 2;

impl Tile {
    fn get() -> &'static Self {
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

    /// The nearest point of the repeated pattern: none is farther away than a cell is wide.
    fn nearest(&self, p: Point) -> Point {
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

/// Three numbers in [-1, 1).
fn random(seed: u64) -> Point {
    let bits = mix(seed);
    let of = |k: u32| (bits >> (21 * k) & 0x1F_FFFF) as f64 / f64::from(1 << 20) - 1.0;
    Point::new(of(0), of(1), of(2))
}

/// A frame of random direction.
fn axes(mut seed: u64) -> [Point; 3] {
    let mut direction = || {
        loop {
            seed = mix(seed);
            let p = random(seed);
            if (0.01..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    };
    let x = direction();
    loop {
        let y = x.cross(direction());
        if y.length_squared() > 0.01 {
            let y = y.normalize();
            return [x, y, x.cross(y)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::{Everywhere, Lengths};

    fn all_nearest(tile: &Tile, p: Point) -> f64 {
        let q = tile.points.iter().map(|q| q.distance(p - p.floor()));
        q.fold(f64::INFINITY, f64::min)
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
            for p in [
                Point::new(tiny, 0.4, 0.7),
                Point::new(0.2, tiny, tiny),
                Point::splat(tiny),
            ] {
                assert_eq!(tile.nearest(p), tile.nearest(p.max(Point::ZERO)));
            }
        }
    }

    #[test]
    fn places_depend_on_position_and_size_alone_and_lie_a_length_apart() {
        let field = Field {
            lengths: Lengths::Field,
            h: &|_| 0.013,
            place: &Everywhere,
            bounds: crate::geom::Aabb::around([Point::ZERO, Point::ONE]),
        };
        let (mut one, mut other) = (Pattern::new(), Pattern::new());
        let (mut moved, mut far) = (0, 0);
        for k in 0..2000 {
            let p = (random(k) + Point::ONE) * 0.5;
            let place = one.nearest(&field, p, 0.013).expect("one size everywhere");
            assert_eq!(other.nearest(&field, p, 0.013), Some(place));
            assert!(place.distance(p) < 0.9 * 0.013);
            moved += u32::from(one.nearest(&field, place, 0.013) != Some(place));
            far += u32::from(place.distance(p) > 0.2 * 0.013);
            assert_eq!(one.nearest(&field, p, 0.03), None);
        }
        // But at the limits of grains, a place is its own.
        assert!(moved < 1800 && far > 1500, "{moved} {far}");
    }
}
