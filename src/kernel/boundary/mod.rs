//! Recovers every input segment and facet, and colors the volumes.
//!
//! The Delaunay mesh of the surface's vertices has most, but not all, of the surface's triangles as faces. Missing parts
//! are recovered in this order. Each step is exact, and none adds a vertex to the surface:
//! 1. turning (`turn`): within flat parts of the surface edges turn in their plane, with vertices off the plane if needed;
//! 2. flips (`find`, `flips`): 2-3 flips and edge removal that create no new crossings of missing parts;
//! 3. points on the missing part (`patch`, `chain`, `cover`): where flips fail, crossings get vertices that lie exactly on
//!    the input, as combinations of its corners without rounding. Missing facets in one plane are one part
//!    (`flat_parts`), whose own segments are turned into place afterwards;
//! 4. suppression (`suppress`): each such vertex is replaced by one vertex inside each volume around it, so that the
//!    input triangle is whole again. In exact arithmetic this always exists; exact signs accept it;
//! 5. where doubles leave no clearance for that, the new vertices stay exact until all are off the surface. Then they
//!    move apart until they can be rounded to doubles (`round_points`).
//!
//! Sources: P.-L. George, H. Borouchaki and E. Saltel, "'Ultimate' robustness in meshing an arbitrary polyhedron"
//! (2003); N. P. Weatherill and O. Hassan (1994); M. Attene and others for points kept implicit (2020-2023).

mod chain;
mod complex;
mod cover;
mod effort;
mod error;
mod exact;
mod find;
mod flat_parts;
mod flips;
mod flood;
mod free_edge;
mod free_vertex;
mod grow;
mod inscribed_ball;
mod insert_exact;
mod map;
mod nearness;
mod patch;
mod points;
mod policy;
mod polygon;
mod recover;
mod regions;
mod report;
mod round_points;
mod seeds;
mod suppress;
mod target;
mod tidy;
mod turn;
mod walk;
mod wedge;

pub use error::{BoundaryError, FacetPlace};
pub use nearness::{Nearness, NearnessKind};
pub use policy::{Filled, RegionPolicy, Walls};
pub use recover::recover;
pub use recover::recover_with_progress;
pub use regions::{RegionSummary, VolumeRegions, fill_by_sides, fill_regions};
pub use report::RecoveryReport;
pub use seeds::RegionRule;

#[cfg(test)]
mod tests;
