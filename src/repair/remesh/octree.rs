//! Boxes of the current triangles, which come and go.

use tetdb_base::geom::{Aabb, Point};

/// No child.
const NONE: u32 = u32::MAX;
/// Cells this many halvings below the root are not divided: a millionth of the surface.
const DEPTH_MAX: u32 = 20;

/// A loose octree: an item lies in the cell of its middle that is as large as its box, and so within twice that cell.
pub struct Octree {
    middle: Point,
    half: f64,
    nodes: Vec<Node>,
    boxes: Vec<Aabb>,
}

struct Node {
    children: [u32; 8],
    items: Vec<u32>,
    /// Items here and below.
    n_below: u32,
}

impl Octree {
    /// An empty tree for boxes within `bounds`, or a little beyond.
    pub fn new(bounds: Aabb) -> Self {
        let half = 0.5 * (bounds.high - bounds.low).max_element();
        Self {
            middle: (bounds.low + bounds.high) * 0.5,
            half,
            nodes: vec![Node::new()],
            boxes: Vec::new(),
        }
    }

    /// Adds item `i`.
    pub fn insert(&mut self, i: u32, around: Aabb) {
        let i = i as usize;
        if self.boxes.len() <= i {
            self.boxes.resize(i + 1, Aabb::EMPTY);
        }
        self.boxes[i] = around;
        let node = self.descend(around, true);
        self.nodes[node].items.push(i as u32);
    }

    /// Removes item `i`.
    pub fn remove(&mut self, i: u32) {
        let node = self.descend(self.boxes[i as usize], false);
        self.nodes[node].items.retain(|&other| other != i);
    }

    /// The node of a box; counts on the way go up or down by one.
    fn descend(&mut self, around: Aabb, up: bool) -> usize {
        let (size, at) =
            ((around.high - around.low).max_element(), (around.low + around.high) * 0.5);
        let (mut middle, mut half, mut node) = (self.middle, self.half, 0);
        for _ in 0..=DEPTH_MAX {
            let n = &mut self.nodes[node].n_below;
            *n = if up { *n + 1 } else { *n - 1 };
            if half < size {
                break;
            }
            half *= 0.5;
            let k = child(at, middle);
            middle = child_middle(middle, half, k);
            if self.nodes[node].children[k] == NONE {
                self.nodes[node].children[k] = self.nodes.len() as u32;
                self.nodes.push(Node::new());
            }
            node = self.nodes[node].children[k] as usize;
        }
        node
    }

    /// Calls `visit` with the items whose boxes share a point with `around`, until it returns true; returns whether it did.
    pub fn meeting(&self, around: &Aabb, mut visit: impl FnMut(u32) -> bool) -> bool {
        let mut stack = vec![(0usize, self.middle, self.half)];
        while let Some((node, middle, half)) = stack.pop() {
            for &i in &self.nodes[node].items {
                if self.boxes[i as usize].meets(around) && visit(i) {
                    return true;
                }
            }
            for (k, &c) in self.nodes[node].children.iter().enumerate() {
                if c == NONE || self.nodes[c as usize].n_below == 0 {
                    continue;
                }
                let (half, middle) = (0.5 * half, child_middle(middle, 0.5 * half, k));
                let reach = Point::splat(2.0 * half);
                if (Aabb { low: middle - reach, high: middle + reach }).meets(around) {
                    stack.push((c as usize, middle, half));
                }
            }
        }
        false
    }
}

impl Node {
    fn new() -> Self {
        Self { children: [NONE; 8], items: Vec::new(), n_below: 0 }
    }
}

fn child(p: Point, middle: Point) -> usize {
    usize::from(p.x > middle.x) + 2 * usize::from(p.y > middle.y) + 4 * usize::from(p.z > middle.z)
}

fn child_middle(middle: Point, half: f64, k: usize) -> Point {
    let side = |bit: usize| if k & bit != 0 { half } else { -half };
    middle + Point::new(side(1), side(2), side(4))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::mix;

    #[test]
    fn it_finds_the_boxes_that_a_search_through_all_finds() {
        let at = |k: u64| (mix(k) >> 11) as f64 / (1u64 << 53) as f64;
        let point = |k: u64| Point::new(at(3 * k), at(3 * k + 1), at(3 * k + 2));
        let box_of = |k: u64, size: f64| {
            let low = point(k);
            Aabb { low, high: low + point(k + 1_000_000) * size * at(k + 77) }
        };
        let mut tree = Octree::new(Aabb { low: Point::ZERO, high: Point::ONE });
        let boxes: Vec<Aabb> = (0..500).map(|k| box_of(k, 0.2)).collect();
        (0u32..).zip(&boxes).for_each(|(i, b)| tree.insert(i, *b));
        (0..500).filter(|i| i % 3 == 0).for_each(|i| tree.remove(i));
        for k in 1000..1200 {
            let query = box_of(k, 0.3);
            let mut found = Vec::new();
            tree.meeting(&query, |i| {
                found.push(i);
                false
            });
            found.sort_unstable();
            let all = (0u32..).zip(&boxes).filter(|(i, b)| i % 3 != 0 && b.meets(&query));
            assert_eq!(found, all.map(|(i, _)| i).collect::<Vec<_>>());
        }
    }
}
