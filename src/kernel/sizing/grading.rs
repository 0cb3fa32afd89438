//! Sizes that grow no steeper than the gradation allows.

use fixedbitset::FixedBitSet;

use super::corners::{PAIRS, TreeCorners};
use super::tree::{Leaf, Tree};
use tetdb_base::storage::{SpillVec, check_cancelled};

/// Rounds of grading and closing hanging corners. The last ones change little; each costs as much as
/// the first.
const GRADE_ROUNDS: u32 = 4;
/// A hanging corner's mean may exceed its graded value by this factor. The slope bound is stated with more slack; at
/// 1.001 every round finds something left to lower.
const EXCESS_MAX: f32 = 1.01;
/// Gives hanging corners their means, where these are known.
pub(super) fn close_finite(corners: &mut TreeCorners, h: &mut SpillVec<f32>) {
    for k in 0..corners.hanging.len() {
        let hanging = corners.hanging.get(k);
        let mean = mean_on(hanging.on, h);
        if mean.is_finite() {
            h.set(hanging.corner as usize, mean);
        }
    }
}

fn mean_on(on: [u32; 4], h: &mut SpillVec<f32>) -> f32 {
    let mut sum = f64::from(h.get(on[0] as usize));
    for &v in &on[1..] {
        sum += f64::from(h.get(v as usize));
    }
    (sum * 0.25) as f32
}

/// The slope bound between corners of the same leaf.
pub(super) struct Grading<'a> {
    pub tree: &'a Tree,
    pub corners: &'a mut TreeCorners,
    pub beta: f64,
    /// By leaf, how many times `beta` its slope may be; once where it is not given.
    pub slope_factor: Option<&'a mut SpillVec<f32>>,
}

impl Grading<'_> {
    /// Lowers values until no two corners of a leaf differ by more than the slope allows.
    ///
    /// The result is the largest such function below the given values, in any order. Sweeps go forward and backward by
    /// turns, because a lowered value travels along with the sweep of its direction.
    pub fn grade(&mut self, h: &mut SpillVec<f32>) {
        // Corners that were lowered since their neighbors were last checked.
        let mut changed = FixedBitSet::with_capacity(h.len());
        changed.insert_range(..);
        let mut next = FixedBitSet::with_capacity(h.len());
        let mut is_backward = false;
        loop {
            check_cancelled();
            let mut sweep = Sweep {
                of_leaf: &mut self.corners.of_leaf,
                slope_factor: self.slope_factor.as_deref_mut(),
                h,
                changed: &mut changed,
                next: &mut next,
                beta: self.beta,
                is_done: true,
            };
            match is_backward {
                true => (self.tree.leaves_backward()).for_each(|(i, leaf)| sweep.relax(i, leaf)),
                false => (0..).zip(self.tree.leaves()).for_each(|(i, leaf)| sweep.relax(i, leaf)),
            }
            if sweep.is_done {
                break;
            }
            std::mem::swap(&mut changed, &mut next);
            next.clear();
            is_backward = !is_backward;
        }
    }

    /// Grades, and gives hanging corners their means: lowering only, so that both hold in the end.
    ///
    /// A mean above its graded value lowers the largest corners of its four, none of them below that value: so the
    /// smallest value of all is unchanged.
    pub fn grade_closed(&mut self, h: &mut SpillVec<f32>) {
        for _ in 0..GRADE_ROUNDS {
            self.grade(h);
            let mut changed = false;
            for k in (0..self.corners.hanging.len()).rev() {
                let hanging = self.corners.hanging.get(k);
                let own = h.get(hanging.corner as usize);
                if mean_on(hanging.on, h) > own * EXCESS_MAX {
                    changed = true;
                    let level = level_for_mean(hanging.distinct(), h, own);
                    for &on in hanging.distinct() {
                        h.change(on as usize, |h| *h = h.min(level));
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

/// One way through all leaves.
struct Sweep<'a> {
    of_leaf: &'a mut SpillVec<[u32; 8]>,
    slope_factor: Option<&'a mut SpillVec<f32>>,
    h: &'a mut SpillVec<f32>,
    changed: &'a mut FixedBitSet,
    next: &'a mut FixedBitSet,
    beta: f64,
    is_done: bool,
}

impl Sweep<'_> {
    #[inline]
    fn relax(&mut self, number: u32, leaf: Leaf) {
        let ids = self.of_leaf.get(number as usize);
        if !ids.iter().any(|&id| self.changed.contains(id as usize)) {
            return;
        }
        let mut before = [0.0; 8];
        for (h, &id) in before.iter_mut().zip(&ids) {
            *h = self.h.get(id as usize);
        }
        let mut h = before;
        let slope_factor = match &mut self.slope_factor {
            Some(by_leaf) => f64::from(by_leaf.get(number as usize)),
            None => 1.0,
        };
        let step = self.beta * leaf.side() * slope_factor;
        // Largest differences, by squared distance of corners in sides.
        let steps = [0.0, step, step * 2f64.sqrt(), step * 3f64.sqrt()];
        while relax_once(&mut h, &steps) {}
        if h == before {
            return;
        }
        self.is_done = false;
        for ((id, h), before) in ids.into_iter().zip(h).zip(before) {
            if h != before {
                self.h.set(id as usize, h);
                self.changed.insert(id as usize);
                self.next.insert(id as usize);
            }
        }
    }
}

/// Lowers each of a leaf's values to the bound of the others; returns whether one changed.
#[inline]
fn relax_once(h: &mut [f32; 8], steps: &[f64; 4]) -> bool {
    let (low, high) =
        (h.iter()).fold((f32::INFINITY, f32::NEG_INFINITY), |(l, u), &x| (l.min(x), u.max(x)));
    // The least step from the least value allows the greatest.
    if bound(low, steps[1]) >= high {
        return false;
    }
    let mut is_changed = false;
    for &(a, b, distance2) in &PAIRS {
        let (a, b) = (a as usize, b as usize);
        for (from, to) in [(a, b), (b, a)] {
            let most = bound(h[from], steps[distance2 as usize]);
            if most < h[to] {
                h[to] = most;
                is_changed = true;
            }
        }
    }
    is_changed
}

/// The level at which to cut the values of some corners so that their mean becomes `wanted`, which is
/// below the present mean.
fn level_for_mean(on: &[u32], h: &mut SpillVec<f32>, wanted: f32) -> f32 {
    let mut values = [f64::INFINITY; 4];
    for (value, &corner) in values.iter_mut().zip(on) {
        *value = f64::from(h.get(corner as usize));
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
pub(super) fn bound(value: f32, step: f64) -> f32 {
    (f64::from(value) + step) as f32
}
