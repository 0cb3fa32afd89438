//! Wanted edge length h(x), the load it implies, the estimate.
//!
//! The field is a pure function of position, so that no order of insertion, no decomposition and no
//! number of threads can change what it says. It is built once from the surface: an octree,
//! fine only where sizes differ (`tree`); values on its corners, interpolated from the surface's edges,
//! joined to the wanted interior size and graded (`values`); trilinear between them (`field`). Boxes, spheres and
//! cylinders with sizes of their own are formulas beside it (`sources`); the least of all counts.
//!
//! Lengths along edges and loads of tetrahedra are closed forms for h linear between vertices (`closed`).
//! Only IEEE basic operations and square roots are used: results are equal on every machine.
//!
//! In memory for now: about 37 bytes per leaf when built, about five times that while building.

mod closed;
mod codec;
mod corners;
mod count;
mod error;
mod field;
mod integral;
mod math;
mod options;
mod seeds;
mod sources;
mod summary;
mod tree;
mod values;

#[cfg(test)]
mod tests;

pub use closed::{TETS_PER_LOAD, divide_parameters, load_of_tet, metric_length};
pub use count::Counts;
pub use error::SizingError;
pub use field::SizeField;
pub use integral::{Domain, Skin};
pub use options::{Length, SizeOptions};
pub use sources::{Shape, SizeSource};
pub use summary::{Range, SizeSummary, SizeWarning};
