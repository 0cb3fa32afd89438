//! Questions to a finished store, answered from the chunks that matter.
//!
//! An [`Inquiry`] holds a store open within a budget: some sub-domains' summaries, and the chunks decoded last. A
//! question rules out sub-domains by their boxes, then chunks by their summaries (box, qualities, regions, vertices), and
//! decides with exact signs inside the chunks that are left. Answers come as iterators; nothing here knows formats.
//!
//! Reading order: `solid` (boxes, balls, planes and what meets them) on `exact`; `frame` (a decoded chunk) and `tree`;
//! `inquiry` (what is held); `locate` (points), `lazy` (a single point); `found` (a tetrahedron with its columns);
//! `selection` (what is asked for), `marks` (faces of the surface and of interfaces), `select` (the answers one after the other),
//! `order` (sorted), `extreme` (the worst few), `around` (tetrahedra around vertices, edges, neighbors), `section` (cuts by a plane, to be drawn) and `shell` (surfaces);
//! `sample` (edges) and `statistics` (of all tetrahedra), `cluster` (fewer triangles) and `scene` (surfaces to be turned and cut).

mod around;
mod cluster;
mod error;
mod exact;
mod extreme;
mod found;
mod frame;
mod inquiry;
mod lazy;
mod locate;
mod marks;
mod order;
mod sample;
mod scene;
mod section;
mod select;
mod selection;
mod shell;
mod solid;
mod statistics;
#[cfg(test)]
mod tests;
mod tree;

pub use cluster::Patch;
pub use error::ReportError;
pub use found::{Found, VARIABLES};
pub use inquiry::{Inquiry, Measures};
pub use locate::Located;
pub use order::Ordered;
pub use sample::EdgeLengths;
pub use scene::{Cross, Scene, SceneCut, Skin};
pub use section::{Extent, Piece, Section, View};
pub use select::Selected;
pub use selection::{Selection, Sharing};
pub use shell::{Clip, Shell};
pub use solid::Solid;
pub use statistics::{Histogram, Statistics};
