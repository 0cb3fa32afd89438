//! Views of a mesh: sections and crinkle cuts, surfaces, statistics of all tetrahedra, pictures and the HTML page.
//!
//! Reading order: `section` (cuts by a plane, to be drawn) and `shell` (surfaces); `sample` (edges) and `statistics`; `cluster`
//! (fewer triangles) and `scene` (surfaces to be turned and cut); `picture` (PNG and SVG) and `page` (HTML).

mod cluster;
pub mod page;
pub mod picture;
mod sample;
mod scene;
mod section;
mod shell;
mod statistics;

pub use cluster::Patch;
pub use sample::EdgeLengths;
pub use scene::{ClippedSkin, Cross, Scene, SceneCut, scene};
pub use section::{Extent, Piece, Section, View, section};
pub use shell::{Clip, ShellView, normal_of, shell};
pub use statistics::{Excess, Histogram, Statistics, statistics};
