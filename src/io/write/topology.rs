//! The neighbors of each sub-domain, for solvers that give each sub-domain to a process of its own.
//!
//! JSON. `subdomains`: `id`, `tets`, `vertices`, `neighbors` (`id`, `faces`). `pairs`: for each two sub-domains that share a vertex, `low` and
//! `high`, their numbers; `vertices`, two lists of equal length with the number of each shared vertex in the one and in the other; `faces`, the same
//! with the tetrahedra on both sides of each shared face. Numbers are those of the pieces.

use std::collections::BTreeMap;
use std::path::Path;

use super::numbering::{Source, shareable_vertices, sources};
use super::output_files::OutputFiles;
use super::scope::Scope;
use super::stream::Stream;
use super::{FileCounts, Result};
use tetdb_base::storage::{Sorted, Sorter, sort_record};
use tetdb_schema::catalog::NeighborRow;
use tetdb_store::sealed::{MergeReader, SealedError};
use tetdb_store::store::Catalog;

sort_record! {
    /// A vertex of a pair of sub-domains, the lower rank first.
    struct SharedVertex {
        pair: [u32; 2],
        id: u64,
        /// Number of the vertex in each.
        numbers: [u32; 2],
    }
}

sort_record! {
    /// A face of a pair of sub-domains, seen from one of them.
    struct SharedFace {
        pair: [u32; 2],
        cut: u32,
        /// Number of the face in the cut.
        index: u32,
        /// Seen from the higher rank.
        is_high: bool,
        tet: u32,
    }
}

pub(super) fn write(
    store: &mut Catalog,
    outputs: &mut OutputFiles,
    out: &Path,
    memory: usize,
) -> Result<FileCounts> {
    let dir = outputs.dir().to_owned();
    let sources = sources(store, Scope::WHOLE, &dir, memory)?;
    let vertices = shared_vertices(store, &sources, &dir, memory)?;
    let faces = shared_faces(store, &sources, &dir, memory)?;
    let neighbors: BTreeMap<u32, Vec<NeighborRow>> =
        (store.topology()?.into_iter()).map(|row| (row.subdomain, row.neighbors)).collect();
    let path = outputs.create(out, 0)?;
    let mut stream = Stream::open(&path)?;
    stream.text("{\"schema\": 1, \"subdomains\": [");
    for (i, Source { row, n_vertices, .. }) in sources.iter().enumerate() {
        let before = if i > 0 { "," } else { "" };
        let neighbors: Vec<_> = (neighbors.get(&row.rank).into_iter().flatten())
            .map(|n| format!("{{\"id\": {}, \"faces\": {}}}", n.subdomain, n.faces))
            .collect();
        stream.text(&format!(
            "{before}\n{{\"id\": {}, \"tets\": {}, \"vertices\": {n_vertices}, \"neighbors\": [{}]}}",
            row.rank,
            row.tets,
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

/// Writes the lists of each pair. Every pair with a face shares vertices, so each face meets its pair.
fn pairs(
    store: &mut Catalog,
    stream: &mut Stream,
    vertices: Sorted<SharedVertex>,
    faces: Sorted<SharedFace>,
) -> Result<()> {
    let (mut vertices, mut group) = (MergeReader::new(vertices), Vec::new());
    let mut faces = MergeReader::new(faces);
    let mut before = "";
    while vertices.next_group(&mut group, |a, b| a.pair == b.pair)? {
        let pair = group[0].pair;
        let shared = [0, 1].map(|side| group.iter().map(|v| v.numbers[side]).collect());
        let mut tets = [Vec::new(), Vec::new()];
        while let Some(next) = faces.next_if(|face| face.pair == pair)? {
            tets[usize::from(next.is_high)].push(next.tet);
        }
        let [low, high] = pair;
        if tets[0].len() != tets[1].len() {
            return Err(unequal(store, low, high));
        }
        stream.text(&format!("{before}\n{{\"low\": {low}, \"high\": {high}, \"vertices\": "));
        lists(stream, &shared)?;
        stream.text(", \"faces\": ");
        lists(stream, &tets)?;
        stream.text("}");
        before = ",";
    }
    match faces.next() {
        None => Ok(()),
        Some(face) => {
            let [low, high] = face?.pair;
            Err(unequal(store, low, high))
        }
    }
}

fn lists(stream: &mut Stream, lists: &[Vec<u32>; 2]) -> Result<()> {
    stream.text("[");
    for (list, after) in lists.iter().zip([", ", "]"]) {
        stream.text("[");
        for (i, &number) in list.iter().enumerate() {
            stream.text(if i == 0 { "" } else { "," });
            stream.text(&number.to_string());
            stream.end()?;
        }
        stream.text("]");
        stream.text(after);
    }
    Ok(())
}

fn unequal(store: &mut Catalog, low: u32, high: u32) -> super::WriteError {
    let what = format!("the faces shared with sub-domain {high} are not the same on both sides");
    SealedError::content(store.dir(), low, what).into()
}

/// Vertices by pair, those of one pair by id.
fn shared_vertices(
    store: &mut Catalog,
    sources: &[Source],
    dir: &Path,
    memory: usize,
) -> Result<Sorted<SharedVertex>> {
    let mut sorter = Sorter::new(dir, memory as u64 / 4);
    let mut by_id = MergeReader::new(shareable_vertices(store, sources, dir, memory)?);
    let mut group = Vec::new();
    while by_id.next_group(&mut group, |a, b| a.id == b.id)? {
        for (i, a) in group.iter().enumerate() {
            for b in &group[i + 1..] {
                sorter.push(SharedVertex {
                    pair: [a, b].map(|v| sources[v.part as usize].row.rank),
                    id: a.id,
                    numbers: [a.local, b.local],
                })?;
            }
        }
    }
    Ok(sorter.finish()?)
}

/// Interface faces by pair.
fn shared_faces(
    store: &mut Catalog,
    sources: &[Source],
    dir: &Path,
    memory: usize,
) -> Result<Sorted<SharedFace>> {
    let mut sorter = Sorter::new(dir, memory as u64 / 4);
    for rank in sources.iter().map(|source| source.row.rank) {
        let mut part = store.open_subdomain(rank, memory / 4)?;
        for face in part.interfaces() {
            let face = face?;
            sorter.push(SharedFace {
                pair: [rank.min(face.other), rank.max(face.other)],
                cut: face.cut,
                index: face.index,
                is_high: rank > face.other,
                tet: face.tet,
            })?;
        }
    }
    Ok(sorter.finish()?)
}
