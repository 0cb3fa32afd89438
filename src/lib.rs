// One exception, two calls of the C library: `cli::heap`.
#![deny(unsafe_code)]
#![doc = include_str!("README.md")]

// Floor 0.
pub mod expr;
pub mod geom;
// Floor 1.
pub mod storage;
// Floor 2.
pub mod mesh;
pub mod sealed;
pub mod surface;
// Floor 3.
pub mod delaunay;
pub mod reconnect;
pub mod samples;
pub mod sizing;
pub mod store;
// Floor 4.
pub mod boundary;
pub mod optimize;
pub mod refine;

// Floor 5.
pub mod bisect;
pub mod topology;
// Floor 6.
pub mod audit;
pub mod pipeline;
pub mod query;
// Floor 7.
pub mod io;
// Floor 8.
pub mod view;
// Floor 9.
pub mod api;
// Floor 10.
pub mod cli;
