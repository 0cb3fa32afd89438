//! Sizes from a field: an error estimate at each vertex of the finished mesh becomes the length wanted there.
//!
//! Reading order: `arrays` (the mesh and the field), `estimate` (second derivatives or jumps at vertices), `sizes` (lengths for a number
//! of tetrahedra), `plan` (the sub-domains to mesh again). All sums run over the mesh in its own order on one thread, so the lengths are
//! the same for any number of threads and any memory.

mod arrays;
mod estimate;
mod plan;
mod sizes;

pub use estimate::ErrorEstimate;
pub use plan::{AdaptForecast, AdaptPlan, AdaptRequest, LongFaces, plan_adaptation};
