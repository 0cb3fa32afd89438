//! The recipe: from a closed surface to a sealed store, in steps that can each be lost but never be half done.
//!
//! | step | state after it | what |
//! |---|---|---|
//! | `coarse` | coarse | validate; Delaunay mesh of the surface's vertices; recover every triangle; color and empty regions |
//! | `divide` | bisected | as often as there are sub-domains less one: refine a band, choose the interface, write two children |
//! | `leaf` | sealed | each sub-domain alone: divide edges; optimize; sort, compress and seal |
//!
//! Inserting the surface's vertices may begin before there is a store (`ahead`).
//!
//! A finished store goes on: `resaturate` makes sub-domains again from their coarse leaves, with other sizes (`sizes`) or because they
//! are damaged; `before` brings back what was.
//!
//! It receives a surface, not a path, and prints nothing: it tells a [`Watcher`] what goes on.

mod again;
mod ahead;
mod before;
mod coarse;
mod crew;
mod divide;
mod error;
mod estimate;
mod fine;
mod held;
mod keep;
mod leaf;
mod neighbors;
mod options;
mod plan;
mod regions;
mod resaturate;
mod run;
mod seal;
mod sizes;
mod stages;
mod tree;
mod watch;
mod whole;

pub use ahead::{HeadStart, ahead};
pub use before::{forget, undo};
pub use coarse::{CoarseReport, coarse as coarse_mesh};
pub use error::PipelineError;
pub use estimate::{Estimate, Prepared, least_for, prepare};
pub use fine::FineReport;
pub use options::{Options, Trial};
pub use plan::{MEMORY_MIN, Plan};
pub use resaturate::{
    Forecast, Remade, ResaturateSummary, Resaturation, asked, changed, forecast, resaturate,
};
pub use run::{Summary, mesh, mesh_prepared};
pub use sizes::{NewSizes, Values};
pub use stages::kept_faces;
pub use watch::{Event, Watcher, silent};
