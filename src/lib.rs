// One exception, two calls of the C library: `cli::heap`.
#![deny(unsafe_code)]
#![warn(missing_docs)]
// The page names the modules, which are public with `internals` alone.
#![cfg_attr(not(feature = "internals"), allow(rustdoc::private_intra_doc_links))]
#![doc = include_str!("README.md")]
// Without the program its row in the table of modules leads to this page.
#![cfg_attr(not(feature = "cli"), doc = "", doc = "[`cli`]: crate")]

#[doc(inline)]
pub use api::{
    Answers, Bytes, CODES, CancelToken, CheckReport, CodeRow, ColorBy, DefectPlace, Error, Event,
    Existing, ExportOptions, Exported, Length, MeshFormat, Mesher, Optimize, Order, Prediction,
    Query, Regions, Remesh, Remeshed, Seal, Settings, Sizes, Snapped, Snapshot, Store, Subdomains,
    Summary, Surface, Tasks, Verification, VerifyLevel,
};

/// What the front door hands out of the modules below: sub-domains and their records, hits of a query.
pub mod data {
    pub use crate::query::Hit;
    pub use crate::sealed::{Chunk, Chunks, Corner, SealedError, Shape, Subdomain};
    pub use glam::DVec3;
    pub use tetdb_schema as schema;
}

// Its text alone: nothing of it is in a program.
#[cfg(doc)]
pub mod guide;

#[cfg(feature = "internals")]
pub use house::*;
#[cfg(not(feature = "internals"))]
use house::*;

/// The modules, from the ground up; a module imports only from those above its group's line.
#[path = "."]
// The lists of names at the head of each module are for those who have `internals`, too.
#[cfg_attr(not(feature = "internals"), allow(unused_imports))]
mod house {
    // Floor 0.
    pub mod expr;
    pub mod geom;
    // Floor 1.
    pub mod storage;
    // Floor 2.
    pub mod mesh;
    pub mod sealed;
    #[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "for the program"))]
    pub mod surface;
    // Floor 3.
    pub mod delaunay;
    pub mod reconnect;
    pub mod samples;
    pub mod sizing;
    pub mod store;
    // Floor 4.
    pub mod boundary;
    #[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "for the program"))]
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
}

// Floor 10.
#[cfg(feature = "cli")]
pub mod cli;
