//! Local reconnection: faces and edges are swapped for others inside a small fixed polyhedron.
//!
//! Gather first (may load pages), then decide on copies, then apply. Gathered are the [`Shell`] of an edge, the
//! [`Ball`] of a vertex, the two tetrahedra of a face ([`FaceSwap`]). Decisions rest on exact signs of the new
//! tetrahedra and on a quality from the caller. [`remove_edge`], [`FaceSwap::apply`] and [`Replacement::apply`] apply.
//!
//! Invariants of every operation: neighbors are mutual; required bits stay on the outer faces; required-edge flags
//! follow their edges; the new tetrahedra inherit region and the other flags; `tet_of` of every vertex involved names a
//! new tetrahedron; ids are used again in the order gathered, so the result depends on the call alone. No operation
//! changes a required face. A required edge shows in [`Shell::required`] if a required face has it, which [`remove_edge`]
//! asserts; an edge that is required without faces has a flag in the attribute of its tetrahedra.

mod attribute;
mod ball;
mod removal;
mod replace;
mod ring;
mod shell;
mod swap;
#[cfg(test)]
mod tests;

pub use attribute::Inherited;
pub use ball::Ball;
pub use removal::remove_edge;
pub use replace::Replacement;
pub use ring::{Forced, RingTriangulation};
pub use shell::Shell;
pub use swap::FaceSwap;
