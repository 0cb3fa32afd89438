//! OpenFOAM: `constant/polyMesh` of the whole, or `processorN/constant/polyMesh` of each sub-domain with its numbers in the whole.
//!
//! Faces are in OpenFOAM's order: those with two cells by owner, then by neighbor; then patch by patch. A patch for each
//! label with faces on the boundary, a face zone for each label with cells on both sides, a cell zone for each region. The faces that two
//! sub-domains share are patches of both, in one order, and begin at the same vertex. Reading order: `faces`, `serial`, `processors`,
//! `polymesh` and `file` (what is written).

mod faces;
mod file;
mod polymesh;
mod processors;
mod serial;

use std::collections::BTreeSet;
use std::path::Path;

use super::error::{Result, WriteError};
use super::merged::Merged;
use super::names::set_names;
use super::output_files::OutputFiles;
use super::report::FileCounts;
use super::selection::ExportSelection;
use faces::FaceWalk;
use polymesh::{Names, Size};

/// Bytes of scratch for a tetrahedron: four faces before they meet, two after.
const SCRATCH_BYTES: u64 = 4 * 16 + 2 * 24;

/// Writes the mesh into the case that `out`, an empty file for ParaView, stands in.
pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    selection: &ExportSelection,
) -> Result<FileCounts> {
    // Every tetrahedron has fewer than four faces to itself, and labels have 31 bits.
    mesh.check_limits(out, i32::MAX as u64 / 4, 0)?;
    let case = out.parent().map(Path::to_owned).unwrap_or_default();
    let ascii = selection.ascii;
    let mut walk = FaceWalk::new(mesh)?;
    let names = names(mesh, &walk)?;
    outputs.create(out, needed_bytes(mesh, ascii))?;
    if selection.pieces {
        refuse_more_processors(&case, mesh.parts().len())?;
        return processors::write(mesh, outputs, &case, (&mut walk, &names), selection);
    }
    serial::write(mesh, outputs, &case, (&mut walk, &names), ascii)
}

/// Approximate bytes of all files and of the sorted faces of the largest sub-domain.
fn needed_bytes(mesh: &Merged, ascii: bool) -> u64 {
    let parts = mesh.parts();
    let cells = mesh.n_tets();
    let size = Size {
        points: parts.iter().map(|part| part.n_vertices).sum(),
        cells,
        inner: 2 * cells,
        faces: 2 * cells + mesh.n_faces(),
    };
    let largest = parts.iter().map(|part| part.n_tets).max();
    size.bytes(ascii) + SCRATCH_BYTES * largest.unwrap_or(0)
}

/// Refuses a case that was decomposed into more parts: the meshes would mix.
fn refuse_more_processors(case: &Path, n: usize) -> Result<()> {
    let path = case.join(format!("processor{n}"));
    if !path.exists() {
        return Ok(());
    }
    let text =
        format!("it is of a case in more than {n} parts: remove the processor folders first");
    let source = std::io::Error::new(std::io::ErrorKind::AlreadyExists, text);
    Err(WriteError::Io { path, source })
}

/// Names of patches and zones, the same in every processor.
fn names(mesh: &mut Merged, walk: &FaceWalk) -> Result<Names> {
    let census = &walk.census;
    let patches: BTreeSet<u32> = (census.patches.iter().flat_map(|p| p.keys()).copied()).collect();
    let all = patches.iter().chain(census.zones.keys());
    let clean = set_names(&all.map(|&label| (label, mesh.label_name(label))).collect());
    let named = |&label: &u32| (label, clean[&label].clone());
    let regions = mesh.filled_regions()?;
    Ok(Names {
        patches: patches.iter().map(named).collect(),
        groups: mesh.overlapping_groups(),
        face_zones: census.zones.keys().map(named).collect(),
        cell_zones: set_names(&regions.iter().map(|&r| (r, mesh.region_name(r))).collect()),
    })
}
