//! VTK unstructured grids, XML or HDF5: the tetrahedra in one file, the boundary faces in another beside it.
//!
//! A `.vtkhdf` file has a partition for each sub-domain, with vertices of its own, or one partition. Reading order: `grid` (any VTK file), this file (the
//! tetrahedra), `boundary`; then `selected` (some tetrahedra) and `defects` (triangles of a surface).

mod boundary;
mod defects;
mod grid;
mod selected;

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::columns::{TableColumn, column, field_columns};
use super::error::{Result, WriteError};
use super::merged::{Measured, Merged, MergedTet};
use super::midpoints::Midpoints;
use super::output_files::OutputFiles;
use super::selection::Share;
use super::writers::Writers;
pub(super) use boundary::{NO_ID, group_columns, write as write_boundary};
use boundary::{Partition, partitions};
pub use defects::defects;
pub(super) use grid::VtkCells;
use grid::{Container, VtkGrid};
pub use selected::{SelectedTet, SelectedVtu};
use tetdb_base::storage::RemoteFailure;
use tetdb_schema::field::FieldRow;

/// A vertex: its lasting id, and the words of its fields.
pub(super) type VertexRow = (i64, Vec<u64>);

/// Columns of the vertices.
pub(super) fn vertex_columns(fields: &[FieldRow]) -> Vec<TableColumn<VertexRow>> {
    let mut columns = vec![column("global_id", |row: &VertexRow| row.0)];
    columns.extend(field_columns(fields, |row: &VertexRow| &row.1));
    columns
}

/// Columns of the tetrahedra.
pub(super) fn tet_columns(fields: &[FieldRow]) -> Vec<TableColumn<MergedTet>> {
    let mut columns = vec![
        column("subdomain", |tet: &MergedTet| tet.subdomain),
        column("region", |tet: &MergedTet| tet.region),
        column("quality", |tet: &MergedTet| tet.quality),
        column("excess", |tet: &MergedTet| tet.excess),
        column("global_id", |tet: &MergedTet| tet.id.number() as i64),
    ];
    columns.extend(field_columns(fields, |tet: &MergedTet| &tet.fields));
    columns
}

/// A grid, and the fields at its vertices.
type TetGrid = (VtkGrid<VertexRow, MergedTet>, Vec<FieldRow>);

/// Writes both files, XML or `hdf` with these kinds of cells. Several processes may write partitions of a `.vtkhdf`, whose mesh numbers the vertices of each sub-domain apart.
pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    hdf: Option<VtkCells>,
    midpoints: Option<&Midpoints>,
    writers: Option<&dyn Writers>,
) -> Result<()> {
    mesh.expect_passes(2, 1);
    let partitions = partitions(mesh, midpoints);
    let container = match hdf {
        Some(cells) => {
            Container::Hdf(cells, partitions.iter().map(|p| [p.n_points(), p.n_tets]).collect())
        }
        None => Container::Xml,
    };
    let [n_points, n_tets, _] = rows(&partitions);
    let counts = [n_points, n_tets, if midpoints.is_some() { 10 } else { 4 }];
    let texts = ("region_names", &*mesh.region_names());
    let [at_vertices, at_tets] = mesh.read_fields(midpoints.is_some(), false)?;
    let columns = (vertex_columns(&at_vertices), tet_columns(&at_tets));
    let grid = VtkGrid::new(&container, counts, texts, columns.0, columns.1);
    let grid = (grid, at_vertices);
    let mut begin = || {
        let path = outputs.create(out, grid.0.file_bytes())?;
        grid.0.begin(&path).map(|()| path)
    };
    let n = partitions.len();
    let Some(writers) = writers else {
        let path = begin()?;
        write_partitions(mesh, (&grid, &path), &partitions, 0..n, midpoints)?;
        return write_boundary(mesh, outputs, &boundary_path(out), hdf, midpoints).map(drop);
    };
    let Share { number, of } = writers.share();
    let write_own = |mesh: &mut Merged, path: &Path| -> Result<()> {
        for p in (0..n).filter(|&p| p as u32 % of == number - 1) {
            mesh.look_at(p..p + 1);
            write_partitions(mesh, (&grid, path), &partitions, p..p + 1, None)?;
        }
        Ok(())
    };
    if number == 1 {
        let path = begin().inspect(|path| writers.announce(path))?;
        write_own(mesh, &path)?;
        mesh.look_at(0..n);
        write_boundary(mesh, outputs, &boundary_path(out), hdf, None)?;
        return writers.wait().map_err(WriteError::Elsewhere);
    }
    let Some(path) = writers.hear() else {
        return Ok(());
    };
    let done = write_own(mesh, &path);
    writers.say(
        done.as_ref()
            .copied()
            .map_err(|error| RemoteFailure { code: error.code(), message: error.to_string() }),
    );
    done
}

/// Points, cells and number of these partitions.
fn rows(partitions: &[Partition]) -> [u64; 3] {
    let points = partitions.iter().map(Partition::n_points).sum();
    let cells = partitions.iter().map(|p| p.n_tets).sum();
    [points, cells, partitions.len() as u64]
}

/// Writes the partitions `which` of the file of the tetrahedra; the mesh is narrowed to them.
fn write_partitions(
    mesh: &mut Merged,
    (grid, path): (&TetGrid, &Path),
    all: &[Partition],
    which: Range<usize>,
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    let partitions = &all[which.clone()];
    let (grid, fields) = grid;
    let mut file = grid.open_rows(path, rows(&all[..which.start]), rows(partitions))?;
    // The midpoints of a partition follow its vertices.
    let mut rows = midpoints.map(|midpoints| midpoints.rows(fields)).transpose()?;
    let mut ends = partitions.iter().map(|p| (p.first_vertex + p.n_vertices, p.n_midpoints));
    let mut end = ends.next();
    mesh.vertices_with(fields, |number, vertex, words| {
        while let Some((_, n)) = end.filter(|(end, _)| number >= *end) {
            for row in rows.iter_mut().flat_map(|rows| rows.by_ref().take(n as usize)) {
                let (position, words) = row?;
                file.point(&(NO_ID, words), position)?;
            }
            end = ends.next();
        }
        file.point(&(vertex.id as i64, words.to_vec()), vertex.point)
    })?;
    for (_, n) in end.into_iter().chain(ends) {
        for row in rows.iter_mut().flat_map(|rows| rows.by_ref().take(n as usize)) {
            let (position, words) = row?;
            file.point(&(NO_ID, words), position)?;
        }
    }
    let mut part = &partitions[0];
    let mut edges = midpoints.map(Midpoints::tets).transpose()?;
    let mut coming = partitions.iter().peekable();
    mesh.measured_tets(Measured::Excess, |tet| {
        if let Some(next) = coming.next_if(|part| part.holds(tet.subdomain)) {
            part = next;
            file.begin_partition()?;
        }
        let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
        let vertices = tet.nodes.into_iter().map(|v| v - part.first_vertex);
        let edges = edges.into_iter().flatten();
        let edges = edges.map(|edge| part.n_vertices + edge - part.first_midpoint);
        file.cell(tet, vertices.chain(edges).map(Ok))
    })?;
    file.finish()
}

/// `NAME_boundary.vtu` beside `NAME.vtu`.
pub(super) fn boundary_path(out: &Path) -> PathBuf {
    let mut name = out.file_stem().unwrap_or_default().to_owned();
    name.push("_boundary.");
    name.push(out.extension().unwrap_or_default());
    out.with_file_name(name)
}
