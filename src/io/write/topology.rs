//! Who neighbors whom, for solvers that give each sub-domain to a process of its own.
//!
//! JSON. `subdomains`: `id`, `tets`, `vertices`, `neighbors` (`id`, `faces`). `pairs`: for each two sub-domains that share a vertex, `low` and
//! `high`, their numbers; `vertices`, two lists of equal length with the number of each shared vertex in the one and in the other; `faces`, the same
//! with the tetrahedra on both sides of each shared face. Numbers are those of the store and of the pieces.

use std::collections::BTreeMap;
use std::path::Path;

use super::draft::Draft;
use super::numbering::candidates;
use super::stream::{Stream, word32};
use super::{FileCounts, Result};
use crate::sealed::SealedError;
use crate::storage::{Sorted, Sorter};
use crate::store::{Catalog, StoreError};
use tetdb_schema::catalog::NeighborRow;

/// A pair's vertex: low, high, order, number in low, number in high.
type SharedVertices = Sorted<24>;
/// A pair's face: low, high, cut, number in the cut, side, tetrahedron.
type SharedFaces = Sorted<21>;

pub(super) fn write(
    store: &mut Catalog,
    draft: &mut Draft,
    out: &Path,
    memory: usize,
) -> Result<FileCounts> {
    let rows = store.subdomains()?;
    let ranks: Vec<_> = rows.iter().map(|row| (row.rank, row.vertices)).collect();
    let dir = draft.dir().to_owned();
    let vertices = shared_vertices(store, &ranks, &dir, memory)?;
    let faces = shared_faces(store, &ranks, &dir, memory)?;
    let neighbors: BTreeMap<u32, Vec<NeighborRow>> = (store.topology()?.into_iter())
        .map(|row| (row.subdomain, row.neighbors))
        .collect();
    let path = draft.create(out, 0)?;
    let mut stream = Stream::open(&path)?;
    stream.text("{\"schema\": 1, \"subdomains\": [");
    for (i, row) in rows.iter().enumerate() {
        let before = if i > 0 { "," } else { "" };
        let neighbors: Vec<_> = (neighbors.get(&row.rank).into_iter().flatten())
            .map(|n| format!("{{\"id\": {}, \"faces\": {}}}", n.subdomain, n.faces))
            .collect();
        stream.text(&format!(
            "{before}\n{{\"id\": {}, \"tets\": {}, \"vertices\": {}, \"neighbors\": [{}]}}",
            row.rank,
            row.tets,
            row.vertices,
            neighbors.join(", ")
        ));
        stream.end()?;
    }
    stream.text("\n], \"pairs\": [");
    pairs(store, &mut stream, vertices, faces)?;
    stream.text("\n]}\n");
    stream.finish()?;
    Ok(FileCounts::default())
}

/// For each pair its lists. Every pair with a face shares vertices, so that faces never run ahead.
fn pairs(
    store: &mut Catalog,
    stream: &mut Stream,
    vertices: SharedVertices,
    faces: SharedFaces,
) -> Result<()> {
    let mut vertices = vertices.peekable();
    let mut faces = faces.peekable();
    let mut before = "";
    while let Some(first) = vertices.next() {
        let first = first?;
        let pair: [u8; 8] = *first.first_chunk().expect("a pair stands first");
        let mut shared = [vec![word32(&first, 16)], vec![word32(&first, 20)]];
        while let Some(next) = vertices.next_if(|r| r.as_ref().is_ok_and(|r| r[..8] == pair)) {
            let next = next?;
            shared[0].push(word32(&next, 16));
            shared[1].push(word32(&next, 20));
        }
        let mut tets = [Vec::new(), Vec::new()];
        while let Some(next) = faces.next_if(|r| r.as_ref().is_ok_and(|r| r[..8] == pair)) {
            let next = next?;
            tets[usize::from(next[16])].push(word32(&next, 17));
        }
        let (low, high) = (word32(&pair, 0), word32(&pair, 4));
        if tets[0].len() != tets[1].len() {
            return Err(unequal(store, low, high));
        }
        stream.text(&format!(
            "{before}\n{{\"low\": {low}, \"high\": {high}, \"vertices\": "
        ));
        lists(stream, &shared)?;
        stream.text(", \"faces\": ");
        lists(stream, &tets)?;
        stream.text("}");
        before = ",";
    }
    match faces.next() {
        None => Ok(()),
        Some(face) => {
            let face = face?;
            Err(unequal(store, word32(&face, 0), word32(&face, 4)))
        }
    }
}

fn lists(stream: &mut Stream, lists: &[Vec<u32>; 2]) -> Result<()> {
    stream.text("[[");
    for (side, list) in lists.iter().enumerate() {
        for (i, &number) in list.iter().enumerate() {
            let last = i + 1 == list.len();
            stream.integer(u64::from(number), if last { b']' } else { b',' });
            stream.end()?;
        }
        if list.is_empty() {
            stream.text("]");
        }
        stream.text(if side == 0 { ", [" } else { "]" });
    }
    Ok(())
}

fn unequal(store: &mut Catalog, low: u32, high: u32) -> super::WriteError {
    StoreError::Sealed(SealedError::Content {
        path: store.dir().to_owned(),
        subdomain: low,
        what: format!("the faces shared with sub-domain {high} are not the same on both sides"),
    })
    .into()
}

/// Vertices by pair, those of one pair in an order that both sides know.
fn shared_vertices(
    store: &mut Catalog,
    ranks: &[(u32, u64)],
    dir: &Path,
    memory: usize,
) -> Result<SharedVertices> {
    let mut sorter = Sorter::<24>::new(dir, memory as u64 / 4);
    let mut group: Vec<(u32, u32)> = Vec::new();
    let mut id = [0; 8];
    let mut hand_on = |group: &mut Vec<(u32, u32)>, id: [u8; 8]| -> Result<()> {
        for (i, a) in group.iter().enumerate() {
            for b in &group[i + 1..] {
                let mut record = [0; 24];
                record[..4].copy_from_slice(&ranks[a.0 as usize].0.to_be_bytes());
                record[4..8].copy_from_slice(&ranks[b.0 as usize].0.to_be_bytes());
                record[8..16].copy_from_slice(&id);
                record[16..20].copy_from_slice(&a.1.to_be_bytes());
                record[20..].copy_from_slice(&b.1.to_be_bytes());
                sorter.push(record)?;
            }
        }
        group.clear();
        Ok(())
    };
    for record in candidates(store, ranks, dir, memory)? {
        let record = record?;
        if record[..8] != id {
            hand_on(&mut group, id)?;
            id = *record.first_chunk().expect("an id stands first");
        }
        group.push((word32(&record, 8), word32(&record, 12)));
    }
    hand_on(&mut group, id)?;
    Ok(sorter.finish()?)
}

/// Interface faces by pair.
fn shared_faces(
    store: &mut Catalog,
    ranks: &[(u32, u64)],
    dir: &Path,
    memory: usize,
) -> Result<SharedFaces> {
    let mut sorter = Sorter::<21>::new(dir, memory as u64 / 4);
    for &(rank, _) in ranks {
        let mut part = store.open_subdomain(rank, memory / 4)?;
        for face in part.interfaces() {
            let face = face?;
            let mut record = [0; 21];
            record[..4].copy_from_slice(&rank.min(face.other).to_be_bytes());
            record[4..8].copy_from_slice(&rank.max(face.other).to_be_bytes());
            record[8..12].copy_from_slice(&face.cut.to_be_bytes());
            record[12..16].copy_from_slice(&face.index.to_be_bytes());
            record[16] = u8::from(rank > face.other);
            record[17..].copy_from_slice(&face.tet.to_be_bytes());
            sorter.push(record)?;
        }
    }
    Ok(sorter.finish()?)
}
