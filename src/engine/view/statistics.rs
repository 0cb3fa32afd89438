//! Statistics of all tetrahedra, from one pass over a store.

use rayon::prelude::*;
use tetdb_schema::record::FACES;

use super::sample::{EdgeLengths, EdgeSample, SAMPLE_BYTES};
use tetdb_base::geom::Point;
use tetdb_base::shape::excess;
use tetdb_base::storage::{Budget, check_cancelled, parallel};
use tetdb_store::query::checked_chunk;
use tetdb_store::query::{QueryError, QuerySession};
use tetdb_store::sealed::{Corner, Shape};

/// Number of bins of quality: fiftieths from 1 to 3, the last with everything beyond.
const QUALITY_BINS: usize = 101;
const QUALITY_PER_UNIT: f64 = 50.0;
/// Number of bins of dihedral angles, two degrees each.
const ANGLE_BINS: usize = 90;
/// Number of tetrahedra that one thread counts at a time.
const RUN: usize = 1024;
/// Bytes of the tetrahedra of a chunk with their corners, which are in memory at once.
const CHUNK_BYTES: u64 = 32_768 * size_of::<[Corner; 4]>() as u64;

/// Counts in bins of equal width from `least` on; the last bin has everything beyond.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Histogram {
    /// Lower end of the first bin.
    pub least: f64,
    /// Width of a bin.
    pub width: f64,
    /// Count of each bin.
    pub bins: Vec<u64>,
}

/// Statistics of all tetrahedra of a store.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Statistics {
    /// Number of tetrahedra.
    pub tets: u64,
    /// Tetrahedra by quality q.
    pub quality: Histogram,
    /// Mean quality q.
    pub quality_mean: f64,
    /// All six dihedral angles of each tetrahedron, in degrees.
    pub angles: Histogram,
    /// Least and greatest mean of a tetrahedron's longest and shortest edge.
    pub size: [f64; 2],
    /// Excess: quality over the best quality that the input triangles of a tetrahedron allow.
    pub excess: Excess,
    /// Edges by length relative to the wanted one.
    pub edges: EdgeLengths,
}

/// Extremes of the excess: quality worse than the surface forces.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Excess {
    /// Greatest excess.
    pub worst: f64,
    /// Number of tetrahedra with an excess above 2.
    pub above_two: u64,
}

/// Counts of some tetrahedra. They are whole numbers and extremes, so that any order gives the same result.
#[derive(Clone)]
struct BinCounts {
    quality: Vec<u64>,
    angles: Vec<u64>,
    /// Sum of q in units of 2⁻³²; a sum of integers does not depend on the order of adding.
    sum: u128,
    size: [f64; 2],
    excess: Excess,
}

/// Excess above which a tetrahedron is counted.
const EXCESS_FROM: f64 = 2.0;

impl BinCounts {
    fn none() -> Self {
        Self {
            quality: vec![0; QUALITY_BINS],
            angles: vec![0; ANGLE_BINS],
            sum: 0,
            size: [f64::INFINITY, 0.0],
            excess: Excess { worst: 1.0, above_two: 0 },
        }
    }

    /// Adds a tetrahedron; `on_surface` returns which of its faces are input triangles.
    fn add(mut self, corners: &[Corner; 4], on_surface: impl FnOnce() -> [bool; 4]) -> Self {
        let points = corners.map(|c| c.point);
        let quality = Shape::new(points).quality;
        let bin = ((quality - 1.0) * QUALITY_PER_UNIT) as usize;
        self.quality[bin.min(QUALITY_BINS - 1)] += 1;
        self.sum += (quality.min(1e6) * 2f64.powi(32)) as u128;
        // The excess never exceeds the quality, so most tetrahedra change neither number.
        if quality > self.excess.worst.min(EXCESS_FROM) {
            let excess = excess(points, on_surface());
            self.excess.worst = self.excess.worst.max(excess);
            self.excess.above_two += u64::from(excess > EXCESS_FROM);
        }
        let [a, b, c, d] = points;
        let lengths = [b - a, c - a, d - a, c - b, d - b, d - c].map(Point::length);
        let least = lengths.into_iter().fold(f64::INFINITY, f64::min);
        let size = 0.5 * (least + lengths.into_iter().fold(0.0, f64::max));
        self.size = [self.size[0].min(size), self.size[1].max(size)];
        let normals = FACES.map(|f| {
            let [a, b, c] = f.map(|i| points[i]);
            (b - a).cross(c - a).normalize_or_zero()
        });
        for i in 0..4 {
            for j in 0..i {
                let cosine = -normals[i].dot(normals[j]);
                let degrees = cosine.clamp(-1.0, 1.0).acos().to_degrees();
                self.angles[((degrees / 2.0) as usize).min(ANGLE_BINS - 1)] += 1;
            }
        }
        self
    }

    fn and(mut self, other: Self) -> Self {
        let pairs = [(&mut self.quality, &other.quality), (&mut self.angles, &other.angles)];
        for (own, other) in pairs {
            own.iter_mut().zip(other).for_each(|(a, b)| *a += b);
        }
        self.sum += other.sum;
        let [least, most] = other.size;
        self.size = [self.size[0].min(least), self.size[1].max(most)];
        self.excess.worst = self.excess.worst.max(other.excess.worst);
        self.excess.above_two += other.excess.above_two;
        self
    }
}

/// Measures every tetrahedron; `report` receives the number done and the total. Takes some ten MiB of `budget`, and 32 bytes for
/// each input triangle of a sub-domain.
///
/// Errors: damage; a budget too small.
pub fn statistics(
    session: &mut QuerySession,
    budget: &Budget,
    report: &dyn Fn(u64, u64),
) -> Result<Statistics, QueryError> {
    let _lease = budget.lease(SAMPLE_BYTES + CHUNK_BYTES, "a sample of edges")?;
    let total: u64 = session.rows.iter().map(|r| r.tets).sum();
    let (mut done, mut counts, mut sample) = (0, BinCounts::none(), EdgeSample::new());
    let mut corners = Vec::new();
    for rank in 0..session.rows.len() {
        let (rank, chunks) = (session.rows[rank].rank, session.rows[rank].chunks[0]);
        let surface = session.surface_of(rank)?;
        for chunk in 0..chunks {
            check_cancelled();
            session.count_tets(rank, chunk);
            let part = &mut session.part(rank)?.subdomain;
            let chunk = checked_chunk(part, chunk)?;
            let (first, records) = (chunk.first, chunk.records);
            corners.clear();
            for tet in &records {
                let found = part.corners(tet.nodes)?;
                sample.add(&found);
                corners.push(found);
            }
            let found = parallel(|| {
                corners
                    .par_chunks(RUN)
                    .zip(records.par_chunks(RUN))
                    .enumerate()
                    .map(|(run, (corners, tets))| {
                        let first = first + (run * RUN) as u32;
                        (first..).zip(corners.iter().zip(tets)).fold(
                            BinCounts::none(),
                            |counts, (local, (corners, tet))| {
                                counts.add(corners, || surface.of(local, tet))
                            },
                        )
                    })
                    .reduce(BinCounts::none, BinCounts::and)
            });
            counts = counts.and(found);
            done += records.len() as u64;
            report(done, total);
        }
    }
    Ok(Statistics {
        tets: total,
        quality: Histogram { least: 1.0, width: 1.0 / QUALITY_PER_UNIT, bins: counts.quality },
        quality_mean: counts.sum as f64 / 2f64.powi(32) / total.max(1) as f64,
        angles: Histogram { least: 0.0, width: 2.0, bins: counts.angles },
        size: counts.size,
        excess: counts.excess,
        edges: sample.finish(),
    })
}
