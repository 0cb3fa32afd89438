//! Gmsh 4.1, binary or text, of first or second order: physical surfaces are labels, physical volumes regions.
//!
//! Where there are several sub-domains, each is a partition, numbered from 1. Its part of a label or region is an entity below that of the label
//! or region. Elements are numbered from 1, triangles first. All numbers are those of the whole, also in files of one partition, named
//! `NAME_1.msh` and so on. The faces between two partitions are listed once, lie in both and have no physical group. Each vertex belongs to
//! its first entity, surfaces before volumes.
//! Source: the Gmsh reference manual, "MSH file format".

mod elements;
mod entities;
mod ghosts;
mod nodes;
mod out;
mod piece;
mod values;

use std::path::{Path, PathBuf};

use super::error::Result;
use super::merged::Merged;
use super::midpoints::Midpoints;
use super::output_files::OutputFiles;
use super::periodic::WrittenPeriodic;
use super::report::FileCounts;
use super::selection::ExportSelection;
use entities::Entities;
pub(super) use entities::physical_names;
use ghosts::Ghosts;
use out::Out;
use piece::GmshPiece;
use tetdb_schema::field::FieldRow;

/// Writes one file of the whole mesh, or one of each partition.
pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    (selection, midpoints, periodic): (&ExportSelection, Option<&Midpoints>, &WrittenPeriodic),
) -> Result<FileCounts> {
    mesh.expect_passes(1, 1);
    let fields = mesh.read_fields(midpoints.is_some(), true)?.concat();
    if !fields.is_empty() {
        // The tags beside values have 32 bits.
        mesh.check_limits(out, i32::MAX as u64, midpoints.map_or(0, Midpoints::n))?;
    }
    let ghosts = match selection.ghosts {
        true => Some(Ghosts::gather(mesh)?),
        false => None,
    };
    let ghosts = ghosts.as_ref();
    let foreign = ghosts.filter(|_| selection.pieces);
    if !selection.pieces {
        let all: Vec<usize> = (0..mesh.n_parts()).collect();
        let piece = GmshPiece { which: &all, midpoints, foreign };
        let content = (selection.ascii, ghosts, periodic, &*fields);
        return write_file(mesh, outputs, out, &piece, content);
    }
    let mut counts = FileCounts::default();
    for (p, part) in mesh.parts().into_iter().enumerate() {
        if selection.writes_piece(part.rank) {
            let path = piece_path(out, part.rank);
            let piece = GmshPiece { which: &[p], midpoints, foreign };
            let content = (selection.ascii, ghosts, periodic, &*fields);
            counts += write_file(mesh, outputs, &path, &piece, content)?;
        }
    }
    Ok(counts)
}

/// `NAME_1.msh` for the first sub-domain: Gmsh's own names for files of partitions.
fn piece_path(out: &Path, rank: u32) -> PathBuf {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let ending = out.extension().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{stem}_{}.{ending}", rank + 1))
}

fn write_file(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    path: &Path,
    piece: &GmshPiece,
    (ascii, ghosts, periodic, fields): (bool, Option<&Ghosts>, &WrittenPeriodic, &[FieldRow]),
) -> Result<FileCounts> {
    let entities = Entities::gather(mesh, piece)?;
    let n_tets = entities.n_tets();
    let nodes = nodes::gather(mesh, piece, &entities, path)?;
    let [vertex_bytes, number_bytes] = if ascii { [55, 6] } else { [32, 8] };
    let numbers = if piece.midpoints.is_some() { 11 } else { 5 };
    let elements_bytes = number_bytes * numbers * (n_tets + entities.n_faces());
    let file = outputs.create(path, 1000 + vertex_bytes * nodes.n + elements_bytes)?;
    let mut out = Out::open(&file, ascii)?;
    out.section("MeshFormat", |out| {
        out.text(if ascii { "4.1 0 8\n" } else { "4.1 1 8\n" });
        if !ascii {
            out.int(1);
            out.text("\n");
        }
        Ok(())
    })?;
    let names = entities.physical_names(mesh);
    out.section("PhysicalNames", |out| {
        out.text(&names);
        Ok(())
    })?;
    out.section("Entities", |out| entities.write_model(out))?;
    if entities.is_partitioned() {
        out.section("PartitionedEntities", |out| {
            entities.write_partitioned(out, ghosts.is_some())
        })?;
    }
    out.section("Nodes", |out| nodes.write(out, &entities))?;
    out.section("Elements", |out| elements::write(mesh, out, piece, &entities))?;
    if !periodic.0.is_empty() {
        out.section("Periodic", |out| write_periodic(out, periodic))?;
    }
    if let Some(ghosts) = ghosts {
        out.section("GhostElements", |out| ghosts.write(out, piece.which, mesh))?;
    }
    values::write(mesh, &mut out, piece, fields)?;
    out.finish()?;
    Ok(FileCounts { vertices: nodes.n, tets: n_tets, triangles: entities.n_faces() })
}

/// Writes for each pair of labels the moved surface and its master, the motion from the master, and the nodes with their masters.
fn write_periodic(out: &mut Out, periodic: &WrittenPeriodic) -> Result<()> {
    out.size(periodic.0.len() as u64);
    out.end()?;
    for link in &periodic.0 {
        let [first, second] = link.row.labels.map(|label| label + 1);
        [2, second, first].into_iter().for_each(|n| out.int(n));
        out.end()?;
        out.size(16);
        link.matrix().into_iter().for_each(|x| out.double(x));
        out.end()?;
        out.size(link.nodes.len() as u64);
        out.end()?;
        for [a, b] in &link.nodes {
            [b + 1, a + 1].into_iter().for_each(|n| out.size(n));
            out.end()?;
        }
    }
    Ok(())
}
