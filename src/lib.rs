#![forbid(unsafe_code)]
//! Embedded, database-backed, out-of-core tetrahedral mesher and mesh store.

pub mod geom;
