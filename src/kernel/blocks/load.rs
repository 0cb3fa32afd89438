//! Samples of the load: where the tetrahedra of the finished mesh will be.

use rayon::prelude::*;

use crate::mesh::anatomy::EDGES;
use crate::refine::Field;
use crate::sizing::TETS_PER_LOAD;
use tetdb_base::geom::{Point, orient};
use tetdb_base::storage::{parallel, spare_threads};

/// A coarse tetrahedron worth more is halved.
const WEIGHT_MAX: f64 = 8.0;
/// Halvings at most.
const DEPTH_MAX: u32 = 18;
/// Tetrahedra sampled as one part.
const PART: usize = 4096;

/// Some predicted tetrahedra and their place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub at: Point,
    pub weight: f32,
}

/// Samples the load of coarse tetrahedra, given by their corners and the mean of the wanted lengths there.
pub(super) fn sample(tets: &[([Point; 4], f64)], field: &Field) -> Vec<Sample> {
    let part = |tets: &[([Point; 4], f64)]| {
        let mut samples = Vec::new();
        let mut open = Vec::new();
        for &(corners, mean) in tets {
            add(corners, mean, field, &mut open, &mut samples);
        }
        samples
    };
    let parts: Vec<Vec<Sample>> = match spare_threads() {
        1 => tets.chunks(PART).map(part).collect(),
        _ => parallel(|| tets.par_chunks(PART).map(part).collect()),
    };
    parts.concat()
}

fn add(
    corners: [Point; 4],
    mean: f64,
    field: &Field,
    open: &mut Vec<([Point; 4], u32)>,
    samples: &mut Vec<Sample>,
) {
    let volume = |[a, b, c, d]: [Point; 4]| orient(a, b, c, d) / 6.0 * TETS_PER_LOAD;
    let center = |[a, b, c, d]: [Point; 4]| (a + b + c + d) * 0.25;
    let weight = volume(corners) / (mean * mean * mean);
    if weight <= WEIGHT_MAX * 0.5 {
        // It is there already.
        samples.push(Sample { at: center(corners), weight: weight.max(1.0) as f32 });
        return;
    }
    open.push((corners, 0));
    while let Some((q, depth)) = open.pop() {
        let at = center(q);
        let length = (field.h)(at);
        if field.place.is_partial() && !field.place.reaches(&q, &[length as f32; 4]) {
            // No points come here.
            samples.push(Sample { at, weight: 1.0 });
            continue;
        }
        let weight = volume(q) / (length * length * length);
        if weight <= WEIGHT_MAX || depth == DEPTH_MAX {
            samples.push(Sample { at, weight: weight as f32 });
            continue;
        }
        let length = |&[i, j]: &[usize; 2]| (q[i] - q[j]).length_squared();
        let longest = EDGES.into_iter().max_by(|a, b| length(a).total_cmp(&length(b)));
        let [i, j] = longest.expect("there are six edges");
        let middle = (q[i] + q[j]) * 0.5;
        let (mut a, mut b) = (q, q);
        a[i] = middle;
        b[j] = middle;
        open.push((a, depth + 1));
        open.push((b, depth + 1));
    }
}
