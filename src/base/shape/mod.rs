//! The shape of one tetrahedron: its quality q, and the least q that its required faces allow.
//!
//! Uses four points, no mesh.

mod anatomy;
mod bound;
mod bound_table;
mod climb;
mod quality;

pub use anatomy::{EDGE_OF, EDGES, FACES};
pub use bound::{excess, face_floor, face_least, face_most, least};
pub use bound_table::excess_near;
pub use climb::Climb;
pub use quality::{
    ALPHA, CONTENT, INVERSE_QUALITY_WANTED, face_bound, inverse_quality, is_below, is_forcing,
    quality,
};
