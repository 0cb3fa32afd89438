//! Sealed tetrahedra: in order of their smallest vertices, most differences are tiny.

use super::columns::{Columns, Malformed, Reader, unzigzag32, zigzag32};
use super::{ChunkKind, ChunkRecord};
use crate::record::SealedTet;

/// What node `I` of a tetrahedron is compared with: the nearest number already known.
///
/// The tetrahedra that share their first vertex, or their first edge, follow each other; there the
/// difference to the predecessor is smaller than the difference inside the tetrahedron.
#[inline]
fn base<const I: usize>(nodes: &[u32; 4], before: &[u32; 4]) -> u32 {
    let like_before = match I {
        0 => true,
        1 => nodes[0] == before[0],
        2 => nodes[0] == before[0] && nodes[1] == before[1],
        _ => false,
    };
    if like_before { before[I] } else { nodes[I - 1] }
}

/// Appends the four columns of nodes.
pub(super) fn encode_nodes(records: &[SealedTet], columns: &mut Columns) {
    let mut scratch = vec![0; records.len()];
    encode_node::<0>(records, &mut scratch, columns);
    encode_node::<1>(records, &mut scratch, columns);
    encode_node::<2>(records, &mut scratch, columns);
    encode_node::<3>(records, &mut scratch, columns);
}

/// The inverse of [`encode_nodes`]; fills the nodes of `records`.
pub(super) fn decode_nodes(
    columns: &mut Reader<'_>,
    records: &mut [SealedTet],
) -> Result<(), Malformed> {
    let mut steps = [const { Vec::new() }; 4];
    for column in &mut steps {
        column.resize(records.len(), 0);
        columns.planes32(column)?;
    }
    let [first, second, third, fourth] = &steps;
    let rest = second.iter().zip(third).zip(fourth);
    let mut before = [0; 4];
    // In one pass, for each node's base is among those just found.
    for (tet, (&a, ((&b, &c), &d))) in records.iter_mut().zip(first.iter().zip(rest)) {
        let mut nodes = [0; 4];
        nodes[0] = unzigzag32(a, base::<0>(&nodes, &before));
        nodes[1] = unzigzag32(b, base::<1>(&nodes, &before));
        nodes[2] = unzigzag32(c, base::<2>(&nodes, &before));
        nodes[3] = unzigzag32(d, base::<3>(&nodes, &before));
        tet.nodes = nodes;
        before = nodes;
    }
    Ok(())
}

fn encode_node<const I: usize>(records: &[SealedTet], scratch: &mut [u32], columns: &mut Columns) {
    let mut before = [0; 4];
    for (z, t) in scratch.iter_mut().zip(records) {
        *z = zigzag32(t.nodes[I], base::<I>(&t.nodes, &before));
        before = t.nodes;
    }
    columns.planes32(scratch);
}

impl ChunkRecord for SealedTet {
    const KIND: ChunkKind = ChunkKind::Tets;
    const COUNT_MAX: usize = 32_768;
    const RAW_BYTES_MAX: usize = 4 * 4 + 10;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        encode_nodes(records, columns);
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
        decode_nodes(columns, records)?;
        columns.dictionary(count, |i, region| records[i].region = region as u32)
    }
}
