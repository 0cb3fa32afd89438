//! Exact validation: lists everything that keeps a surface from bounding volumes.

use super::boundary_loops::{JUNCTION_SHARE, TJunction, t_junctions};
#[cfg(test)]
use super::contact::ContactKind;
use super::contact::{Contact, contact};
use super::edges::{Closedness, Facets};
use super::stars::touching;
use super::{Defect, SourceFile, Surface, SurfaceError};
use crate::storage::ScratchSpace;

/// Self-intersections listed at most; all are counted.
const LISTED_MAX: usize = 100_000;

/// Result of a validation.
#[derive(Clone, Debug, PartialEq)]
pub struct Validation {
    /// Edges, parts, two-sided facets.
    pub closedness: Closedness,
    /// Vertices on open edges, or nearer to them than 1e-6 of the box diagonal.
    pub t_junctions: Vec<TJunction>,
    /// Kind by kind (no area, repeated, open at a T-junction, open, intersecting), each sorted by triangle.
    pub defects: Vec<Defect>,
    /// Pairs of triangles that touch where they should not, listed or not; counting ends beyond a million.
    pub n_intersections: u64,
    /// Defects in all, listed or not.
    pub n_defects: u64,
    /// The files of the surface.
    pub files: Vec<SourceFile>,
}

impl Validation {
    /// Returns whether the surface may be meshed.
    pub fn is_valid(&self) -> bool {
        self.n_defects == 0
    }

    /// The first defect as an error, when there is one.
    ///
    /// # Errors
    /// [`SurfaceError::Invalid`].
    pub fn accept(&self) -> Result<(), SurfaceError> {
        match self.defects.first() {
            None => Ok(()),
            Some(defect) => Err(SurfaceError::Invalid {
                defect: Box::new(defect.clone()),
                n_defects: self.n_defects,
                files: self.files.clone(),
            }),
        }
    }

    /// Number of listed self-intersections of this kind.
    #[cfg(test)]
    pub fn n_of_kind(&self, kind: ContactKind) -> usize {
        let is_kind =
            |d: &&Defect| matches!(d, Defect::SelfIntersection { kind: k, .. } if *k == kind);
        self.defects.iter().filter(is_kind).count()
    }
}

/// Checks a surface completely and exactly.
///
/// Near-linear time where boxes of triangles overlap few others, but for those around one vertex or one edge, of which there may be many; about 150 bytes per triangle. Same
/// result for any number of threads. Orientation is no defect: see [`Closedness::n_inconsistent`].
pub fn validate(surface: &Surface) -> Validation {
    validate_with(surface, &ScratchSpace::boundless())
}

/// [`validate`] within scratch space. Memory outside it: 8 bytes a triangle, and 60 for each triangle of a star.
///
/// A scratch file that fails unwinds ([`attempt`](crate::storage::attempt)).
pub fn validate_with(surface: &Surface, scratch: &ScratchSpace) -> Validation {
    let mut facets = Facets::new(surface, scratch);
    let closedness = facets.closedness(surface);
    let t_junctions = match closedness.is_closed() {
        true => Vec::new(),
        false => t_junctions(surface, &closedness, JUNCTION_SHARE * surface.bounds().diagonal()),
    };
    let mut defects = edge_defects(surface, &closedness, &t_junctions);
    let Facets { mut is_left_out, .. } = facets;
    for &(t, _) in &closedness.degenerate {
        is_left_out[t as usize] = true;
    }
    let look = |a: u32, b: u32| {
        let ids = [a, b].map(|t| surface.triangles[t as usize]);
        let found = contact(surface.corners(a), ids[0], surface.corners(b), ids[1])?;
        Some(([a, b], found))
    };
    let (mut touching, n_intersections) =
        touching(surface, &mut is_left_out, scratch, LISTED_MAX, look);
    touching.sort_unstable_by_key(|(triangles, _)| *triangles);
    let n_defects = defects.len() as u64 + n_intersections;
    defects.extend(touching.into_iter().map(|(triangles, found)| Defect::SelfIntersection {
        triangles,
        kind: found.kind,
        at: found.at,
    }));
    let files = surface.files.clone();
    Validation { closedness, t_junctions, defects, n_intersections, n_defects, files }
}

/// Pairs of triangles beyond which [`pairs_that_touch`] gives up.
pub const PAIRS_MAX: u64 = super::box_pairs::FOUND_MAX;

/// All pairs of triangles that touch where they should not, sorted; `None` where there are more than [`PAIRS_MAX`].
///
/// Triangles without area are left out, and those of the same vertices as an earlier one. A scratch file that fails unwinds.
pub fn pairs_that_touch(
    surface: &Surface,
    scratch: &ScratchSpace,
) -> Option<Vec<([u32; 2], Contact)>> {
    let Facets { degenerate, mut is_left_out, .. } = Facets::new(surface, scratch);
    for (t, _) in degenerate {
        is_left_out[t as usize] = true;
    }
    let look = |a: u32, b: u32| {
        let ids = [a, b].map(|t| surface.triangles[t as usize]);
        let found = contact(surface.corners(a), ids[0], surface.corners(b), ids[1])?;
        Some(([a, b], found))
    };
    let (mut found, n) = touching(surface, &mut is_left_out, scratch, usize::MAX, look);
    found.sort_unstable_by_key(|(triangles, _)| *triangles);
    (n == found.len() as u64 && n <= PAIRS_MAX).then_some(found)
}

/// The defects that edges and vertices alone show.
fn edge_defects(
    surface: &Surface,
    closedness: &Closedness,
    t_junctions: &[TJunction],
) -> Vec<Defect> {
    let mut defects = Vec::new();
    if surface.n_triangles() == 0 {
        defects.push(Defect::Empty);
    }
    let degenerate = closedness.degenerate.iter();
    defects.extend(degenerate.map(|&(triangle, repeated)| Defect::Degenerate {
        triangle,
        repeated,
        corners: surface.corners(triangle),
    }));
    defects.extend(
        closedness.duplicates.iter().map(|&triangles| Defect::Duplicate {
            triangles,
            corners: surface.corners(triangles[0]),
        }),
    );
    let mut open: Vec<Defect> = closedness
        .open
        .iter()
        .map(|&(triangle, vertices)| {
            let [from, to] = vertices.map(|v| surface.points[v as usize]);
            let first =
                t_junctions.partition_point(|j| (j.triangle, j.edge) < (triangle, vertices));
            let junction = t_junctions[first..]
                .first()
                .filter(|j| (j.triangle, j.edge) == (triangle, vertices))
                .map(|j| j.at);
            Defect::OpenEdge { triangle, vertices, from, to, junction }
        })
        .collect();
    // Edges with a known reason come first.
    open.sort_by_key(|d| !matches!(d, Defect::OpenEdge { junction: Some(_), .. }));
    defects.extend(open);
    defects
}
