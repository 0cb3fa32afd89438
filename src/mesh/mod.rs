//! The working mesh: cursors over one sub-domain's pages; balls, shells, checks.

pub mod anatomy;
mod cursor;
mod faces;
mod kept;
mod renumber;

pub use anatomy::{FaceRef, Tet};
pub use cursor::{End, MESH_STATE_WORDS, Mesh, MeshState, VertexTag, dense, sparse};
pub use faces::{Facet, InterfaceFace};
pub use renumber::{Workspace, renumber};
