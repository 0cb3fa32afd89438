//! A slab with low steps, like those from rounded offsets in CAD parts.
//!
//! ```text
//!          _______            Each column ends at a height of its own, a share `step` of the slab's length off its
//!   ______|       |____       neighbors'. The step's two triangles are that low and as long as the slab is deep; on the
//!  |      |       |    |      slab's side, which bottom and top columns share, triangles have edges that short.
//!  |______|_______|____|
//! ```

use super::build::Builder;
use super::build::triangles_checked;
use super::prism::{Flat, Prism, pieces};
use super::random::Random;
use super::{Sample, SampleError};
use tetdb_base::geom::Point;

/// Height and depth of the slab, whose length is 1.
const HEIGHT: f64 = 0.1;
const DEPTH: f64 = 0.6;
/// No step is lower than this part of the highest.
const LEAST: f64 = 0.5;

/// `steps,count=5,step=1e-7,seed=1`: columns, and their steps as a share of the slab's length. Five columns have 60 triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    pub count: usize,
    pub step: f64,
    pub seed: u64,
}

impl Steps {
    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        triangles_checked("steps", 12.0 * self.count as f64, bytes_max)?;
        let mut random = Random::new(self.seed);
        let widths = pieces(self.count, || LEAST + random.unit());
        let mut height = HEIGHT;
        let heights: Vec<f64> = (0..self.count)
            .map(|_| {
                let step = self.step * (LEAST + (1.0 - LEAST) * random.unit());
                // Many high steps in one direction would leave nothing of the slab.
                let is_up = match height {
                    h if h < 0.5 * HEIGHT => true,
                    h if h > 1.5 * HEIGHT => false,
                    _ => random.unit() < 0.5,
                };
                height += if is_up { step } else { -step };
                height
            })
            .collect();
        let side = side(&widths, &heights);
        let mut build = Builder::default();
        let labels = ["back", "front", "around"].map(|name| build.label(name));
        let prism = Prism { at: &|x, z, y| Point::new(x, -y, z), heights: [-DEPTH, 0.0], labels };
        prism.push(&mut build, &side, &side.triangles);
        Ok(build.finish())
    }
}

/// The slab's side, column by column, without a point that the slab would not have.
fn side(widths: &[f64], heights: &[f64]) -> Flat {
    let mut flat = Flat { points: Vec::new(), triangles: Vec::new() };
    let mut x = 0.0;
    let mut left = chain(&mut flat, x, &heights[..1]);
    for (i, &width) in widths.iter().enumerate() {
        x += width;
        // Where two columns meet, the lower one's corner is on the higher one's side.
        let next = heights.get(i + 1).copied();
        let mut ends: Vec<f64> = [Some(heights[i]), next].into_iter().flatten().collect();
        ends.sort_unstable_by(f64::total_cmp);
        let right = chain(&mut flat, x, &ends);
        let below = |chain: &[u32]| -> Vec<u32> {
            let is_below = |v: &u32| flat.points[*v as usize][1] <= heights[i];
            chain.iter().copied().filter(is_below).collect()
        };
        let (of_left, of_right) = (below(&left), below(&right));
        zip(&mut flat, &of_left, &of_right);
        left = right;
    }
    flat
}

/// Points above each other, the lowest at the bottom.
fn chain(flat: &mut Flat, x: f64, heights: &[f64]) -> Vec<u32> {
    let first = flat.points.len() as u32;
    flat.points.push([x, 0.0]);
    flat.points.extend(heights.iter().map(|&z| [x, z]));
    (first..flat.points.len() as u32).collect()
}

/// Triangles between two chains, each time to the lower of the next points.
fn zip(flat: &mut Flat, left: &[u32], right: &[u32]) {
    let (mut i, mut j) = (0, 0);
    let height = |v: u32, flat: &Flat| flat.points[v as usize][1];
    while i + 1 < left.len() || j + 1 < right.len() {
        let goes_right = match (left.get(i + 1), right.get(j + 1)) {
            (Some(&l), Some(&r)) => height(r, flat) <= height(l, flat),
            (None, _) => true,
            (_, None) => false,
        };
        if goes_right {
            flat.triangles.push([left[i], right[j], right[j + 1]]);
            j += 1;
        } else {
            flat.triangles.push([left[i], right[j], left[i + 1]]);
            i += 1;
        }
    }
}
