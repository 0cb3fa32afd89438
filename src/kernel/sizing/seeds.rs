//! Sizes at the surface's vertices, and along its long edges, in the octree's frame.
//!
//! ```text
//!   a                                   b     Between two ends with short edges a long edge gets seeds a step of their
//!   o-.--.---.-----.------.-----.---.-.-o     own size apart: sizes grow from both ends up to the edge's own length.
//!                                             Without, all of it would be as small as its ends, for nothing.
//! ```

use super::SizingError;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::FrozenSpillVec;

/// Position in the unit cube, size, and how many times the gradation's slope is allowed there.
pub(super) type EdgeSeed = [f32; 5];

/// The cube of the octree: `low` corner and `side`, in input units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OctreeFrame {
    pub low: Point,
    pub side: f64,
}

impl OctreeFrame {
    /// A cube around the box, larger by 2^-10 so that points on the box are inside it.
    pub fn around(bounds: &Aabb) -> Self {
        let extent = (bounds.high - bounds.low).max_element();
        let side = extent * (1.0 + 1.0 / 1024.0);
        Self { low: (bounds.low + bounds.high) * 0.5 - Point::splat(0.5 * side), side }
    }
}

/// Places with sizes, in units of the cube's side: the surface's vertices, numbered as there, and behind them places along its edges.
#[derive(Debug)]
pub(super) struct Seeds<'a> {
    pub points: &'a [Point],
    pub frame: OctreeFrame,
    pub per_side: f64,
    /// By vertex; zero where no triangle has it.
    pub h: Vec<f64>,
    /// By vertex, how many times the gradation's slope is allowed there; empty where it is once for all.
    pub slope_factor: Vec<f32>,
    /// Seeds along edges, numbered after the vertices.
    pub along: Option<FrozenSpillVec<EdgeSeed>>,
}

impl<'a> Seeds<'a> {
    /// The vertices that triangles use, in their order.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        (0u32..).zip(&self.h).filter(|(_, h)| **h > 0.0).map(|(v, _)| v)
    }

    /// The vertices that triangles use, then the places along edges.
    pub fn all(&self) -> impl Iterator<Item = u32> {
        let first = self.points.len() as u32;
        let n = self.along.as_ref().map_or(0, FrozenSpillVec::len) as u32;
        self.vertices().chain(first..first + n)
    }

    /// The seed along an edge; `None` if `seed` is a vertex.
    #[inline]
    fn along(&self, seed: u32) -> Option<EdgeSeed> {
        let behind = (seed as usize).checked_sub(self.points.len())?;
        Some(self.along.as_ref()?.get(behind))
    }

    /// Position of a seed in the unit cube.
    #[inline]
    pub fn at(&self, seed: u32) -> Point {
        match self.along(seed) {
            Some([x, y, z, ..]) => Point::new(f64::from(x), f64::from(y), f64::from(z)),
            None => self.in_cube(self.points[seed as usize]),
        }
    }

    fn in_cube(&self, p: Point) -> Point {
        ((p - self.frame.low) * self.per_side).clamp(Point::ZERO, Point::ONE)
    }

    /// Size at a seed.
    #[inline]
    pub fn h(&self, seed: u32) -> f64 {
        match self.along(seed) {
            Some([.., h, _]) => f64::from(h),
            None => self.h[seed as usize],
        }
    }

    /// Factor on the gradation's slope that is allowed at a seed.
    pub fn slope_factor(&self, seed: u32) -> f64 {
        match self.along(seed) {
            Some([.., slope_factor]) => f64::from(slope_factor),
            None => (self.slope_factor.get(seed as usize)).map_or(1.0, |&s| f64::from(s)),
        }
    }

    /// Returns whether more than the gradation's slope is allowed anywhere.
    pub fn has_slope_factors(&self) -> bool {
        !self.slope_factor.is_empty()
    }

    /// Bytes of memory held for vertices; seeds along edges are in arrays of the scratch space.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.h[..]) + size_of_val(&self.slope_factor[..])
    }

    /// The vertices that triangles use, with sizes that are known, in a cube that is.
    pub fn with_sizes(
        points: &'a [Point],
        triangles: &[[u32; 3]],
        frame: OctreeFrame,
        size: impl Fn(Point) -> f64,
    ) -> Result<Self, SizingError> {
        let mut h = vec![0.0; points.len()];
        for &v in triangles.iter().flatten() {
            let h = &mut h[v as usize];
            if *h == 0.0 {
                *h = size(points[v as usize]) / frame.side;
            }
        }
        if triangles.is_empty() {
            return Err(SizingError::NoEdges);
        }
        Ok(Self {
            points,
            frame,
            per_side: 1.0 / frame.side,
            h,
            slope_factor: Vec::new(),
            along: None,
        })
    }
}

/// The cube around the points that triangles use, and their box.
pub(super) fn octree_frame(points: &[Point], triangles: &[[u32; 3]]) -> (OctreeFrame, Aabb) {
    let corners = triangles.iter().flatten().map(|&v| points[v as usize]);
    let bounds = Aabb::around(corners);
    (OctreeFrame::around(&bounds), bounds)
}
