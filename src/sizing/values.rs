//! Sizes at the octree's corners: gathered from the surface, filled in between, graded.

use super::SizingError;
use super::corners::Corners;
use super::options::Targets;
use super::seeds::Seed;
use super::tree::{LATTICE, Leaf, Tree};
use super::wishes::Wishes;
use crate::geom::Point;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Rounds of averaging that smooth what was filled in. The graph is shallow (cells grow with the
/// distance to the surface), so values are within 2 % of the limit after these.
const FILL_ROUNDS: u32 = 60;
/// Rounds of grading and closing hanging corners. The last ones change little; each costs as much as
/// the first.
const GRADE_ROUNDS: u32 = 4;
/// A hanging corner's mean may exceed its graded value by this factor: the bound on slopes is stated
/// with more room, and at 1.001 every round finds something left to lower.
const EXCESS_MAX: f32 = 1.01;
/// Pairs of corners of a cell with the squared distance in sides: all 28 of them.
const PAIRS: [(u8, u8, u8); 28] = pairs();
/// The twelve edges of a cell come first in `PAIRS`.
const N_EDGES: usize = 12;

const fn pairs() -> [(u8, u8, u8); 28] {
    let mut list = [(0, 0, 0); 28];
    let mut n = 0;
    let mut distance2 = 1;
    while distance2 <= 3 {
        let mut a = 0u8;
        while a < 8 {
            let mut b = a + 1;
            while b < 8 {
                if (a ^ b).count_ones() == distance2 {
                    list[n] = (a, b, distance2 as u8);
                    n += 1;
                }
                b += 1;
            }
            a += 1;
        }
        distance2 += 1;
    }
    list
}

/// Sizes at all corners, in units of the root's side, no steeper than the gradation along any line
/// between two corners of a leaf.
pub(super) fn corner_values(
    tree: &Tree,
    leaves: &[Leaf],
    corners: &Corners,
    seeds: &[Seed],
    targets: &Targets,
    wishes: &Wishes,
) -> Result<Vec<f32>, SizingError> {
    let (gathered, nearest) = gather(tree, leaves, corners, seeds);
    let grading = Grading::new(leaves, corners, targets.beta);
    let mut h = if targets.hsiz.is_some() {
        gathered.clone()
    } else {
        fill(leaves, corners, &gathered)
    };
    if targets.any() {
        let [lower, upper] = grading.cones(&gathered, &nearest);
        for (i, h) in h.iter_mut().enumerate() {
            let wanted = targets.interior(f64::from(*h)) as f32;
            *h = wanted.max(lower[i]).min(upper[i]);
        }
    }
    wishes.lower(leaves, corners, &mut h)?;
    grading.grade_closed(&mut h);
    Ok(h)
}

/// Sizes at all corners that are those of `wishes`, joined to the seeds' sizes by the gradation: near the seeds neither
/// finer nor coarser than it allows. Where nothing is wished, what is wished around it.
pub(super) fn corner_values_within(
    tree: &Tree,
    leaves: &[Leaf],
    corners: &Corners,
    seeds: &[Seed],
    beta: f64,
    wishes: &Wishes,
) -> Result<Vec<f32>, SizingError> {
    let (gathered, nearest) = gather(tree, leaves, corners, seeds);
    let grading = Grading::new(leaves, corners, beta);
    let mut wished = vec![f32::INFINITY; corners.n_corners];
    wishes.lower(leaves, corners, &mut wished)?;
    let mut h = fill(leaves, corners, &wished);
    let [lower, upper] = grading.cones(&gathered, &nearest);
    for (i, h) in h.iter_mut().enumerate() {
        *h = h.max(lower[i]).min(upper[i]);
    }
    grading.grade_closed(&mut h);
    Ok(h)
}

/// Weighted means of the seeds' sizes at the corners of the leaves that hold them, infinite elsewhere;
/// and distances from there to the nearest of these seeds.
///
/// What falls on a hanging corner is handed to the corners it hangs on.
fn gather(tree: &Tree, leaves: &[Leaf], corners: &Corners, seeds: &[Seed]) -> (Vec<f32>, Vec<f64>) {
    let mut sums = vec![[0.0f64; 2]; corners.n_corners];
    let mut nearest = vec![f64::INFINITY; corners.n_corners];
    for seed in seeds {
        let cell = lattice_cell(seed.at);
        let (number, _) = tree.leaf_at(cell);
        let leaf = &leaves[number as usize];
        let local = (seed.at - leaf.low()) * (1.0 / leaf.side());
        for (c, &id) in corners.of_leaf[number as usize].iter().enumerate() {
            let weight = corner_weight(local, c);
            sums[id as usize][0] += weight * seed.h;
            sums[id as usize][1] += weight;
            let distance = (local - corner_place(c)).length() * leaf.side();
            nearest[id as usize] = distance.min(nearest[id as usize]);
        }
    }
    for hanging in corners.hanging.iter().rev() {
        let [sum, weight] = std::mem::take(&mut sums[hanging.corner as usize]);
        for on in hanging.on {
            sums[on as usize][0] += 0.25 * sum;
            sums[on as usize][1] += 0.25 * weight;
            let distance = nearest[hanging.corner as usize] + hanging.distance();
            nearest[on as usize] = distance.min(nearest[on as usize]);
        }
    }
    let means = sums
        .iter()
        .map(|[sum, weight]| {
            if *weight > 0.0 {
                (sum / weight) as f32
            } else {
                f32::INFINITY
            }
        })
        .collect();
    (means, nearest)
}

fn corner_place(corner: usize) -> Point {
    let at = |axis: usize| (corner >> axis & 1) as f64;
    Point::new(at(0), at(1), at(2))
}

/// The lattice cell of a position in the unit cube.
#[inline]
pub(super) fn lattice_cell(at: Point) -> [u32; 3] {
    (at * f64::from(LATTICE))
        .to_array()
        .map(|x| (x as u32).min(LATTICE - 1))
}

fn corner_weight(local: Point, corner: usize) -> f64 {
    (0..3).fold(1.0, |weight, axis| {
        let x = local[axis].clamp(0.0, 1.0);
        weight * if corner >> axis & 1 == 1 { x } else { 1.0 - x }
    })
}

/// Fills the corners that have no value: fronts of averages of their neighbors, then averaging of all
/// filled ones among themselves, which tends to the harmonic interpolation.
fn fill(leaves: &[Leaf], corners: &Corners, gathered: &[f32]) -> Vec<f32> {
    let mut h = gathered.to_vec();
    // Leaves with a corner to fill, as (leaf, weight): a cell's edge conducts as its width.
    let open: Vec<(u32, f32)> = (0..leaves.len())
        .filter(|&i| {
            let ids = corners.of_leaf[i];
            ids.iter().any(|&c| gathered[c as usize].is_infinite())
        })
        .map(|i| (i as u32, leaves[i].side() as f32))
        .collect();
    let mut sums = vec![[0.0f32; 2]; if open.is_empty() { 0 } else { h.len() }];
    let mut smooth = 0;
    while !open.is_empty() && smooth < FILL_ROUNDS {
        sums.fill([0.0; 2]);
        for &(leaf, weight) in &open {
            let ids = &corners.of_leaf[leaf as usize];
            for &(a, b, _) in &PAIRS[..N_EDGES] {
                let (a, b) = (ids[a as usize] as usize, ids[b as usize] as usize);
                for (to, from) in [(a, b), (b, a)] {
                    if h[from].is_finite() {
                        sums[to][0] += weight * h[from];
                        sums[to][1] += weight;
                    }
                }
            }
        }
        let mut complete = true;
        for (i, &[sum, weight]) in sums.iter().enumerate() {
            if gathered[i].is_infinite() && weight > 0.0 {
                complete &= h[i].is_finite();
                h[i] = sum / weight;
            }
        }
        close_finite(corners, &mut h);
        smooth += u32::from(complete);
    }
    h
}

/// Gives hanging corners their means, where these are known.
fn close_finite(corners: &Corners, h: &mut [f32]) {
    for hanging in &corners.hanging {
        let mean = mean_on(hanging.on, h);
        if mean.is_finite() {
            h[hanging.corner as usize] = mean;
        }
    }
}

fn mean_on(on: [u32; 4], h: &[f32]) -> f32 {
    let [a, b, c, d] = on.map(|v| f64::from(h[v as usize]));
    ((a + b + c + d) * 0.25) as f32
}

/// The slope bound between corners of the same leaf.
struct Grading<'a> {
    leaves: &'a [Leaf],
    corners: &'a Corners,
    /// Leaves around corner c: `around[starts[c]..starts[c + 1]]`.
    starts: Vec<u32>,
    around: Vec<u32>,
    beta: f64,
}

impl<'a> Grading<'a> {
    fn new(leaves: &'a [Leaf], corners: &'a Corners, beta: f64) -> Self {
        let mut starts = vec![0u32; corners.n_corners + 1];
        for &id in corners.of_leaf.iter().flatten() {
            starts[id as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut around = vec![0u32; 8 * leaves.len()];
        for (leaf, ids) in corners.of_leaf.iter().enumerate() {
            for &id in ids {
                around[next[id as usize] as usize] = leaf as u32;
                next[id as usize] += 1;
            }
        }
        Self {
            leaves,
            corners,
            starts,
            around,
            beta,
        }
    }

    /// What the gradation allows beside sizes at some corners, each at a distance from where it holds: the least, the most.
    fn cones(&self, gathered: &[f32], nearest: &[f64]) -> [Vec<f32>; 2] {
        [-1.0f32, 1.0].map(|sign| {
            let starts = gathered.iter().zip(nearest);
            let mut cone: Vec<f32> = starts
                .map(|(&h, &d)| match h.is_finite() {
                    true => bound(sign * h, self.beta * d),
                    false => f32::INFINITY,
                })
                .collect();
            self.grade(&mut cone);
            cone.iter_mut().for_each(|h| *h *= sign);
            cone
        })
    }

    /// Largest differences in a leaf, by squared distance of corners in sides.
    fn steps(&self, leaf: usize) -> [f64; 4] {
        let step = self.beta * self.leaves[leaf].side();
        [0.0, step, step * 2f64.sqrt(), step * 3f64.sqrt()]
    }

    /// Lowers values until no two corners of a leaf differ by more than the slope allows.
    ///
    /// The result is the largest such function below the given values, whatever the order.
    fn grade(&self, h: &mut [f32]) {
        let mut heap = BinaryHeap::new();
        let mut pushed = vec![false; h.len()];
        for (leaf, ids) in self.corners.of_leaf.iter().enumerate() {
            let steps = self.steps(leaf);
            for &(a, b, distance2) in &PAIRS {
                let (a, b) = (ids[a as usize], ids[b as usize]);
                let low = if h[a as usize] <= h[b as usize] { a } else { b };
                let (x, y) = (h[low as usize], h[(a ^ b ^ low) as usize]);
                if !pushed[low as usize] && bound(x, steps[distance2 as usize]) < y {
                    pushed[low as usize] = true;
                    heap.push(Reverse((ordered(x), low)));
                }
            }
        }
        let mut last = None;
        while let Some(Reverse((key, corner))) = heap.pop() {
            let value = h[corner as usize];
            // Outdated: the corner was lowered since. Or a repetition, which follows at once.
            if ordered(value) != key || last == Some((key, corner)) {
                continue;
            }
            last = Some((key, corner));
            let range = self.starts[corner as usize]..self.starts[corner as usize + 1];
            for &leaf in &self.around[range.start as usize..range.end as usize] {
                let ids = &self.corners.of_leaf[leaf as usize];
                let steps = self.steps(leaf as usize);
                let Some(own) = ids.iter().position(|&id| id == corner) else {
                    continue;
                };
                for (other, &id) in ids.iter().enumerate() {
                    let bound = bound(value, steps[(own ^ other).count_ones() as usize]);
                    if bound < h[id as usize] {
                        h[id as usize] = bound;
                        heap.push(Reverse((ordered(bound), id)));
                    }
                }
            }
        }
    }

    /// Grades, and gives hanging corners their means: lowering only, so that both hold in the end.
    ///
    /// A mean above its graded value lowers the largest of the corners it is taken from, none of them
    /// below that value: so the smallest value of all stays what it is.
    fn grade_closed(&self, h: &mut [f32]) {
        for _ in 0..GRADE_ROUNDS {
            self.grade(h);
            let mut changed = false;
            for hanging in self.corners.hanging.iter().rev() {
                let own = h[hanging.corner as usize];
                if mean_on(hanging.on, h) > own * EXCESS_MAX {
                    changed = true;
                    let level = level_for_mean(hanging.distinct(), h, own);
                    for &on in hanging.distinct() {
                        h[on as usize] = h[on as usize].min(level);
                    }
                }
            }
            close_finite(self.corners, h);
            if !changed {
                break;
            }
        }
    }
}

/// The level at which to cut the values of some corners so that their mean becomes `wanted`, which is
/// below the present mean.
fn level_for_mean(on: &[u32], h: &[f32], wanted: f32) -> f32 {
    let mut values = [f64::INFINITY; 4];
    for (value, &corner) in values.iter_mut().zip(on) {
        *value = f64::from(h[corner as usize]);
    }
    values.sort_unstable_by(f64::total_cmp);
    let mut rest = f64::from(wanted) * on.len() as f64;
    for (i, &value) in values[..on.len()].iter().enumerate() {
        let level = rest / (on.len() - i) as f64;
        if level <= value {
            return level as f32;
        }
        rest -= value;
    }
    wanted
}

/// The largest value allowed at a step from `value`.
fn bound(value: f32, step: f64) -> f32 {
    (f64::from(value) + step) as f32
}

/// A number that sorts as the value does, negative ones too.
fn ordered(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 {
        !bits
    } else {
        bits | 1 << 31
    }
}
