#![forbid(unsafe_code)]
//! Embedded, database-backed, out-of-core tetrahedral mesher and mesh store.

// Floor 0.
pub mod geom;
// Floor 1.
pub mod store;
// Floor 2.
pub mod mesh;
pub mod surface;
// Floor 3.
pub mod delaunay;
pub mod samples;
// Floor 4.
pub mod boundary;
// Floor 7.
pub mod io;
