//! Coarse snapshots: working meshes kept as they were, in the order they were, less what follows from the rest (neighbors, sizes).

use super::columns::{Columns, Malformed, Reader};
use super::facets::{decode_vertices, encode_vertices};
use super::steps::{
    put_points, put_steps32, put_steps64, steps32, take_points, take_steps32, take_steps64, walk32,
};
use super::tets::{decode_nodes, encode_nodes};
use super::{ChunkKind, ChunkRecord};
use crate::record::{CoarseFace, CoarseTet, CoarseVertex, Facet, SealedTet};

/// The even orders of four nodes.
const TURNS: [[usize; 4]; 12] = [
    [0, 1, 2, 3],
    [0, 2, 3, 1],
    [0, 3, 1, 2],
    [1, 0, 3, 2],
    [1, 3, 2, 0],
    [1, 2, 0, 3],
    [2, 0, 1, 3],
    [2, 1, 3, 0],
    [2, 3, 0, 1],
    [3, 0, 2, 1],
    [3, 2, 1, 0],
    [3, 1, 0, 2],
];

/// Of the order in which the first node is that number `i` and the second number `j`: its place in [`TURNS`].
const TURN_OF: [[u8; 4]; 4] = {
    let (mut table, mut n) = ([[NO_TURN; 4]; 4], 0);
    while n < TURNS.len() {
        let [i, j, ..] = TURNS[n];
        table[i][j] = n as u8;
        n += 1;
    }
    table
};
/// One node cannot be two.
const NO_TURN: u8 = u8::MAX;

impl CoarseTet {
    /// The nodes turned as those of a sealed tetrahedron, and which of [`TURNS`] turns them back.
    fn turned(&self) -> (SealedTet, u8) {
        let turned = SealedTet { nodes: self.nodes, region: self.region }.rotated();
        let [a, b, c, _] = turned.nodes;
        let place = |node: u32| match node {
            _ if node == a => 0,
            _ if node == b => 1,
            _ if node == c => 2,
            _ => 3,
        };
        let back = TURN_OF[place(self.nodes[0])][place(self.nodes[1])];
        assert!(back != NO_TURN, "a tetrahedron has four nodes");
        (turned, back)
    }
}

impl ChunkRecord for CoarseTet {
    const KIND: ChunkKind = ChunkKind::CoarseTets;
    const COUNT_MAX: usize = 32_768;
    const RAW_BYTES_MAX: usize = 4 * 4 + 1 + 3 * 10;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        let (turned, turns): (Vec<SealedTet>, Vec<u8>) = records.iter().map(Self::turned).unzip();
        encode_nodes(&turned, columns);
        columns.raw(&turns);
        columns.dictionary(records.iter().map(|t| u64::from(t.bits)));
        columns.dictionary(records.iter().map(|t| u64::from(t.region)));
        columns.dictionary(records.iter().map(|t| u64::from(t.flags)));
    }

    fn decode(
        columns: &mut Reader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        let mut turned = vec![SealedTet::default(); count];
        decode_nodes(columns, &mut turned)?;
        let start = records.len();
        for (tet, &turn) in turned.iter().zip(columns.raw(count)?) {
            let turn = TURNS.get(usize::from(turn)).ok_or(Malformed("an unknown turn"))?;
            records.push(Self { nodes: turn.map(|i| tet.nodes[i]), ..Self::default() });
        }
        let records = &mut records[start..];
        columns.dictionary(count, |i, bits| records[i].bits = bits as u8)?;
        columns.dictionary(count, |i, region| records[i].region = region as u32)?;
        columns.dictionary(count, |i, flags| records[i].flags = flags as u32)
    }
}

impl ChunkRecord for CoarseVertex {
    const KIND: ChunkKind = ChunkKind::CoarseVertices;
    const COUNT_MAX: usize = 8192;
    const RAW_BYTES_MAX: usize = 3 * 8 + 10 + 5;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        put_points(records.iter().map(|v| v.point), columns);
        columns.dictionary(records.iter().map(|v| u64::from(v.tag)));
        let owners: Vec<u32> = steps32(records.iter().map(|v| v.owner)).collect();
        columns.planes32(&owners);
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
        take_points(columns, count, |i, axis, x| records[i].point[axis] = x)?;
        columns.dictionary(count, |i, tag| records[i].tag = tag as u32)?;
        let mut owners = vec![0; count];
        columns.planes32(&mut owners)?;
        for (v, owner) in records.iter_mut().zip(walk32(owners.into_iter())) {
            v.owner = owner;
        }
        Ok(())
    }
}

impl ChunkRecord for Facet {
    const KIND: ChunkKind = ChunkKind::CoarseFacets;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 10 + 10 + 2 * 10;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        encode_vertices(records.iter().map(|f| f.vertices), columns);
        columns.dictionary(records.iter().map(|f| u64::from(f.label)));
        put_steps64(records.iter().map(|f| f.triangle), columns);
        for side in 0..2 {
            columns.dictionary(records.iter().map(|f| u64::from(f.regions[side])));
        }
    }

    fn decode(
        columns: &mut Reader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        let start = records.len();
        let faces = decode_vertices(columns, count)?;
        records.extend(faces.into_iter().map(|vertices| Self {
            vertices,
            label: 0,
            triangle: 0,
            regions: [0; 2],
        }));
        let records = &mut records[start..];
        columns.dictionary(count, |i, label| records[i].label = label as u32)?;
        take_steps64(columns, count, |i, triangle| records[i].triangle = triangle)?;
        for side in 0..2 {
            columns.dictionary(count, |i, r| records[i].regions[side] = r as u32)?;
        }
        Ok(())
    }
}

impl ChunkRecord for CoarseFace {
    const KIND: ChunkKind = ChunkKind::CoarseFaces;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 2 * 10 + 5;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        encode_vertices(records.iter().map(|f| f.vertices), columns);
        columns.dictionary(records.iter().map(|f| u64::from(f.cut)));
        columns.dictionary(records.iter().map(|f| u64::from(f.side)));
        put_steps32(records.iter().map(|f| f.index), columns);
    }

    fn decode(
        columns: &mut Reader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        let start = records.len();
        let faces = decode_vertices(columns, count)?;
        records.extend(faces.into_iter().map(|vertices| Self { vertices, ..Self::default() }));
        let records = &mut records[start..];
        columns.dictionary(count, |i, cut| records[i].cut = cut as u32)?;
        columns.dictionary(count, |i, side| records[i].side = side as u32)?;
        take_steps32(columns, count, |i, index| records[i].index = index)
    }
}
