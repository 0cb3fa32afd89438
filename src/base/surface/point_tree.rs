//! A tree of boxes over points in Hilbert order, for the points in a box.

use rayon::prelude::*;

use crate::geom::{Aabb, HilbertFrame, Point};
use crate::storage::parallel;

/// Points of one leaf, and children of one node.
const ARITY: usize = 8;

/// Points in Hilbert order, boxes around groups of them, boxes around groups of boxes up to one.
pub(super) struct PointTree {
    points: Vec<(u32, Point)>,
    /// `levels[0]` are the leaves; a node of level k + 1 holds `ARITY` nodes of level k.
    levels: Vec<Vec<Aabb>>,
}

impl PointTree {
    /// A tree over numbered points.
    pub fn new(mut points: Vec<(u32, Point)>) -> Self {
        let frame = HilbertFrame::new(&Aabb::around(points.iter().map(|p| p.1)));
        parallel(|| points.par_sort_by_cached_key(|&(id, p)| (frame.index(p), id)));
        let around = |group: &[(u32, Point)]| Aabb::around(group.iter().map(|p| p.1));
        let mut levels =
            vec![parallel(|| points.par_chunks(ARITY).map(around).collect::<Vec<_>>())];
        while let Some(last) = levels.last()
            && last.len() > 1
        {
            let above = last
                .chunks(ARITY)
                .map(|group| Aabb::around(group.iter().flat_map(|b| [b.low, b.high])));
            levels.push(above.collect());
        }
        Self { points, levels }
    }

    /// Calls `found` on each point in the closed box, in the order of the tree.
    pub fn within(&self, bounds: &Aabb, mut found: impl FnMut(u32, Point)) {
        let mut stack = vec![(self.levels.len() - 1, 0)];
        while let Some((level, node)) = stack.pop() {
            let Some(own) = self.levels[level].get(node) else {
                continue;
            };
            if !own.meets(bounds) {
                continue;
            }
            let children = node * ARITY..(node + 1) * ARITY;
            if level > 0 {
                stack.extend(children.map(|child| (level - 1, child)));
                continue;
            }
            for &(id, p) in &self.points[children.start..children.end.min(self.points.len())] {
                if bounds.low.cmple(p).all() && p.cmple(bounds.high).all() {
                    found(id, p);
                }
            }
        }
    }
}
