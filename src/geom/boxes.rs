//! A tree of boxes over the Hilbert order.

use rayon::prelude::*;

use super::{Aabb, HilbertFrame, Point};

/// Things in one leaf.
const LEAF: usize = 4;
/// Children of one node.
const ARITY: usize = 4;

/// Boxes of things in Hilbert order of their middles, and of groups of groups of them.
///
/// Memory: about 52 bytes per thing and a third of that for the tree.
#[derive(Clone, Debug)]
pub struct BoxTree {
    /// Numbers in curve order.
    pub order: Vec<u32>,
    /// Their boxes, in the same order.
    pub boxes: Vec<Aabb>,
    /// `levels[0]` are the leaves; a node of level k + 1 holds `ARITY` nodes of level k.
    pub levels: Vec<Vec<Aabb>>,
}

impl BoxTree {
    pub const ARITY: usize = ARITY;

    /// A tree over those of `n` things within `bounds` that `keep` accepts.
    pub fn new(
        bounds: &Aabb,
        n: u32,
        keep: impl Fn(u32) -> bool + Sync,
        box_of: impl Fn(u32) -> Aabb + Sync,
    ) -> Self {
        let frame = HilbertFrame::new(bounds);
        let mut keys: Vec<(u64, u32)> = (0..n)
            .into_par_iter()
            .filter(|&i| keep(i))
            .map(|i| {
                let Aabb { low, high } = box_of(i);
                (frame.index((low + high) * 0.5), i)
            })
            .collect();
        keys.par_sort_unstable();
        let order: Vec<u32> = keys.into_iter().map(|(_, i)| i).collect();
        let boxes: Vec<Aabb> = order.par_iter().map(|&i| box_of(i)).collect();
        let mut levels = vec![enclose(&boxes, LEAF)];
        while let Some(last) = levels.last()
            && last.len() > 1
        {
            levels.push(enclose(last, ARITY));
        }
        Self {
            order,
            boxes,
            levels,
        }
    }

    /// Calls `visit` with the things whose boxes hold `p`, in curve order, until it returns true.
    pub fn at(&self, p: Point, mut visit: impl FnMut(u32) -> bool) {
        let holds = |b: &Aabb| b.low.cmple(p).all() && p.cmple(b.high).all();
        let top = self.levels.len() - 1;
        let mut stack: Vec<(usize, usize)> =
            (0..self.levels[top].len()).map(|n| (top, n)).collect();
        while let Some((level, node)) = stack.pop() {
            if !holds(&self.levels[level][node]) {
                continue;
            }
            if level > 0 {
                let children = self.children(level, node).rev();
                stack.extend(children.map(|child| (level - 1, child)));
                continue;
            }
            for i in self.members(node) {
                if holds(&self.boxes[i]) && visit(self.order[i]) {
                    return;
                }
            }
        }
    }

    /// Nodes one level below that a node above the leaves holds.
    pub fn children(&self, level: usize, node: usize) -> std::ops::Range<usize> {
        node * ARITY..((node + 1) * ARITY).min(self.levels[level - 1].len())
    }

    /// Places of a leaf's things in curve order.
    pub fn members(&self, leaf: usize) -> std::ops::Range<usize> {
        leaf * LEAF..((leaf + 1) * LEAF).min(self.boxes.len())
    }
}

fn enclose(boxes: &[Aabb], group: usize) -> Vec<Aabb> {
    let join = |a: Aabb, b: &Aabb| Aabb {
        low: a.low.min(b.low),
        high: a.high.max(b.high),
    };
    boxes
        .par_chunks(group)
        .map(|g| g.iter().fold(Aabb::EMPTY, join))
        .collect()
}
