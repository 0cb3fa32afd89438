//! One meshing run: the coarse mesh, the bisections, and the final mesh of each sub-domain.

pub(super) mod coarse;
pub(super) mod commit;
pub(super) mod divide;
mod head_start;
pub(super) mod owners;
mod run;

pub use coarse::CoarseReport;
pub use coarse::coarse as coarse_mesh;
pub use head_start::{HeadStart, head_start};
pub use run::{Summary, mesh, mesh_prepared};
