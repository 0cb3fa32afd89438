//! Pairs of triangles whose boxes share a point.

use rayon::prelude::*;

use super::{BoxTree, Surface};
use crate::geom::Aabb;
use crate::storage::{ScratchSpace, parallel};

/// Leaves one task handles.
const BLOCK: usize = 256;
/// Leaves between two looks at how much was found: few at first, so that a hopeless heap of some thousand triangles is given up early.
const ROUND_MIN: usize = 1 << 4;
const ROUND: usize = 1 << 14;
/// Results one task keeps at most: with `ROUND / BLOCK` tasks this bounds the memory on hopeless input.
const BLOCK_LISTED_MAX: usize = 8192;
/// Results after which the search ends: the input is hopeless and its pairs may be quadratic. To look at so many takes some seconds.
pub(super) const FOUND_MAX: u64 = 1_000_000;

/// A tree over the triangles that `keep` accepts.
pub(super) fn tree_of(
    surface: &Surface,
    scratch: &ScratchSpace,
    keep: impl Fn(u32) -> bool + Sync,
) -> BoxTree {
    let box_of = |t: u32| Aabb::around(surface.corners(t));
    BoxTree::new(&surface.bounds(), surface.n_triangles() as u32, scratch, keep, box_of)
}

impl BoxTree {
    /// Calls `test` on each pair of triangles whose boxes share a point and collects its results.
    ///
    /// At most `listed_max` results are kept, of all that are counted; which ones does not depend on
    /// the number of threads. The search ends after a round with more than a million in all.
    pub fn pairs<T: Send>(
        &self,
        listed_max: usize,
        test: impl Fn(u32, u32) -> Option<T> + Sync,
    ) -> (Vec<T>, u64) {
        let n_leaves = self.levels[0].len();
        let (mut listed, mut n_found) = (Vec::new(), 0);
        // A caller that wants them all gets them all.
        let block_listed_max = BLOCK_LISTED_MAX.max(listed_max / 64);
        let (mut end, mut length) = (0, ROUND_MIN);
        while end < n_leaves {
            let begin = end;
            end = (begin + length).min(n_leaves);
            let starts: Vec<usize> = (begin..end).step_by(BLOCK).collect();
            let found: Vec<(Vec<T>, u64)> = parallel(|| {
                starts
                    .into_par_iter()
                    .map(|start| {
                        let (mut out, mut n) = (Vec::new(), 0);
                        let mut keep = |a: u32, b: u32| {
                            if let Some(result) = test(a, b) {
                                n += 1;
                                if out.len() < block_listed_max {
                                    out.push(result);
                                }
                            }
                        };
                        let mut stack = Vec::new();
                        for leaf in start..(start + BLOCK).min(end) {
                            self.pairs_of_leaf(leaf, &mut stack, &mut keep);
                        }
                        (out, n)
                    })
                    .collect()
            });
            let before = n_found;
            for (block, n) in found {
                n_found += n;
                let scratch = listed_max - listed.len();
                listed.extend(block.into_iter().take(scratch));
            }
            if n_found > FOUND_MAX {
                break;
            }
            if n_found - before < FOUND_MAX / 16 {
                length = (2 * length).min(ROUND);
            }
        }
        (listed, n_found)
    }

    /// Pairs of the triangles of `leaf` among themselves and with those of later leaves.
    fn pairs_of_leaf(
        &self,
        leaf: usize,
        stack: &mut Vec<(usize, usize)>,
        pair: &mut impl FnMut(u32, u32),
    ) {
        let own = self.members(leaf);
        for i in own.clone() {
            for j in i + 1..own.end {
                self.try_pair(i, j, pair);
            }
        }
        let bounds = self.levels[0].get(leaf);
        stack.push((self.levels.len() - 1, 0));
        while let Some((level, node)) = stack.pop() {
            // The last leaf below the node.
            let last = (node + 1) * Self::ARITY.pow(level as u32) - 1;
            if last <= leaf || !self.levels[level].get(node).meets(&bounds) {
                continue;
            }
            if level > 0 {
                let children = self.children(level, node);
                stack.extend(children.map(|child| (level - 1, child)));
                continue;
            }
            for i in own.clone().filter(|&i| self.boxes.get(i).meets(&self.levels[0].get(node))) {
                for j in self.members(node) {
                    self.try_pair(i, j, pair);
                }
            }
        }
    }

    fn try_pair(&self, i: usize, j: usize, pair: &mut impl FnMut(u32, u32)) {
        if self.boxes.get(i).meets(&self.boxes.get(j)) {
            let (a, b) = (self.order.get(i), self.order.get(j));
            pair(a.min(b), a.max(b));
        }
    }
}
