//! Questions to a finished store, answered from the chunks that matter.
//!
//! A [`QuerySession`] holds a store open within a budget: some sub-domains' summaries, and the chunks decoded last. A question rules out
//! sub-domains by their boxes, then chunks by their summaries (box, qualities, regions, vertices). Inside the remaining chunks it decides with
//! exact signs. Answers are iterators; this module has no file formats.
//!
//! Reading order: `solid` (boxes, balls, planes) on `exact`; `decoded` (a decoded chunk) and `tree`; `session` (open files and caches); `locate`
//! (points), `lazy` (a single point); `hit` (a tetrahedron with its values), `extra` (fields); `selection` (conditions), `marks` (tetrahedra on the surface and on
//! interfaces), `surface_faces` (required faces), `select` (the hits in order of id), `shared_select` (the same by several threads), `chunks`
//! (the hits of chosen chunks), `order` (sorted), `extreme` (the worst few), `around` (tetrahedra around vertices and edges, neighbors).

mod around;
mod chunks;
mod decoded;
mod error;
mod exact;
mod extra;
mod extreme;
mod hit;
mod lazy;
mod locate;
mod marks;
mod near;
mod order;
mod select;
mod selection;
mod session;
mod shared_select;
mod solid;
mod surface_faces;
mod tree;

pub use chunks::{ChunkedSelection, TetChunk};
pub use error::QueryError;
pub(crate) use exact::Vector;
pub use extra::ExtraVariable;
pub use hit::{EXTRA_MAX, Hit, VARIABLES};
pub use locate::LocatedPoint;
pub(crate) use locate::{holds, shares};
pub use order::Ordered;
pub use select::Selected;
pub use selection::{Selection, Sharing};
pub use session::checked_chunk;
pub use session::regions_called;
pub use session::{Measures, QuerySession};
pub(crate) use session::{bounds_of, chunk_bounds};
pub use shared_select::shared_select;
pub use solid::Solid;
