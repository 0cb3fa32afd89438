//! Answers sorted by a number, more of them than memory holds if need be.

use std::path::Path;

use tetdb_schema::ids::TetId;

use super::QueryError;
use super::hit::Hit;
use tetdb_base::geom::Point;
use tetdb_base::storage::{Sorted, Sorter, sort_record, total_order};

sort_record! {
    /// A hit, first by the variable it is sorted by.
    struct OrderedHit {
        key: u64,
        id: u64,
        vertices: [u64; 4],
        corners: [[f64; 3]; 4],
        region: u32,
        /// A bit for each face on the surface, or [`UNKNOWN`].
        on_surface: u32,
    }
}

/// Value for a hit whose faces on the surface are not known.
const UNKNOWN: u32 = 16;

/// Tetrahedra ascending by one of the [`VARIABLES`](super::VARIABLES), or descending; equal ones by id.
pub struct Ordered {
    sorted: Sorted<OrderedHit>,
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
        Ok(Self { sorted: sorter.finish()? })
    }
}

impl Iterator for Ordered {
    type Item = Result<Hit, QueryError>;

    fn next(&mut self) -> Option<Self::Item> {
        let record = self.sorted.next()?;
        Some(record.map(hit).map_err(QueryError::from))
    }
}

fn record(tet: &Hit, value: f64, descending: bool) -> OrderedHit {
    let rising = total_order(value);
    OrderedHit {
        key: if descending { !rising } else { rising },
        id: tet.id.number(),
        vertices: tet.vertices,
        corners: tet.corners.map(|c| c.to_array()),
        region: tet.region,
        on_surface: tet
            .on_surface
            .map_or(UNKNOWN, |faces| (0..4).map(|i| u32::from(faces[i]) << i).sum()),
    }
}

fn hit(record: OrderedHit) -> Hit {
    let id = TetId::from_number(record.id).expect("it was written from an id");
    let corners = record.corners.map(Point::from_array);
    let known = (record.on_surface != UNKNOWN).then_some(record.on_surface);
    Hit {
        on_surface: known.map(|bits| [0, 1, 2, 3].map(|i| bits >> i & 1 != 0)),
        ..Hit::new(id, record.region, record.vertices, corners)
    }
}
