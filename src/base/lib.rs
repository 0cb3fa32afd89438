//! The base of all other crates: geometry, the language of sizes and queries, paged storage, surfaces.
//!
//! | module | subject |
//! |---|---|
//! | [`geom`] | points and exact signs |
//! | [`expr`] | the language of sizes and queries |
//! | [`shape`] | quality of one tetrahedron, and the quality that its surface triangles allow |
//! | [`storage`] | pages, cache, budget, transactions, external sort |
//! | [`surface`] | triangles, labels, validation |
//!
//! This crate has no mesh of tetrahedra. Programs use the crate `tetdb`; the items here may change at any time.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod expr;
pub mod geom;
pub mod shape;
pub mod storage;
pub mod surface;
