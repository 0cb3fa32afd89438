//! Grains: parts of space with one direction and one size of the pattern each.
//!
//! Grains of one octave of sizes are the surroundings of displaced middles of cubes. All there is to a grain depends on where it is
//! and on the size wanted there: zones and sub-domains agree about it.

use super::field::Field;
use tetdb_base::geom::{Point, mix};

/// Side of the pattern in units of h. With it meshes have as many tetrahedra as by dividing edges alone, with a fortieth more 2 % fewer.
pub(super) const PERIOD: f64 = 13.2;
/// Width of grains in units of the power of two below h, 18 to 36 h. Wider ones have more tetrahedra away from their limits, but what is
/// set in at once takes memory as the cube of it, and at 48 large balls take longer. At a quarter of it balls need one more sweep of smoothing.
const GRAIN: f64 = 36.0;

/// The power of two below a size, as its exponent's bits.
pub(super) fn octave(h: f64) -> u32 {
    (h.to_bits() >> 52) as u32
}

/// Width of the grains of an octave.
pub(super) fn width(octave: u32) -> f64 {
    GRAIN * f64::from_bits(u64::from(octave) << 52)
}

/// A part of space with one direction and one size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grain {
    site: Point,
    axes: [Point; 3],
    shift: Point,
    pub h: f64,
}

impl Grain {
    /// Where a point lies in the pattern, in units of its side.
    pub fn local(&self, p: Point) -> Point {
        let d = (p - self.site) / (PERIOD * self.h);
        let [x, y, z] = self.axes;
        Point::new(d.dot(x), d.dot(y), d.dot(z)) + self.shift
    }

    /// Where a place of the pattern lies.
    pub fn position(&self, local: Point) -> Point {
        let found = local - self.shift;
        let [x, y, z] = self.axes;
        self.site + (x * found.x + y * found.y + z * found.z) * (PERIOD * self.h)
    }
}

/// The displaced middle of a cell, in units of the grains' width, its seed, and its grain once a point was in it.
#[derive(Clone, Copy, Default)]
pub(super) struct Site {
    pub at: Point,
    /// The cell's lower corner: whole numbers.
    pub corner: Point,
    seed: u64,
    grain: Option<Grain>,
}

impl Site {
    /// The site of the cell with this lower corner.
    pub fn new(corner: Point, octave: u32) -> Self {
        let cell = [corner.x as i64, corner.y as i64, corner.z as i64];
        let mix_in = |seed, &c: &i64| mix(seed ^ c as u64);
        let seed = cell.iter().fold(u64::from(octave), mix_in);
        Self { at: corner + Point::splat(0.5) + random(seed) * 0.4, corner, seed, grain: None }
    }

    /// Its grain, whose cells are `width` wide.
    pub fn grain(&mut self, field: &Field, width: f64) -> &Grain {
        let (at, seed) = (field.bounds.low + self.at * width, self.seed);
        self.grain.get_or_insert_with(|| Grain {
            site: at,
            axes: axes(seed),
            shift: random(seed ^ 1),
            h: (field.h)(at),
        })
    }
}

/// Grains that may hold points of one cell's width: the same ones for many points in a row.
pub(super) struct Around {
    octave: u32,
    base: Point,
    sites: [Site; 8],
}

impl Around {
    pub fn new() -> Self {
        Self { octave: u32::MAX, base: Point::ZERO, sites: [Site::default(); 8] }
    }

    /// The eight displaced middles of cells around a point, which is in units of the grains' width.
    pub fn sites(&mut self, at: Point, octave: u32) -> &mut [Site; 8] {
        let base = (at - Point::splat(0.5)).floor();
        if (self.octave, self.base) != (octave, base) {
            (self.octave, self.base) = (octave, base);
            for (k, site) in (0..).zip(&mut self.sites) {
                let step = Point::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
                *site = Site::new(base + step, octave);
            }
        }
        &mut self.sites
    }

    /// The nearest of them.
    pub fn nearest(&mut self, at: Point, octave: u32) -> &mut Site {
        let sites = self.sites(at, octave);
        let nearest = nearest(sites, at);
        &mut sites[nearest]
    }
}

/// Which site is the nearest to a point; of equals the first.
pub(super) fn nearest(sites: &[Site; 8], at: Point) -> usize {
    let mut best = (f64::INFINITY, 0);
    for (k, site) in sites.iter().enumerate() {
        let squared = (site.at - at).length_squared();
        if squared < best.0 {
            best = (squared, k);
        }
    }
    best.1
}

/// Three numbers in [-1, 1).
pub(super) fn random(seed: u64) -> Point {
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
