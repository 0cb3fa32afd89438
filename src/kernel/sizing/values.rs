//! Sizes at the octree's corners: gathered from the surface, filled in between, graded.

use fixedbitset::FixedBitSet;
use rayon::prelude::*;

use super::SizingError;
use super::constraints::SizeConstraints;
use super::corners::TreeCorners;
use super::grading::{Grading, bound, close_finite};
use super::options::Targets;
use super::parts::{CornerParts, OfLeaves, PartLeaves, PartWork};
use super::seeds::Seeds;
use super::tree::{LATTICE, Leaf, Tree};
use tetdb_base::geom::Point;
use tetdb_base::storage::{
    OrRaise, ScratchSpace, SortRecord, SpillVec, check_cancelled, parallel, sort_record,
};

/// Rounds of averaging that smooth filled values. The graph is shallow (cells grow with the distance to the surface).
/// After these rounds, the number of tetrahedra expected of a scanned skull is within 0.4 % of the limit.
const FILL_ROUNDS: u32 = 18;
/// Share of the slowest part of the error that plain averaging leaves after a round. Sixty rounds of plain averaging
/// would do no better than these, which use the round before as well (the Chebyshev semi-iteration: Golub, Varga 1961).
const SLOWEST: f32 = 0.98;
/// Largest factor between a value and the mean of its neighbors.
const REACH: f32 = 2.0;
/// Seeds whose leaves are found together.
const SEEDS_AT_ONCE: usize = 1 << 16;
/// For each corner of a cell, the three corners at the other ends of its edges.
const ALONG_EDGES: [[u8; 3]; 8] =
    [[1, 2, 4], [0, 3, 5], [0, 3, 6], [1, 2, 7], [0, 5, 6], [1, 4, 7], [2, 4, 7], [3, 5, 6]];

sort_record! {
    /// A seed and the leaf that holds it.
    struct LeafSeed {
        leaf: u32,
        seed: u32,
    }
}

/// Computes sizes at corners from these parts.
pub(super) struct CornerSizes<'a> {
    pub tree: &'a Tree,
    pub corners: &'a mut TreeCorners,
    pub seeds: &'a Seeds<'a>,
    pub beta: f64,
    /// By leaf, how many times `beta` its slope may be; once where it is not given.
    pub slope_factor: Option<SpillVec<f32>>,
    pub scratch: &'a ScratchSpace,
    /// All leaves, once they were needed.
    pub parts: Option<CornerParts>,
}

impl CornerSizes<'_> {
    /// Sizes at all corners, in units of the root's side, no steeper than the gradation along any line
    /// between two corners of a leaf.
    pub fn values(
        &mut self,
        targets: &Targets,
        constraints: &SizeConstraints,
    ) -> Result<SpillVec<f32>, SizingError> {
        let (mut gathered, nearest) = self.gather(|seeds, v| seeds.h(v));
        let [mut upper, mut lower] = self.cones(&mut gathered, nearest);
        let mut h = match targets.hsiz {
            Some(_) => gathered,
            None => self.fill(gathered),
        };
        for i in 0..h.len() {
            let wanted = targets.interior(f64::from(h.get(i))) as f32;
            h.set(i, wanted.max(lower.get(i)).min(upper.get(i)));
        }
        constraints.lower(self.tree, self.corners, &mut h)?;
        self.grading().grade_closed(&mut h);
        Ok(h)
    }

    /// Lets leaves near needles be steeper, as the seeds allow it in the mean: gathered and filled in as sizes are.
    pub fn gather_slope_factors(&mut self) {
        if !self.seeds.has_slope_factors() {
            return;
        }
        let (at_seeds, _) = self.gather(|seeds, v| seeds.slope_factor(v));
        let mut at_corners = self.fill(at_seeds);
        let mut by_leaf = self.scratch.vec(self.corners.of_leaf.len(), 1.0f32);
        for i in 0..by_leaf.len() {
            let ids = self.corners.of_leaf.get(i);
            let sum: f64 = (ids.iter()).map(|&id| f64::from(at_corners.get(id as usize))).sum();
            by_leaf.set(i, (sum / 8.0) as f32);
        }
        self.slope_factor = Some(by_leaf);
    }

    /// Weighted means of a value of the seeds at the corners of the leaves that hold them, and distances from there to
    /// the nearest of these seeds; infinite elsewhere.
    ///
    /// Seeds are taken leaf by leaf, those of a leaf in their order. The share of a hanging corner goes to the corners
    /// it hangs on.
    pub fn gather(&mut self, value: impl Fn(&Seeds, u32) -> f64) -> (SpillVec<f32>, SpillVec<f64>) {
        let (tree, seeds, n) = (self.tree, self.seeds, self.corners.n_corners);
        let mut by_leaf = self.scratch.sorter::<LeafSeed>();
        let mut all = seeds.all();
        loop {
            let some: Vec<u32> = all.by_ref().take(SEEDS_AT_ONCE).collect();
            if some.is_empty() {
                break;
            }
            let in_leaf = |&seed: &u32| {
                let (leaf, _) = tree.leaf_at(lattice_cell(seeds.at(seed)));
                LeafSeed { leaf, seed }.to_bytes()
            };
            let found: Vec<_> = parallel(|| some.par_iter().map(in_leaf).collect());
            by_leaf.extend(&found).or_raise();
        }
        let by_leaf = by_leaf.finish().or_raise();
        let mut sums = self.scratch.vec(n, [0.0f64; 2]);
        let mut nearest = self.scratch.vec(n, f64::INFINITY);
        for next in by_leaf {
            let LeafSeed { seed, .. } = next.or_raise();
            let (at, h) = (seeds.at(seed), value(seeds, seed));
            let cell = lattice_cell(at);
            let (number, level) = tree.leaf_at(cell);
            let anchor = cell.map(|x| x & !((LATTICE >> level) - 1));
            let leaf = Leaf { anchor, level };
            let local = (at - leaf.low()) * (1.0 / leaf.side());
            let ids = self.corners.of_leaf.get(number as usize);
            for (c, id) in ids.into_iter().enumerate() {
                let weight = corner_weight(local, c);
                sums.change(id as usize, |sum| {
                    *sum = [sum[0] + weight * h, sum[1] + weight];
                });
                let distance = (local - corner_place(c)).length() * leaf.side();
                nearest.change(id as usize, |d| *d = distance.min(*d));
            }
        }
        let hanging = &mut self.corners.hanging;
        for k in (0..hanging.len()).rev() {
            let hanging = hanging.get(k);
            let [sum, weight] = sums.get(hanging.corner as usize);
            sums.set(hanging.corner as usize, [0.0; 2]);
            for on in hanging.on {
                sums.change(on as usize, |s| {
                    *s = [s[0] + 0.25 * sum, s[1] + 0.25 * weight];
                });
            }
            let distance = nearest.get(hanging.corner as usize) + hanging.distance();
            for on in hanging.on {
                nearest.change(on as usize, |d| *d = distance.min(*d));
            }
        }
        let mut means = self.scratch.vec(n, f32::INFINITY);
        for i in 0..n {
            let [sum, weight] = sums.get(i);
            if weight > 0.0 {
                means.set(i, (sum / weight) as f32);
            }
        }
        (means, nearest)
    }

    /// Fills the corners that have no value: fronts of averages of their neighbors, then averaging of all
    /// filled ones among themselves, which tends to the harmonic interpolation.
    pub fn fill(&mut self, gathered: SpillVec<f32>) -> SpillVec<f32> {
        let mut h = gathered;
        let mut is_open = FixedBitSet::with_capacity(h.len());
        for i in 0..h.len() {
            if h.get(i).is_infinite() {
                is_open.insert(i);
            }
        }
        let is_due = |ids: &[u32; 8]| ids.iter().any(|&c| is_open.contains(c as usize));
        let open = CornerParts::new(self.tree, self.corners, self.scratch, is_due);
        if open.is_empty() {
            return h;
        }
        // Values of the round before.
        let mut before = self.scratch.vec(h.len(), 0.0f32);
        let (mut smooth, mut over) = (0, 1.0);
        while smooth < FILL_ROUNDS {
            check_cancelled();
            over = match smooth {
                0 => 1.0,
                1 => 1.0 / (1.0 - 0.5 * SLOWEST * SLOWEST),
                _ => 1.0 / (1.0 - 0.25 * SLOWEST * SLOWEST * over),
            };
            let of = OfLeaves { ids: &self.corners.of_leaf, slope_factor: None };
            let reached = open.change(of, &h, &mut before, &Average { is_open: &is_open, over });
            std::mem::swap(&mut h, &mut before);
            close_finite(self.corners, &mut h);
            smooth += u32::from(!reached);
        }
        h
    }

    pub fn grading(&mut self) -> Grading<'_> {
        let all = || CornerParts::new(self.tree, self.corners, self.scratch, |_| true);
        Grading {
            parts: self.parts.get_or_insert_with(all),
            corners: self.corners,
            beta: self.beta,
            slope_factor: self.slope_factor.as_ref(),
        }
    }

    /// Upper and lower bounds that the gradation sets around corners with sizes; `nearest` is the distance of each
    /// corner from the place of its size.
    ///
    /// Without the lower bound, few fine triangles in a coarse surface keep the whole interior fine: averages fall with
    /// the inverse distance. It starts from the least size of neighboring corners, so that one large triangle among small
    /// ones raises nothing. Without that step scans lose 3 to 7 % of their tetrahedra; with a second one the lower bound
    /// ends too near to small faces of CAD surfaces.
    pub fn cones(
        &mut self,
        gathered: &mut SpillVec<f32>,
        mut nearest: SpillVec<f64>,
    ) -> [SpillVec<f32>; 2] {
        let least = self.least_of_neighbors(gathered);
        [(1.0, gathered), (-1.0, &mut { least })].map(|(sign, from)| {
            let mut cone = self.scratch.vec(from.len(), f32::INFINITY);
            for i in 0..cone.len() {
                let h = from.get(i);
                if h.is_finite() {
                    cone.set(i, bound(sign * h, self.beta * nearest.get(i)));
                }
            }
            self.grading().grade(&mut cone);
            for i in 0..cone.len() {
                cone.change(i, |h| *h *= sign);
            }
            cone
        })
    }

    /// The least size at the corners of the leaves around each corner with a size; infinite at the others.
    fn least_of_neighbors(&mut self, sizes: &mut SpillVec<f32>) -> SpillVec<f32> {
        let mut least = self.scratch.vec(sizes.len(), f32::INFINITY);
        for i in 0..self.corners.of_leaf.len() {
            let ids = self.corners.of_leaf.get(i).map(|id| id as usize);
            let at_leaf = ids.iter().fold(f32::INFINITY, |least, &id| least.min(sizes.get(id)));
            for id in ids {
                if sizes.get(id).is_finite() {
                    least.change(id, |h| *h = h.min(at_leaf));
                }
            }
        }
        least
    }
}

/// One round of averaging: from values and those of the round before to the next.
struct Average<'a> {
    is_open: &'a FixedBitSet,
    over: f32,
}

impl PartWork for Average<'_> {
    /// Returns whether a corner got its first value.
    fn run(
        &self,
        leaves: &mut PartLeaves,
        first: usize,
        h: &mut impl FnMut(usize) -> f32,
        own: &mut [f32],
    ) -> bool {
        let mut sums = vec![[0.0f32; 2]; own.len()];
        for k in 0..leaves.len() {
            let (leaf, ids) = leaves.at(k);
            // A cell's edge conducts as its width.
            let weight = leaf.side() as f32;
            let mut values = [0.0; 8];
            for (value, &id) in values.iter_mut().zip(&ids) {
                *value = weight * h(id as usize);
            }
            for (&id, along) in ids.iter().zip(ALONG_EDGES) {
                let sum = sums.get_mut((id as usize).wrapping_sub(first));
                if let Some(sum) = sum.filter(|_| self.is_open.contains(id as usize)) {
                    for corner in along {
                        let value = values[corner as usize];
                        if value.is_finite() {
                            *sum = [sum[0] + value, sum[1] + weight];
                        }
                    }
                }
            }
        }
        let mut reached = false;
        for ((i, before), [sum, weight]) in (first..).zip(own).zip(sums) {
            let old = h(i);
            let older = std::mem::replace(before, old);
            if weight > 0.0 {
                reached |= old.is_infinite();
                let mean = sum / weight;
                // Next to steep steps, and at corners that hang between others, extrapolation would run away, even below
                // zero.
                let next = match self.over > 1.0 {
                    true => older + self.over * (mean - older),
                    false => mean,
                };
                *before = next.clamp(mean / REACH, mean * REACH);
            }
        }
        reached
    }
}

fn corner_place(corner: usize) -> Point {
    let at = |axis: usize| (corner >> axis & 1) as f64;
    Point::new(at(0), at(1), at(2))
}

/// The lattice cell of a position in the unit cube.
#[inline]
pub(super) fn lattice_cell(at: Point) -> [u32; 3] {
    (at * f64::from(LATTICE)).to_array().map(|x| (x as u32).min(LATTICE - 1))
}

fn corner_weight(local: Point, corner: usize) -> f64 {
    (0..3).fold(1.0, |weight, axis| {
        let x = local[axis].clamp(0.0, 1.0);
        weight * if corner >> axis & 1 == 1 { x } else { 1.0 - x }
    })
}
