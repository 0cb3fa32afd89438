//! Summaries of chunks: boxes, ranges and counts, by which a reader skips chunks.

use super::columns::{ColumnReader, ColumnWriter, Malformed};
use super::{ChunkKind, ChunkRecord};

/// Summary of a chunk of tetrahedra; 128 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TetSummary {
    /// Bounding box of the vertices: low corner, high corner.
    pub bounds: [[f64; 3]; 2],
    /// Sum of the volumes in order.
    pub volume: f64,
    /// Least and greatest quality q.
    pub quality: [f32; 2],
    /// Least and greatest region.
    pub regions: [u32; 2],
    /// Least and greatest vertex number.
    pub vertices: [u32; 2],
    /// Number of the first record.
    pub first: u32,
    /// Number of records.
    pub count: u32,
    /// Faces without a partner in the chunk: shared with other chunks or on the boundary.
    pub open_faces: u32,
    /// Bytes of the stored value.
    pub bytes: u32,
    /// Upper bound of all edge lengths; 0 if unknown.
    pub edge_max: f32,
}

/// Summary of a chunk of vertices; 64 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexSummary {
    /// Bounding box: low corner, high corner.
    pub bounds: [[f64; 3]; 2],
    /// Number of the first record.
    pub first: u32,
    /// Number of records.
    pub count: u32,
    /// Cells with vertices: bit x + 4 y + 16 z, in the box divided in four along each axis. 0 if unknown.
    pub cells: u64,
}

/// Summary of a chunk of facets or interface faces; 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RangeSummary<const INTERFACE: bool> {
    /// Number of the first record.
    pub first: u32,
    /// Number of records.
    pub count: u32,
}

/// A number, or an array of them, of fixed width and little-endian.
trait Fixed: Sized {
    fn put(&self, bytes: &mut Vec<u8>);
    /// Takes a value from the front of `bytes`.
    fn take(bytes: &mut &[u8]) -> Self;
}

macro_rules! fixed_numbers {
    ($($number:ty)+) => {$(
        impl Fixed for $number {
            fn put(&self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
            fn take(bytes: &mut &[u8]) -> Self {
                let (head, rest) = bytes.split_first_chunk().expect("fields fit into the width");
                *bytes = rest;
                Self::from_le_bytes(*head)
            }
        }
    )+};
}
fixed_numbers!(u32 u64 f32 f64);

impl<T: Fixed, const N: usize> Fixed for [T; N] {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.iter().for_each(|t| t.put(bytes));
    }
    fn take(bytes: &mut &[u8]) -> Self {
        std::array::from_fn(|_| T::take(bytes))
    }
}

/// Generates both directions of a summary: its fields in order, then zeros up to its width. The given function checks a summary that was
/// read.
macro_rules! fixed_fields {
    ($check:expr; $($field:ident),+) => {
        const RAW_BYTES_MAX: usize = Self::BYTES;

        fn encode(records: &[Self], _first: u32, columns: &mut ColumnWriter) {
            for summary in records {
                let end = columns.bytes.len() + Self::BYTES;
                $(summary.$field.put(&mut columns.bytes);)+
                columns.bytes.resize(end, 0);
            }
        }

        fn decode(
            columns: &mut ColumnReader<'_>,
            _first: u32,
            count: usize,
            records: &mut Vec<Self>,
        ) -> Result<(), Malformed> {
            for _ in 0..count {
                let mut bytes = columns.raw(Self::BYTES)?;
                let summary = Self { $($field: Fixed::take(&mut bytes)),+ };
                if bytes.iter().any(|&b| b != 0) {
                    return Err(Malformed("a reserved byte is not zero"));
                }
                if !$check(&summary) {
                    return Err(Malformed("a summary that no chunk can have"));
                }
                records.push(summary);
            }
            Ok(())
        }
    };
}

/// True if a box has finite corners, the low one first.
pub fn is_box([low, high]: &[[f64; 3]; 2]) -> bool {
    let ends = low.iter().zip(high);
    ends.into_iter().all(|(low, high)| low.is_finite() && high.is_finite() && low <= high)
}

impl TetSummary {
    /// Bytes of a summary.
    pub const BYTES: usize = 128;

    /// True if a chunk can have this summary.
    fn is_sound(&self) -> bool {
        let [least, most] = self.quality;
        is_box(&self.bounds)
            && least <= most
            && self.regions[0] <= self.regions[1]
            && self.vertices[0] <= self.vertices[1]
            && self.edge_max >= 0.0
            && !self.volume.is_nan()
            && self.count > 0
    }
}

impl ChunkRecord for TetSummary {
    const KIND: ChunkKind = ChunkKind::TetSummaries;
    const COUNT_MAX: usize = 2048;
    fixed_fields! {
        Self::is_sound;
        bounds, volume, quality, regions, vertices, first, count, open_faces, bytes, edge_max
    }
}

impl VertexSummary {
    /// Bytes of a summary.
    pub const BYTES: usize = 64;

    /// Bits of the cells of a box that contain at least one of the points.
    pub fn cells_of(bounds: &[[f64; 3]; 2], points: impl Iterator<Item = [f64; 3]>) -> u64 {
        let cell = |axis: usize, x: f64| {
            let [low, high] = [bounds[0][axis], bounds[1][axis]];
            let share = (x - low) / (high - low);
            // For a box without extent this is not a number, and becomes 0.
            (share * 4.0).clamp(0.0, 3.0) as u32
        };
        points.fold(0, |cells, p| {
            cells | 1 << (cell(0, p[0]) + 4 * cell(1, p[1]) + 16 * cell(2, p[2]))
        })
    }

    /// Boxes that together contain all vertices: the cells with vertices, slightly enlarged, or the whole box.
    pub fn cells(&self) -> impl Iterator<Item = [[f64; 3]; 2]> + '_ {
        /// Enlargement of a cell, in extents of the box; more than rounding can move a border.
        const SLACK: f64 = 1e-9;
        let whole = (self.cells == 0).then_some(self.bounds);
        let bits = (0..64u32).filter(|i| self.cells >> i & 1 == 1);
        let [low, high] = self.bounds;
        whole.into_iter().chain(bits.map(move |i| {
            let place = [i & 3, i >> 2 & 3, i >> 4].map(f64::from);
            [0.0, 1.0].map(|end| {
                std::array::from_fn(|axis| {
                    let share = (place[axis] + end) / 4.0 + (2.0 * end - 1.0) * SLACK;
                    let x = low[axis] + share * (high[axis] - low[axis]);
                    x.clamp(low[axis], high[axis])
                })
            })
        }))
    }
}

impl ChunkRecord for VertexSummary {
    const KIND: ChunkKind = ChunkKind::VertexSummaries;
    const COUNT_MAX: usize = 4096;
    fixed_fields! { |summary: &Self| is_box(&summary.bounds); bounds, first, count, cells }
}

impl<const INTERFACE: bool> RangeSummary<INTERFACE> {
    /// Bytes of a summary.
    pub const BYTES: usize = 16;
}

impl<const INTERFACE: bool> ChunkRecord for RangeSummary<INTERFACE> {
    const KIND: ChunkKind =
        if INTERFACE { ChunkKind::InterfaceSummaries } else { ChunkKind::FacetSummaries };
    const COUNT_MAX: usize = 16_384;
    fixed_fields! { |_: &Self| true; first, count }
}

/// Summary of one component of a field in a chunk; 64 bytes. With `AT_TETS`, the range of a field at vertices over the tetrahedra of a chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldSummary<const AT_TETS: bool> {
    /// Number of the first value.
    pub first: u32,
    /// Number of values.
    pub count: u32,
    /// The first of its stored pieces.
    pub piece: u32,
    /// Number of its pieces.
    pub pieces: u32,
    /// Number of values that are not numbers.
    pub nan: u32,
    /// Least value; infinite where none is a number.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
}

impl<const AT_TETS: bool> FieldSummary<AT_TETS> {
    /// Bytes of a summary.
    pub const BYTES: usize = 64;
}

impl<const AT_TETS: bool> ChunkRecord for FieldSummary<AT_TETS> {
    const KIND: ChunkKind =
        if AT_TETS { ChunkKind::FieldTetSummaries } else { ChunkKind::FieldSummaries };
    const COUNT_MAX: usize = 4096;
    fixed_fields! {
        |summary: &Self| !summary.low.is_nan() && !summary.high.is_nan();
        first, count, piece, pieces, nan, low, high
    }
}
