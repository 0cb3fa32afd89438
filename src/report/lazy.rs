//! A single point in a chunk, with as few chunks of vertices as can be.
//!
//! A tetrahedron lies in the box around the boxes of the chunks its vertices are in: most of a chunk is ruled out before any
//! vertex is read. Of the rest, chunks of vertices are read nearest first, and what has all its vertices is looked at.

use tetdb_schema::ids::TetId;

use super::found::Found;
use super::inquiry::{checked_chunk, vertex_bounds};
use super::locate::Search;
use super::{Inquiry, ReportError};
use crate::catalog::Subdomain;
use crate::geom::{Aabb, Point};
use crate::store::stop_if_requested;
use tetdb_schema::record::SealedTet;

/// A tetrahedron that may hold the point, and the chunks of its vertices.
struct Waiting {
    id: TetId,
    tet: SealedTet,
    chunks: [u32; 4],
}

impl Inquiry {
    /// Looks for the point in one chunk. Errors: damage.
    pub(super) fn search_lazily(
        &mut self,
        rank: u32,
        chunk: u32,
        search: &mut Search,
    ) -> Result<(), ReportError> {
        stop_if_requested();
        self.count_tets();
        let part = &mut self.part(rank)?.subdomain;
        let mut waiting = waiting(part, chunk, search.point)?;
        let nearness: Vec<f64> = (0..part.vertex_summaries().len())
            .map(|c| nearness(&vertex_bounds(part, c), search.point))
            .collect();
        let mut is_read = vec![false; nearness.len()];
        while !waiting.is_empty() && !search.settled {
            let wanted = waiting.iter().flat_map(|w| w.chunks);
            let next = wanted
                .filter(|&c| !is_read[c as usize])
                .min_by(|&a, &b| nearness[a as usize].total_cmp(&nearness[b as usize]));
            if let Some(next) = next {
                is_read[next as usize] = true;
            }
            let (ready, rest): (Vec<_>, Vec<_>) = waiting
                .into_iter()
                .partition(|w| w.chunks.iter().all(|&c| is_read[c as usize]));
            waiting = rest;
            for w in ready {
                let corners = part.corners(w.tet.nodes)?;
                let points = corners.map(|c| c.point);
                search.look(w.id, &points, || {
                    Found::new(w.id, w.tet.region, corners.map(|c| c.id), points)
                });
                if search.settled {
                    break;
                }
            }
        }
        Ok(())
    }
}

fn waiting(part: &mut Subdomain, chunk: u32, p: Point) -> Result<Vec<Waiting>, ReportError> {
    let records = checked_chunk(part, chunk)?;
    let n_vertices = part.row().vertices;
    let mut waiting = Vec::new();
    for (local, tet) in (records.first..).zip(records.records) {
        if let Some(&v) = tet.nodes.iter().find(|&&v| u64::from(v) >= n_vertices) {
            // Says what is wrong.
            part.corner(v)?;
        }
        let chunks = tet.nodes.map(|v| part.vertex_chunk_of(v) as u32);
        let around = around(part, chunks);
        if around.low.cmple(p).all() && p.cmple(around.high).all() {
            let id = TetId::new(part.id(), local);
            let id = id.expect("the reader counted the tetrahedra of the sub-domain");
            waiting.push(Waiting { id, tet, chunks });
        }
    }
    Ok(waiting)
}

/// A box around tetrahedra with vertices in these chunks.
pub(super) fn around(part: &Subdomain, chunks: [u32; 4]) -> Aabb {
    chunks.iter().fold(Aabb::EMPTY, |sum, &c| {
        let b = vertex_bounds(part, c as usize);
        Aabb {
            low: sum.low.min(b.low),
            high: sum.high.max(b.high),
        }
    })
}

/// The distance of a point from a box; within it, a negative number, the less the more central it is.
fn nearness(bounds: &Aabb, p: Point) -> f64 {
    let outside = (p - p.clamp(bounds.low, bounds.high)).length();
    if outside > 0.0 {
        return outside;
    }
    let (center, extent) = ((bounds.low + bounds.high) * 0.5, bounds.high - bounds.low);
    ((p - center).abs() - extent * 0.5).max_element()
}
