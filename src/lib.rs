#![forbid(unsafe_code)]
//! Embedded, database-backed, out-of-core tetrahedral mesher and mesh store.

// Floor 0.
pub mod geom;
// Floor 1.
pub mod store;
