// One exception, two calls of the C library: `cli::heap`.
#![deny(unsafe_code)]
#![doc = include_str!("README.md")]

// Floor 0.
pub mod expr;
pub mod geom;
// Floor 1.
pub mod store;
// Floor 2.
pub mod catalog;
pub mod mesh;
pub mod surface;
// Floor 3.
pub mod delaunay;
pub mod reconnect;
pub mod samples;
pub mod sizing;
// Floor 4.
pub mod boundary;
pub mod optimize;
pub mod refine;

pub mod bisect;
pub mod topology;
// Floor 6.
pub mod audit;
pub mod pipeline;
// Floor 7.
pub mod io;
pub mod report;
// Floor 8.
pub mod cli;
