//! Sealed vertices: the high bytes of neighboring coordinates agree, the low ones are noise kept as it is.

use super::columns::{Columns, Malformed, Reader, unzigzag32, zigzag32};
use super::steps::{put_points, steps32, take_points, walk32};
use super::{ChunkKind, ChunkRecord};
use crate::record::SealedVertex;

/// Guesses the index of a vertex in its owner's numbering: as far from its place as at that owner's last vertex.
///
/// For the vertices a sub-domain owns, index and place are the same, and the guess is always right.
#[derive(Default)]
struct IndexGuess {
    offset: [u32; 16],
}

impl IndexGuess {
    fn of(&mut self, owner: u32) -> &mut u32 {
        &mut self.offset[owner as usize % 16]
    }
}

impl ChunkRecord for SealedVertex {
    const KIND: ChunkKind = ChunkKind::Vertices;
    const COUNT_MAX: usize = 8192;
    const RAW_BYTES_MAX: usize = 3 * 8 + 4 + 10 + 10 + 5;

    fn encode(records: &[Self], first: u32, columns: &mut Columns) {
        put_points(records.iter().map(|v| v.point), columns);
        let sizes: Vec<u64> =
            steps32(records.iter().map(|v| v.h.to_bits())).map(u64::from).collect();
        columns.planes(&sizes, 4);
        columns.dictionary(records.iter().map(|v| u64::from(v.tag)));
        columns.dictionary(records.iter().map(|v| v.id >> 32));
        let mut guess = IndexGuess::default();
        columns.varints32(records.iter().zip(first..).map(|(v, place)| {
            let (offset, index) = (guess.of((v.id >> 32) as u32), v.id as u32);
            let z = zigzag32(index, place.wrapping_add(*offset));
            *offset = index.wrapping_sub(place);
            z
        }));
    }

    fn decode(
        columns: &mut Reader<'_>,
        first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        let start = records.len();
        let empty = Self { point: [0.0; 3], h: 0.0, tag: 0, id: 0 };
        records.resize(start + count, empty);
        let records = &mut records[start..];
        take_points(columns, count, |i, axis, x| records[i].point[axis] = x)?;
        let sizes = columns.planes(count, 4)?.into_iter().map(|z| z as u32);
        for (v, bits) in records.iter_mut().zip(walk32(sizes)) {
            v.h = f32::from_bits(bits);
        }
        columns.dictionary(count, |i, tag| records[i].tag = tag as u32)?;
        columns.dictionary(count, |i, owner| records[i].id = owner << 32)?;
        let mut guess = IndexGuess::default();
        for (v, place) in records.iter_mut().zip(first..) {
            let offset = guess.of((v.id >> 32) as u32);
            let index = unzigzag32(columns.varint32()?, place.wrapping_add(*offset));
            *offset = index.wrapping_sub(place);
            v.id |= u64::from(index);
        }
        Ok(())
    }
}
