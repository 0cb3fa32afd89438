//! The working mesh: cursors over one sub-domain's pages; balls, shells, checks.

pub mod anatomy;
mod cursor;
mod renumber;

pub use anatomy::{FaceRef, Tet};
pub use cursor::{
    End, Facet, InterfaceFace, MESH_STATE_WORDS, Mesh, MeshState, VertexTag, dense, sparse,
};
pub use renumber::{Workspace, renumber};
