//! Sealed tetrahedra: in order of their smallest vertices, most differences are tiny.

use super::columns::{Columns, Malformed, Reader, unzigzag32, zigzag32};
use super::{ChunkKind, ChunkRecord};
use crate::record::SealedTet;

/// Column `i` of a tetrahedron, given the one before: a difference to the nearest number already known.
///
/// The tetrahedra that share their first vertex, or their first edge, follow each other; there the
/// difference to the predecessor is smaller than the difference inside the tetrahedron.
#[inline]
fn base(i: usize, nodes: &[u32; 4], before: &[u32; 4]) -> u32 {
    if i == 0 || (i < 3 && nodes[..i] == before[..i]) {
        before[i]
    } else {
        nodes[i - 1]
    }
}

impl ChunkRecord for SealedTet {
    const KIND: ChunkKind = ChunkKind::Tets;
    const COUNT_MAX: usize = 32_768;
    const RAW_BYTES_MAX: usize = 4 * 5 + 10;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        for i in 0..4 {
            let mut before = [0; 4];
            columns.varints32(records.iter().map(|t| {
                let z = zigzag32(t.nodes[i], base(i, &t.nodes, &before));
                before = t.nodes;
                z
            }));
        }
        columns.dictionary(records.iter().map(|t| u64::from(t.region)));
    }

    fn decode(
        columns: &mut Reader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        let start = records.len();
        records.resize(start + count, Self::default());
        let records = &mut records[start..];
        for i in 0..4 {
            let mut before = [0; 4];
            for t in records.iter_mut() {
                t.nodes[i] = unzigzag32(columns.varint32()?, base(i, &t.nodes, &before));
                before = t.nodes;
            }
        }
        columns.dictionary(count, |i, region| records[i].region = region as u32)
    }
}
