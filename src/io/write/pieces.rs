//! Each sub-domain as a mesh of its own, with the numbers of the store.
//!
//! The faces shared with other sub-domains are boundary faces, labelled `interface_N` by the sub-domain N behind them.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::columns::Number;
use super::dispatch;
use super::merged::Merged;
use super::names::escaped;
use super::output_files::OutputFiles;
use super::read_progress::ReadProgress;
use super::scope::{FaceSet, Scope};
use super::stream::Stream;
use super::{ExportSelection, FileCounts, MeshFormat, Result, WriteError, vtk};
use tetdb_schema::field::{FieldPlace, FieldRow};
use tetdb_store::store::Catalog;

pub(super) fn write(
    store: &mut Catalog,
    outputs: &mut OutputFiles,
    out: &Path,
    (format, selection): (MeshFormat, &ExportSelection),
    memory: usize,
    report: &dyn Fn(u64, u64),
) -> Result<FileCounts> {
    let (parallel, extension) = match format {
        MeshFormat::Pvtu => (true, "vtu"),
        _ => (false, out.extension().and_then(|e| e.to_str()).unwrap_or_default()),
    };
    let mut rows = store.subdomains()?;
    if !selection.subdomains.is_empty() {
        rows.retain(|row| selection.subdomains.contains(&row.rank));
    }
    let names_all = parallel && selection.writes_head();
    let mine = rows.iter().filter(|row| selection.writes_piece(row.rank));
    let all: u64 = mine.map(|row| row.tets).sum();
    let (mut counts, mut pieces) = (FileCounts::default(), Vec::new());
    for row in rows {
        let piece = piece_path(out, row.rank, extension);
        let is_written = selection.writes_piece(row.rank);
        // The process that names all pieces reads which of them have tetrahedra of the regions.
        let is_read = is_written || names_all && !selection.regions.is_empty();
        if !is_read {
            pieces.push(piece);
            continue;
        }
        let scope = Scope {
            ranks: &BTreeSet::from([row.rank]),
            regions: &selection.regions,
            faces: FaceSet::SkinAndInterfaces,
            apart: false,
        };
        let dir = outputs.dir().join(format!("piece-{}", row.rank));
        fs::create_dir(&dir).map_err(|e| WriteError::io(&dir, e))?;
        // Progress counts the tetrahedra of all pieces.
        let report_piece = |done: u64, total: u64| {
            let share = done as f64 / total.max(1) as f64;
            report(counts.tets + (share * row.tets as f64) as u64, all);
        };
        let mut mesh = Merged::open(store, scope, &dir, memory, ReadProgress::new(&report_piece))?;
        let is_empty = mesh.n_tets() == 0;
        let written = match is_written && !is_empty {
            true => dispatch::write(format, selection, &mut mesh, outputs, &piece, None)?,
            false => FileCounts::default(),
        };
        fs::remove_dir_all(&dir).map_err(|e| WriteError::io(&dir, e))?;
        counts += written;
        if !is_empty {
            pieces.push(piece);
        }
    }
    if names_all {
        let is_second = selection.order == super::ElementOrder::Second;
        let (at_vertices, at_tets): (Vec<_>, Vec<_>) =
            store.fields()?.into_iter().partition(|f| f.place == FieldPlace::Vertices);
        let at_vertices = if is_second { Vec::new() } else { at_vertices };
        head(outputs, out, &pieces, [&at_vertices, &at_tets])?;
    }
    Ok(counts)
}

/// `NAME_00007.vtu` beside `NAME.pvtu`.
pub(super) fn piece_path(out: &Path, rank: u32, extension: &str) -> PathBuf {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{stem}_{rank:05}.{extension}"))
}

/// The file that names the pieces. Arrays as in `vtu`. Source: the VTK file formats document, "Parallel file formats".
fn head(
    outputs: &mut OutputFiles,
    out: &Path,
    pieces: &[PathBuf],
    [at_vertices, at_tets]: [&[FieldRow]; 2],
) -> Result<()> {
    let path = outputs.create(out, 2000)?;
    let mut stream = Stream::open(&path)?;
    stream.text(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n  <PUnstructuredGrid GhostLevel=\"0\">\n",
    );
    type Described = (Cow<'static, str>, Number, u64);
    let arrays = |columns: Vec<Described>| -> String {
        let line = |(name, number, components): Described| {
            let components = match components {
                1 => String::new(),
                n => format!(" NumberOfComponents=\"{n}\""),
            };
            format!("      <PDataArray type=\"{}\" Name=\"{name}\"{components}/>\n", number.vtk())
        };
        columns.into_iter().map(line).collect()
    };
    let points = vtk::vertex_columns(at_vertices);
    let points = points.iter().map(|c| (c.name.clone(), c.number, c.components)).collect();
    let cells = vtk::tet_columns(at_tets);
    let cells = cells.iter().map(|c| (c.name.clone(), c.number, c.components)).collect();
    for (group, columns) in [("PPointData", points), ("PCellData", cells)] {
        stream.text(&format!("    <{group}>\n{}    </{group}>\n", arrays(columns)));
    }
    stream.text("    <PPoints>\n      <PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n    </PPoints>\n");
    for piece in pieces {
        let name = piece.file_name().unwrap_or_default().to_string_lossy();
        stream.text(&format!("    <Piece Source=\"{}\"/>\n", escaped(&name)));
        stream.end()?;
    }
    stream.text("  </PUnstructuredGrid>\n</VTKFile>\n");
    stream.finish()
}
