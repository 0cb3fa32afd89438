//! When the surface changed, and which operations failed since: they fail again while nothing around them changes.

use tetdb_base::geom::IdMap;

use super::mesh::EdgeKey;

/// An operation on an edge or a vertex.
#[derive(Clone, Copy, Debug)]
pub enum Operation {
    /// The edge between two triangles is swapped.
    Flip(EdgeKey),
    /// A short edge is collapsed.
    Collapse(EdgeKey),
    /// An edge is collapsed if that raises the least quality.
    CollapsePoor(EdgeKey),
    /// A vertex moves to the middle of its neighbors.
    Move(u32),
}

/// The order of changes and failures.
#[derive(Default)]
pub struct History {
    /// Number of changes so far.
    pub n_changes: u64,
    /// The last change around each vertex.
    changed: Vec<u64>,
    /// Changes there were when a move failed.
    moves: Vec<u64>,
    /// The same for flips, collapses and those for quality.
    edges: [IdMap<EdgeKey, u64>; 3],
}

impl History {
    /// Counts a change of triangles with these vertices.
    pub fn change(&mut self, vertices: impl Iterator<Item = u32>) {
        self.n_changes += 1;
        for v in vertices.map(|v| v as usize) {
            if self.changed.len() <= v {
                self.changed.resize(v + 1, 0);
            }
            self.changed[v] = self.n_changes;
        }
    }

    /// Notes an operation that failed after `n_changes` changes.
    pub fn fail(&mut self, operation: Operation, n_changes: u64) {
        // Failures before the first change count as well.
        let now = n_changes + 1;
        match operation {
            Operation::Move(v) => {
                let v = v as usize;
                if self.moves.len() <= v {
                    self.moves.resize(v + 1, 0);
                }
                self.moves[v] = now;
            }
            Operation::Flip(e) => drop(self.edges[0].insert(e, now)),
            Operation::Collapse(e) => drop(self.edges[1].insert(e, now)),
            Operation::CollapsePoor(e) => drop(self.edges[2].insert(e, now)),
        }
    }

    /// Returns whether an operation failed, and nothing changed around it since.
    pub fn is_vain(&self, operation: Operation) -> bool {
        let (failed, ends) = match operation {
            Operation::Move(v) => (self.moves.get(v as usize), [v; 2]),
            Operation::Flip(e) => (self.edges[0].get(&e), [e.0, e.1]),
            Operation::Collapse(e) => (self.edges[1].get(&e), [e.0, e.1]),
            Operation::CollapsePoor(e) => (self.edges[2].get(&e), [e.0, e.1]),
        };
        let changed = |v: u32| self.changed.get(v as usize).copied().unwrap_or(0);
        failed.is_some_and(|&failed| ends.iter().all(|&v| changed(v) < failed))
    }
}
