//! Edge lengths relative to the wanted ones, from a sample of edges that fits a table.
//!
//! An edge belongs to several tetrahedra. Each edge has a hash of the ids of its ends, and the edges with the lowest hashes are
//! kept, each once. So the sample does not depend on the order, and every edge has the same chance.

use tetdb_base::geom::STEP;
use tetdb_kernel::sizing::metric_length;
use tetdb_schema::ids::{Owner, VertexId};
use tetdb_store::sealed::Corner;

/// Fewest edges kept, if there are so many. Shares of the sample are then within half a percent of those of all edges.
const EDGES_LEAST: usize = 1 << 16;
/// Bytes of the table.
pub(super) const SAMPLE_BYTES: u64 = (4 * EDGES_LEAST * size_of::<Edge>()) as u64;
/// Number of bins of metric length, and bins per unit.
const BINS: usize = 60;
const PER_UNIT: f64 = 20.0;

#[derive(Clone, Copy)]
struct Edge {
    mix: u64,
    metric: f32,
    /// True if both ends are vertices of the input.
    given: bool,
}

/// Statistics of edge lengths; each edge counts once.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct EdgeLengths {
    /// Number of edges in the sample.
    pub edges: u64,
    /// Approximate number of edges of the mesh; exact if the sample has them all.
    pub of_about: u64,
    /// Number of sample edges with both ends on the input.
    pub given: u64,
    /// Edges with at least one new end by length / wanted length: twentieths from 0 to 3, the last bin with everything beyond.
    pub bins: Vec<u64>,
    /// Like `bins`, for edges with both ends on the input.
    pub given_bins: Vec<u64>,
    /// Median of length / wanted length over the edges with a new end.
    pub median: f64,
    /// Share of the edges with a new end whose length / wanted length is within [1/√2, √2].
    pub share_near: f64,
}

/// A sample of edges. Invariant: no edge in it has a hash above `most`.
pub(super) struct EdgeSample {
    edges: Vec<Edge>,
    most: u64,
}

impl EdgeSample {
    pub fn new() -> Self {
        Self { edges: Vec::with_capacity(4 * EDGES_LEAST), most: u64::MAX }
    }

    /// Adds the six edges of a tetrahedron.
    pub fn add(&mut self, corners: &[Corner; 4]) {
        for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let (a, b) = (&corners[i], &corners[j]);
            let mix = mix(a.id.min(b.id), a.id.max(b.id));
            if mix > self.most || a.h <= 0.0 || b.h <= 0.0 {
                continue;
            }
            let length = a.point.distance(b.point);
            self.edges.push(Edge {
                mix,
                metric: metric_length(length, f64::from(a.h), f64::from(b.h)) as f32,
                given: is_given(a) && is_given(b),
            });
            if self.edges.len() == 4 * EDGES_LEAST {
                self.thin();
            }
        }
    }

    /// Leaves each edge once, and drops the edges with the highest hashes if there are too many.
    fn thin(&mut self) {
        self.once();
        while self.edges.len() > 2 * EDGES_LEAST {
            self.most /= 2;
            let end = self.edges.partition_point(|e| e.mix <= self.most);
            self.edges.truncate(end);
        }
    }

    fn once(&mut self) {
        self.edges.sort_unstable_by_key(|e| e.mix);
        self.edges.dedup_by_key(|e| e.mix);
    }

    pub fn finish(mut self) -> EdgeLengths {
        self.once();
        let share = self.most as f64 / u64::MAX as f64;
        let mut found = EdgeLengths {
            edges: self.edges.len() as u64,
            of_about: (self.edges.len() as f64 / share).round() as u64,
            bins: vec![0; BINS],
            given_bins: vec![0; BINS],
            ..EdgeLengths::default()
        };
        let mut lengths = Vec::with_capacity(self.edges.len());
        for edge in &self.edges {
            let bin = ((f64::from(edge.metric) * PER_UNIT) as usize).min(BINS - 1);
            if edge.given {
                found.given += 1;
                found.given_bins[bin] += 1;
            } else {
                found.bins[bin] += 1;
                lengths.push(edge.metric);
            }
        }
        lengths.sort_unstable_by(f32::total_cmp);
        if !lengths.is_empty() {
            let near = |m: &&f32| (0.5f32.sqrt()..=2f32.sqrt()).contains(*m);
            found.median = f64::from(lengths[lengths.len() / 2]);
            found.share_near = lengths.iter().filter(near).count() as f64 / lengths.len() as f64;
        }
        found
    }
}

fn is_given(corner: &Corner) -> bool {
    VertexId::from_number(corner.id).is_some_and(|id| id.owner == Owner::Surface)
}

fn mix(a: u64, b: u64) -> u64 {
    let spread = |x: u64| {
        let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ x >> 31
    };
    spread(spread(a.wrapping_add(STEP)) ^ b.wrapping_mul(STEP))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::Point;

    fn corner(id: u64, x: f64) -> Corner {
        Corner { point: Point::new(x, 0.0, 0.0), mix: 0, id: 7 << 52 | id, tag: 0, h: 1.0 }
    }

    #[test]
    fn an_edge_of_many_tetrahedra_counts_once() {
        let mut sample = EdgeSample::new();
        let corners = [0, 1, 2, 3].map(|i| corner(i, 0.5 * i as f64));
        sample.add(&corners);
        sample.add(&[corners[3], corners[0], corners[2], corners[1]]);
        let found = sample.finish();
        assert_eq!((found.edges, found.of_about), (6, 6));
        assert_eq!(
            (found.bins[10], found.bins[20], found.bins[30]),
            (3, 2, 1),
            "lengths 0.5, 1 and 1.5"
        );
        assert_eq!((found.median, found.share_near), (1.0, 2.0 / 6.0));
    }

    #[test]
    fn of_many_edges_a_fair_share_is_kept_whatever_the_order() {
        let n = 200_000u64;
        let run = |order: &mut dyn Iterator<Item = u64>| {
            let mut sample = EdgeSample::new();
            for i in order {
                sample.add(&[0, 1, 2, 3].map(|k| corner(4 * i + k, (i % 3) as f64 * k as f64)));
            }
            sample.finish()
        };
        let found = run(&mut (0..n));
        assert!(found.edges as usize > EDGES_LEAST && found.edges < n);
        let error = found.of_about as f64 / (6 * n) as f64 - 1.0;
        assert!(error.abs() < 0.02, "{error}");
        let zero = found.bins[0] as f64 / found.edges as f64;
        assert!((zero - 1.0 / 3.0).abs() < 0.01, "{zero}");
        let back = run(&mut (0..n).rev());
        assert_eq!((back.edges, back.bins), (found.edges, found.bins));
    }
}
