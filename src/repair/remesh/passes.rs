//! The order of the changes: lengths first, then the poorest triangles.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use tetdb_base::storage::check_cancelled;

use super::change::Remesher;
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
        self.flips();
        for round in 0..ROUNDS {
            progress(round as f64 / (ROUNDS + 2) as f64);
            self.collapses();
            self.flips();
            if !self.splits(triangles_max) {
                return false;
            }
            self.flips();
            self.collapses();
            self.flips();
            self.moves(2);
            self.flips();
        }
        for _ in 0..LAST_ROUNDS {
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
        each(short, |(_, e)| {
            if !self.mesh.at_edge(e.0, e.1).is_empty() && self.relative_length(e) < SHORT {
                self.collapse(e, false);
            }
        });
    }

    fn flips(&mut self) {
        for _ in 0..4 {
            let before = self.report.flips;
            each(self.mesh.edges(), |e| {
                if !self.mesh.at_edge(e.0, e.1).is_empty() {
                    self.flip(e);
                }
            });
            if self.report.flips - before < self.mesh.triangles.len() as u64 / 200 + 1 {
                break;
            }
        }
    }

    fn moves(&mut self, n: usize) {
        for _ in 0..n {
            each(0..self.mesh.points.len() as u32, |v| {
                if !self.mesh.around[v as usize].is_empty() {
                    self.relocate(v);
                }
            });
        }
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
                || self.collapse(edges[0], true)
                || corners.into_iter().any(|v| self.relocate(v))
                || self.flip(edges[1]).is_some()
                || self.collapse(edges[1], true);
            // Kept curves on both sides forbid all that; halves are less flat.
            if !done && is_needle {
                self.split(edges[2]);
            }
        });
        count(&self.report) - count(&report)
    }
}
