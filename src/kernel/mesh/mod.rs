//! The working mesh: cursors over one sub-domain's pages; balls, shells, checks.

pub mod anatomy;
mod cursor;
mod faces;
mod renumber;
mod scan;
mod snapshot;
mod speculation;
mod vertices;

pub use anatomy::{FaceRef, Tet};
pub use cursor::Mesh;
pub use faces::{MeshFacet, MeshInterfaceFace, SHEET};
pub use renumber::{Workspace, renumber};
pub use scan::{Scan, scan_parts, tets_of_page};
pub use speculation::{DraftState, Evaluated, Speculation, evaluate_speculatively};
pub use tetdb_schema::page::{dense, next_id, sparse};
pub use tetdb_schema::tree::MeshState;
pub use vertices::{End, VertexTag};
