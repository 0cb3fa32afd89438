//! A closed surface around anything: triangles that cross, overlap, or have gaps between them, edges and points.
//!
//! ```text
//!      a tree of the input                              `oracle`
//!   -> a Delaunay mesh, flooded from outside            `flood`, `delaunay`, `apart`
//!   -> cells filled where the border is no manifold     `manifold`
//!   -> the border, checked by exact signs and measured  `measure`
//! ```
//!
//! Certain: the wrap is closed and a 2-manifold, encloses all of the input and touches none of it, and its vertices are at most the offset
//! away from the input. Measured: how far its triangles are from the input, and the input from the wrap. Where the input has hollows that
//! are closed, or whose openings are narrower than the gap, the wrap passes over them, so parts of the input may be far below it.
//!
//! Is not: an approximation that keeps edges or labels' borders. All vertices are new.

mod apart;
mod delaunay;
mod flood;
mod manifold;
mod measure;
mod oracle;
mod settings;

#[cfg(test)]
mod tests;

use rayon::prelude::*;

use tetdb_base::geom::{Aabb, HilbertFrame, IdMap, Point};
use tetdb_base::storage::{ScratchSpace, check_cancelled, parallel};
use tetdb_base::surface::Surface;

use delaunay::N_FAR;
use flood::Flood;
use oracle::{Oracle, Pieces};
pub use settings::{WrapError, WrapReport, WrapSettings};

/// Extents and coordinates beyond which squares and cubes of lengths leave the range of doubles.
const EXTENTS: std::ops::Range<f64> = 1e-20..1e40;
/// Least offset as a share of the largest coordinate: the vertices' distances are known to a thousandth of it, and coordinates to 1e-16.
const OFFSET_LEAST: f64 = 1e-10;
/// Bytes of the wrap for a triangle: what is returned, the tree over it and its distances.
const BYTES_WRAP: u64 = 250;
/// Pieces of long triangles, for each triangle at most, and in all.
const PIECES: usize = 40;
/// See [`PIECES`]: they take 320 MB.
const PIECES_MAX: usize = 2_000_000;

/// Triangles, edges and points as triangles, the latter with equal corners.
struct Parts<'a> {
    surface: &'a Surface,
    n_triangles: usize,
    n_edges: usize,
}

impl<'a> Parts<'a> {
    fn new(surface: &'a Surface) -> Self {
        let (n_triangles, n_edges) = (surface.n_triangles(), surface.embedded.edges.len());
        Self { surface, n_triangles, n_edges }
    }

    fn len(&self) -> usize {
        self.n_triangles + self.n_edges + self.surface.embedded.points.len()
    }

    /// Three vertices and the label.
    fn part(&self, t: u32) -> ([u32; 3], u32) {
        let t = t as usize;
        if t < self.n_triangles {
            return (self.surface.triangles[t], self.surface.labels[t]);
        }
        let t = t - self.n_triangles;
        if t < self.n_edges {
            let [a, b, label] = self.surface.embedded.edges[t];
            return ([a, b, b], label);
        }
        let [a, label] = self.surface.embedded.points[t - self.n_edges];
        ([a, a, a], label)
    }

    fn corners(&self, t: u32) -> [Point; 3] {
        self.part(t).0.map(|v| self.surface.points[v as usize])
    }
}

/// Wraps all triangles, edges and points of a surface, whether valid or not.
///
/// The result is the same for any number of threads. Memory is leased from `scratch`. A cancelled run unwinds
/// ([`attempt`](tetdb_base::storage::attempt)).
///
/// # Errors
/// [`WrapError`]. Never a wrap that does not enclose the input.
pub fn wrap(
    surface: &Surface,
    settings: &WrapSettings,
    scratch: &ScratchSpace,
    progress: &dyn Fn(f64),
) -> Result<(Surface, WrapReport), WrapError> {
    let WrapSettings { gap, offset } = *settings;
    let parts = Parts::new(surface);
    let n = parts.len();
    if n == 0 {
        return Err(WrapError::Empty);
    }
    let bounds = Aabb::around((0..n as u32).flat_map(|t| parts.corners(t)));
    check(bounds, settings)?;
    let input = leased(scratch, n as u64 * Oracle::BYTES_PIECE)?;
    let pieces = Pieces::new(n, n + (PIECES * n).min(PIECES_MAX), |t| parts.corners(t));
    drop(input);
    let _input = leased(scratch, pieces.len() as u64 * Oracle::BYTES_PIECE)?;
    let oracle = Oracle::new(pieces, |t| parts.corners(t));
    let mut flood = Flood::new(&oracle, bounds, gap, offset);
    flood.run(scratch, progress)?;
    check_cancelled();
    let filled = manifold::fill(&flood.mesh, &mut flood.is_outside);
    let (points, triangles) = measure::border(&flood);
    let _output = leased(scratch, triangles.len() as u64 * BYTES_WRAP)?;
    let far = points.iter().find(|p| flood.mesh.points[..N_FAR as usize].contains(*p));
    if triangles.is_empty() || far.is_some() {
        let at = far.copied().unwrap_or(bounds.low);
        return Err(WrapError::Incomplete { reason: "a vertex on the offset is missing", at });
    }
    let mut result = Surface {
        points,
        triangles,
        label_names: surface.label_names.clone(),
        label_sets: surface.label_sets.clone(),
        ..Surface::default()
    };
    if let Some(t) = measure::touching(&result, &oracle) {
        let [at, ..] = result.corners(t);
        return Err(WrapError::Incomplete { reason: "a triangle touches the input", at });
    }
    if let Some(k) = left_out(&flood, &parts) {
        return Err(WrapError::Incomplete { reason: "a point of the input is not inside", at: k });
    }
    let steiner_points = flood.mesh.points.len() as u64 - u64::from(N_FAR);
    drop(flood);
    let (to, nearest) =
        measure::distances(result.n_triangles(), |t| result.corners(t), gap, &oracle);
    result.labels = nearest.into_iter().map(|t| parts.part(t).1).collect();
    drop(oracle);
    let own = Oracle::new(
        Pieces::new(result.n_triangles(), result.n_triangles(), |t| result.corners(t)),
        |t| result.corners(t),
    );
    let (from, _) = measure::distances(n, |t| parts.corners(t), gap, &own);
    let report = WrapReport {
        gap,
        offset,
        parts_before: n as u64,
        triangles: result.n_triangles() as u64,
        vertices: result.n_vertices() as u64,
        shells: shells(&result),
        steiner_points,
        filled,
        distance_to_input_max: to.most,
        distance_to_input_mean: to.mean(),
        distance_from_input_max: from.most,
        distance_from_input_mean: from.mean(),
        samples: to.n + from.n,
    };
    Ok((result, report))
}

/// Refuses lengths and coordinates that cannot be computed with.
fn check(bounds: Aabb, settings: &WrapSettings) -> Result<(), WrapError> {
    let WrapSettings { gap, offset } = *settings;
    for (what, value) in [("gap", gap), ("offset", offset)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(WrapError::Length { what, value });
        }
    }
    let largest = bounds.low.abs().max(bounds.high.abs()).max_element();
    let extent = bounds.diagonal().max(offset);
    if !EXTENTS.contains(&extent) || largest > EXTENTS.end {
        return Err(WrapError::Range { largest, extent });
    }
    let least = OFFSET_LEAST * largest.max(bounds.diagonal());
    if offset.min(gap) < least {
        return Err(WrapError::Rounding { offset: offset.min(gap), largest, least });
    }
    Ok(())
}

fn leased(
    scratch: &ScratchSpace,
    bytes: u64,
) -> Result<Option<tetdb_base::storage::Lease>, WrapError> {
    if bytes > scratch.available() {
        return Err(WrapError::Memory { bytes_max: scratch.cap(), bytes });
    }
    Ok(scratch.lease(bytes as usize))
}

/// An input point that is not inside.
fn left_out(flood: &Flood, parts: &Parts) -> Option<Point> {
    let mut is_used = vec![false; parts.surface.n_vertices()];
    for t in 0..parts.len() as u32 {
        parts.part(t).0.iter().for_each(|&v| is_used[v as usize] = true);
    }
    let used = parts.surface.points.iter().zip(is_used).filter(|(_, used)| *used);
    let mut points: Vec<Point> = used.map(|(p, _)| *p).collect();
    // Each is sought from the place of the one before.
    let frame = HilbertFrame::new(&Aabb::around(points.iter().copied()));
    parallel(|| points.par_sort_by_cached_key(|p| frame.index(*p)));
    measure::left_out(flood, &points).map(|k| points[k])
}

/// Number of connected shells.
fn shells(surface: &Surface) -> u64 {
    let mut above: Vec<u32> = (0..surface.n_vertices() as u32).collect();
    fn root(above: &mut [u32], mut v: u32) -> u32 {
        while above[v as usize] != v {
            above[v as usize] = above[above[v as usize] as usize];
            v = above[v as usize];
        }
        v
    }
    let mut roots: IdMap<u32, ()> = IdMap::default();
    for &[a, b, c] in &surface.triangles {
        let a = root(&mut above, a);
        for v in [b, c] {
            let other = root(&mut above, v);
            above[other as usize] = a;
        }
    }
    for v in 0..surface.n_vertices() as u32 {
        roots.insert(root(&mut above, v), ());
    }
    roots.len() as u64
}
