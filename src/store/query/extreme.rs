//! A given number of the best or the worst tetrahedra, without reading all.

use super::hit::Hit;
use super::select::hits_in;
use super::selection::Selection;
use super::session::bounds_of;
use super::{QueryError, QuerySession};

/// A chunk and the greatest (or least, then negative) quality its summary promises.
struct Promise {
    quality: f64,
    rank: u32,
    chunk: u32,
}

impl QuerySession {
    /// Returns whether [`QuerySession::extreme`] can answer `selection`: no condition needs marks of tetrahedra.
    pub fn has_extremes(&self, selection: &Selection) -> bool {
        selection.labels.is_none() && selection.interface.is_none()
    }

    /// The `limit` tetrahedra of greatest quality `q` (the worst), or of the least, in that order; equal ones by id.
    ///
    /// Chunks are read in the order of what their summaries promise, until no other can have any. Memory: twice the
    /// answer and a chunk. Errors: as [`QuerySession::select`]; panics where there are [none](QuerySession::has_extremes).
    pub fn extreme(
        &mut self,
        selection: &Selection,
        greatest: bool,
        limit: usize,
    ) -> Result<Vec<Hit>, QueryError> {
        assert!(self.has_extremes(selection), "faces mark tetrahedra");
        self.check(selection)?;
        let sign = if greatest { 1.0 } else { -1.0 };
        let key = |f: &Hit| sign * f.shape.quality;
        let mut best: Vec<Hit> = Vec::new();
        for promise in self.promises(selection, sign)? {
            let least = best.get(limit.wrapping_sub(1)).map(key);
            if limit == 0 || least.is_some_and(|least| promise.quality < least) {
                break;
            }
            let found = hits_in(self, selection, &None, promise.rank, promise.chunk)?;
            best.extend(found);
            best.sort_by(|a, b| key(b).total_cmp(&key(a)).then(a.id.cmp(&b.id)));
            best.truncate(limit);
        }
        Ok(best)
    }

    /// Chunks that may have hits, the most promising first.
    fn promises(&mut self, selection: &Selection, sign: f64) -> Result<Vec<Promise>, QueryError> {
        let rows = self.rows.iter();
        let ranks: Vec<u32> = rows
            .filter(|row| selection.may_be_in(row.rank, &bounds_of(row)))
            .map(|row| row.rank)
            .collect();
        let mut promises = Vec::new();
        for rank in ranks {
            let ranges = self.extra_ranges(rank, &selection.condition_extra)?;
            let part = &self.part(rank)?.subdomain;
            for (chunk, summary) in (0u32..).zip(part.tet_summaries()) {
                if selection.may_be_among(rank, summary, ranges.of(chunk)) {
                    // Summaries round to the nearest.
                    let [least, most] = summary.quality;
                    let quality = match sign > 0.0 {
                        true => f64::from(most.next_up()),
                        false => -f64::from(least.next_down()),
                    };
                    promises.push(Promise { quality, rank, chunk });
                }
            }
        }
        promises.sort_by(|a, b| {
            let by_quality = b.quality.total_cmp(&a.quality);
            by_quality.then((a.rank, a.chunk).cmp(&(b.rank, b.chunk)))
        });
        Ok(promises)
    }
}
