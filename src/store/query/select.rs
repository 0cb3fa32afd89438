//! The tetrahedra of a selection, one after the other in the order of their ids.

use std::vec::IntoIter;

use tetdb_schema::ids::TetId;
use tetdb_schema::record::SealedTet;

use super::hit::Hit;
use super::locate::leaders;
use super::marks::Marks;
use super::selection::Selection;
use super::session::{bounds_of, reach, vertex_chunk};
use super::{QueryError, QuerySession};
use crate::sealed::Subdomain;
use tetdb_base::geom::{Aabb, IdMap, Point};

/// Chunks one after the other that belong to the same share. Of shorter runs, both shares need the vertices; of longer ones, one
/// waits for the other.
const SHARED_RUN: usize = 4;

/// The answers to [`QuerySession::select`]; holds one chunk's at a time. Ends after the first error.
pub struct Selected<'a> {
    session: &'a mut QuerySession,
    selection: Selection,
    ranks: IntoIter<u32>,
    rank: u32,
    /// Chunks of the sub-domain to be read.
    chunks: IntoIter<u32>,
    marks: Option<Marks>,
    ready: IntoIter<Hit>,
}

impl QuerySession {
    /// Tetrahedra that satisfy all of `selection`, in the order of their ids.
    ///
    /// Errors: sub-domains the store does not have; an interface that is not there; regions that
    /// are not filled.
    pub fn select(&mut self, selection: Selection) -> Result<Selected<'_>, QueryError> {
        let ranks = self.ranks_of(&selection)?;
        Ok(Selected {
            session: self,
            selection,
            ranks: ranks.into_iter(),
            rank: 0,
            chunks: Vec::new().into_iter(),
            marks: None,
            ready: Vec::new().into_iter(),
        })
    }

    /// Sub-domains that may have hits. Errors: as [`QuerySession::select`].
    pub(super) fn ranks_of(&mut self, selection: &Selection) -> Result<Vec<u32>, QueryError> {
        self.check(selection)?;
        let may_have = self.rows.iter().filter(|r| selection.may_be_in(r.rank, &bounds_of(r)));
        Ok(may_have.map(|row| row.rank).collect())
    }

    pub(super) fn check(&mut self, selection: &Selection) -> Result<(), QueryError> {
        let named = selection.subdomains.iter().flatten();
        for &rank in named.chain(selection.interface.iter().flatten()) {
            self.store.subdomain(rank)?;
        }
        if let Some([a, b]) = selection.interface {
            let rows = self.store.interfaces()?;
            let pair = [a.min(b), a.max(b)];
            if !rows.iter().any(|row| [row.low, row.high] == pair) {
                return Err(QueryError::NoInterface(a, b));
            }
        }
        let regions = match selection.regions {
            Some(_) => self.store.regions()?,
            None => Vec::new(),
        };
        let is_known = |region: u32| regions.iter().any(|row| row.filled && row.region == region);
        if let Some(region) =
            selection.regions.iter().flatten().find(|&&r| !regions.is_empty() && !is_known(r))
        {
            let filled = regions.iter().filter(|row| row.filled);
            let known = filled.map(|row| row.region.to_string()).collect();
            return Err(QueryError::NoRegion { name: region.to_string(), known });
        }
        for &id in selection.tets.iter().flatten() {
            let row = self.rows.iter().find(|r| r.rank == id.subdomain().rank());
            if row.is_none_or(|row| u64::from(id.local()) >= row.tets) {
                return Err(QueryError::NoTet { id });
            }
        }
        Ok(())
    }
}

impl Selected<'_> {
    /// Cost of the session so far.
    pub fn measures(&self) -> crate::query::Measures {
        self.session.measures()
    }

    /// Opens the next sub-domain, or returns `false` after the last.
    fn next_part(&mut self) -> Result<bool, QueryError> {
        let Some(rank) = self.ranks.next() else {
            return Ok(false);
        };
        self.rank = rank;
        self.marks = None;
        let (chunks, marks) = chunks_of(self.session, &self.selection, rank)?;
        self.marks = marks;
        self.chunks = chunks.into_iter();
        Ok(true)
    }

    fn read(&mut self, chunk: u32) -> Result<(), QueryError> {
        let found = hits_in(self.session, &self.selection, &self.marks, self.rank, chunk)?;
        self.ready = found.into_iter();
        Ok(())
    }

    fn advance(&mut self) -> Result<Option<Hit>, QueryError> {
        loop {
            if let Some(found) = self.ready.next() {
                return Ok(Some(found));
            }
            if let Some(chunk) = self.chunks.next() {
                self.read(chunk)?;
            } else if !self.next_part()? {
                return Ok(None);
            }
        }
    }
}

impl Iterator for Selected<'_> {
    type Item = Result<Hit, QueryError>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = self.advance();
        if next.is_err() {
            self.ranks = Vec::new().into_iter();
            self.chunks = Vec::new().into_iter();
        }
        next.transpose()
    }
}

/// Chunks of a sub-domain that may have hits, and the tetrahedra that may be hits as far as faces decide.
pub(super) fn chunks_of(
    session: &mut QuerySession,
    selection: &Selection,
    rank: u32,
) -> Result<(Vec<u32>, Option<Marks>), QueryError> {
    let marks = session.marks(rank, selection)?;
    let ranges = session.extra_ranges(rank, &selection.condition_extra)?;
    let part = session.part(rank)?;
    let mut chunks = Vec::new();
    for (chunk, summary) in (0u32..).zip(part.subdomain.tet_summaries()) {
        let marked = marks.as_ref().is_none_or(|m| m.any(summary.first, summary.count));
        if marked
            && selection.may_be_among(rank, summary, ranges.of(chunk))
            && (!selection.is_local() || is_led_near(&part.subdomain, selection, chunk as usize))
        {
            chunks.push(chunk);
        }
    }
    if let Some([number, of]) = selection.share {
        let mut runs = (0..chunks.len()).map(|place| place / SHARED_RUN % of == number);
        chunks.retain(|_| runs.next() == Some(true));
    }
    Ok((chunks, marks))
}

/// A tetrahedron, its number in the sub-domain and its record.
type LocalHit = (Hit, (u32, SealedTet));

/// Hits in one chunk, ascending by id.
pub(super) fn hits_in(
    session: &mut QuerySession,
    selection: &Selection,
    marks: &Option<Marks>,
    rank: u32,
    chunk: u32,
) -> Result<Vec<Hit>, QueryError> {
    let n_shares = selection.share.map_or(1, |[_, of]| of);
    let stays_decoded = selection.stays_decoded
        && marks.is_none()
        && !selection.needs_surface()
        && session.has_space_for_plane(n_shares);
    let found = match stays_decoded {
        true => decoded_hits(session, selection, rank, chunk)?,
        false => read_hits(session, selection, marks, rank, chunk)?,
    };
    let n = selection.condition_extra.len();
    if n == 0 && selection.extra.is_empty() {
        let hits = found.into_iter().map(|(hit, _)| hit);
        return Ok(hits.filter(|hit| selection.holds(hit, &[])).collect());
    }
    let (hits, tets): (Vec<Hit>, Vec<(u32, SealedTet)>) = found.into_iter().unzip();
    let of_condition = session.extra_values(rank, &selection.condition_extra, &tets)?;
    let mut found: Vec<LocalHit> = hits.into_iter().zip(tets).collect();
    let mut place = 0..found.len();
    found.retain(|(hit, _)| {
        let i = place.next().expect("a place for each");
        selection.holds(hit, &of_condition[i * n..(i + 1) * n])
    });
    let (mut hits, tets): (Vec<Hit>, Vec<(u32, SealedTet)>) = found.into_iter().unzip();
    let values = session.extra_values(rank, &selection.extra, &tets)?;
    for (hit, values) in hits.iter_mut().zip(values.chunks(selection.extra.len().max(1))) {
        hit.extra[..values.len()].copy_from_slice(values);
    }
    Ok(hits)
}

/// Tetrahedra of a chunk that are where the selection is, each with its record; only what is near is decoded. Most of that is not a
/// hit, so shapes are measured after the exact test.
fn read_hits(
    session: &mut QuerySession,
    selection: &Selection,
    marks: &Option<Marks>,
    rank: u32,
    chunk: u32,
) -> Result<Vec<LocalHit>, QueryError> {
    let mut nearby = Nearby::default();
    let surface = match selection.needs_surface() {
        true => Some(session.surface_of(rank)?),
        false => None,
    };
    let mut kept = Vec::new();
    let frame = session.frame(rank, chunk, |part, local, tet| {
        let keep = marks.as_ref().is_none_or(|m| m.has(local))
            && TetId::new(part.id(), local).is_some_and(|id| selection.may_be(id, tet.region))
            && (!selection.is_local() || nearby.may_meet(part, selection, chunk, tet.nodes));
        if keep {
            kept.push((local, *tet));
        }
        keep
    })?;
    let found = frame.tets.iter().zip(kept);
    let found = found.filter(|(tet, _)| selection.meets(&frame.corners(tet)));
    let hits = found.map(|(tet, (local, record))| {
        let on_surface = surface.as_ref().map(|faces| faces.of(local, &record));
        (Hit { on_surface, ..frame.hit(tet) }, (local, record))
    });
    Ok(hits.collect())
}

/// The same from a chunk that is decoded as it is and stays so.
fn decoded_hits(
    session: &mut QuerySession,
    selection: &Selection,
    rank: u32,
    chunk: u32,
) -> Result<Vec<LocalHit>, QueryError> {
    let searched = session.searched(rank, chunk)?;
    let (frame, mut hits) = (&searched.frame, Vec::new());
    searched.tree.visit(&|bounds| selection.may_meet(bounds), &mut |i| {
        let tet = &frame.tets[i];
        let may_be = selection.may_be(frame.id(tet), tet.region);
        if may_be && selection.meets(&frame.corners(tet)) {
            let record = SealedTet { nodes: frame.locals(tet), region: tet.region };
            hits.push((frame.hit(tet), (tet.local, record)));
        }
    });
    Ok(hits)
}

/// Places of a chunk that matter to a selection: all vertices of a tetrahedron that meets it are within the length of its longest edge.
#[derive(Default)]
struct Nearby {
    /// For a chunk of vertices a box around those of its cells that are near enough; empty where none are.
    boxes: IdMap<usize, Aabb>,
    place: usize,
}

impl Nearby {
    /// Box around the cells of chunk `c` of vertices that matter to tetrahedra with edges not longer than `reach`.
    fn cells(&mut self, part: &Subdomain, selection: &Selection, reach: f64, c: usize) -> Aabb {
        *self.boxes.entry(c).or_insert_with(|| {
            let mut near = Aabb::EMPTY;
            for cell in part.vertex_summaries()[c].cells() {
                let [low, high] = cell.map(Point::from_array);
                let widened = Aabb { low: low - reach, high: high + reach };
                if selection.may_meet(&widened) {
                    near = near.with(low).with(high);
                }
            }
            near
        })
    }

    /// Returns whether a tetrahedron of the chunk with these vertices may meet the selection.
    fn may_meet(
        &mut self,
        part: &Subdomain,
        selection: &Selection,
        chunk: u32,
        nodes: [u32; 4],
    ) -> bool {
        let reach = reach(part, chunk as usize);
        let mut around = Aabb::EMPTY;
        for v in nodes {
            let c = vertex_chunk(part, v, &mut self.place);
            let near = self.cells(part, selection, reach, c);
            if near.low.x > near.high.x {
                return false;
            }
            around = around.with(near.low).with(near.high);
        }
        selection.may_meet(&around)
    }
}

/// Returns whether a vertex that leads tetrahedra of the chunk may be near enough to the selection.
fn is_led_near(part: &Subdomain, selection: &Selection, chunk: usize) -> bool {
    let leaders = leaders(part, chunk);
    let first = part.vertex_chunk_of(leaders.start);
    let last = part.vertex_chunk_of(leaders.end.saturating_sub(1)).max(first);
    let (mut nearby, reach) = (Nearby::default(), reach(part, chunk));
    (first..=last).any(|c| {
        let near = nearby.cells(part, selection, reach, c);
        near.low.x <= near.high.x
    })
}
