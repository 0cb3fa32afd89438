//! The mesher: from triangles to tetrahedra, on pages that need not be in memory.
//!
//! | module | subject |
//! |---|---|
//! | [`mesh`] | tetrahedra, cursors over pages |
//! | [`delaunay`] | insertion of one point |
//! | [`reconnect`] | flips |
//! | [`sizing`] | wanted edge lengths, load, estimate |
//! | [`samples`] | generated surfaces |
//! | [`boundary`] | input segments and facets appear |
//! | [`optimize`] | the worst tetrahedra become better |
//! | [`blocks`] | saturation and smoothing in blocks, on all threads |
//! | [`bisect`] | one cut: plane, zone, interface, two children |
//! | [`topology`] | which sub-domains are neighbors |
//!
//! This crate has no access to a store or to file formats. Programs use the crate `tetdb`; the items here may change at
//! any time.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod bisect;
pub mod blocks;
pub mod boundary;
pub mod delaunay;
pub mod mesh;
pub mod optimize;
pub mod reconnect;
pub mod samples;
pub mod sizing;
pub mod topology;
