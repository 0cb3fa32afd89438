//! The working mesh: cursors over one sub-domain's pages; balls, shells, checks.

mod ahead;
pub mod anatomy;
mod cursor;
mod faces;
mod renumber;
mod scan;
mod snapshot;
mod state;
mod vertices;

pub use ahead::{Draft, Foreseen, Trial, look_ahead};
pub use anatomy::{FaceRef, Tet};
pub use cursor::Mesh;
pub use faces::{Facet, InterfaceFace, SHEET};
pub use renumber::{Workspace, renumber};
pub use scan::{Scan, scan_parts, tets_of_page};
pub use state::{MESH_STATE_WORDS, MeshState, dense, next_id, sparse};
pub use vertices::{End, VertexTag};
