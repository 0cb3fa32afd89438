//! The recipe: from a closed surface to a sealed store, in steps that can each be lost but never be half done.
//!
//! | step | state after it | what |
//! |---|---|---|
//! | `coarse` | coarse | validate; Delaunay mesh of the surface's vertices; recover every triangle; color and empty regions |
//! | `fine` | sealed | size field; divide edges; optimize; sort, compress and seal |
//!
//! It receives a surface, not a path, and prints nothing: it tells a [`Watcher`] what goes on.

mod coarse;
mod error;
mod fine;
mod options;
mod plan;
mod run;
mod seal;
mod watch;

pub use error::PipelineError;
pub use options::Options;
pub use plan::{MEMORY_MIN, Plan};
pub use run::{Summary, mesh};
pub use watch::{Event, Watcher, silent};
