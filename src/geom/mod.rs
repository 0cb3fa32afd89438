//! Points, planes and exact signs. This room knows no mesh.
//!
//! One convention holds everywhere (drawn in `mesh/anatomy.rs`): a tetrahedron `a b c d` is positive
//! when `det(b-a, c-a, d-a) > 0`, and [`insphere`] is positive inside the sphere of a positive one.

mod dyadic;
mod hash;
mod hilbert;
mod sign;
mod wide;

#[cfg(test)]
pub(crate) mod oracle;
#[cfg(test)]
pub(crate) mod tests;

pub use dyadic::Dyadic;
pub use hash::{STEP, mix};
pub use hilbert::{HilbertFrame, hilbert_index};
pub use sign::{
    Seen, in_sphere_perturbed, insphere, insphere_filtered, lex_cmp, orient, orient_sign,
};

/// A position in space, in input units.
pub type Point = glam::DVec3;

/// Axis-aligned box, `low <= high` on each axis; the empty box has `low > high`.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Aabb {
    pub low: Point,
    pub high: Point,
}

impl Aabb {
    /// The box of no point: any point extends it to itself.
    pub const EMPTY: Self = Self {
        low: Point::INFINITY,
        high: Point::NEG_INFINITY,
    };

    /// The smallest box that also holds `p`.
    #[inline]
    #[must_use]
    pub fn with(self, p: Point) -> Self {
        Self {
            low: self.low.min(p),
            high: self.high.max(p),
        }
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        (self.high - self.low).length()
    }

    /// Whether the two closed boxes share a point.
    pub fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}
