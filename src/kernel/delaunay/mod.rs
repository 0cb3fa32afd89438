//! Inserts one point: locate, cavity, ball.
//!
//! `T_{i+1} = T_i − C_P + B_P`: the cavity C_P holds the tetrahedra whose circumsphere contains P,
//! corrected so that it keeps required faces and is star-shaped around P; the ball of insertion B_P
//! joins P to the outer faces of C_P. Ties of the sphere test are broken by lexicographic coordinates
//! (see `geom`), so without required faces the mesh is a function of the point set alone.
//!
//! Source: A. Bowyer and D. F. Watson, Computer Journal 24 (1981); the paper, section 1.1.

mod cavity;
mod enclosing;
mod kernel;
mod links;
mod locate;
mod order;
#[cfg(test)]
mod tests;

pub use enclosing::enclose;
pub use kernel::{CavityFace, Kernel, KernelStats, PointLocation, Rejected};
pub use order::insertion_key;
