//! A tree of boxes over the Hilbert order.

use rayon::prelude::*;

use crate::geom::{Aabb, HilbertFrame, Point};
use crate::storage::{FrozenSpillVec, KeyedId, OrRaise, ScratchSpace, parallel};

/// Items in one leaf.
const LEAF: usize = 4;
/// Children of one node.
const ARITY: usize = 4;

/// Keys and boxes found side by side.
const AT_ONCE: usize = 1 << 16;

/// Boxes of items in Hilbert order of their middles, and of nested groups of them.
///
/// Memory: about 52 bytes per item and a third of that for the tree, in memory or in scratch files.
#[derive(Clone, Debug)]
pub struct BoxTree {
    /// Numbers in curve order.
    pub order: FrozenSpillVec<u32>,
    /// Their boxes, in the same order.
    pub boxes: FrozenSpillVec<Aabb>,
    /// `levels[0]` are the leaves; a node of level k + 1 holds `ARITY` nodes of level k.
    pub levels: Vec<FrozenSpillVec<Aabb>>,
}

impl BoxTree {
    /// Children of a node.
    pub const ARITY: usize = ARITY;

    /// A tree over the items of `0..n` within `bounds` that `keep` accepts. A scratch file that fails unwinds.
    pub fn new(
        bounds: &Aabb,
        n: u32,
        scratch: &ScratchSpace,
        keep: impl Fn(u32) -> bool + Sync,
        box_of: impl Fn(u32) -> Aabb + Sync,
    ) -> Self {
        let frame = HilbertFrame::new(bounds);
        let mut sorter = scratch.sorter::<KeyedId>();
        for first in (0..n).step_by(AT_ONCE) {
            let some = first..n.min(first.saturating_add(AT_ONCE as u32));
            let keys: Vec<KeyedId> = parallel(|| {
                some.into_par_iter()
                    .filter(|&i| keep(i))
                    .map(|i| {
                        let Aabb { low, high } = box_of(i);
                        let key = frame.index((low + high) * 0.5);
                        KeyedId { key, id: i }
                    })
                    .collect()
            });
            for key in keys {
                sorter.push(key).or_raise();
            }
        }
        let mut sorted = sorter.finish().or_raise();
        let (mut order, mut boxes) = (scratch.builder(), scratch.builder());
        loop {
            let some: Vec<u32> =
                sorted.by_ref().take(AT_ONCE).map(|keyed| keyed.or_raise().id).collect();
            if some.is_empty() {
                break;
            }
            let around: Vec<Aabb> = parallel(|| some.par_iter().map(|&i| box_of(i)).collect());
            some.into_iter().for_each(|i| order.push(i));
            around.into_iter().for_each(|b| boxes.push(b));
        }
        let boxes = boxes.finish().freeze();
        let mut levels = vec![enclose(&boxes, LEAF, scratch)];
        while let Some(last) = levels.last()
            && last.len() > 1
        {
            levels.push(enclose(last, ARITY, scratch));
        }
        Self { order: order.finish().freeze(), boxes, levels }
    }

    /// Calls `visit` with the items whose boxes contain `p`, in curve order, until it returns true.
    pub fn at(&self, p: Point, visit: impl FnMut(u32) -> bool) {
        self.search(|b| b.low.cmple(p).all() && p.cmple(b.high).all(), visit);
    }

    /// Calls `visit` with the items whose boxes share a point with `bounds`, in curve order.
    pub fn meeting(&self, bounds: &Aabb, mut visit: impl FnMut(u32)) {
        self.search(
            |b| b.meets(bounds),
            |item| {
                visit(item);
                false
            },
        );
    }

    /// Calls `visit` with the items whose boxes `matches`, in curve order, until it returns true.
    ///
    /// A box around matching boxes must match as well.
    fn search(&self, matches: impl Fn(&Aabb) -> bool, mut visit: impl FnMut(u32) -> bool) {
        let top = self.levels.len() - 1;
        let mut stack: Vec<(usize, usize)> =
            (0..self.levels[top].len()).map(|n| (top, n)).collect();
        while let Some((level, node)) = stack.pop() {
            if !matches(&self.levels[level].get(node)) {
                continue;
            }
            if level > 0 {
                let children = self.children(level, node).rev();
                stack.extend(children.map(|child| (level - 1, child)));
                continue;
            }
            for i in self.members(node) {
                if matches(&self.boxes.get(i)) && visit(self.order.get(i)) {
                    return;
                }
            }
        }
    }

    /// Nodes one level below that a node above the leaves holds.
    pub fn children(&self, level: usize, node: usize) -> std::ops::Range<usize> {
        node * ARITY..((node + 1) * ARITY).min(self.levels[level - 1].len())
    }

    /// Positions of a leaf's items in curve order.
    pub fn members(&self, leaf: usize) -> std::ops::Range<usize> {
        leaf * LEAF..((leaf + 1) * LEAF).min(self.boxes.len())
    }
}

fn enclose(
    boxes: &FrozenSpillVec<Aabb>,
    group: usize,
    scratch: &ScratchSpace,
) -> FrozenSpillVec<Aabb> {
    let mut around = scratch.builder();
    for first in (0..boxes.len()).step_by(group) {
        let group = first..(first + group).min(boxes.len());
        around.push(group.fold(Aabb::EMPTY, |a, i| a.union(boxes.get(i))));
    }
    around.finish().freeze()
}
