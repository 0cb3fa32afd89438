//! The size field: the wanted edge length h(x), the load that follows from it, and the predicted mesh.
//!
//! The field is a pure function of position: it does not depend on the order of insertion, the decomposition or the
//! number of threads. It is built once from the surface. An octree (`tree`) is fine only where sizes differ. Values on
//! its corners are interpolated from the surface's edges (`seeds`, `gather`, `edge_seeds`), joined to the wanted
//! interior size and graded (`values`); between corners they are trilinear (`field`). Boxes, spheres and cylinders with
//! sizes of their own are formulas evaluated next to it (`sources`). Expressions (`formula`), sizes of regions
//! (`region`), sizes near labels (`label`) and those of background meshes (`background`) are sampled into the octree
//! when it is built (`constraints`). The least of all sizes counts.
//!
//! The expected mesh follows from the field and the surface: the load inside (`integral`), the numbers of tetrahedra
//! and vertices (`count`).
//!
//! Lengths along edges and loads of tetrahedra are closed forms for h linear between vertices (`closed`).
//! Only IEEE basic operations and square roots are used: results are equal on every machine.
//!
//! Memory: about 37 bytes per leaf when built, about four times that while building. `balls,count=1000` has 107,000
//! leaves, 4.2 MB, 8 bytes for each of its 506,000 triangles. Resident are only the octree's 5 bytes per leaf and,
//! while building, 8 to 12 bytes per vertex and lists of seeds near a cell. All other arrays go to scratch files if the
//! scratch space given is too small (`tetdb_base::storage::ScratchSpace`). The field does not depend on the scratch
//! space or the number of threads.

mod background;
mod closed;
mod codec;
mod constraint;
mod constraints;
mod corners;
mod count;
mod edge_seeds;
mod error;
mod field;
mod formula;
mod gather;
mod grading;
mod integral;
mod label;
mod length;
mod math;
mod options;
mod parts;
mod region;
mod remesh;
mod seeds;
mod sources;
mod summarize;
mod summary;
mod tree;
mod values;

#[cfg(test)]
mod tests;

pub use background::{Background, BackgroundMesh};
pub use closed::{TETS_PER_LOAD, density_of_tet, load_of_tet, metric_length};
pub use constraint::SizeConstraint;
pub use count::TetCounts;
pub use error::SizingError;
pub use field::{ExtraSizes, SizeField};
pub use formula::Formula;
pub use integral::{Domain, SurfaceSkin};
pub use label::{LabelSize, NearLabel, list_of_labels};
pub use length::Length;
pub use options::{RegionSize, SizeOptions};
pub use region::Region;
pub use sources::{SizeSource, SourceShape};
pub use summary::{SizeRange, SizeSummary, SizeWarning};
