//! The recipe that meshes a surface, and the front door that programs call.
//!
//! | module | subject |
//! |---|---|
//! | [`api`] | the front door |
//! | `pipeline` | the recipe, in resumable steps |
//! | `view` | pictures, sections, the page |
//!
//! Programs use the crate `tetdb`, which re-exports [`api`]. No promise is made of `pipeline` and `view`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod api;
#[doc(hidden)]
pub mod pipeline;
#[doc(hidden)]
pub mod view;

/// What the front door hands out of other crates: sub-domains and their records, hits of a query.
pub mod data {
    pub use glam::DVec3;
    pub use tetdb_schema as schema;
    pub use tetdb_store::query::Hit;
    pub use tetdb_store::sealed::{Chunk, Chunks, Corner, SealedError, Shape, Subdomain};
}
