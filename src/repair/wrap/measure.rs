//! The checks of a wrap, and its distances.

use rayon::prelude::*;

use tetdb_base::geom::{Aabb, Point, orient};
use tetdb_base::storage::{check_cancelled, parallel};
use tetdb_base::surface::{Surface, meets};

use super::delaunay::{Delaunay, FACES, NONE};
use super::flood::Flood;
use super::oracle::Oracle;

/// Items of one task.
const BLOCK: usize = 1 << 12;
/// Of fewer triangles than this, samples are nearer to each other, down to a tenth: a soup of ten triangles has few points else.
const MANY: f64 = 1e4;
/// A triangle is sampled with at most this many points along a side.
const SAMPLES_MAX: f64 = 32.0;

/// Sums over samples.
#[derive(Clone, Copy, Default)]
pub struct Distances {
    /// The largest.
    pub most: f64,
    sum: f64,
    /// Number of samples.
    pub n: u64,
}

impl Distances {
    /// The mean.
    pub fn mean(&self) -> f64 {
        self.sum / self.n.max(1) as f64
    }

    fn with(self, d: f64) -> Self {
        Self { most: self.most.max(d), sum: self.sum + d, n: self.n + 1 }
    }

    fn join(self, other: Self) -> Self {
        Self { most: self.most.max(other.most), sum: self.sum + other.sum, n: self.n + other.n }
    }
}

/// The faces between inside and outside, seen from outside, and their vertices in order of appearance.
pub fn border(flood: &Flood) -> (Vec<Point>, Vec<[u32; 3]>) {
    let mesh = &flood.mesh;
    let mut numbers = vec![NONE; mesh.points.len()];
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for t in 0..mesh.tets.len() as u32 {
        if !mesh.is_live(t) || flood.is_outside[t as usize] {
            continue;
        }
        for (i, across) in mesh.tets[t as usize].across.into_iter().enumerate() {
            if across != NONE && !flood.is_outside[across as usize >> 2] {
                continue;
            }
            triangles.push(mesh.face(t, i).map(|v| {
                let number = &mut numbers[v as usize];
                if *number == NONE {
                    *number = points.len() as u32;
                    points.push(mesh.points[v as usize] + Point::ZERO);
                }
                *number
            }));
        }
    }
    (points, triangles)
}

/// A triangle of the wrap that meets the input, by exact signs.
pub fn touching(wrap: &Surface, oracle: &Oracle) -> Option<u32> {
    in_blocks(wrap.n_triangles(), |t| {
        let corners = wrap.corners(t as u32);
        let around = Aabb::around(corners);
        oracle.any_meeting(&around, |s| Aabb::around(*s).meets(&around) && meets(&corners, s))
    })
    .map(|t| t as u32)
}

/// An input point in no inside cell, by exact signs.
pub fn left_out(flood: &Flood, points: &[Point]) -> Option<usize> {
    let mesh = &flood.mesh;
    let first = (0..mesh.tets.len() as u32).find(|&t| mesh.is_live(t))?;
    let starts: Vec<usize> = (0..points.len()).step_by(BLOCK).collect();
    parallel(|| {
        starts.par_iter().find_map_first(|&start| {
            let end = (start + BLOCK).min(points.len());
            let mut hint = first;
            check_cancelled();
            (start..end).find(|&k| match mesh.locate(points[k], hint) {
                Some(t) => {
                    hint = t;
                    !is_within(mesh, &flood.is_outside, points[k], t)
                }
                None => true,
            })
        })
    })
}

/// Whether the cell that holds `p`, and those behind the faces that `p` is on, are inside.
fn is_within(mesh: &Delaunay, is_outside: &[bool], p: Point, t: u32) -> bool {
    let corners = mesh.corners(t);
    let mut on = FACES.into_iter().zip(mesh.tets[t as usize].across);
    let is_open = |([a, b, c], across): ([usize; 3], u32)| {
        orient(p, corners[a], corners[b], corners[c]) == 0.0
            && (across == NONE || is_outside[across as usize >> 2])
    };
    !is_outside[t as usize] && !on.any(is_open)
}

/// The first number for which `test` is true.
fn in_blocks(n: usize, test: impl Fn(usize) -> bool + Sync) -> Option<usize> {
    let starts: Vec<usize> = (0..n).step_by(BLOCK).collect();
    parallel(|| {
        starts.par_iter().find_map_first(|&start| {
            check_cancelled();
            (start..(start + BLOCK).min(n)).find(|&k| test(k))
        })
    })
}

/// Distances from samples of triangles to an oracle's, samples at most `apart` from each other, and the nearest triangle of each middle.
pub fn distances(
    n: usize,
    corners_of: impl Fn(u32) -> [Point; 3] + Sync,
    apart: f64,
    oracle: &Oracle,
) -> (Distances, Vec<u32>) {
    let apart = apart * (n as f64 / MANY).sqrt().clamp(0.1, 1.0);
    let starts: Vec<usize> = (0..n).step_by(BLOCK).collect();
    let blocks: Vec<(Distances, Vec<u32>)> = parallel(|| {
        let block = |&start: &usize| {
            check_cancelled();
            let (mut found, mut nearest) = (Distances::default(), Vec::new());
            for t in start..(start + BLOCK).min(n) {
                let corners = corners_of(t as u32);
                let middle = corners.iter().sum::<Point>() / 3.0;
                let at = oracle.nearest(middle, f64::INFINITY);
                nearest.push(at.triangle);
                found = found.with(at.distance);
                samples(&corners, apart, |p| {
                    let within = (at.distance + p.distance(middle)) * (1.0 + 1e-9);
                    found = found.with(oracle.nearest(p, within).distance);
                });
            }
            (found, nearest)
        };
        starts.par_iter().map(block).collect()
    });
    let (mut all, mut nearest) = (Distances::default(), Vec::with_capacity(n));
    for (found, ids) in blocks {
        all = all.join(found);
        nearest.extend(ids);
    }
    (all, nearest)
}

/// Corners, and a grid of points between them.
fn samples([a, b, c]: &[Point; 3], apart: f64, mut visit: impl FnMut(Point)) {
    let longest = a.distance(*b).max(b.distance(*c)).max(c.distance(*a));
    let n = (longest / apart).ceil().clamp(1.0, SAMPLES_MAX) as u32;
    for i in 0..=n {
        for j in 0..=n - i {
            let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(n));
            visit(*a + (*b - *a) * u + (*c - *a) * v);
        }
    }
}
