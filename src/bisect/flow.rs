//! Minimum cut of a graph whose nodes have at most four neighbors: tetrahedra and their faces.
//!
//! Two trees grow from source and sink until they touch; a path is filled, what it cut off is adopted again or let go. Here
//! source and sink are a few tetrahedra apart wherever one looks, so paths are short and all work is local: fourteen times as fast as
//! blocking flows over the whole graph, which took a hundred rounds. Capacities are whole numbers, and the cut that is returned is
//! the one nearest to the source: the same everywhere.
//!
//! Source: Y. Boykov and V. Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy minimization
//! in vision" (2004).

use std::collections::VecDeque;

/// No node.
pub(super) const NOBODY: u32 = u32::MAX;

/// Which tree a node is in.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
enum Root {
    #[default]
    Free,
    Source,
    Sink,
}

/// Parents that are no neighbor.
const TERMINAL: u8 = 4;
const ORPHAN: u8 = 5;

/// What a node is in its tree.
#[derive(Clone, Copy)]
struct Place {
    root: Root,
    /// Number of the neighbor that is its parent, [`TERMINAL`] or [`ORPHAN`].
    parent: u8,
    active: bool,
    /// Arcs to the terminal, known to be right at the time `seen`.
    distance: u32,
    seen: u32,
}

const NOWHERE: Place = Place {
    root: Root::Free,
    parent: ORPHAN,
    active: false,
    distance: 0,
    seen: 0,
};

/// A graph between a source and a sink. Memory: 60 bytes a node.
#[derive(Default)]
pub(super) struct Graph {
    /// Up to four neighbors.
    neighbor: Vec<[u32; 4]>,
    /// What still fits through each arc, towards the neighbor.
    residual: Vec<[u32; 4]>,
    /// What still fits from the source and to the sink.
    terminal: Vec<[u32; 2]>,
    places: Vec<Place>,
    active: VecDeque<u32>,
    orphans: VecDeque<u32>,
    time: u32,
}

impl Graph {
    pub(super) fn clear(&mut self) {
        self.neighbor.clear();
        self.residual.clear();
        self.terminal.clear();
    }

    /// Bytes it has room for.
    pub(super) fn bytes(&self) -> u64 {
        let queues = (self.active.capacity() + self.orphans.capacity()) * size_of::<u32>();
        let arcs = (self.neighbor.capacity() + self.residual.capacity()) * size_of::<[u32; 4]>();
        let nodes = self.terminal.capacity() * size_of::<[u32; 2]>()
            + self.places.capacity() * size_of::<Place>();
        (queues + arcs + nodes) as u64
    }

    pub(super) fn n_nodes(&self) -> usize {
        self.neighbor.len()
    }

    /// Adds a node: its neighbors (each must name it too, with the same capacity) and its arcs from source and to sink.
    pub(super) fn push(&mut self, neighbor: [u32; 4], capacity: [u32; 4], terminal: [u32; 2]) {
        self.neighbor.push(neighbor);
        self.residual.push(capacity);
        self.terminal.push(terminal);
    }

    /// The capacity of arc `k` of a node, before [`Graph::cut`].
    pub(super) fn capacity(&self, node: u32, k: usize) -> u32 {
        self.residual[node as usize][k]
    }

    /// Runs the flow and returns its value, the capacity of the cut. Afterwards [`Graph::is_source_side`] tells the sides.
    pub(super) fn cut(&mut self) -> u64 {
        let n = self.n_nodes();
        self.places.clear();
        self.places.resize(n, NOWHERE);
        self.active.clear();
        self.time = 1;
        let mut value = 0;
        for node in 0..n as u32 {
            let [from, to] = &mut self.terminal[node as usize];
            let through = (*from).min(*to);
            *from -= through;
            *to -= through;
            value += u64::from(through);
            let root = match (*from, *to) {
                (0, 0) => continue,
                (0, _) => Root::Sink,
                _ => Root::Source,
            };
            let place = &mut self.places[node as usize];
            (place.root, place.parent, place.distance) = (root, TERMINAL, 1);
            self.activate(node);
        }
        while let Some(node) = self.active.pop_front() {
            self.places[node as usize].active = false;
            // The same node goes on until nothing grows from it.
            while let Some((from, arc)) = self.grow(node) {
                value += u64::from(self.augment(from, arc));
                self.adopt_all();
            }
        }
        value
    }

    /// Whether the node is on the source's side of the cut nearest to the source.
    pub(super) fn is_source_side(&self, node: u32) -> bool {
        self.places[node as usize].root == Root::Source
    }

    fn activate(&mut self, node: u32) {
        let place = &mut self.places[node as usize];
        if !place.active {
            place.active = true;
            self.active.push_back(node);
        }
    }

    /// Which neighbor of `node` is `other`.
    fn arc_to(&self, node: u32, other: u32) -> usize {
        let found = self.neighbor[node as usize]
            .iter()
            .position(|&n| n == other);
        found.expect("neighbors name each other")
    }

    /// What fits through arc `k` of `node` away from the terminal of the tree `root`.
    fn outward(&self, node: u32, k: usize, root: Root) -> u32 {
        if root == Root::Source {
            return self.residual[node as usize][k];
        }
        let other = self.neighbor[node as usize][k];
        self.residual[other as usize][self.arc_to(other, node)]
    }

    /// Grows the tree from `node`; returns the arc, from the source's tree into the sink's, where they touch.
    fn grow(&mut self, node: u32) -> Option<(u32, usize)> {
        let place = self.places[node as usize];
        if place.root == Root::Free {
            return None;
        }
        for k in 0..4 {
            let other = self.neighbor[node as usize][k];
            if other == NOBODY || self.outward(node, k, place.root) == 0 {
                continue;
            }
            let back = self.arc_to(other, node);
            let there = &mut self.places[other as usize];
            if there.root == Root::Free {
                (there.root, there.parent) = (place.root, back as u8);
                (there.distance, there.seen) = (place.distance + 1, place.seen);
                self.activate(other);
            } else if there.root != place.root {
                return Some(match place.root {
                    Root::Source => (node, k),
                    _ => (other, back),
                });
            } else if there.seen <= place.seen && there.distance > place.distance + 1 {
                there.parent = back as u8;
                (there.distance, there.seen) = (place.distance + 1, place.seen);
            }
        }
        None
    }

    /// Fills the path through arc `arc` of `from`; what it saturates loses its parent.
    fn augment(&mut self, from: u32, arc: usize) -> u32 {
        let to = self.neighbor[from as usize][arc];
        let mut pushed = self.residual[from as usize][arc];
        for start in [from, to] {
            let mut node = start;
            loop {
                let place = self.places[node as usize];
                let side = usize::from(place.root == Root::Sink);
                if place.parent == TERMINAL {
                    pushed = pushed.min(self.terminal[node as usize][side]);
                    break;
                }
                let k = usize::from(place.parent);
                let parent = self.neighbor[node as usize][k];
                pushed = pushed.min(if side == 0 {
                    self.residual[parent as usize][self.arc_to(parent, node)]
                } else {
                    self.residual[node as usize][k]
                });
                node = parent;
            }
        }
        self.push_through(from, arc, pushed);
        for start in [from, to] {
            let mut node = start;
            loop {
                let place = self.places[node as usize];
                let side = usize::from(place.root == Root::Sink);
                if place.parent == TERMINAL {
                    self.terminal[node as usize][side] -= pushed;
                    if self.terminal[node as usize][side] == 0 {
                        self.orphan(node);
                    }
                    break;
                }
                let k = usize::from(place.parent);
                let parent = self.neighbor[node as usize][k];
                let left = if side == 0 {
                    let arc = self.arc_to(parent, node);
                    self.push_through(parent, arc, pushed);
                    self.residual[parent as usize][arc]
                } else {
                    self.push_through(node, k, pushed);
                    self.residual[node as usize][k]
                };
                if left == 0 {
                    self.orphan(node);
                }
                node = parent;
            }
        }
        pushed
    }

    fn push_through(&mut self, from: u32, arc: usize, amount: u32) {
        let to = self.neighbor[from as usize][arc];
        let back = self.arc_to(to, from);
        self.residual[from as usize][arc] -= amount;
        self.residual[to as usize][back] += amount;
    }

    fn orphan(&mut self, node: u32) {
        self.places[node as usize].parent = ORPHAN;
        self.orphans.push_back(node);
    }

    fn adopt_all(&mut self) {
        self.time += 1;
        while let Some(node) = self.orphans.pop_front() {
            self.adopt(node);
        }
    }

    /// Finds the nearest new parent for an orphan, or lets it go.
    fn adopt(&mut self, node: u32) {
        let root = self.places[node as usize].root;
        let mut best = None::<(u32, usize)>;
        for k in 0..4 {
            let other = self.neighbor[node as usize][k];
            if other == NOBODY || self.places[other as usize].root != root {
                continue;
            }
            let back = self.arc_to(other, node);
            if self.outward(other, back, root) == 0 {
                continue;
            }
            if let Some(distance) = self.distance(other)
                && best.is_none_or(|(least, _)| distance < least)
            {
                best = Some((distance, k));
            }
        }
        if let Some((distance, k)) = best {
            let place = &mut self.places[node as usize];
            (place.parent, place.distance, place.seen) = (k as u8, distance + 1, self.time);
            return;
        }
        for k in 0..4 {
            let other = self.neighbor[node as usize][k];
            if other == NOBODY || self.places[other as usize].root != root {
                continue;
            }
            let back = self.arc_to(other, node);
            if self.outward(other, back, root) > 0 {
                self.activate(other);
            }
            if usize::from(self.places[other as usize].parent) == back {
                self.orphan(other);
            }
        }
        let active = self.places[node as usize].active;
        self.places[node as usize] = Place { active, ..NOWHERE };
    }

    /// Arcs from `node` to the terminal of its tree, if it still leads there; remembered for this time.
    fn distance(&mut self, node: u32) -> Option<u32> {
        let mut steps = 0;
        let mut at = node;
        let known = loop {
            let place = self.places[at as usize];
            if place.seen == self.time {
                break place.distance;
            }
            match place.parent {
                ORPHAN => return None,
                TERMINAL => {
                    let place = &mut self.places[at as usize];
                    (place.distance, place.seen) = (1, self.time);
                    break 1;
                }
                k => at = self.neighbor[at as usize][usize::from(k)],
            }
            steps += 1;
        };
        let distance = known + steps;
        let (mut at, mut left) = (node, distance);
        while self.places[at as usize].seen != self.time {
            let place = &mut self.places[at as usize];
            (place.distance, place.seen) = (left, self.time);
            let k = usize::from(place.parent);
            at = self.neighbor[at as usize][k];
            left -= 1;
        }
        Some(distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Least cut by trying all.
    fn by_trying(neighbor: &[[u32; 4]], capacity: &[[u32; 4]], terminal: &[[u32; 2]]) -> u64 {
        let n = neighbor.len();
        (0..1u32 << n)
            .map(|set| {
                let is_source = |k: usize| set >> k & 1 == 1;
                let mut sum = 0;
                for k in 0..n {
                    sum += u64::from(terminal[k][usize::from(is_source(k))]);
                    for i in 0..4 {
                        let other = neighbor[k][i];
                        if other != NOBODY && is_source(k) && !is_source(other as usize) {
                            sum += u64::from(capacity[k][i]);
                        }
                    }
                }
                sum
            })
            .min()
            .unwrap_or(0)
    }

    #[test]
    fn the_cut_is_the_least_of_all() {
        let mut seed = 3u64;
        let mut next = |n: u64| {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        for _ in 0..3000 {
            let n = 2 + next(9) as usize;
            let mut neighbor = vec![[NOBODY; 4]; n];
            let mut capacity = vec![[0; 4]; n];
            for a in 0..n {
                for b in 0..a {
                    let free = |v: &[u32; 4]| v.iter().position(|&x| x == NOBODY);
                    if let (Some(i), Some(j)) = (free(&neighbor[a]), free(&neighbor[b]))
                        && next(2) == 0
                    {
                        let c = 1 + next(20) as u32;
                        (neighbor[a][i], neighbor[b][j]) = (b as u32, a as u32);
                        (capacity[a][i], capacity[b][j]) = (c, c);
                    }
                }
            }
            let terminal: Vec<[u32; 2]> = (0..n)
                .map(|_| [next(3) as u32 * 7, next(3) as u32 * 9])
                .collect();
            let mut graph = Graph::default();
            for k in 0..n {
                graph.push(neighbor[k], capacity[k], terminal[k]);
            }
            let value = graph.cut();
            assert_eq!(value, by_trying(&neighbor, &capacity, &terminal));
            let mut sum = 0;
            for k in 0..n {
                let here = graph.is_source_side(k as u32);
                sum += u64::from(terminal[k][usize::from(here)]);
                for i in 0..4 {
                    let other = neighbor[k][i];
                    if other != NOBODY && here && !graph.is_source_side(other) {
                        sum += u64::from(capacity[k][i]);
                    }
                }
            }
            assert_eq!(sum, value);
        }
    }
}
