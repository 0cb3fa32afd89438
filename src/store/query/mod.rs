//! Questions to a finished store, answered from the chunks that matter.
//!
//! A [`QuerySession`] holds a store open within a budget: some sub-domains' summaries, and the chunks decoded last. A
//! question rules out sub-domains by their boxes, then chunks by their summaries (box, qualities, regions, vertices), and
//! decides with exact signs inside the chunks that are left. Answers are iterators; this module has no file formats.
//!
//! Reading order: `solid` (boxes, balls, planes and what meets them) on `exact`; `decoded` (a decoded chunk) and `tree`;
//! `session` (what is held open); `locate` (points), `lazy` (a single point); `hit` (a tetrahedron with its columns);
//! `selection` (conditions), `marks` (tetrahedra on the surface and on interfaces), `surface_faces` (their faces on the surface), `select` (the answers one after the other),
//! `order` (sorted), `extreme` (the worst few), `around` (tetrahedra around vertices, edges, neighbors).

mod around;
mod decoded;
mod error;
mod exact;
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
mod solid;
mod surface_faces;
mod tree;

pub use error::QueryError;
pub use hit::{Hit, VARIABLES};
pub use locate::Located;
pub use order::Ordered;
pub use select::Selected;
pub use selection::{Selection, Sharing};
pub use session::checked_chunk;
pub use session::regions_called;
pub use session::{Measures, QuerySession};
pub use solid::Solid;
