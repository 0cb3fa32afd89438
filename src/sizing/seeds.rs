//! Sizes at the surface's vertices, in the octree's frame.

use super::SizingError;
use crate::geom::{Aabb, Point};

/// The cube of the octree: `low` corner and `side`, in input units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) low: Point,
    pub(super) side: f64,
}

impl Frame {
    /// A cube around the box, larger by 2^-10 so that points on the box are inside it.
    pub(super) fn around(bounds: &Aabb) -> Self {
        let extent = (bounds.high - bounds.low).max_element();
        let side = extent * (1.0 + 1.0 / 1024.0);
        Self {
            low: (bounds.low + bounds.high) * 0.5 - Point::splat(0.5 * side),
            side,
        }
    }

    /// Position in the unit cube; points outside are moved to its wall.
    pub(super) fn unit(&self, p: Point) -> Point {
        ((p - self.low) * (1.0 / self.side)).clamp(Point::ZERO, Point::ONE)
    }
}

/// A vertex of the surface with the size its edges give it, both in units of the cube's side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seed {
    pub(super) at: Point,
    pub(super) h: f64,
}

/// Seeds, and the vertices they belong to.
#[derive(Debug)]
pub(super) struct Seeds {
    pub(super) list: Vec<Seed>,
    vertices: Vec<u32>,
    n_vertices: usize,
    side: f64,
}

impl Seeds {
    /// Lowers sizes to those given, one for each vertex of the surface, in input units.
    pub(super) fn lower(&mut self, h: &[f64]) -> Result<(), SizingError> {
        if h.len() != self.n_vertices {
            return Err(SizingError::SizeCount {
                found: h.len(),
                expected: self.n_vertices,
            });
        }
        for (seed, &v) in self.list.iter_mut().zip(&self.vertices) {
            seed.h = seed.h.min(h[v as usize] / self.side);
        }
        Ok(())
    }
}

/// Sizes of the vertices that triangles use, in vertex order, and the box around them.
///
/// The size is the geometric mean of the arithmetic and the harmonic mean of the incident edges'
/// lengths: equal to both where lengths are similar. With either alone, one needle's short
/// edge would be ignored, or one would rule all its long neighbors.
pub(super) fn seeds_of(
    points: &[Point],
    triangles: &[[u32; 3]],
) -> Result<(Frame, Aabb, Seeds), SizingError> {
    // Per vertex: number of edge ends, their lengths' sum, their inverse lengths' sum.
    let mut sums = vec![[0.0f64; 3]; points.len()];
    let mut bounds = Aabb::EMPTY;
    for t in triangles {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (t[i] as usize, t[j] as usize);
            let length = points[a].distance(points[b]);
            bounds = bounds.with(points[a]);
            if length > 0.0 && (1.0 / length).is_finite() {
                for v in [a, b] {
                    sums[v][0] += 1.0;
                    sums[v][1] += length;
                    sums[v][2] += 1.0 / length;
                }
            }
        }
    }
    let frame = Frame::around(&bounds);
    let used = (0..points.len()).filter(|&v| sums[v][0] > 0.0);
    let vertices: Vec<u32> = used.map(|v| v as u32).collect();
    let seed = |&v: &u32| {
        let [_, sum, inverse] = sums[v as usize];
        Seed {
            at: frame.unit(points[v as usize]),
            h: (sum / inverse).sqrt() / frame.side,
        }
    };
    let list: Vec<Seed> = vertices.iter().map(seed).collect();
    if list.is_empty() || !frame.side.is_normal() {
        return Err(SizingError::NoEdges);
    }
    let seeds = Seeds {
        list,
        vertices,
        n_vertices: points.len(),
        side: frame.side,
    };
    Ok((frame, bounds, seeds))
}
