//! The tetrahedra of a selection chunk by chunk, so that the caller chooses which chunks to read, and when.

use super::hit::Hit;
use super::marks::Marks;
use super::select::{chunks_of, hits_in};
use super::selection::Selection;
use super::{QueryError, QuerySession};

/// A chunk of tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TetChunk {
    /// Rank of its sub-domain.
    pub subdomain: u32,
    /// Its number in the sub-domain.
    pub chunk: u32,
    /// Number of its tetrahedra.
    pub n_tets: u32,
    /// True if all of them are hits for sure: they can be counted without being read.
    pub is_whole: bool,
}

/// A selection that is read chunk by chunk.
pub struct ChunkedSelection {
    selection: Selection,
    /// Marks of the sub-domain read last.
    marks: Option<(u32, Option<Marks>)>,
}

impl QuerySession {
    /// The chunks that may have hits, in the order of ids. Errors: as [`QuerySession::select`].
    pub fn chunks(&mut self, selection: &Selection) -> Result<Vec<TetChunk>, QueryError> {
        let mut all = Vec::new();
        for rank in self.ranks_of(selection)? {
            let (chunks, _) = chunks_of(self, selection, rank)?;
            let ranges = self.extra_ranges(rank, &selection.condition_extra)?;
            let summaries = self.part(rank)?.subdomain.tet_summaries();
            all.extend(chunks.into_iter().map(|chunk| {
                let summary = &summaries[chunk as usize];
                let is_whole = selection.holds_for_all(rank, summary, ranges.of(chunk));
                TetChunk { subdomain: rank, chunk, n_tets: summary.count, is_whole }
            }));
        }
        Ok(all)
    }
}

impl ChunkedSelection {
    /// Errors: as [`QuerySession::select`].
    pub fn new(session: &mut QuerySession, selection: Selection) -> Result<Self, QueryError> {
        session.check(&selection)?;
        Ok(Self { selection, marks: None })
    }

    /// The hits in a chunk, in the order of ids. Errors: a chunk that is not there; damage.
    pub fn hits(
        &mut self,
        session: &mut QuerySession,
        subdomain: u32,
        chunk: u32,
    ) -> Result<Vec<Hit>, QueryError> {
        let part = &session.part(subdomain)?.subdomain;
        if chunk as usize >= part.tet_summaries().len() {
            return Err(QueryError::NoChunk { subdomain, chunk });
        }
        if self.marks.as_ref().is_none_or(|(rank, _)| *rank != subdomain) {
            self.marks = None;
            let marks = session.marks(subdomain, &self.selection)?;
            self.marks = Some((subdomain, marks));
        }
        let marks = self.marks.as_ref().map_or(&None, |(_, marks)| marks);
        hits_in(session, &self.selection, marks, subdomain, chunk)
    }
}
