//! The input: a closed surface of triangles with labels, welded and validated exactly.
//!
//! Reading order: [`triangles`](Surface) (what a surface is), `weld` (how readers build one),
//! `edges` (which triangles meet where), `orientation` (turning triangles the same way), `contact`
//! (how two triangles touch), `boxes`, `broad` and `stars` (which pairs to look at), `validate` (all of it together),
//! `defect` (what can be wrong and what to do about it), `boundary_loops` (where it is open), `near` and `repair`
//! (mending on demand), `fitness` (what mesh its triangles allow), `split` (finer triangles of the same surface),
//! `seek` (distances and what lies above), `volumes` (what is enclosed), `seeds` (what points say of volumes), `sheets` (embedded triangles with volume on both sides),
//! `embedded_set` and `wires` (embedded edges and points), `wire_contact` (how they touch), `divide` (triangles divided where they lie
//! on them), `fins` (what holds edges), `point_sizes`.
//!
//! Is not: file formats (`io`), which volumes are filled (`boundary`).

mod boundary_loops;
mod box_pairs;
mod boxes;
mod contact;
mod defect;
mod divide;
mod edges;
mod embedded;
mod embedded_contact;
mod embedded_set;
mod fitness;
mod orientation;
mod point_sizes;
mod point_tree;
mod repair;
mod seeds;
mod seeker;
mod sheets;
mod split;
mod stars;
mod support_triangles;
mod triangles;
mod validate;
mod volumes;
mod weld;
mod weld_near;

#[cfg(test)]
mod tests;

pub use boundary_loops::{BoundaryLoop, TJunction, boundary_loops, t_junctions};
pub use boxes::BoxTree;
pub use contact::{Contact, ContactKind, contact};
pub use defect::show;
pub use defect::{Defect, SurfaceError};
pub use edges::{Closedness, closedness};
pub use embedded_set::{EmbedError, Embedded, EmbeddedSet};
pub use fitness::{Fitness, fitness};
pub use orientation::{Orientation, orient_alike, orient_alike_with};
pub use repair::{Closing, Repair, closing, repair, repair_bytes};
pub use seeds::{Seed, SeedKind};
pub use seeker::{Crossing, Seeker};
pub use split::{SplitReport, split};
pub use triangles::{Note, NoteKind, SourceFile, Surface, VolumePoints};
pub use validate::{Validation, validate, validate_with};
pub use volumes::{OUTSIDE, VOLUMES_TRIANGLE, Volumes, Wall};
pub use weld::SurfaceBuilder;
pub use weld_near::weld_near;
