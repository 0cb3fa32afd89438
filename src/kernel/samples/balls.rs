//! A unit cube with inclusions: balls, the paper's case 5, or ellipsoids in their place.

use super::SampleError;
use super::boxes::{box_triangles, push_box};
use super::build::Builder;
use super::build::triangles_checked;
use super::random::{Random, cube_root, power};
use super::sample::Sample;
use super::sphere::{Ball, Spheres, sphere_pieces, sphere_triangles};
use tetdb_base::geom::{Aabb, Point};

/// Radii and gap for a thousand balls; other counts scale them to fill the same share of the cube.
const RADIUS_LOW: f64 = 0.015;
const RADIUS_HIGH: f64 = 0.08;
const GAP: f64 = 0.006;
/// Default edge length for a thousand balls: 0.5 M triangles, 48 k for a hundred.
const H_DEFAULT: f64 = 0.011;
/// A few balls would be larger than the cube they are put in.
const RADIUS_MAX: f64 = 0.4;
/// Tries for one ball between two rounds of moving those already placed.
const TRIES_MAX: u32 = 5_000;
/// Rounds of moving before all balls are drawn anew. A thousand balls need none; a hundred, of which
/// the largest third touch each other's reach everywhere, need a few.
const SHAKES_MAX: u32 = 60;
/// Draws at full size, and in all: each further one is smaller by `SHRINK`. Only counts below about
/// 50, with radii that no longer fit next to each other in the cube, come so far.
const DRAWS_FULL: u32 = 3;
const DRAWS_MAX: u32 = 30;
const SHRINK: f64 = 0.95;

/// Semi-axes of an ellipsoid, in units of the ball's radius that it replaces. Their edges are as much shorter.
pub(super) const ELLIPSOID: Point = Point::new(1.0, 0.75, 0.5);

/// Parameters of `balls,count=…,seed=…,h=…` and of `ellipsoids` with the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Balls {
    pub count: usize,
    pub seed: u64,
    /// Edge length; by default it follows the balls' size.
    pub h: f64,
    /// Semi-axes in units of a ball's radius.
    pub axes: Point,
}

impl Balls {
    /// Radii and gaps, and so edges, scale with this for counts other than a thousand.
    fn scale(count: usize) -> f64 {
        cube_root(1000.0 / count as f64)
    }

    /// What they are called in a sample's word and as a label.
    pub(super) fn name(&self) -> &'static str {
        if self.axes == Point::ONE { "balls" } else { "ellipsoids" }
    }

    /// The edge length for that many balls when none is given.
    pub(super) fn h_default(count: usize) -> f64 {
        H_DEFAULT * Self::scale(count)
    }

    /// Builds the surface: labels `walls` and `balls`, or `ellipsoids`.
    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        let mut random = Random::new(self.seed);
        let placed = self.place(&mut random)?;
        let bounds = Aabb { low: Point::ZERO, high: Point::ONE };
        let n_triangles =
            placed.iter().map(|(_, r)| sphere_triangles(sphere_pieces(*r, self.h))).sum::<f64>()
                + box_triangles(&bounds, self.h);
        triangles_checked("balls", n_triangles, bytes_max)?;
        let mut build = Builder::default();
        let walls = build.label("walls");
        let label = build.label(self.name());
        push_box(&mut build, &bounds, self.h, false, [walls; 6]);
        let mut spheres = Spheres::default();
        for (center, radius) in placed {
            let ball = Ball::turned(center, radius, self.axes, &mut random);
            spheres.push(&mut build, &ball, self.h, true, label);
        }
        Ok(build.finish())
    }

    /// Centers and radii, largest first.
    fn place(&self, random: &mut Random) -> Result<Vec<(Point, f64)>, SampleError> {
        let mut shrink = 1.0;
        let mut result = Err((0, 0.0));
        for draw in 0..DRAWS_MAX {
            if draw >= DRAWS_FULL {
                shrink *= SHRINK;
            }
            let radii = self.radii(shrink, random);
            result = BallPacking::place(&radii, GAP * Self::scale(self.count), random);
            if result.is_ok() {
                break;
            }
        }
        result.map_err(|(placed, radius)| SampleError::NoRoom {
            placed: placed + 1,
            count: self.count,
            radius,
            seed: self.seed,
        })
    }

    /// Log-uniform radii, largest first.
    ///
    /// Drawn one from each of `count` equal strata, so that every seed gives nearly the same
    /// total area; independent draws would vary it by 3 % for a thousand balls.
    fn radii(&self, shrink: f64, random: &mut Random) -> Vec<f64> {
        let scale = Self::scale(self.count) * shrink;
        let low = RADIUS_LOW * scale;
        let ratio = (RADIUS_HIGH * scale).min(RADIUS_MAX) / low;
        (0..self.count)
            .rev()
            .map(|i| low * power(ratio, (i as f64 + random.unit()) / self.count as f64))
            .collect()
    }
}

/// Balls being put at random places of the unit cube.
struct BallPacking {
    placed: Vec<(Point, f64)>,
    gap: f64,
    /// Cells along an axis of a grid whose cells are wider than any two neighbors' distance.
    n: usize,
    /// Balls by the cell of their center: number, center, radius.
    cells: Vec<Vec<(u32, Point, f64)>>,
}

impl BallPacking {
    /// Places balls of the radii given, largest first; on failure the number placed and the radius.
    fn place(
        radii: &[f64],
        gap: f64,
        random: &mut Random,
    ) -> Result<Vec<(Point, f64)>, (usize, f64)> {
        let largest = radii.first().copied().unwrap_or(0.5);
        let n = ((1.0 / (2.0 * largest + gap)) as usize).clamp(1, 256);
        let mut packing = Self {
            placed: Vec::with_capacity(radii.len()),
            gap,
            n,
            cells: vec![Vec::new(); n * n * n],
        };
        for &radius in radii {
            if !packing.add(radius, random) {
                return Err((packing.placed.len(), radius));
            }
        }
        Ok(packing.placed)
    }

    /// Finds a place for one more ball, moving the others when there is none.
    fn add(&mut self, radius: f64, random: &mut Random) -> bool {
        let margin = radius + self.gap;
        let new = self.placed.len() as u32;
        for _ in 0..=SHAKES_MAX {
            for _ in 0..TRIES_MAX {
                let center = Point::splat(margin) + random.in_cube() * (1.0 - 2.0 * margin);
                if self.is_free(new, center, radius) {
                    let cell = self.cell(center);
                    self.cells[cell].push((new, center, radius));
                    self.placed.push((center, radius));
                    return true;
                }
            }
            for _ in 0..10 {
                self.shake(random);
            }
        }
        false
    }

    /// Moves each ball a little when its new place is free.
    fn shake(&mut self, random: &mut Random) {
        for ball in 0..self.placed.len() as u32 {
            let (center, radius) = self.placed[ball as usize];
            let reach = self.gap + 0.3 * radius;
            let moved = center + (random.in_cube() * 2.0 - Point::ONE) * reach;
            let margin = Point::splat(radius + self.gap);
            let inside = moved.cmpge(margin).all() && moved.cmple(Point::ONE - margin).all();
            if inside && self.is_free(ball, moved, radius) {
                let (old, new) = (self.cell(center), self.cell(moved));
                self.cells[old].retain(|b| b.0 != ball);
                self.cells[new].push((ball, moved, radius));
                self.placed[ball as usize].0 = moved;
            }
        }
    }

    fn coordinates(&self, p: Point) -> [usize; 3] {
        let of = |x: f64| ((x * self.n as f64) as usize).min(self.n - 1);
        [of(p.x), of(p.y), of(p.z)]
    }

    fn cell(&self, p: Point) -> usize {
        let [x, y, z] = self.coordinates(p);
        (z * self.n + y) * self.n + x
    }

    /// Returns whether a ball there keeps the gap to all others but itself.
    fn is_free(&self, ball: u32, center: Point, radius: f64) -> bool {
        // Called millions of times and usually refused, most often by a ball of the same cell.
        let [x, y, z] = self.coordinates(center);
        let cell_is_free = |cell: usize| {
            for &(other, at, r) in &self.cells[cell] {
                let reach = r + radius + self.gap;
                if at.distance_squared(center) < reach * reach && other != ball {
                    return false;
                }
            }
            true
        };
        if !cell_is_free((z * self.n + y) * self.n + x) {
            return false;
        }
        let around = |x: usize| x.saturating_sub(1)..(x + 2).min(self.n);
        for z in around(z) {
            for y in around(y) {
                let row = (z * self.n + y) * self.n;
                if around(x).any(|x| !cell_is_free(row + x)) {
                    return false;
                }
            }
        }
        true
    }
}
