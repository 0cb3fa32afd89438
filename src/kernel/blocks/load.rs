//! Samples of the load: where the tetrahedra of the finished mesh will be.

use rayon::prelude::*;

use super::field::Field;
use crate::mesh::anatomy::EDGES;
use crate::mesh::{Mesh, dense, sparse};
use crate::sizing::TETS_PER_LOAD;
use tetdb_base::geom::{Point, mix, orient};
use tetdb_base::storage::{Pages, parallel, spare_threads};

/// Most tetrahedra that a mesh has ids for. What is predicted to have more is not divided: its blocks would have no bound.
pub(super) const TETS_MAX: f64 = (1 << 30) as f64;
/// A coarse tetrahedron worth more is halved.
const WEIGHT_MAX: f64 = 8.0;
/// Halvings at most.
const DEPTH_MAX: u32 = 18;
/// Tetrahedra sampled as one part, and parts sampled at once.
const PART: usize = 4096;
const PARTS: usize = 16;
/// Samples kept. Where there are more, every second one goes, and the others count twice.
const SAMPLES_MAX: usize = 1 << 19;

/// Some predicted tetrahedra and their place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub at: Point,
    pub weight: f32,
}

impl Sample {
    /// A number that has nothing to do with the place.
    fn lot(&self) -> u64 {
        self.at.to_array().into_iter().fold(0, |lot, x| mix(lot ^ x.to_bits()))
    }
}

/// Samples the load to come of a coarse mesh. Their number is bounded.
pub(super) fn sample<P: Pages>(mesh: &mut Mesh<P>, field: &Field) -> Vec<Sample> {
    let mut samples = Samples::default();
    let mut tets = Vec::with_capacity(PART * PARTS);
    for t in (0..dense(mesh.tet_ids_end())).map(sparse) {
        let tet = mesh.tet(t);
        if tet.is_live() {
            let ends = mesh.ends(&tet);
            let mean = ends.iter().map(|e| f64::from(e.h)).sum::<f64>() * 0.25;
            tets.push((ends.map(|e| e.point), mean));
        }
        if tets.len() == PART * PARTS {
            samples.add(&tets, field);
            tets.clear();
        }
    }
    samples.add(&tets, field);
    samples.kept
}

#[derive(Default)]
struct Samples {
    kept: Vec<Sample>,
    /// How often half of the samples went.
    halvings: u32,
}

impl Samples {
    fn add(&mut self, tets: &[([Point; 4], f64)], field: &Field) {
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
        for mut sample in parts.into_iter().flatten() {
            if sample.lot() & ((1 << self.halvings) - 1) == 0 {
                sample.weight *= (1u64 << self.halvings) as f32;
                self.kept.push(sample);
            }
            if self.kept.len() >= SAMPLES_MAX {
                let bit = 1 << self.halvings;
                self.kept.retain(|s| s.lot() & bit == 0);
                self.kept.iter_mut().for_each(|s| s.weight *= 2.0);
                self.halvings += 1;
            }
        }
    }
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
