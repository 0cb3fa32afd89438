//! Wanted edge length h(x), the load it implies, the estimate.
//!
//! The field is a pure function of position, so that no order of insertion, no decomposition and no
//! number of threads can change what it says. It is built once from the surface: an octree,
//! fine only where sizes differ (`tree`); values on its corners, interpolated from the surface's edges (`seeds`, `gather`, `edge_seeds`),
//! joined to the wanted interior size and graded (`values`); trilinear between them (`field`). Boxes, spheres and
//! cylinders with sizes of their own are formulas beside it (`sources`); expressions (`formula`), sizes of regions (`region`) and of background meshes
//! (`background`) are brought into the octree when it is made (`constraints`). The least of all counts.
//!
//! How much there is to mesh follows from the field and the surface: the load of what is inside (`integral`), tetrahedra and
//! vertices to expect (`count`).
//!
//! Lengths along edges and loads of tetrahedra are closed forms for h linear between vertices (`closed`).
//! Only IEEE basic operations and square roots are used: results are equal on every machine.
//!
//! In memory: about 37 bytes per leaf when built, about four times that while building. `balls,count=1000` has 107,000 leaves, 4.2 MB, 8 bytes for each of
//! its 506,000 triangles. Of these only the octree's 5 bytes per leaf and, while building, 8 to 12 per vertex and lists of seeds near a cell must be held: the rest is in arrays that go
//! to scratch files where the room given is too small (`store::ScratchSpace`). The room and the number of threads change nothing of the field.

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
mod length;
mod math;
mod options;
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
pub use closed::{TETS_PER_LOAD, load_of_tet, metric_length};
pub use constraint::SizeConstraint;
pub use count::TetCounts;
pub use error::SizingError;
pub use field::{ExtraSizes, SizeField};
pub use formula::Formula;
pub use integral::{Domain, SurfaceSkin};
pub use length::Length;
pub use options::{RegionSize, SizeOptions};
pub use region::Region;
pub use sources::{Shape, SizeSource};
pub use summary::{SizeRange, SizeSummary, SizeWarning};
