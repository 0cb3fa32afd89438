//! Open and doubled surfaces closed where winding numbers say what is inside.
//!
//! ```text
//!      shells seen from outside                                  `shells`
//!   -> triangles that touch in common vertices and edges alone   `resolve`, where they do not
//!   -> tetrahedra between them                                   `coarse`
//!   -> winding numbers of the tetrahedra                         `winding`
//!   -> inside and outside                                        `sides`: a minimum cut
//!   -> triangles and faces between the two                       `patches`
//! ```
//!
//! No triangle of the input is altered: it stays, is turned, or goes where it does not lie between inside and outside. Holes are closed by
//! faces of the tetrahedra. Where triangles cross, they are divided first.

mod coarse;
mod patches;
mod shells;
mod sides;
mod winding;

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use tetdb_base::geom::{Point, counted, short};
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{Defect, Surface, closedness, repair_bytes, validate_with};
use tetdb_kernel::boundary::BoundaryError;

use crate::resolve::{ResolveError, Resolved, resolve};
pub use coarse::Watcher;
use coarse::coarse;
pub use patches::{ClosedHole, LABELS_MAX};
use patches::{Kept, keep};
use shells::turn_shells;
use sides::choose_sides;
use winding::WindingTree;

/// Places listed at most.
const LISTED_MAX: usize = 16;
/// Holes listed in words.
const LISTED: usize = 3;

/// Report of [`close`]. Serialized, it is the key `winding` of `tetdb check --json`.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct CloseReport {
    /// Holes that were closed, the largest first.
    pub holes: Vec<ClosedHole>,
    /// Area of all of them.
    pub hole_area: f64,
    /// Triangles added, which close the holes.
    pub triangles_added: usize,
    /// Vertices added inside holes; those of divided triangles are counted by `resolve`.
    pub points_added: usize,
    /// Triangles turned outward.
    pub turned: usize,
    /// Triangles dropped with inside on both sides.
    pub dropped_inside: usize,
    /// Triangles dropped with outside on both sides.
    pub dropped_outside: usize,
    /// Triangles dropped that another one gives from the other side.
    pub dropped_repeated: usize,
    /// Volume weighted with the winding number of the given surface.
    pub volume_by_winding: f64,
    /// Volume enclosed now.
    pub volume: f64,
    /// Volume with a winding number between 0.3 and 0.7, where the choice is open to doubt.
    pub volume_doubtful: f64,
    /// Report of the resolution of crossings, which comes first.
    pub resolve: Resolved,
}

impl CloseReport {
    /// The counts in words.
    pub fn in_words(&self) -> String {
        let mut text = match self.holes.len() as u64 {
            0 => "no hole was to be closed".to_owned(),
            n => {
                let new = counted(self.triangles_added as u64, "[triangle|triangles]");
                let area = short(self.hole_area);
                format!("{}, with {new} of area {area}", counted(n, "[hole was|holes were] closed"))
            }
        };
        if !self.holes.is_empty() {
            let named = |hole: &ClosedHole| {
                let [area, length] = [hole.area, hole.boundary].map(short);
                format!("{} of area {area} in a boundary of {length}", hole.label)
            };
            let listed: Vec<String> = self.holes.iter().take(LISTED).map(named).collect();
            let rest = if self.holes.len() > LISTED { ", …" } else { "" };
            text += &format!(" ({}{rest})", listed.join(", "));
        }
        for (n, what) in [
            (self.points_added, "[vertex was|vertices were] added in them"),
            (self.turned, "[triangle was|triangles were] turned outward"),
            (self.dropped_inside, "[triangle|triangles] inside [was|were] dropped"),
            (self.dropped_outside, "[triangle|triangles] outside [was|were] dropped"),
            (self.dropped_repeated, "repeated [triangle was|triangles were] dropped"),
        ] {
            if n > 0 {
                text += &format!("; {}", counted(n as u64, what));
            }
        }
        text += &format!("; the volume is {}", short(self.volume));
        if self.volume_doubtful > 1e-9 * self.volume {
            text += &format!(", and {} of space is open to doubt", short(self.volume_doubtful));
        }
        if self.resolve.rounds > 0 {
            text += &format!("; before that, {}", self.resolve.in_words());
        }
        text
    }
}

/// Reasons why a surface is not closed.
#[derive(Debug, thiserror::Error)]
pub enum CloseError {
    /// Crossings stay.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// Triangles cannot be made faces of tetrahedra.
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    /// No place has a winding number above one half.
    #[error("the surface goes around nothing: no place has a winding number above one half")]
    NothingInside,
    /// The result has defects.
    #[error("the closed surface has {}", counted(*.n, "[defect|defects]"))]
    Unsound {
        /// Number of defects.
        n: u64,
        /// Places of some.
        places: Vec<Point>,
    },
}

/// Bytes of memory that [`close`] holds, the surface among them.
pub fn close_bytes(surface: &Surface) -> u64 {
    /// Seven tetrahedra at 32 bytes in the mesh, 136 in the graph, 32 for the costs of faces and 16 for the winding number.
    const VERTEX: u64 = 1600;
    repair_bytes(surface) + VERTEX * surface.n_vertices() as u64
}

/// Whether [`close`] is worth trying, told from some triangles in a moment: the coarse mesh of a sheet with thousands of corners on one
/// circle takes long, and nothing would come of it.
pub fn is_promising(surface: &Surface) -> bool {
    tree_around(surface, PROMISING).is_some()
}

/// A tree of triangles that go around some place, told from `n_most` of them; `None` if none do.
fn tree_around(surface: &Surface, n_most: usize) -> Option<WindingTree<'_>> {
    let all = WindingTree::new(surface, |_| true);
    if all.goes_around(n_most) {
        return Some(all);
    }
    // Walls given from both sides go around nothing: one side of each may.
    let two_sided = closedness(surface).two_sided;
    let seconds: BTreeSet<u32> = two_sided.into_iter().map(|[_, second]| second).collect();
    let tree = WindingTree::new(surface, |t| !seconds.contains(&t));
    (!seconds.is_empty() && tree.goes_around(n_most)).then_some(tree)
}

/// Triangles asked by [`is_promising`].
const PROMISING: usize = 256;

/// Makes a closed surface of one with open edges, doubled or turned shells, or parts that overlap.
///
/// Inside is where the surface goes around more than half a time, either way. Triangles between inside and outside stay, turned
/// outward, with their labels; the others are dropped. Faces of Delaunay tetrahedra close the holes, with labels `closed-hole-1` and so
/// on. Effects: vertices and triangles are renumbered. The result is the same for any number of threads. Memory: [`close_bytes`]. A
/// scratch file that fails unwinds, as a cancelled run does ([`attempt`](tetdb_base::storage::attempt)).
///
/// # Errors
/// [`CloseError`]; the surface is then between two steps.
pub fn close(
    surface: &mut Surface,
    scratch: &ScratchSpace,
    watch: &Watcher,
) -> Result<CloseReport, CloseError> {
    watch("resolve crossings", 0, 0);
    let shells_turned = turn_shells(surface);
    let resolve = resolve(surface, scratch)?;
    if surface.n_triangles() == 0 {
        return Err(CloseError::NothingInside);
    }
    let tree = tree_around(surface, usize::MAX).ok_or(CloseError::NothingInside)?;
    let mut mesh = coarse(surface, watch)?;
    let sides = choose_sides(&mut mesh, &tree, watch);
    if sides.volume == 0.0 {
        return Err(CloseError::NothingInside);
    }
    let Kept { turned, dropped_inside, dropped_outside, dropped_repeated, holes, points_added } =
        keep(surface, &mut mesh, &sides);
    drop(mesh);
    let found = validate_with(surface, scratch);
    if found.n_defects > 0 {
        let places = found.defects.iter().filter_map(Defect::at).take(LISTED_MAX).collect();
        return Err(CloseError::Unsound { n: found.n_defects, places });
    }
    Ok(CloseReport {
        resolve,
        // The sum of nothing is -0.
        hole_area: holes.iter().map(|hole| hole.area).sum::<f64>() + 0.0,
        triangles_added: holes.iter().map(|hole| hole.triangles).sum(),
        holes,
        points_added,
        turned: turned + shells_turned,
        dropped_inside,
        dropped_outside,
        dropped_repeated,
        volume_by_winding: sides.volume_by_winding,
        volume: sides.volume,
        volume_doubtful: sides.volume_doubtful,
    })
}
