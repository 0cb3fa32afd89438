//! Answers sorted by a number, more of them than memory holds if need be.

use std::path::Path;

use tetdb_schema::ids::TetId;

use super::hit::Hit;
use super::{EXTRA_MAX, QueryError};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Sorted, Sorter, sort_record, total_order};
use tetdb_schema::field::Scalar;

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
        extra: [u64; EXTRA_MAX],
        /// A bit for each integer among `extra`.
        integers: u32,
    }
}

/// Value for a hit whose faces on the surface are not known.
const UNKNOWN: u32 = 16;

/// Tetrahedra ascending by one of the [`VARIABLES`](super::VARIABLES) or of the extra values behind them, or descending; equal ones by id.
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
            sorter.push(record(&tet, tet.value(variable), descending))?;
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
        extra: tet.extra.map(|value| match value {
            Scalar::Int(n) => n as u64,
            Scalar::Float(x) => x.to_bits(),
        }),
        integers: (0..EXTRA_MAX)
            .map(|i| u32::from(matches!(tet.extra[i], Scalar::Int(_))) << i)
            .sum(),
    }
}

fn hit(record: OrderedHit) -> Hit {
    let id = TetId::from_number(record.id).expect("it was written from an id");
    let corners = record.corners.map(Point::from_array);
    let known = (record.on_surface != UNKNOWN).then_some(record.on_surface);
    Hit {
        on_surface: known.map(|bits| [0, 1, 2, 3].map(|i| bits >> i & 1 != 0)),
        extra: std::array::from_fn(|i| match record.integers >> i & 1 {
            0 => Scalar::Float(f64::from_bits(record.extra[i])),
            _ => Scalar::Int(record.extra[i] as i64),
        }),
        ..Hit::new(id, record.region, record.vertices, corners)
    }
}
