//! The pipeline that meshes a surface, and the public calls of the library.
//!
//! | module | subject |
//! |---|---|
//! | [`api`] | the front door |
//! | `pipeline` | the recipe, in resumable steps |
//! | `view` | pictures, sections, the page |
//!
//! Programs use the crate `tetdb`, which re-exports [`api`]. `pipeline` and `view` may change without notice.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod api;
#[doc(hidden)]
pub mod pipeline;
#[doc(hidden)]
pub mod view;

/// Types of other crates that appear in the public calls: sub-domains and their records, hits of a query.
pub mod data {
    pub use glam::DVec3;
    pub use tetdb_schema as schema;
    pub use tetdb_store::query::Hit;
    pub use tetdb_store::sealed::{Chunk, Chunks, Corner, SealedError, Shape, Subdomain};
}
