//! A mesh as NumPy arrays, a file each: `NAME_points.npy`, `NAME_tets.npy` and so on beside `NAME.npy`, which is not written.
//!
//! Numbers of vertices are those of the other formats; they have the narrowest signed type that holds them.

use std::path::{Path, PathBuf};

use super::columns::{TableColumn, column, field_columns, put_row};
use super::error::Result;
use super::faces::MergedFace;
use super::merged::{Measured, Merged, MergedTet};
use super::npy::{HEAD_BYTES, head};
use super::output_files::OutputFiles;
use super::periodic::WrittenPeriodic;
use super::stream::Strip;
use tetdb_schema::record::SealedVertex;

/// Arrays of equally many rows being written.
struct Arrays<T> {
    columns: Vec<TableColumn<T>>,
    strips: Vec<Strip>,
}

impl<T> Arrays<T> {
    /// Begins the files of `columns` beside `out`, their heads written. Errors: the disk.
    fn create(
        outputs: &mut OutputFiles,
        out: &Path,
        rows: u64,
        columns: Vec<TableColumn<T>>,
    ) -> Result<Self> {
        let strip = |column: &TableColumn<T>| {
            let length = rows * column.components * column.number.bytes();
            let file_bytes = HEAD_BYTES as u64 + length;
            let path = outputs.create(&array_path(out, &column.name), file_bytes)?;
            let inner = match column.components {
                1 => String::new(),
                n => format!(" {n}"),
            };
            let mut strip = Strip::open(&path, 0, file_bytes)?;
            strip.put(&head(&format!("'{}'", column.number.numpy()), rows, &inner))?;
            Ok(strip)
        };
        let strips = columns.iter().map(strip).collect::<Result<_>>()?;
        Ok(Self { columns, strips })
    }

    fn row(&mut self, row: &T) -> Result<()> {
        put_row(row, &self.columns, &mut self.strips)
    }

    fn finish(self) -> Result<()> {
        self.strips.into_iter().try_for_each(Strip::finish)
    }
}

/// `NAME_column.npy` beside `NAME.npy`.
fn array_path(out: &Path, column: &str) -> PathBuf {
    let mut name = out.file_stem().unwrap_or_default().to_owned();
    name.push(format!("_{column}.npy"));
    out.with_file_name(name)
}

/// Numbers of vertices, in 32 bits where all fit.
fn vertex_numbers<T, const N: usize>(
    name: &'static str,
    n_vertices: u64,
    numbers: fn(&T) -> [u64; N],
) -> TableColumn<T>
where
    T: 'static,
{
    match n_vertices <= i32::MAX as u64 {
        true => column(name, move |row| numbers(row).map(|v| v as i32)),
        false => column(name, move |row| numbers(row).map(|v| v as i64)),
    }
}

pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    periodic: &WrittenPeriodic,
) -> Result<()> {
    mesh.expect_passes(1, 1);
    let n_vertices = mesh.n_vertices();
    type VertexRow = (SealedVertex, Vec<u64>);
    let [at_vertices, at_tets] = mesh.read_fields(false, false)?;
    let mut columns = vec![
        column("points", |row: &VertexRow| row.0.point),
        column("vertex_id", |row: &VertexRow| row.0.id as i64),
    ];
    columns.extend(field_columns(&at_vertices, |row: &VertexRow| &row.1));
    let mut arrays = Arrays::create(outputs, out, n_vertices, columns)?;
    mesh.vertices_with(&at_vertices, |_, vertex, words| arrays.row(&(*vertex, words.to_vec())))?;
    arrays.finish()?;

    let mut columns = vec![
        vertex_numbers("tets", n_vertices, |tet: &MergedTet| tet.nodes),
        column("region", |tet: &MergedTet| tet.region),
        column("subdomain", |tet: &MergedTet| tet.subdomain),
        column("quality", |tet: &MergedTet| tet.quality),
        column("global_id", |tet: &MergedTet| tet.id.number() as i64),
    ];
    columns.extend(field_columns(&at_tets, |tet: &MergedTet| &tet.fields));
    let mut arrays = Arrays::create(outputs, out, mesh.n_tets(), columns)?;
    mesh.measured_tets(Measured::Quality, |tet| arrays.row(tet))?;
    arrays.finish()?;

    let columns = vec![
        vertex_numbers("triangles", n_vertices, |face: &MergedFace| face.vertices),
        column("label", |face: &MergedFace| face.label),
        column("input_id", |face: &MergedFace| face.triangle().map_or(-1, |t| t as i64)),
    ];
    let mut arrays = Arrays::create(outputs, out, mesh.n_faces(), columns)?;
    mesh.faces().each(|face| arrays.row(face))?;
    arrays.finish()?;
    if periodic.0.is_empty() {
        return Ok(());
    }
    type Pair = (u32, [u64; 2], u64);
    let columns = vec![
        vertex_numbers("periodic", n_vertices, |pair: &Pair| pair.1),
        column("periodic_pair", |pair: &Pair| pair.0),
        vertex_numbers("periodic_least", n_vertices, |pair: &Pair| [pair.2]),
    ];
    let (n, least) =
        (periodic.0.iter().map(|link| link.nodes.len() as u64).sum(), periodic.least());
    let mut arrays = Arrays::create(outputs, out, n, columns)?;
    for (pair, link) in (0..).zip(&periodic.0) {
        link.nodes.iter().try_for_each(|nodes| arrays.row(&(pair, *nodes, least[&nodes[0]])))?;
    }
    arrays.finish()
}
