//! Sealed facets and interface faces.

use super::columns::{Columns, Malformed, Reader, unzigzag32, zigzag32};
use super::steps::{put_steps32, put_steps64, take_steps32, take_steps64};
use super::{ChunkKind, ChunkRecord};
use crate::record::{InterfaceFace, SealedFacet};

/// Three vertices: the first against the face before, the others against the first.
pub(super) fn encode_vertices(
    faces: impl Iterator<Item = [u32; 3]> + Clone,
    columns: &mut Columns,
) {
    put_steps32(faces.clone().map(|[a, ..]| a), columns);
    columns.varints32(faces.clone().map(|[a, b, _]| zigzag32(b, a)));
    columns.varints32(faces.map(|[a, _, c]| zigzag32(c, a)));
}

pub(super) fn decode_vertices(
    columns: &mut Reader<'_>,
    count: usize,
) -> Result<Vec<[u32; 3]>, Malformed> {
    let mut faces = vec![[0; 3]; count];
    take_steps32(columns, count, |i, a| faces[i][0] = a)?;
    for place in 1..3 {
        for face in &mut faces {
            face[place] = unzigzag32(columns.varint32()?, face[0]);
        }
    }
    Ok(faces)
}

/// A tetrahedron, where "none" (all bits set) must stay short: it is stored as 0, the others one higher.
fn encode_tets(tets: impl Iterator<Item = u32>, columns: &mut Columns) {
    let mut base = 0;
    for t in tets {
        if t == u32::MAX {
            columns.varint(0);
        } else {
            columns.varint(u64::from(zigzag32(t, base)) + 1);
            base = t;
        }
    }
}

fn decode_tet(columns: &mut Reader<'_>, base: &mut u32) -> Result<u32, Malformed> {
    match columns.varint()? {
        0 => Ok(u32::MAX),
        z => {
            let z =
                u32::try_from(z - 1).map_err(|_| Malformed("a number has more than 32 bits"))?;
            *base = unzigzag32(z, *base);
            Ok(*base)
        }
    }
}

impl ChunkRecord for SealedFacet {
    const KIND: ChunkKind = ChunkKind::Facets;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 10 + 10 + 2 * 10 + 2 * 5;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        encode_vertices(records.iter().map(|f| f.vertices), columns);
        columns.dictionary(records.iter().map(|f| u64::from(f.label)));
        put_steps64(records.iter().map(|f| f.triangle), columns);
        for side in 0..2 {
            columns.dictionary(records.iter().map(|f| u64::from(f.regions[side])));
            encode_tets(records.iter().map(|f| f.tets[side]), columns);
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
            tets: [0; 2],
        }));
        let records = &mut records[start..];
        columns.dictionary(count, |i, label| records[i].label = label as u32)?;
        take_steps64(columns, count, |i, triangle| records[i].triangle = triangle)?;
        for side in 0..2 {
            columns.dictionary(count, |i, r| records[i].regions[side] = r as u32)?;
            let mut base = 0;
            for f in records.iter_mut() {
                f.tets[side] = decode_tet(columns, &mut base)?;
            }
        }
        Ok(())
    }
}

impl ChunkRecord for InterfaceFace {
    const KIND: ChunkKind = ChunkKind::InterfaceFaces;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 2 * 10 + 2 * 5;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        encode_vertices(records.iter().map(|f| f.vertices), columns);
        columns.dictionary(records.iter().map(|f| u64::from(f.cut)));
        columns.dictionary(records.iter().map(|f| u64::from(f.other)));
        put_steps32(records.iter().map(|f| f.index), columns);
        encode_tets(records.iter().map(|f| f.tet), columns);
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
            cut: 0,
            index: 0,
            other: 0,
            tet: 0,
        }));
        let records = &mut records[start..];
        columns.dictionary(count, |i, cut| records[i].cut = cut as u32)?;
        columns.dictionary(count, |i, other| records[i].other = other as u32)?;
        take_steps32(columns, count, |i, index| records[i].index = index)?;
        let mut base = 0;
        for f in records.iter_mut() {
            f.tet = decode_tet(columns, &mut base)?;
        }
        Ok(())
    }
}
