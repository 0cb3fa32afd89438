//! Seeds from a surface: sizes of its vertices, from their edges, and places along long edges.

use super::SizingError;
use super::edge_seeds::edge_seeds;
use super::options::Targets;
use super::seeds::{OctreeFrame, Seeds};
use tetdb_base::geom::Point;
use tetdb_base::storage::ScratchSpace;

/// A vertex's size is at least this share of the mean length of its edges. With none, a slab of sixty triangles with steps of a ten-millionth takes
/// 8,300 tetrahedra instead of 135; with all of it, which is the arithmetic mean, an even scan loses an eighth of its elements.
const MEAN_SHARE: f64 = 0.5;
/// A vertex whose longest edge is this many of its sizes is next to a needle: from there on sizes may grow faster. Even surfaces stay as they were
/// with it; other values were not tried.
const NEEDLE_FROM: f64 = 3.0;

/// Sizes of the vertices that triangles use, and along their edges. `at_vertices`: sizes to which those of vertices are lowered, in input units.
///
/// A vertex's size is the geometric mean of the arithmetic and the harmonic mean of its edges' lengths: equal to both where
/// lengths are similar. With either alone, one needle's short edge would be ignored, or one would rule all its long neighbors.
///
/// Memory: 8 bytes a vertex, 4 more with needles, and a quarter of the scratch space, which decides how many vertices
/// are handled in one pass over the triangles.
pub(super) fn surface_seeds<'a>(
    points: &'a [Point],
    triangles: &[[u32; 3]],
    frame: OctreeFrame,
    targets: &Targets,
    at_vertices: Option<&[f64]>,
    scratch: &ScratchSpace,
) -> Result<Seeds<'a>, SizingError> {
    if let Some(h) = at_vertices
        && h.len() != points.len()
    {
        return Err(SizingError::SizeCount { found: h.len(), expected: points.len() });
    }
    let at_once = usize::try_from(scratch.available() / 4 / 32).unwrap_or(usize::MAX);
    let at_once = at_once.clamp(1 << 16, points.len().max(1 << 16));
    let mut seeds = Seeds {
        points,
        frame,
        per_side: 1.0 / frame.side,
        h: vec![0.0; points.len()],
        slope_factor: Vec::new(),
        along: None,
    };
    for first in (0..points.len()).step_by(at_once) {
        let sums = sums_from(first, at_once, points, triangles);
        seeds.take_sums(first, &sums, targets.slope_factor_max());
    }
    if seeds.h.iter().all(|&h| h == 0.0) || !frame.side.is_normal() {
        return Err(SizingError::NoEdges);
    }
    seeds.along = edge_seeds(&seeds, triangles, targets, at_vertices, scratch);
    let given = at_vertices.into_iter().flatten();
    for (seed, &h) in seeds.h.iter_mut().zip(given) {
        *seed = seed.min(h / frame.side);
    }
    Ok(seeds)
}

/// For a vertex: the number of its edges' ends, the sum of their lengths, the sum of their inverse lengths, the
/// longest.
type WeightedSums = [f64; 4];

/// Sums of the vertices from `first` on.
fn sums_from(
    first: usize,
    n: usize,
    points: &[Point],
    triangles: &[[u32; 3]],
) -> Vec<WeightedSums> {
    let n = n.min(points.len() - first);
    let mut sums = vec![[0.0f64; 4]; n];
    for t in triangles {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let ends = [t[i] as usize, t[j] as usize];
            let here = ends.map(|v| v.wrapping_sub(first));
            if here.iter().all(|&v| v >= n) {
                continue;
            }
            let length = points[ends[0]].distance(points[ends[1]]);
            if length > 0.0 && (1.0 / length).is_finite() {
                for v in here.into_iter().filter(|&v| v < n) {
                    let [ends, sum, inverse, longest] = sums[v];
                    let longest = longest.max(length);
                    sums[v] = [ends + 1.0, sum + length, inverse + 1.0 / length, longest];
                }
            }
        }
    }
    sums
}

impl Seeds<'_> {
    fn take_sums(&mut self, first: usize, sums: &[WeightedSums], slope_factor_max: f64) {
        for (v, &[ends, sum, inverse, longest]) in (first..).zip(sums) {
            if ends == 0.0 {
                continue;
            }
            let h = (sum / inverse).sqrt().max(MEAN_SHARE * sum / ends);
            self.h[v] = h * self.per_side;
            let slope_factor = (longest / (NEEDLE_FROM * h)).clamp(1.0, slope_factor_max);
            if slope_factor > 1.0 {
                if self.slope_factor.is_empty() {
                    self.slope_factor = vec![1.0; self.h.len()];
                }
                self.slope_factor[v] = slope_factor as f32;
            }
        }
    }
}
