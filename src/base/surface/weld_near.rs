//! Joins points that are near each other, for surfaces whose seams do not quite meet.

use std::collections::HashMap;

use super::Surface;
use super::weld::drop_unused_points;
use crate::geom::Point;

/// Width of a cube in distances. At 2 half of the looks along each axis go into two cubes; much wider cubes fill up.
const CUBE: f64 = 8.0;
/// End of a chain of points.
const NONE: u32 = u32::MAX;

/// Joins points not farther apart than `distance` (in input units, positive) and returns how many were joined to another.
///
/// In the order of their ids each point goes to the nearest of those kept before it, or is kept: so no point
/// moves farther than `distance`, and chains of near points do not run together. Effects: renumbers vertices; triangles
/// may collapse, repeat or open.
pub fn weld_near(surface: &mut Surface, distance: f64) -> usize {
    let new_ids = new_ids(surface, distance);
    for v in surface.triangles.iter_mut().flatten() {
        *v = new_ids[*v as usize];
    }
    drop_unused_points(surface);
    count_joined(&new_ids)
}

/// Number of points that [`weld_near`] would join to another.
pub(super) fn n_near(surface: &Surface, distance: f64) -> usize {
    count_joined(&new_ids(surface, distance))
}

/// For each point the one it goes to, or itself.
fn new_ids(surface: &Surface, distance: f64) -> Vec<u32> {
    let mut kept = Retained::new(surface.bounds().low, distance);
    let points = &surface.points;
    (0..points.len() as u32).map(|v| kept.find_or_keep(v, points)).collect()
}

fn count_joined(new_ids: &[u32]) -> usize {
    (0u32..).zip(new_ids).filter(|(v, id)| *v != **id).count()
}

/// The points kept so far, in cubes [`CUBE`] times as wide as the distance: near points lie in at most eight of them,
/// mostly in one.
struct Retained {
    low: Point,
    distance: f64,
    /// Last point of each cube.
    last: HashMap<[i64; 3], u32>,
    /// For each point the one before it in its cube.
    before: Vec<u32>,
}

impl Retained {
    fn new(low: Point, distance: f64) -> Self {
        Self { low, distance, last: HashMap::new(), before: Vec::new() }
    }

    /// The cube of a position.
    fn cube(&self, p: Point) -> [i64; 3] {
        ((p - self.low) / (CUBE * self.distance)).to_array().map(|x| x.floor() as i64)
    }

    fn find_or_keep(&mut self, v: u32, points: &[Point]) -> u32 {
        let p = points[v as usize];
        self.before.push(NONE);
        if let Some(near) = self.nearest(p, points) {
            return near;
        }
        let last = self.last.insert(self.cube(p), v);
        self.before[v as usize] = last.unwrap_or(NONE);
        v
    }

    /// The kept point nearest to `p` within the distance; of equally near ones the first.
    fn nearest(&self, p: Point, points: &[Point]) -> Option<u32> {
        let margin = Point::splat(self.distance);
        let (from, to) = (self.cube(p - margin), self.cube(p + margin));
        let mut best: Option<(f64, u32)> = None;
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    let mut v = self.last.get(&[x, y, z]).copied().unwrap_or(NONE);
                    while v != NONE {
                        let candidate = (p.distance(points[v as usize]), v);
                        if candidate.0 <= self.distance && best.is_none_or(|b| candidate < b) {
                            best = Some(candidate);
                        }
                        v = self.before[v as usize];
                    }
                }
            }
        }
        best.map(|(_, v)| v)
    }
}
