//! Minimum cut of a graph whose nodes have at most four neighbors: tetrahedra and their faces.
//!
//! Blocking flows on levels; between layers a few tetrahedra apart the paths are short, so a few dozen
//! rounds suffice whatever the extent of the surface between them. Capacities are whole numbers: the flow, and the cut nearest to the
//! source, which is the one returned, are the same everywhere.
//!
//! Source: E. A. Dinic, "Algorithm for solution of a problem of maximum flow in a network with power estimation" (1970).

/// No node.
pub(super) const NOBODY: u32 = u32::MAX;
const UNREACHED: u32 = u32::MAX;

/// A graph between a source and a sink. Memory: 52 bytes a node.
#[derive(Default)]
pub(super) struct Graph {
    /// Up to four neighbors.
    neighbor: Vec<[u32; 4]>,
    /// What still fits through each arc, towards the neighbor.
    residual: Vec<[u32; 4]>,
    /// What still fits from the source and to the sink.
    terminal: Vec<[u32; 2]>,
    level: Vec<u32>,
    /// The next arc to try; 4 is the sink, 5 none.
    next: Vec<u8>,
    queue: Vec<u32>,
    path: Vec<(u32, u8)>,
}

/// What a cut costs and needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CutValue {
    pub capacity: u64,
    pub rounds: u32,
}

impl Graph {
    pub(super) fn clear(&mut self) {
        self.neighbor.clear();
        self.residual.clear();
        self.terminal.clear();
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

    /// Runs the flow. Afterwards [`Graph::is_source_side`] tells the sides.
    pub(super) fn cut(&mut self) -> CutValue {
        let n = self.n_nodes();
        self.level.resize(n, UNREACHED);
        self.next.resize(n, 0);
        let mut value = CutValue::default();
        for terminal in &mut self.terminal {
            let through = terminal[0].min(terminal[1]);
            terminal[0] -= through;
            terminal[1] -= through;
            value.capacity += u64::from(through);
        }
        loop {
            let sink_reached = self.levels();
            if !sink_reached {
                return value;
            }
            value.rounds += 1;
            value.capacity += self.blocking_flow();
        }
    }

    /// Whether the node is on the source's side of the cut nearest to the source.
    pub(super) fn is_source_side(&self, node: u32) -> bool {
        self.level[node as usize] != UNREACHED
    }

    /// Distances from the source over what still fits; stops one level after the sink is met.
    fn levels(&mut self) -> bool {
        self.level.fill(UNREACHED);
        self.next.fill(0);
        self.queue.clear();
        for (node, terminal) in self.terminal.iter().enumerate() {
            if terminal[0] > 0 {
                self.level[node] = 0;
                self.queue.push(node as u32);
            }
        }
        let mut at = 0;
        let mut met = UNREACHED;
        while at < self.queue.len() {
            let node = self.queue[at] as usize;
            at += 1;
            let level = self.level[node];
            if level > met {
                break;
            }
            if self.terminal[node][1] > 0 {
                met = met.min(level);
            }
            for (k, &other) in self.neighbor[node].iter().enumerate() {
                if other != NOBODY
                    && self.residual[node][k] > 0
                    && self.level[other as usize] == UNREACHED
                {
                    self.level[other as usize] = level + 1;
                    self.queue.push(other);
                }
            }
        }
        met != UNREACHED
    }

    fn blocking_flow(&mut self) -> u64 {
        let mut sum = 0;
        for source in 0..self.n_nodes() as u32 {
            while self.terminal[source as usize][0] > 0 && self.level[source as usize] == 0 {
                let pushed = self.augment(source);
                if pushed == 0 {
                    break;
                }
                sum += u64::from(pushed);
            }
        }
        sum
    }

    /// Pushes along one path of rising levels from `source` to the sink; 0 when there is none left.
    fn augment(&mut self, source: u32) -> u32 {
        self.path.clear();
        let mut node = source;
        loop {
            let arc = self.next[node as usize];
            if arc == 4 && self.terminal[node as usize][1] > 0 {
                break;
            }
            if arc >= 4 {
                // Nothing leads on from here: back one step, and never here again in this round.
                self.next[node as usize] = 5;
                let Some((before, _)) = self.path.pop() else {
                    return 0;
                };
                node = before;
                self.next[node as usize] += 1;
                continue;
            }
            let k = usize::from(arc);
            let other = self.neighbor[node as usize][k];
            let open = other != NOBODY
                && self.residual[node as usize][k] > 0
                && self.level[other as usize] == self.level[node as usize] + 1;
            if open {
                self.path.push((node, arc));
                node = other;
            } else {
                self.next[node as usize] += 1;
            }
        }
        let mut pushed = self.terminal[source as usize][0].min(self.terminal[node as usize][1]);
        for &(from, arc) in &self.path {
            pushed = pushed.min(self.residual[from as usize][usize::from(arc)]);
        }
        self.terminal[source as usize][0] -= pushed;
        self.terminal[node as usize][1] -= pushed;
        for k in 0..self.path.len() {
            let (from, arc) = self.path[k];
            let to = self.neighbor[from as usize][usize::from(arc)];
            self.residual[from as usize][usize::from(arc)] -= pushed;
            let back = self.neighbor[to as usize].iter().position(|&n| n == from);
            let back = back.expect("neighbors name each other");
            self.residual[to as usize][back] += pushed;
        }
        pushed
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
        for _ in 0..500 {
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
            assert_eq!(value.capacity, by_trying(&neighbor, &capacity, &terminal));
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
            assert_eq!(sum, value.capacity);
        }
    }
}
