//! Rows of an array in an HDF5 file.

use hdf5_reader::error::Error;
use hdf5_reader::{Dataset, Datatype, SliceInfo, SliceInfoElem};

/// Numbers of an array that are read at once.
const AT_ONCE: u64 = 1 << 15;

/// The word of VTK for a type of numbers.
pub fn kind(datatype: &Datatype) -> Option<&'static str> {
    Some(match datatype {
        Datatype::FixedPoint { size: 1, signed: true, .. } => "Int8",
        Datatype::FixedPoint { size: 1, .. } => "UInt8",
        Datatype::FixedPoint { size: 2, signed: true, .. } => "Int16",
        Datatype::FixedPoint { size: 2, .. } => "UInt16",
        Datatype::FixedPoint { size: 4, signed: true, .. } => "Int32",
        Datatype::FixedPoint { size: 4, .. } => "UInt32",
        Datatype::FixedPoint { size: 8, signed: true, .. } => "Int64",
        Datatype::FixedPoint { size: 8, .. } => "UInt64",
        Datatype::FloatingPoint { size: 4, .. } => "Float32",
        Datatype::FloatingPoint { size: 8, .. } => "Float64",
        _ => return None,
    })
}

/// Rows of an array of a file, read block by block.
pub struct HdfRows {
    dataset: Dataset,
    first: u64,
    next: u64,
    end: u64,
}

impl HdfRows {
    /// So many rows from one on.
    pub fn new(dataset: Dataset, first: u64, rows: u64) -> Self {
        Self { dataset, first, next: first, end: first.saturating_add(rows) }
    }

    /// Number of the first row.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// The bytes of the next rows, low ones first; `None` at the end, or where data are damaged or missing.
    pub fn next_block(&mut self) -> Option<Vec<u8>> {
        let columns: u64 = self.dataset.shape().iter().skip(1).product();
        let end = self.end.min(self.next + (AT_ONCE / columns.max(1)).max(1));
        if end <= self.next || end > *self.dataset.shape().first()? {
            return None;
        }
        let mut selections = vec![SliceInfoElem::Slice { start: self.next, end, step: 1 }];
        let others = self.dataset.shape().iter().skip(1);
        selections.extend(others.map(|&n| SliceInfoElem::Slice { start: 0, end: n, step: 1 }));
        let rows = SliceInfo { selections };
        self.next = end;
        macro_rules! bytes {
            ($type:ty) => {{
                let read: Result<_, Error> = self.dataset.read_slice::<$type>(&rows);
                Some(read.ok()?.iter().flat_map(|x| x.to_le_bytes()).collect())
            }};
        }
        match kind(self.dataset.dtype())? {
            "Int8" => bytes!(i8),
            "UInt8" => bytes!(u8),
            "Int16" => bytes!(i16),
            "UInt16" => bytes!(u16),
            "Int32" => bytes!(i32),
            "UInt32" => bytes!(u32),
            "Int64" => bytes!(i64),
            "UInt64" => bytes!(u64),
            "Float32" => bytes!(f32),
            _ => bytes!(f64),
        }
    }
}
