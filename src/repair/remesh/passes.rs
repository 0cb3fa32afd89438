//! The order of the changes: lengths first, then the poorest triangles.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;
use tetdb_base::geom::Aabb;
use tetdb_base::storage::{check_cancelled, parallel};

use super::change::{Change, Remesher};
use super::history::Operation;
use super::mesh::{EdgeKey, edge, quality};

/// Edges longer than this, in units of the wanted length, are divided; those shorter than `SHORT` collapse (Botsch and Kobbelt 2004).
const LONG: f64 = 4.0 / 3.0;
/// See [`LONG`].
const SHORT: f64 = 0.8;
/// Rounds of divisions and collapses; the surface hardly changes after five.
const ROUNDS: usize = 5;
/// Rounds for the poorest triangles alone.
const LAST_ROUNDS: usize = 6;
/// Triangles below this quality (an angle of about 25 degrees) are poor.
const POOR: f64 = 0.55;
/// Triangles below this quality (15 degrees) are divided where nothing else helps.
const NEEDLE: f64 = 0.4;

/// Passes of a round, for progress.
const PASSES: usize = 8;

/// Operations that all threads evaluate before their changes are applied: with more, more are evaluated twice; with less, threads wait.
const BATCH: usize = 512;

/// Puts operations that follow each other into different batches, for neighbors get in each other's way.
fn spread(operations: Vec<Operation>) -> Vec<Operation> {
    let n = operations.len().div_ceil(BATCH).max(1);
    (0..n).flat_map(|k| operations[k.min(operations.len())..].iter().step_by(n).copied()).collect()
}

/// Calls made between two looks at whether the run is cancelled.
fn each<T>(items: impl IntoIterator<Item = T>, mut visit: impl FnMut(T)) {
    for item in items {
        check_cancelled();
        visit(item);
    }
}

impl Remesher<'_> {
    /// Runs all passes; false if there would be more triangles than `triangles_max`. `progress` gets the share that is done.
    pub fn run(&mut self, triangles_max: usize, progress: &dyn Fn(f64)) -> bool {
        let all = (ROUNDS * PASSES + LAST_ROUNDS) as f64;
        progress(0.0);
        self.flips();
        for round in 0..ROUNDS {
            for pass in 0..PASSES {
                progress((round * PASSES + pass) as f64 / all);
                match pass {
                    0 | 4 => self.collapses(),
                    2 if !self.splits(triangles_max) => return false,
                    2 => {}
                    6 => self.moves(2),
                    _ => self.flips(),
                }
            }
        }
        for round in 0..LAST_ROUNDS {
            progress((ROUNDS * PASSES + round) as f64 / all);
            if self.poor() == 0 {
                break;
            }
        }
        progress(1.0);
        true
    }

    /// Divides long edges, the longest first; false if there would be too many triangles.
    fn splits(&mut self, triangles_max: usize) -> bool {
        let mut heap: BinaryHeap<(u64, Reverse<EdgeKey>)> = BinaryHeap::new();
        let consider = |this: &Self, heap: &mut BinaryHeap<_>, e: EdgeKey| {
            let length = this.relative_length(e);
            if length > LONG {
                heap.push((length.to_bits(), Reverse(e)));
            }
        };
        for e in self.mesh.edges() {
            consider(self, &mut heap, e);
        }
        while let Some((length, Reverse(e))) = heap.pop() {
            check_cancelled();
            let is_there = !self.mesh.at_edge(e.0, e.1).is_empty();
            if !is_there || self.relative_length(e).to_bits() != length {
                continue;
            }
            if self.mesh.triangles.len() > triangles_max {
                return false;
            }
            let Some(m) = self.split(e) else { continue };
            // Opposite edges flip at once: halves of needles would be divided for ever else.
            let mut opposite: Vec<EdgeKey> = Vec::new();
            for &t in &self.mesh.around[m as usize] {
                let [a, b, c] = self.mesh.triangles[t as usize];
                opposite.extend([edge(a, b), edge(b, c), edge(c, a)]);
            }
            opposite.sort_unstable();
            opposite.dedup();
            for e in opposite {
                let e = if e.0 != m && e.1 != m { self.flip(e).unwrap_or(e) } else { e };
                consider(self, &mut heap, e);
            }
        }
        true
    }

    fn collapses(&mut self) {
        let mut short: Vec<(u64, EdgeKey)> = Vec::new();
        for e in self.mesh.edges() {
            let length = self.relative_length(e);
            if length < SHORT {
                short.push((length.to_bits(), e));
            }
        }
        short.sort_unstable();
        self.in_batches(
            &short.into_iter().map(|(_, e)| Operation::Collapse(e)).collect::<Vec<_>>(),
        );
    }

    fn flips(&mut self) {
        for _ in 0..4 {
            let before = self.report.flips;
            let edges = self.mesh.edges().into_iter().map(Operation::Flip).collect();
            self.in_batches(&spread(edges));
            if self.report.flips - before < self.mesh.triangles.len() as u64 / 200 + 1 {
                break;
            }
        }
    }

    fn moves(&mut self, n: usize) {
        for _ in 0..n {
            let vertices = 0..self.mesh.points.len() as u32;
            self.in_batches(&spread(vertices.map(Operation::Move).collect()));
        }
    }

    /// Does operations batch by batch: all threads evaluate a batch, and then its changes are applied in order. One near a change of the same
    /// batch is evaluated again. So the result does not depend on the number of threads.
    fn in_batches(&mut self, operations: &[Operation]) {
        for batch in operations.chunks(BATCH) {
            check_cancelled();
            let batch: Vec<Operation> =
                batch.iter().copied().filter(|o| self.is_possible(*o)).collect();
            let (this, before) = (&*self, self.history.n_changes);
            let changes: Vec<Option<Change>> =
                parallel(|| batch.par_iter().map(|&o| this.change_of(o)).collect());
            let mut done: Vec<Aabb> = Vec::new();
            for (operation, mut change) in batch.into_iter().zip(changes) {
                if let Some(found) = &change {
                    let reach = self.reach(found);
                    if done.iter().any(|b| b.meets(&reach)) {
                        change = self
                            .is_possible(operation)
                            .then(|| self.change_of(operation))
                            .flatten();
                    } else if !self.keeps_labels(found) {
                        change = None;
                    }
                }
                done.extend(change.as_ref().map(|change| self.reach(change)));
                self.settle(operation, change.as_ref(), before);
            }
        }
    }

    /// Returns whether the edge or vertex of an operation is there and worth a try.
    fn is_possible(&self, operation: Operation) -> bool {
        let is_there = match operation {
            Operation::Move(v) => !self.mesh.around[v as usize].is_empty(),
            Operation::Collapse(e) => {
                !self.mesh.at_edge(e.0, e.1).is_empty() && self.relative_length(e) < SHORT
            }
            Operation::Flip(e) | Operation::CollapsePoor(e) => {
                !self.mesh.at_edge(e.0, e.1).is_empty()
            }
        };
        is_there && !self.history.is_vain(operation)
    }

    /// Tries everything at poor triangles, the poorest first; returns the number of changes.
    fn poor(&mut self) -> u64 {
        let report = self.report;
        let count = |r: &super::settings::RemeshReport| r.flips + r.collapses + r.moves + r.splits;
        let mut poor: Vec<(u64, u32)> = Vec::new();
        for t in self.mesh.alive() {
            let q = quality(self.mesh.corners(t));
            if q < POOR {
                poor.push((q.to_bits(), t));
            }
        }
        poor.sort_unstable();
        each(poor, |(q, t)| {
            let is_same =
                self.mesh.is_alive[t as usize] && quality(self.mesh.corners(t)).to_bits() == q;
            if !is_same {
                return;
            }
            let corners = self.mesh.triangles[t as usize];
            let mut edges = [0, 1, 2].map(|k| edge(corners[k], corners[(k + 1) % 3]));
            let length = |e: EdgeKey| {
                self.mesh.points[e.0 as usize].distance(self.mesh.points[e.1 as usize])
            };
            edges.sort_by(|a, b| length(*a).total_cmp(&length(*b)));
            let is_needle =
                q < NEEDLE.to_bits() && length(edges[2]) > 3.0 * self.envelope.tolerance;
            let done = self.flip(edges[2]).is_some()
                || self.attempt(Operation::CollapsePoor(edges[0]))
                || corners.into_iter().any(|v| self.attempt(Operation::Move(v)))
                || self.flip(edges[1]).is_some()
                || self.attempt(Operation::CollapsePoor(edges[1]));
            // Kept curves on both sides forbid all that; halves are less flat.
            if !done && is_needle {
                self.split(edges[2]);
            }
        });
        count(&self.report) - count(&report)
    }
}
