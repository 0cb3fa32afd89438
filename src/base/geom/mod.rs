//! Points, planes and exact signs. The module has no mesh.
//!
//! One convention holds everywhere (drawn in `shape`): a tetrahedron `a b c d` is positive
//! when `det(b-a, c-a, d-a) > 0`, and [`insphere`] is positive inside the sphere of a positive one.

mod dyadic;
mod hash;
mod hilbert;
mod number;
mod pair;
mod point;
mod sign;
mod wide;

#[cfg(test)]
mod tests;

pub use dyadic::Dyadic;
pub use hash::{IdMap, IdSet, STEP, mix};
pub use hilbert::{HilbertFrame, hilbert_index};
pub use number::{count, counted, short};
pub use pair::DoublePair;
pub use point::{Aabb, Point};
pub use sign::{
    RelativePoint, in_sphere_perturbed, insphere, insphere_filtered, larger, lex_cmp, orient,
    orient_sign,
};
