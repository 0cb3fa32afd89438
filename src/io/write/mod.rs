//! Meshes and surfaces as files for other programs.
//!
//! A store becomes one conforming mesh. Vertices and tetrahedra are numbered densely in (sub-domain, local) order, and vertices that several
//! sub-domains share once. Every input triangle that bounds a filled region is a boundary face, in the order of the input. Alternatively each
//! sub-domain becomes a mesh of its own, numbered as in the store, whose boundary includes the faces shared with others. All is streamed: memory
//! does not grow with the mesh. Files are written in a folder beside the output, synced, and renamed when they are complete. Coordinates are
//! never rounded.
//!
//! Reading order: [`export_with`], `pieces` (a file for each sub-domain), `merged` (sub-domains as one mesh), `numbering` (shared vertices),
//! `faces` (the boundary), `output_files`, `stream`, `array_file` and `columns` (files), then one file or folder for each format.

mod abaqus;
mod array_file;
mod columns;
mod dispatch;
mod doubles;
mod edge_means;
mod embedded;
mod embedded_list;
mod error;
mod exodus;
mod faces;
mod foam;
mod format;
mod gmsh;
mod gmsh22;
mod hdf5;
mod label_groups;
mod medit;
mod merged;
mod merged_fields;
mod merged_parts;
mod mfem;
mod midpoints;
mod names;
mod nastran;
mod netcdf;
mod npy;
mod npy_columns;
mod numbering;
mod output_files;
#[cfg(feature = "parquet")]
mod parquet;
mod periodic;
mod pieces;
mod read_progress;
mod report;
mod scope;
mod selection;
mod sides;
mod split;
mod stream;
mod su2;
mod summary;
mod surface;
#[cfg(test)]
mod tests;
mod tetgen;
mod topology;
mod vertex_places;
mod vtk;
mod writers;
mod xdmf;

use std::collections::BTreeSet;
use std::path::Path;

use error::Result;
pub use error::WriteError;
pub use format::{ENDINGS, MeshFormat};
use format::{
    FACES_ALONE, GHOSTS, PARTITIONS, REGIONS, REGIONS_APART, SECOND_ORDER, SLITS, STREAM,
    SUBDOMAINS, TEXT,
};
pub use merged_fields::{fits_doubles, has_values_at};
pub use npy::TextFile;
pub use npy::bytes;
pub use npy::{NpyField, NpyTable};
use read_progress::ReadProgress;
pub use report::ExportReport;
use report::FileCounts;
pub use selection::{Content, ElementOrder, ExportSelection, Share};
pub use surface::{SurfaceWritten, check_surface_format, surface, wires};
pub use vtk::{SelectedTet, SelectedVtu, defects};

use merged::Merged;
use output_files::{OutputFiles, STDOUT};
use scope::{FaceSet, Scope};
use tetdb_base::storage::attempt;
use tetdb_store::store::{Catalog, StoreError};
pub use vertex_places::{VertexPlace, each_vertex_place, leaves_out_vertices};
pub use writers::Writers;
use writers::is_first;

/// [`export_with`] by one process.
pub fn export(
    store: &mut Catalog,
    out: &Path,
    selection: &ExportSelection,
    memory_bytes: usize,
    report: &dyn Fn(u64, u64),
) -> Result<ExportReport> {
    export_with(store, (out, selection), memory_bytes, report, None)
}

/// Exports the selected part of the finished mesh of `store` to `out`, in the format of its extension; replaces existing files.
///
/// Holds about `memory_bytes`, and reports progress as (done, total) in records read. The files depend on the
/// mesh alone. If [`ExportSelection::is_shared_file`], several `writers` may each call this function; the first returns files and counts.
/// Errors: [`WriteError`], also those of other writers; no file of `out`'s name is touched before all are complete.
pub fn export_with(
    store: &mut Catalog,
    (out, selection): (&Path, &ExportSelection),
    memory_bytes: usize,
    report: &dyn Fn(u64, u64),
    writers: Option<&dyn Writers>,
) -> Result<ExportReport> {
    let format = check(out, selection)?;
    attempt(|| {
        let catalog = &mut *store;
        let path = catalog.dir().to_owned();
        if !catalog.state()?.is_finished() {
            return Err(StoreError::Unfinished { path }.into());
        }
        for &rank in &selection.subdomains {
            store.subdomain(rank)?;
        }
        check_regions(store, selection)?;
        let mut outputs = OutputFiles::new(out)?;
        let counts = match format {
            MeshFormat::Topology => topology::write(store, &mut outputs, out, memory_bytes)?,
            #[cfg(feature = "parquet")]
            MeshFormat::Parquet => {
                parquet::write(store, &mut outputs, out, selection, memory_bytes, report)?
            }
            _ if format == MeshFormat::Pvtu || selection.pieces && !format.numbers_globally() => {
                let what = (format, selection);
                pieces::write(store, &mut outputs, out, what, memory_bytes, report)?
            }
            _ => {
                let apart = selection.is_apart(format);
                let scope = Scope {
                    ranks: match selection.pieces {
                        true => &BTreeSet::new(),
                        false => &selection.subdomains,
                    },
                    regions: &selection.regions,
                    faces: match selection.content {
                        _ if !is_first(writers) => FaceSet::Nothing,
                        Content::Mesh
                            if matches!(format, MeshFormat::VtkHdf | MeshFormat::Gmsh) =>
                        {
                            FaceSet::SkinAndInterfaces
                        }
                        Content::Mesh => FaceSet::Skin,
                        Content::Boundary => FaceSet::SkinAndInterfaces,
                        Content::Interfaces => FaceSet::Interfaces,
                    },
                    apart,
                };
                let progress = ReadProgress::new(report);
                let dir = outputs.dir().to_owned();
                let mut mesh = Merged::open(store, scope, &dir, memory_bytes, progress)?;
                if selection.split_sheets {
                    split::split(&mut mesh, &mut outputs, out)?;
                }
                dispatch::write(format, selection, &mut mesh, &mut outputs, out, writers)?
            }
        };
        Ok(ExportReport {
            vertices: counts.vertices,
            tets: counts.tets,
            triangles: counts.triangles,
            files: outputs.publish()?,
        })
    })?
}

/// Refuses regions that do not exist or are empty.
fn check_regions(store: &mut Catalog, selection: &ExportSelection) -> Result<()> {
    let rows = store.regions()?;
    let filled: Vec<u32> = (rows.iter().filter(|row| row.filled)).map(|row| row.region).collect();
    match (selection.regions.iter()).find(|region| !filled.contains(region)) {
        Some(&region) => Err(WriteError::NoRegion { region, filled }),
        None => Ok(()),
    }
}

/// The format of `out`. Errors: the format cannot hold the selection.
pub fn check(out: &Path, selection: &ExportSelection) -> Result<MeshFormat> {
    let path = || out.to_owned();
    let known = ENDINGS;
    let named = selection.format.or_else(|| MeshFormat::from_extension(out));
    let format = named.ok_or_else(|| WriteError::UnknownFormat { path: path(), known })?;
    let stdout = out == Path::new(STDOUT);
    let (pieces, regions) = (selection.pieces, !selection.regions.is_empty());
    let subdomains = !selection.subdomains.is_empty();
    let asked = [
        (selection.content != Content::Mesh, FACES_ALONE),
        (selection.ascii, TEXT),
        (selection.order == ElementOrder::Second, SECOND_ORDER),
        (selection.ghosts, GHOSTS),
        (pieces || subdomains, SUBDOMAINS),
        (regions, REGIONS),
        (regions && (pieces || subdomains), REGIONS_APART),
        (selection.split_sheets, SLITS),
        (selection.one_partition, PARTITIONS),
        (stdout, STREAM),
    ];
    let refused = asked.into_iter().filter(|(is_asked, _)| *is_asked);
    let lacks = |(_, ability)| format.lacks(ability);
    let one_stream = (stdout && (pieces || selection.split_sheets))
        .then(|| "several files in one stream".to_owned());
    let slits = (pieces && selection.split_sheets).then(|| "split sheets in pieces".to_owned());
    let share = (selection.share)
        .filter(|share| !selection.in_pieces(format) || !(1..=share.of).contains(&share.number))
        .map(|share| format!("share {} of {} in one file", share.number, share.of));
    let several = one_stream.or(slits).or(share);
    match refused.filter_map(lacks).next().or(several) {
        None => Ok(format),
        Some(what) => Err(WriteError::Unsupported { path: path(), format: format.word(), what }),
    }
}
