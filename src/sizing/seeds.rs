//! Sizes at the surface's vertices, in the octree's frame.

use super::SizingError;
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;

/// The cube of the octree: `low` corner and `side`, in input units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OctreeFrame {
    pub(super) low: Point,
    pub(super) side: f64,
}

impl OctreeFrame {
    /// A cube around the box, larger by 2^-10 so that points on the box are inside it.
    pub(super) fn around(bounds: &Aabb) -> Self {
        let extent = (bounds.high - bounds.low).max_element();
        let side = extent * (1.0 + 1.0 / 1024.0);
        Self {
            low: (bounds.low + bounds.high) * 0.5 - Point::splat(0.5 * side),
            side,
        }
    }
}

/// Sizes of the surface's vertices that their edges give, and their positions, in units of the cube's side.
#[derive(Debug)]
pub(super) struct Seeds<'a> {
    points: &'a [Point],
    frame: OctreeFrame,
    per_side: f64,
    /// By vertex; zero where no triangle has it.
    h: Vec<f64>,
}

impl Seeds<'_> {
    /// The vertices that triangles use, in their order.
    pub(super) fn vertices(&self) -> impl Iterator<Item = u32> {
        (0u32..)
            .zip(&self.h)
            .filter(|(_, h)| **h > 0.0)
            .map(|(v, _)| v)
    }

    /// Position of a vertex in the unit cube.
    #[inline]
    pub(super) fn at(&self, v: u32) -> Point {
        let p = self.points[v as usize] - self.frame.low;
        (p * self.per_side).clamp(Point::ZERO, Point::ONE)
    }

    /// Size at a vertex.
    #[inline]
    pub(super) fn h(&self, v: u32) -> f64 {
        self.h[v as usize]
    }

    /// Lowers sizes to those given, one for each vertex of the surface, in input units.
    pub(super) fn lower(&mut self, h: &[f64]) -> Result<(), SizingError> {
        if h.len() != self.h.len() {
            return Err(SizingError::SizeCount {
                found: h.len(),
                expected: self.h.len(),
            });
        }
        for (seed, &h) in self.h.iter_mut().zip(h) {
            *seed = seed.min(h / self.frame.side);
        }
        Ok(())
    }
}

/// Sizes of the vertices that triangles use, and the box around them.
///
/// The size is the geometric mean of the arithmetic and the harmonic mean of the incident edges'
/// lengths: equal to both where lengths are similar. With either alone, one needle's short
/// edge would be ignored, or one would rule all its long neighbors.
///
/// Memory: 8 bytes a vertex and a quarter of the room: for so many vertices at a time the triangles are gone through.
pub(super) fn seeds_of<'a>(
    points: &'a [Point],
    triangles: &[[u32; 3]],
    room: &ScratchSpace,
) -> Result<(OctreeFrame, Aabb, Seeds<'a>), SizingError> {
    let corners = triangles.iter().flatten().map(|&v| points[v as usize]);
    let bounds = Aabb::around(corners);
    let frame = OctreeFrame::around(&bounds);
    let at_once = usize::try_from(room.available() / 4 / 24).unwrap_or(usize::MAX);
    let at_once = at_once.clamp(1 << 16, points.len().max(1 << 16));
    let mut h = vec![0.0; points.len()];
    for (k, h) in h.chunks_mut(at_once).enumerate() {
        sizes_from(k * at_once, points, triangles, frame.side, h);
    }
    if h.iter().all(|&h| h == 0.0) || !frame.side.is_normal() {
        return Err(SizingError::NoEdges);
    }
    let seeds = Seeds {
        points,
        frame,
        per_side: 1.0 / frame.side,
        h,
    };
    Ok((frame, bounds, seeds))
}

/// Sizes of the vertices from `first` on.
fn sizes_from(first: usize, points: &[Point], triangles: &[[u32; 3]], side: f64, h: &mut [f64]) {
    // Per vertex: number of edge ends, their lengths' sum, their inverse lengths' sum.
    let mut sums = vec![[0.0f64; 3]; h.len()];
    for t in triangles {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let ends = [t[i] as usize, t[j] as usize];
            let here = ends.map(|v| v.wrapping_sub(first));
            if here.iter().all(|&v| v >= sums.len()) {
                continue;
            }
            let length = points[ends[0]].distance(points[ends[1]]);
            if length > 0.0 && (1.0 / length).is_finite() {
                for v in here.into_iter().filter(|&v| v < h.len()) {
                    sums[v][0] += 1.0;
                    sums[v][1] += length;
                    sums[v][2] += 1.0 / length;
                }
            }
        }
    }
    for (h, [n, sum, inverse]) in h.iter_mut().zip(sums) {
        if n > 0.0 {
            *h = (sum / inverse).sqrt() / side;
        }
    }
}
