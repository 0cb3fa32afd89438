//! Answers sorted by a number, more of them than memory holds if need be.

use std::path::Path;

use tetdb_schema::ids::TetId;

use super::QueryError;
use super::hit::Hit;
use crate::geom::Point;
use crate::storage::{Sorted, Sorter};

/// Bytes of a record: key, id, vertices, corners, region.
const BYTES: usize = 8 + 8 + 4 * 8 + 12 * 8 + 4;

/// Tetrahedra ascending by one of the [`VARIABLES`](super::VARIABLES), or descending; equal ones by id.
pub struct Ordered {
    sorted: Sorted<BYTES>,
}

impl Ordered {
    /// Sorts all of `found` by the variable at a position, with runs in `dir` beyond `memory_bytes`.
    ///
    /// Errors: those of `found`; the disk.
    pub fn new(
        found: impl Iterator<Item = Result<Hit, QueryError>>,
        variable: usize,
        descending: bool,
        dir: &Path,
        memory_bytes: u64,
    ) -> Result<Self, QueryError> {
        let mut sorter = Sorter::new(dir, memory_bytes);
        for tet in found {
            let tet = tet?;
            sorter.push(record(&tet, tet.values()[variable], descending))?;
        }
        Ok(Self {
            sorted: sorter.finish()?,
        })
    }
}

impl Iterator for Ordered {
    type Item = Result<Hit, QueryError>;

    fn next(&mut self) -> Option<Self::Item> {
        let record = self.sorted.next()?;
        Some(record.map(|r| found(&r)).map_err(QueryError::from))
    }
}

fn record(tet: &Hit, key: f64, descending: bool) -> [u8; BYTES] {
    // Bits in the order of the numbers: negative ones turned over, the others above them.
    let bits = key.to_bits();
    let rising = bits ^ if bits >> 63 == 1 { u64::MAX } else { 1 << 63 };
    let key = if descending { !rising } else { rising };
    let words = [key, tet.id.number()].into_iter().chain(tet.vertices);
    let corners = tet.corners.iter().flat_map(|c| c.to_array());
    let mut record = [0; BYTES];
    for (place, word) in record
        .chunks_exact_mut(8)
        .zip(words.chain(corners.map(f64::to_bits)))
    {
        place.copy_from_slice(&word.to_be_bytes());
    }
    record[BYTES - 4..].copy_from_slice(&tet.region.to_be_bytes());
    record
}

fn found(record: &[u8; BYTES]) -> Hit {
    let word = |i: usize| {
        let bytes = record[8 * i..8 * i + 8].try_into();
        u64::from_be_bytes(bytes.expect("eight bytes were taken"))
    };
    let corner = |i: usize| {
        let axis = |k: usize| f64::from_bits(word(6 + 3 * i + k));
        Point::new(axis(0), axis(1), axis(2))
    };
    let id = TetId::from_number(word(1)).expect("it was made from an id");
    let region = record[BYTES - 4..].try_into();
    let region = u32::from_be_bytes(region.expect("four bytes were taken"));
    let vertices = [2, 3, 4, 5].map(word);
    Hit::new(id, region, vertices, [0, 1, 2, 3].map(corner))
}
