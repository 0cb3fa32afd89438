//! Numbers of fields: differences of neighbors in byte planes.

use super::columns::{ColumnReader, ColumnWriter, Malformed, unzigzag64, zigzag64};
use super::{ChunkKind, ChunkRecord};

/// One number of a field, as [`FieldNumber::pack`](crate::field::FieldNumber::pack) gives it.
///
/// Neighbors in the order of a store are near each other, so the bits of their numbers differ in the low places: the high planes are
/// nearly empty. Words of integers have their sign, so this holds for them too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldWord(pub u64);

impl ChunkRecord for FieldWord {
    const KIND: ChunkKind = ChunkKind::FieldValues;
    const COUNT_MAX: usize = 32_768;
    const RAW_BYTES_MAX: usize = 8;

    fn encode(records: &[Self], _first: u32, columns: &mut ColumnWriter) {
        let mut base = 0;
        let differences: Vec<u64> = records
            .iter()
            .map(|word| zigzag64(word.0, std::mem::replace(&mut base, word.0)))
            .collect();
        let all = differences.iter().fold(0, |all, d| all | d);
        let width = (71 - (all | 1).leading_zeros()) / 8;
        columns.raw(&[width as u8]);
        columns.planes(&differences, width as usize);
    }

    fn decode(
        columns: &mut ColumnReader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        let width = columns.raw(1)?[0];
        if !(1..=8).contains(&width) {
            return Err(Malformed("a column of no known width"));
        }
        let mut base = 0;
        records.extend(columns.planes(count, width.into())?.into_iter().map(|difference| {
            base = unzigzag64(difference, base);
            Self(base)
        }));
        Ok(())
    }
}
