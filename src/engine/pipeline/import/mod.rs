//! A tetrahedral mesh made by anyone becomes a sealed store.
//!
//! Every step is a stream or an external sort:
//! 1. `place`: vertices are renumbered along the Hilbert curve and joined where their coordinates are equal; each tetrahedron is checked by
//!    its exact sign;
//! 2. `planes`: the sub-domain of each tetrahedron, by the file or by planes;
//! 3. `faces`: faces are matched; those on the boundary, between regions and of the file's triangles are the surface of the store;
//! 4. `overlap`: the boundary shows whether tetrahedra overlap or do not conform;
//! 5. `write`: sub-domains are sealed one by one. Their tetrahedra come in order from one sort of all.

mod bad_mesh;
mod faces;
mod overlap;
mod place;
mod planes;
mod prepare;
mod records;
mod write;

pub use bad_mesh::BadMesh;
pub use place::Placed;
pub use prepare::place;
pub use write::{GENERATION, StoreValues, write};
