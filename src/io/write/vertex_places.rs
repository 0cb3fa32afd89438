//! The number that an export gives each vertex of a store.

use std::path::Path;

use super::error::Result;
use super::numbering::{Numbering, sources};
use super::scope::Scope;
use tetdb_base::storage::{Sorter, StorageError, sort_record};
use tetdb_store::sealed::{MergeReader, input_index};
use tetdb_store::store::Catalog;

/// A vertex of a sub-domain.
#[derive(Clone, Copy, Debug)]
pub struct VertexPlace {
    /// Lasting id.
    pub id: u64,
    /// Number in an export of the whole; `None` if no tetrahedron of the store has the vertex.
    pub number: Option<u64>,
    /// The sub-domain.
    pub rank: u32,
    /// Number in the sub-domain.
    pub local: u32,
}

sort_record! {
    /// A vertex of the input.
    struct InputVertex {
        id: u64,
        /// [`UNWRITTEN`], which comes last, where no tetrahedron of the sub-domain has it.
        number: u64,
        rank: u32,
        local: u32,
    }
}

const UNWRITTEN: u64 = u64::MAX;

/// Returns whether an export of the whole leaves out vertices, because no tetrahedron has them.
///
/// Holds about `memory` bytes, and keeps scratch files in `dir`. Errors: damage, the disk.
pub fn leaves_out_vertices(store: &mut Catalog, dir: &Path, memory: usize) -> Result<bool> {
    let sources = sources(store, Scope::WHOLE, dir, memory)?;
    let is_some = sources.iter().any(|source| source.is_partial());
    sources.into_iter().try_for_each(|source| source.discard())?;
    Ok(is_some)
}

/// Calls `each` with every vertex of every sub-domain.
///
/// Holds about `memory` bytes, and keeps scratch files in `dir`. Errors: damage, the disk; those of `each`.
pub fn each_vertex_place(
    store: &mut Catalog,
    dir: &Path,
    memory: usize,
    mut each: impl FnMut(VertexPlace) -> std::result::Result<(), StorageError>,
) -> Result<()> {
    let parts = sources(store, Scope::WHOLE, dir, memory)?;
    let numbering = Numbering::new(store, &parts, false, dir, memory)?;
    // A vertex without a tetrahedron in one sub-domain may have some in another.
    let is_partial = parts.len() > 1 && parts.iter().any(|source| source.is_partial());
    let mut of_input = Sorter::new(dir, memory as u64 / 4);
    for (p, source) in parts.iter().enumerate() {
        let numbers = numbering.part(store, &parts, p)?;
        let rank = source.row.rank;
        let mut part = store.open_subdomain(rank, memory / 4)?;
        for (local, vertex) in (0..).zip(part.vertices()) {
            let id = vertex?.id;
            let number = numbers.vertex(local);
            match is_partial && input_index(id).is_some() {
                true => {
                    let number = number.unwrap_or(UNWRITTEN);
                    of_input.push(InputVertex { id, number, rank, local })?;
                }
                false => each(VertexPlace { id, number, rank, local })?,
            }
        }
    }
    let (mut of_input, mut same) = (MergeReader::new(of_input.finish()?), Vec::new());
    while of_input.next_group(&mut same, |a, b| a.id == b.id)? {
        let number = Some(same[0].number).filter(|&number| number != UNWRITTEN);
        for &InputVertex { id, rank, local, .. } in &same {
            each(VertexPlace { id, number, rank, local })?;
        }
    }
    Ok(())
}
