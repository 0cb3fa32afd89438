//! Samples of the load: where the tetrahedra of the finished mesh will be.
//!
//! A coarse tetrahedron is halved until its volume is small for the least of the lengths wanted at its corners. Lengths elsewhere would not do:
//! around a point of tiny length they are the same share of a piece's size at any scale, and most of the load lies there.

use rayon::prelude::*;

use super::field::Field;
use super::part::Part;
use super::scaffold::{COARSER, is_void};
use crate::mesh::anatomy::EDGES;
use crate::mesh::{Mesh, Scan, Tet, scan_parts, sparse, tets_of_page};
use crate::sizing::{TETS_PER_LOAD, density_of_tet};
use tetdb_base::geom::{Point, mix, orient};
use tetdb_base::storage::{Pages, StorageError, kind, parallel, raise, spare_threads};

/// Most tetrahedra that a mesh has ids for. What is predicted to have more is not divided: its blocks would have no bound.
const TETS_MAX: f64 = (1 << 30) as f64;
/// A piece worth more, for the least of the lengths at its corners, is halved: for samples, and to predict their sum alone.
const WEIGHT_MAX: f64 = 8.0;
const PREDICTED_MAX: f64 = 64.0;
/// Halvings of a piece at most: its edges are a millionth of the tetrahedron's then.
const DEPTH_MAX: u32 = 60;
/// Tetrahedra sampled as one part, and parts sampled at once at most.
const PART: usize = 4096;
const PARTS: usize = 16;
/// Samples kept. Where there are more, every second one goes, and the others count twice.
const SAMPLES_MAX: usize = 1 << 19;
/// Bytes of that many.
pub(super) const SAMPLES_BYTES: u64 = (SAMPLES_MAX * size_of::<Sample>()) as u64;

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

/// Corners of a tetrahedron and the lengths wanted there.
type SizedTet = ([Point; 4], [f64; 4]);

/// The load to come of a coarse mesh.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Load {
    /// Predicted tetrahedra. Of more than [`TETS_MAX`] not all are counted.
    pub tets: f64,
    /// Tetrahedra of the scaffold's lengths in place of those that are too long for it now.
    pub in_voids: f64,
}

/// Unwinds with an error if that many predicted tetrahedra are more than there are ids for.
pub(super) fn check(tets: f64) {
    if tets > TETS_MAX {
        raise(StorageError::TooMany { what: "tetrahedra" });
    }
}

/// Predicts the load.
pub(super) fn predict<P: Pages>(mesh: &mut Mesh<P>, field: &Field) -> Load {
    let pages: Vec<u32> = (0..mesh.pages().n_pages::<{ kind::TETS }>()).collect();
    let parts = scan_parts(mesh, &pages, &Predict(field));
    parts.into_iter().fold(Load::default(), |sum, part| Load {
        tets: sum.tets + part.tets,
        in_voids: sum.in_voids + part.in_voids,
    })
}

/// Scan that predicts the load of a page.
struct Predict<'a, 'b>(&'a Field<'b>);

impl Scan for Predict<'_, '_> {
    type Part = u32;
    type Output = Load;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Load {
        let mut load = Load::default();
        let mut open = Vec::new();
        tets_of_page(mesh, page, |mesh, _, tet| {
            let sized = sized(mesh, &tet);
            let before = load.tets;
            for_each_piece(sized, (self.0, PREDICTED_MAX), &mut open, |sample| {
                load.tets += f64::from(sample.weight);
                load.tets <= TETS_MAX
            });
            if is_void(&sized.0, &sized.1) {
                load.in_voids += (load.tets - before) / COARSER.powi(3);
            }
        });
        load
    }
}

fn sized<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet) -> SizedTet {
    let ends = mesh.ends(tet);
    (ends.map(|e| e.point), ends.map(|e| f64::from(e.h)))
}

/// Samples the load to come of a coarse mesh, or of a part of it. Their number is bounded.
pub(super) fn sample<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    part: Option<&Part>,
) -> Vec<Sample> {
    let mut samples = Samples::default();
    // Each part may have as many samples as the whole.
    let room = mesh.pages().bytes_used().map_or(u64::MAX, |[used, most]| most.saturating_sub(used));
    let parts = spare_threads().min(PARTS).min((room / 4 / SAMPLES_BYTES) as usize).max(1);
    let mut tets = Vec::with_capacity(PART * parts);
    let mut add = |mesh: &mut Mesh<P>, tet: &Tet| {
        tets.push(sized(mesh, tet));
        if tets.len() == PART * parts {
            samples.add_parts(&tets, field);
            tets.clear();
        }
    };
    match part {
        Some(part) => {
            for &k in &part.inside {
                let tet = mesh.tet(sparse(k));
                add(mesh, &tet);
            }
        }
        None => {
            let mut from = 0;
            while let Some((t, tet)) = mesh.next_tet(from) {
                from = t + 1;
                add(mesh, &tet);
            }
        }
    }
    samples.add_parts(&tets, field);
    samples.kept
}

/// Samples, thinned out by lot. Which ones are left depends on all that were added, not on how they were divided into parts.
#[derive(Default)]
struct Samples {
    kept: Vec<Sample>,
    /// How often half of the samples went.
    halvings: u32,
}

impl Samples {
    fn add_parts(&mut self, tets: &[SizedTet], field: &Field) {
        if tets.len() <= PART {
            self.add_tets(tets, field);
            return;
        }
        let part = |tets: &[SizedTet]| {
            let mut samples = Self::default();
            samples.add_tets(tets, field);
            samples
        };
        let parts: Vec<Self> = parallel(|| tets.par_chunks(PART).map(part).collect());
        parts.into_iter().for_each(|part| self.add_all(part));
    }

    fn add_all(&mut self, part: Self) {
        while self.halvings < part.halvings {
            self.halve();
        }
        for mut sample in part.kept {
            sample.weight /= (1u64 << part.halvings) as f32;
            self.add(sample);
        }
    }

    fn add_tets(&mut self, tets: &[SizedTet], field: &Field) {
        let mut open = Vec::new();
        let mut sum = 0.0;
        for &tet in tets {
            for_each_piece(tet, (field, WEIGHT_MAX), &mut open, |sample| {
                sum += f64::from(sample.weight);
                self.add(sample);
                sum <= TETS_MAX
            });
        }
    }

    fn add(&mut self, mut sample: Sample) {
        if sample.lot() & ((1 << self.halvings) - 1) == 0 {
            sample.weight *= (1u64 << self.halvings) as f32;
            self.kept.push(sample);
            while self.kept.len() >= SAMPLES_MAX {
                self.halve();
            }
        }
    }

    fn halve(&mut self) {
        let bit = 1 << self.halvings;
        self.kept.retain(|s| s.lot() & bit == 0);
        self.kept.iter_mut().for_each(|s| s.weight *= 2.0);
        self.halvings += 1;
    }
}

/// Calls `visit` with each piece of a tetrahedron, worth at most so much, until it returns false. `open` is empty before and after.
fn for_each_piece(
    tet: SizedTet,
    (field, weight_max): (&Field, f64),
    open: &mut Vec<(SizedTet, u32)>,
    mut visit: impl FnMut(Sample) -> bool,
) {
    open.push((tet, 0));
    while let Some(((q, sizes), depth)) = open.pop() {
        let at = (q[0] + q[1] + q[2] + q[3]) * 0.25;
        let volume = TETS_PER_LOAD / 6.0 * orient(q[0], q[1], q[2], q[3]);
        let least = sizes.into_iter().fold(f64::INFINITY, f64::min);
        let is_small = volume <= weight_max * least * least * least || depth == DEPTH_MAX;
        // No points come where the field does not reach.
        let is_out = field.place.is_partial() && !field.place.reaches(&q, &sizes.map(|h| h as f32));
        if is_small || is_out {
            let weight = if is_out { 1.0 } else { volume * density_of_tet(sizes) };
            // A whole one is there already.
            let weight = if depth == 0 { weight.max(1.0) } else { weight };
            if !visit(Sample { at, weight: weight as f32 }) {
                open.clear();
            }
            continue;
        }
        let length = |&[i, j]: &[usize; 2]| (q[i] - q[j]).length_squared();
        let longest = EDGES.into_iter().max_by(|a, b| length(a).total_cmp(&length(b)));
        let [i, j] = longest.expect("there are six edges");
        let middle = (q[i] + q[j]) * 0.5;
        let h = (field.h)(middle);
        let half = |end: usize| {
            let (mut q, mut sizes) = (q, sizes);
            (q[end], sizes[end]) = (middle, h);
            ((q, sizes), depth + 1)
        };
        open.push(half(i));
        open.push(half(j));
    }
}

#[cfg(test)]
mod tests {
    use super::super::placement::Everywhere;
    use super::*;
    use tetdb_base::geom::Aabb;

    #[test]
    fn most_of_the_load_lies_around_a_point_of_tiny_length() {
        let (least, slope) = (1e-4, 0.26);
        let h = |p: Point| least + slope * p.length();
        let corners = [Point::ZERO, Point::X, Point::Y, Point::Z];
        let bounds = Aabb::around(corners);
        let field = Field { h: &h, place: &Everywhere, bounds };
        // Lengths between corners are taken for linear, which is more than they are here.
        // In the ball that touches the far face in closed form; h is above 0.15 beyond.
        let x = slope / 3f64.sqrt() / least;
        let radial = (1.0 + x).ln() + 2.0 / (1.0 + x) - 0.5 / (1.0 + x).powi(2) - 1.5;
        let ball = std::f64::consts::FRAC_PI_2 * radial / slope.powi(3) * TETS_PER_LOAD;
        let beyond = TETS_PER_LOAD * (1.0 / 6.0 - 0.1) / 0.15f64.powi(3);
        for (weight_max, share) in [(WEIGHT_MAX, 0.85), (PREDICTED_MAX, 0.75)] {
            let mut sum = 0.0;
            for_each_piece((corners, corners.map(h)), (&field, weight_max), &mut vec![], |s| {
                sum += f64::from(s.weight);
                true
            });
            assert!(sum > share * ball && sum < 1.05 * (ball + beyond), "{sum} for {ball}");
        }
    }

    #[test]
    fn samples_are_those_of_one_part_however_many_there_are() {
        let h = |_: Point| 0.0014;
        let corners = [Point::ZERO, Point::X, Point::Y, Point::Z];
        let field = Field { h: &h, place: &Everywhere, bounds: Aabb::around(corners) };
        let tets: Vec<SizedTet> = (0..8)
            .map(|i| (corners.map(|p| p * 0.1 + Point::X * f64::from(i)), [0.0014; 4]))
            .collect();
        let mut one = Samples::default();
        one.add_tets(&tets, &field);
        let mut several = Samples::default();
        for part in tets.chunks(3) {
            let mut samples = Samples::default();
            samples.add_tets(part, &field);
            several.add_all(samples);
        }
        assert!(one.halvings > 0, "{} are too few", one.kept.len());
        let content = |s: &Samples| -> Vec<_> {
            s.kept.iter().map(|s| (s.at.to_array().map(f64::to_bits), s.weight)).collect()
        };
        assert_eq!(content(&one), content(&several));
    }
}
