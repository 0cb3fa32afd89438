//! The working mesh: cursors over one sub-domain's pages; balls, shells, checks.

pub mod anatomy;
mod cursor;
mod faces;
mod renumber;
mod scan;
mod snapshot;
mod trial;
mod vertices;

pub use anatomy::{FaceRef, Tet};
pub use cursor::Mesh;
pub use faces::{Facet, InterfaceFace, SHEET};
pub use renumber::{Workspace, renumber};
pub use scan::{Scan, scan_parts, tets_of_page};
pub use tetdb_schema::page::{dense, next_id, sparse};
pub use tetdb_schema::tree::MeshState;
pub use trial::{Draft, Foreseen, Trial, look_ahead};
pub use vertices::{End, VertexTag};
