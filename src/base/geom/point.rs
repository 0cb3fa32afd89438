//! Positions and boxes around them.

/// A position in space, in input units.
pub type Point = glam::DVec3;

/// Axis-aligned box, `low <= high` on each axis; the empty box has `low > high`.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Aabb {
    /// Least coordinate on each axis.
    pub low: Point,
    /// Greatest coordinate on each axis.
    pub high: Point,
}

impl Aabb {
    /// The box of no point: any point extends it to itself.
    pub const EMPTY: Self = Self { low: Point::INFINITY, high: Point::NEG_INFINITY };

    /// The smallest box that also holds `p`.
    #[inline]
    #[must_use]
    pub fn with(self, p: Point) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        (self.high - self.low).length()
    }

    /// Returns whether the two closed boxes share a point.
    pub fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}
