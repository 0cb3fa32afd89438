//! Location of points: the tetrahedra that hold them.

use std::ops::Range;

use tetdb_schema::ids::TetId;

use super::decoded::Searched;
use super::hit::Hit;
use super::near::NearVertices;
use super::session::{bounds_of, chunk_bounds, reach};
use super::{QueryError, QuerySession};
use crate::sealed::Subdomain;
use tetdb_base::geom::{Aabb, HilbertFrame, Point, orient};

/// Greatest number of points that are located one by one, each in as few chunks as possible; for more it pays to decode whole chunks.
const FEW: usize = 16;

/// A point and the tetrahedron that holds it; of several tetrahedra with the point on a face, the one with the least id.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocatedPoint {
    /// The point.
    pub point: Point,
    /// `None` outside the mesh.
    pub found: Option<Hit>,
    /// Shares of the corners, of sum 1 but for rounding; a zero says exactly that the point is on that face.
    pub barycentric: [f64; 4],
}

/// A chunk whose box holds the point.
#[derive(Clone, Copy)]
pub(super) struct ChunkCandidate {
    pub rank: u32,
    pub chunk: u32,
    resident: bool,
    /// Least distance of a leading vertex; negative where the point is within the box of such vertices.
    nearness: f64,
    /// Greatest distance of a vertex of a tetrahedron that holds the point.
    pub reach: f64,
}

/// State of the search for a point.
pub(super) struct Search {
    pub point: Point,
    pub best: Option<(Hit, [f64; 4])>,
    /// True if the point is strictly inside `best`, so that no other tetrahedron holds it.
    pub settled: bool,
}

impl Search {
    /// Tests a tetrahedron.
    pub fn look(&mut self, id: TetId, corners: &[Point; 4], found: impl FnOnce() -> Hit) {
        let Some(shares) = shares(corners, self.point) else {
            return;
        };
        if self.best.is_none_or(|(best, _)| id < best.id) {
            self.best = Some((found(), shares));
        }
        self.settled = shares.iter().all(|&s| s > 0.0);
    }
}

/// Six times the volumes of the point with each face, or `None` where one is negative: signs are exact.
pub(crate) fn shares(corners: &[Point; 4], p: Point) -> Option<[f64; 4]> {
    let mut shares = [0.0; 4];
    for i in 0..4 {
        let mut with = *corners;
        with[i] = p;
        let [a, b, c, d] = with;
        shares[i] = orient(a, b, c, d);
        if shares[i] < 0.0 {
            return None;
        }
    }
    Some(shares)
}

/// Returns whether a box holds a point.
pub(crate) fn holds(bounds: &Aabb, p: Point) -> bool {
    bounds.low.cmple(p).all() && p.cmple(bounds.high).all()
}

impl QuerySession {
    /// Finds the tetrahedra of `points`; the answers are in their order.
    ///
    /// Points are located in the order of the Hilbert curve, so that they share chunks.
    /// Memory: some 300 bytes a point. Errors: damage.
    pub fn locate(&mut self, points: &[Point]) -> Result<Vec<LocatedPoint>, QueryError> {
        let curve = HilbertFrame::new(&self.bounds());
        let mut order: Vec<(u64, usize)> =
            points.iter().enumerate().map(|(i, &p)| (curve.index(p), i)).collect();
        order.sort_unstable();
        let mut answers: Vec<LocatedPoint> = points
            .iter()
            .map(|&point| LocatedPoint { point, found: None, barycentric: [0.0; 4] })
            .collect();
        let mut candidates = Vec::new();
        for (_, i) in order {
            let search = self.search(points[i], points.len() <= FEW, &mut candidates)?;
            if let Some((found, shares)) = search.best {
                let sum: f64 = shares.iter().sum();
                answers[i].found = Some(found);
                answers[i].barycentric = shares.map(|s| s / sum);
            }
        }
        Ok(answers)
    }

    fn search(
        &mut self,
        point: Point,
        lazily: bool,
        candidates: &mut Vec<ChunkCandidate>,
    ) -> Result<Search, QueryError> {
        let mut search = Search { point, best: None, settled: false };
        self.candidates(point, candidates)?;
        let n_resident = candidates.partition_point(|c| c.resident);
        let n_whole = if lazily { n_resident } else { candidates.len() };
        for candidate in &candidates[..n_whole] {
            let searched = self.searched(candidate.rank, candidate.chunk)?;
            search_frame(&searched, &mut search);
            if search.settled {
                return Ok(search);
            }
        }
        self.search_lazily(&candidates[n_whole..], &mut search)?;
        Ok(search)
    }

    /// The chunks whose boxes hold a point, resident ones first, then the most promising.
    fn candidates(
        &mut self,
        p: Point,
        candidates: &mut Vec<ChunkCandidate>,
    ) -> Result<(), QueryError> {
        candidates.clear();
        let mut ranks = Vec::new();
        self.tree.visit(&|b| holds(b, p), &mut |i| {
            if holds(&bounds_of(&self.rows[i]), p) {
                ranks.push(self.rows[i].rank);
            }
        });
        for rank in ranks {
            let part = self.part(rank)?;
            part.tree.visit(&|b| holds(b, p), &mut |chunk| {
                if !holds(&chunk_bounds(&part.subdomain, chunk), p) {
                    return;
                }
                let reach = reach(&part.subdomain, chunk);
                let nearness = leaders_nearness(&part.subdomain, chunk, p);
                if nearness <= reach {
                    candidates.push(ChunkCandidate {
                        rank,
                        chunk: chunk as u32,
                        resident: false,
                        nearness,
                        reach,
                    });
                }
            });
        }
        for candidate in candidates.iter_mut() {
            candidate.resident = self.is_resident(candidate.rank, candidate.chunk);
        }
        candidates.sort_by(|a, b| {
            let by_residency = b.resident.cmp(&a.resident);
            by_residency.then(a.nearness.total_cmp(&b.nearness))
        });
        Ok(())
    }
}

/// The vertices that lead the tetrahedra of a chunk: the first, and one after the last.
///
/// Tetrahedra are sorted by their least vertex, and vertices along a curve. So the least vertices of a chunk's tetrahedra run from that of its
/// first one to that of the next chunk, and lie in chunks of vertices with small boxes.
pub(super) fn leaders(part: &Subdomain, chunk: usize) -> Range<u32> {
    let least = |chunk: usize| part.tet_summaries().get(chunk).map(|s| s.vertices[0]);
    let n_vertices = part.row().vertices as u32;
    let first = least(chunk).unwrap_or_default();
    let last = least(chunk + 1).map_or(n_vertices, |v| v.saturating_add(1));
    first..last.min(n_vertices)
}

/// Least distance of the leading vertices of a chunk, bounded by the boxes of their chunks.
fn leaders_nearness(part: &Subdomain, chunk: usize, p: Point) -> f64 {
    let leaders = leaders(part, chunk);
    let first = part.vertex_chunk_of(leaders.start);
    let last = part.vertex_chunk_of(leaders.end.saturating_sub(1));
    (first..=last.max(first))
        .map(|c| NearVertices::new(part, c, p, f64::INFINITY).nearness)
        .fold(f64::INFINITY, f64::min)
}

fn search_frame(searched: &Searched, search: &mut Search) {
    let (frame, p) = (&searched.frame, search.point);
    searched.tree.visit(&|b| holds(b, p), &mut |i| {
        let tet = &frame.tets[i];
        if !search.settled {
            let id = frame.id(tet);
            search.look(id, &frame.corners(tet), || frame.hit(tet));
        }
    });
}
