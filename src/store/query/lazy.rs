//! Location of a single point with as few chunks as possible.
//!
//! A tetrahedron that holds the point lies in the box around its vertices. Each of these is at most as far from the point as the longest edge of
//! the chunk is long. The box of a vertex that is not read yet is that of its chunk. A chunk of tetrahedra is read only when one of its leading
//! vertices is near enough, and these bounds rule out most of it. Each chunk of vertices that is read rules out more. The next chunk to read is
//! the one that completes the most tetrahedra, and among equals the one where the point is most central.

use std::collections::BTreeMap;

use tetdb_schema::ids::TetId;
use tetdb_schema::record::SealedTet;

use super::hit::Hit;
use super::locate::{ChunkCandidate, Search, holds, leaders};
use super::near::{NearVertices, nearness};
use super::session::{checked_chunk, vertex_chunk};
use super::{QueryError, QuerySession};
use crate::sealed::Subdomain;
use crate::store::StoreError;
use tetdb_base::geom::{Aabb, IdMap, Point};
use tetdb_base::storage::check_cancelled;

/// A tetrahedron that may hold the point, and the chunks of its vertices.
struct Waiting {
    id: TetId,
    tet: SealedTet,
    chunks: [u32; 4],
}

/// A search for one point, with the chunks read so far.
struct LazySearch {
    point: Point,
    /// No vertex of a tetrahedron that holds the point is farther away.
    reach: f64,
    waiting: Vec<Waiting>,
    /// Chunks of vertices by sub-domain and number: their vertices near the point, and whether they are read.
    chunks: IdMap<(u32, u32), (NearVertices, bool)>,
}

impl LazySearch {
    /// Vertices of a chunk near the point, and whether the chunk is read.
    fn near(&mut self, part: &Subdomain, chunk: u32) -> (NearVertices, bool) {
        let (p, reach) = (self.point, self.reach);
        let new = || (NearVertices::new(part, chunk as usize, p, reach), false);
        let key = (part.id().rank(), chunk);
        *self.chunks.entry(key).or_insert_with(new)
    }

    /// Marks a chunk as read.
    fn note(&mut self, rank: u32, chunk: u32) {
        if let Some((_, is_read)) = self.chunks.get_mut(&(rank, chunk)) {
            *is_read = true;
        }
    }

    fn is_read(&self, rank: u32, chunk: u32) -> bool {
        self.chunks.get(&(rank, chunk)).is_some_and(|c| c.1)
    }

    fn nearness(&self, key: (u32, u32)) -> f64 {
        self.chunks.get(&key).map_or(f64::INFINITY, |c| c.0.nearness)
    }

    /// The chunk to read next: of the tetrahedra that lack fewest, the one that most of them lack, then the nearest.
    fn next(&self) -> Option<(u32, u32)> {
        let mut wanted = BTreeMap::<(u32, u32), (usize, usize)>::new();
        for w in &self.waiting {
            let rank = w.id.subdomain().rank();
            let mut chunks = w.chunks;
            chunks.sort_unstable();
            let is_new = |i: &usize| *i == 0 || chunks[*i] != chunks[*i - 1];
            let lacking = (0..4).filter(is_new).map(|i| chunks[i]);
            let lacking: Vec<u32> = lacking.filter(|&c| !self.is_read(rank, c)).collect();
            for &chunk in &lacking {
                let (fewest, many) = wanted.entry((rank, chunk)).or_insert((usize::MAX, 0));
                if lacking.len() < *fewest {
                    (*fewest, *many) = (lacking.len(), 0);
                }
                *many += usize::from(lacking.len() == *fewest);
            }
        }
        let best = wanted.into_iter().min_by(|(a, (few, many)), (b, (fewer, more))| {
            let by_lack = few.cmp(fewer).then(more.cmp(many));
            by_lack.then(self.nearness(*a).total_cmp(&self.nearness(*b)))
        });
        best.map(|(key, _)| key)
    }
}

impl QuerySession {
    /// Looks for the point in these chunks. Errors: damage.
    pub(super) fn search_lazily(
        &mut self,
        candidates: &[ChunkCandidate],
        search: &mut Search,
    ) -> Result<(), QueryError> {
        let reaches = candidates.iter().map(|c| c.reach);
        let mut lazy = LazySearch {
            point: search.point,
            reach: reaches.fold(0.0, f64::max),
            waiting: Vec::new(),
            chunks: IdMap::default(),
        };
        for candidate in candidates {
            self.gather(candidate, &mut lazy)?;
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
        candidate: &ChunkCandidate,
        lazy: &mut LazySearch,
    ) -> Result<(), QueryError> {
        check_cancelled();
        let part = &mut self.part(candidate.rank)?.subdomain;
        if !is_led_near(part, candidate, lazy)? {
            return Ok(());
        }
        self.count_tets(candidate.rank, candidate.chunk);
        let part = &mut self.part(candidate.rank)?.subdomain;
        let records = checked_chunk(part, candidate.chunk)?;
        let n_vertices = part.row().vertices;
        let mut place = 0;
        for (local, tet) in (records.first..).zip(records.records) {
            if let Some(&v) = tet.nodes.iter().find(|&&v| u64::from(v) >= n_vertices) {
                // Returns the error.
                part.corner(v)?;
            }
            // The leading vertex rules out nearly all tetrahedra, before the others are looked up.
            let (mut chunks, mut around) = ([0; 4], Some(Aabb::EMPTY));
            for (v, chunk) in tet.nodes.into_iter().zip(&mut chunks) {
                *chunk = vertex_chunk(part, v, &mut place) as u32;
                let Some(bounds) = bounds_near(part, v, *chunk, lazy)? else {
                    around = None;
                    break;
                };
                around = around.map(|around| around.union(bounds));
            }
            if around.is_some_and(|around| holds(&around, lazy.point)) {
                let id = TetId::new(part.id(), local);
                lazy.waiting.push(Waiting { id: id.expect("the chunk was checked"), tet, chunks });
            }
        }
        Ok(())
    }

    /// Reads chunks of vertices that are not farther than `most` until the point is settled; tests tetrahedra whose vertices are all read.
    fn read_up_to(
        &mut self,
        most: f64,
        lazy: &mut LazySearch,
        search: &mut Search,
    ) -> Result<(), QueryError> {
        loop {
            let mut rest = Vec::new();
            for w in std::mem::take(&mut lazy.waiting) {
                let rank = w.id.subdomain().rank();
                let part = &mut self.part(rank)?.subdomain;
                if !w.chunks.iter().all(|&c| lazy.is_read(rank, c)) {
                    if may_hold(part, &w, lazy)? {
                        rest.push(w);
                    }
                    continue;
                }
                let corners = part.corners(w.tet.nodes)?;
                let points = corners.map(|c| c.point);
                search.look(w.id, &points, || {
                    Hit::new(w.id, w.tet.region, corners.map(|c| c.id), points)
                });
                if search.settled {
                    return Ok(());
                }
            }
            lazy.waiting = rest;
            let Some(next) = lazy.next() else {
                return Ok(());
            };
            if lazy.nearness(next) > most {
                return Ok(());
            }
            lazy.note(next.0, next.1);
        }
    }
}

/// Returns whether a vertex that leads tetrahedra of the chunk may be near enough; reads the chunks of vertices this takes, the nearest first.
fn is_led_near(
    part: &mut Subdomain,
    candidate: &ChunkCandidate,
    lazy: &mut LazySearch,
) -> Result<bool, StoreError> {
    if lazy.reach == f64::INFINITY {
        return Ok(true);
    }
    let leaders = leaders(part, candidate.chunk as usize);
    let first = part.vertex_chunk_of(leaders.start) as u32;
    let last = part.vertex_chunk_of(leaders.end.saturating_sub(1)) as u32;
    let reach = lazy.reach;
    let mut chunks: Vec<(f64, u32)> = (first..=last.max(first))
        .map(|c| (lazy.near(part, c).0.nearness, c))
        .filter(|&(nearness, _)| nearness <= reach)
        .collect();
    chunks.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, chunk) in chunks {
        let summary = &part.vertex_summaries()[chunk as usize];
        let end = summary.first.saturating_add(summary.count);
        lazy.note(candidate.rank, chunk);
        for v in leaders.start.max(summary.first)..leaders.end.min(end) {
            if part.corner(v)?.point.distance(lazy.point) <= lazy.reach {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// Returns whether the known bounds of its vertices let the tetrahedron hold the point.
fn may_hold(part: &mut Subdomain, w: &Waiting, lazy: &mut LazySearch) -> Result<bool, StoreError> {
    let mut around = Aabb::EMPTY;
    for (v, chunk) in w.tet.nodes.into_iter().zip(w.chunks) {
        match bounds_near(part, v, chunk, lazy)? {
            Some(bounds) => around = around.union(bounds),
            None => return Ok(false),
        }
    }
    Ok(holds(&around, lazy.point))
}

/// Known bounds of a vertex of a chunk; `None` if the vertex is too far away.
#[inline]
fn bounds_near(
    part: &mut Subdomain,
    v: u32,
    chunk: u32,
    lazy: &mut LazySearch,
) -> Result<Option<Aabb>, StoreError> {
    let (near, is_read) = lazy.near(part, chunk);
    let bounds = match is_read {
        true => Aabb::around([part.corner(v)?.point]),
        false => near.bounds,
    };
    let is_far = bounds.low.x > bounds.high.x || nearness(&bounds, lazy.point) > lazy.reach;
    Ok((!is_far).then_some(bounds))
}
