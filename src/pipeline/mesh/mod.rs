//! One run: the coarse mesh, the bisections, each sub-domain to its final density.

pub(super) mod coarse;
pub(super) mod coarse_snapshot;
pub(super) mod commit;
pub(super) mod common;
pub(super) mod cut_journal;
pub(super) mod divide;
mod head_start;
pub(super) mod owners;
mod run;
pub(super) mod saturate;
pub(super) mod stages;

pub use coarse::CoarseReport;
#[cfg(any(test, feature = "internals"))]
pub use coarse::coarse as coarse_mesh;
pub use head_start::{HeadStart, ahead};
pub use run::{Summary, mesh, mesh_prepared};
pub use saturate::FineReport;
pub use stages::stage_faces;
