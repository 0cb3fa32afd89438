//! A single point, with as few chunks as can be.
//!
//! A tetrahedron lies in the box around the boxes of the chunks its vertices are in: most of a chunk is ruled out before any
//! vertex is read. Of the rest, chunks of vertices whose boxes hold the point are read first, chunk of tetrahedra by
//! chunk, and what has all its vertices is looked at; nearly always that settles it. Only then are other chunks of vertices read, the
//! nearest first.

use std::collections::BTreeMap;

use tetdb_schema::ids::TetId;
use tetdb_schema::record::SealedTet;

use super::found::Found;
use super::inquiry::{checked_chunk, vertex_bounds, vertex_chunk};
use super::locate::{Candidate, Search};
use super::{Inquiry, ReportError};
use crate::catalog::Subdomain;
use crate::geom::{Aabb, Point};
use crate::store::stop_if_requested;

/// A tetrahedron that may hold the point, and the chunks of its vertices.
struct Waiting {
    id: TetId,
    tet: SealedTet,
    chunks: [u32; 4],
}

/// What is wanted, and what has been read.
#[derive(Default)]
struct Lazy {
    waiting: Vec<Waiting>,
    /// How near a chunk of vertices is, by sub-domain and number; `None` once it is read.
    nearness: BTreeMap<(u32, u32), Option<f64>>,
}

impl Lazy {
    /// The nearest chunk not yet read that some tetrahedron waits for, not farther than `most`.
    fn nearest(&self, most: f64) -> Option<(u32, u32)> {
        let mut wanted: Option<((u32, u32), f64)> = None;
        for w in &self.waiting {
            for chunk in w.chunks {
                let key = (w.id.subdomain().rank(), chunk);
                if let Some(Some(near)) = self.nearness.get(&key)
                    && *near <= most
                    && wanted.is_none_or(|(_, least)| *near < least)
                {
                    wanted = Some((key, *near));
                }
            }
        }
        wanted.map(|(key, _)| key)
    }

    fn is_ready(&self, w: &Waiting) -> bool {
        let rank = w.id.subdomain().rank();
        let is_read = |c: u32| self.nearness.get(&(rank, c)) == Some(&None);
        w.chunks.into_iter().all(is_read)
    }
}

impl Inquiry {
    /// Looks for the point in these chunks. Errors: damage.
    pub(super) fn search_lazily(
        &mut self,
        candidates: &[Candidate],
        search: &mut Search,
    ) -> Result<(), ReportError> {
        let mut lazy = Lazy::default();
        for candidate in candidates {
            self.gather(candidate, search.point, &mut lazy)?;
            self.read_up_to(0.0, &mut lazy, search)?;
            if search.settled {
                return Ok(());
            }
        }
        self.read_up_to(f64::INFINITY, &mut lazy, search)
    }

    /// Adds the tetrahedra of a chunk that may hold the point.
    fn gather(
        &mut self,
        candidate: &Candidate,
        p: Point,
        lazy: &mut Lazy,
    ) -> Result<(), ReportError> {
        stop_if_requested();
        self.count_tets();
        let part = &mut self.part(candidate.rank)?.subdomain;
        let records = checked_chunk(part, candidate.chunk)?;
        let n_vertices = part.row().vertices;
        let mut place = 0;
        for (local, tet) in (records.first..).zip(records.records) {
            if let Some(&v) = tet.nodes.iter().find(|&&v| u64::from(v) >= n_vertices) {
                // Says what is wrong.
                part.corner(v)?;
            }
            let chunks = tet.nodes.map(|v| vertex_chunk(part, v, &mut place) as u32);
            let around = around(part, chunks);
            if !(around.low.cmple(p).all() && p.cmple(around.high).all()) {
                continue;
            }
            let id = TetId::new(part.id(), local);
            let id = id.expect("the chunk was checked");
            for c in chunks {
                let near = || Some(nearness(&vertex_bounds(part, c as usize), p));
                lazy.nearness
                    .entry((candidate.rank, c))
                    .or_insert_with(near);
            }
            lazy.waiting.push(Waiting { id, tet, chunks });
        }
        Ok(())
    }

    /// Reads chunks of vertices as far as `most`, the nearest first, until the point is settled; looks at what has all its vertices.
    fn read_up_to(
        &mut self,
        most: f64,
        lazy: &mut Lazy,
        search: &mut Search,
    ) -> Result<(), ReportError> {
        while !search.settled {
            let (ready, rest): (Vec<_>, Vec<_>) = std::mem::take(&mut lazy.waiting)
                .into_iter()
                .partition(|w| lazy.is_ready(w));
            lazy.waiting = rest;
            for w in ready {
                let part = &mut self.part(w.id.subdomain().rank())?.subdomain;
                let corners = part.corners(w.tet.nodes)?;
                let points = corners.map(|c| c.point);
                search.look(w.id, &points, || {
                    Found::new(w.id, w.tet.region, corners.map(|c| c.id), points)
                });
                if search.settled {
                    return Ok(());
                }
            }
            let Some(next) = lazy.nearest(most) else {
                break;
            };
            lazy.nearness.insert(next, None);
        }
        Ok(())
    }
}

/// A box around tetrahedra with vertices in these chunks.
fn around(part: &Subdomain, chunks: [u32; 4]) -> Aabb {
    chunks.iter().fold(Aabb::EMPTY, |sum, &c| {
        let b = vertex_bounds(part, c as usize);
        Aabb {
            low: sum.low.min(b.low),
            high: sum.high.max(b.high),
        }
    })
}

/// The distance of a point from a box; within it, a negative number, the less the more central it is.
pub(super) fn nearness(bounds: &Aabb, p: Point) -> f64 {
    let outside = (p - p.clamp(bounds.low, bounds.high)).length();
    if outside > 0.0 {
        return outside;
    }
    let (center, extent) = ((bounds.low + bounds.high) * 0.5, bounds.high - bounds.low);
    ((p - center).abs() - extent * 0.5).max_element()
}
