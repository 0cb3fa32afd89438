//! Views of a mesh: sections and crinkle cuts, surfaces, statistics of all tetrahedra, pictures and the HTML page.
//!
//! Reading order: `section` (cuts by a plane, to be drawn) and `shell` (surfaces); `sample` (edges) and `statistics`; `cluster`
//! (fewer triangles), `scene` (surfaces to be turned and cut) and `pick` (the tetrahedron on a ray); `picture` (PNG and SVG) and
//! `page` (HTML).

mod cluster;
pub mod page;
mod pick;
pub mod picture;
mod sample;
mod scene;
mod section;
mod shell;
mod statistics;

pub use cluster::Patch;
pub use pick::{Ray, pick};
pub use sample::EdgeLengths;
pub use scene::{ClippedSkin, Cross, DrawnTets, Scene, SceneCut, SurfaceShare, scene};
pub use section::{Extent, Piece, Section, View, section};
pub use shell::{Clip, ShellView, normal_of, shell};
pub use statistics::{Excess, Histogram, Statistics, statistics};
