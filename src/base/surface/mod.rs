//! The input: a closed surface of triangles with labels, welded and validated exactly.
//!
//! Reading order: [`triangles`](Surface) (the surface), `weld` (building one), `cells` (one
//! from volume cells), `label_sets` (triangles in several groups), `polygon` (cutting polygons), `edges` (triangles at each edge),
//! `orientation` (turning triangles alike), `contact` (how two triangles touch), `boxes`, `box_pairs` and `stars`
//! (pairs that may touch), `validate` (all checks), `defect` (errors and suggestions), `boundary_loops` (open edges),
//! `weld_near` and `repair` (repair on demand), `fitness` (mesh quality that the triangles allow), `split` (finer
//! triangles), `seeker` (distances, triangles above a point), `volumes` (enclosed volumes), `seeds` (points that name
//! volumes), `sheets` (embedded triangles), `embedded_set` and `embedded` (embedded edges and points),
//! `embedded_contact` (their contacts), `divide` (triangles divided at embedded vertices), `support_triangles` (which
//! keep embedded edges), `point_sizes`, `periodic` (labels that are the same at two places).
//!
//! Is not: file formats (`io`), which volumes are filled (`boundary`).

mod boundary_loops;
mod box_pairs;
mod boxes;
mod cells;
mod contact;
mod defect;
mod divide;
mod edges;
mod embedded;
mod embedded_contact;
mod embedded_set;
mod fitness;
mod label_sets;
mod orientation;
mod periodic;
mod point_sizes;
mod point_tree;
mod polygon;
mod repair;
mod seeds;
mod seeker;
mod sheets;
mod split;
mod stars;
mod support_triangles;
mod triangles;
mod validate;
mod vertex_table;
mod volumes;
mod weld;
mod weld_near;

#[cfg(test)]
mod tests;

pub use boundary_loops::{BoundaryLoop, TJunction, boundary_loops, t_junctions};
pub use boxes::BoxTree;
pub use cells::CellBoundary;
pub use contact::{Contact, ContactKind, contact, meets};
pub use defect::{Defect, SurfaceError};
pub use defect::{show, triangle_name};
pub use divide::Divided;
pub use edges::{Closedness, closedness};
pub use embedded_set::{EmbedError, Embedded, EmbeddedSet};
pub use fitness::{Fitness, fitness};
pub use orientation::{Orientation, orient_alike, orient_alike_with};
pub use periodic::{
    MotionKind, Patch, PatchTriangle, PeriodicMatch, Unpaired, UnpairedPart, match_patches,
};
pub use repair::{
    Closing, Merged, Repair, closing, drop_folds, merge_repeated, repair, repair_bytes,
    replace_triangles,
};
pub use seeds::{Seed, SeedKind};
pub use seeker::{Crossing, Seeker, nearest_point};
pub use split::{SplitReport, predict_split, split};
pub use triangles::{Note, NoteKind, SourceFile, Surface, VolumePoints};
pub use validate::{PAIRS_MAX, Validation, pairs_that_touch, validate, validate_with};
pub use vertex_table::VertexTable;
pub use volumes::{EnclosedVolumes, OUTSIDE, VOLUMES_TRIANGLE, Wall};
pub use weld::{SurfaceBuilder, drop_unused_points};
pub use weld_near::weld_near;
