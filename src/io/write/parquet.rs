//! Columns as Apache Parquet: for each sub-domain a file of tetrahedra and one of vertices.
//!
//! `NAME_00007.parquet` has a row for each tetrahedron, `NAME_00007_vertices.parquet` one for each vertex; `NAME.parquet` is not written. Rows are
//! in the order of the store, near in space what is near in the file. A field has a column for each component, such as `u.x`. Each group of rows has the least and greatest value of each column, so that programs read
//! only the groups of a box of space.

use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{DataType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use tetdb_schema::field::{FieldNumber, FieldPlace, FieldRow};
use tetdb_schema::ids::TetId;

use super::merged_fields::{FieldChunk, open_fields};
use super::numbering::{Subset, sources};
use super::output_files::OutputFiles;
use super::pieces::piece_path;
use super::scope::Scope;
use super::{ExportSelection, FileCounts, Result, WriteError};
use tetdb_base::geom::Point;
use tetdb_base::storage::check_cancelled;
use tetdb_store::sealed::{FieldFile, Shape, Subdomain};
use tetdb_store::store::Catalog;

/// Rows of a group: few enough that a box of space meets few groups, enough for columns to compress well.
const GROUP_ROWS: usize = 65_536;

/// Ids are those of `tetdb query`: they last. `x y z` is the centroid. Columns of fields and the closing brace follow.
const TETS: &str = "message tets { REQUIRED INT64 id; REQUIRED INT32 subdomain; REQUIRED INT32 region; \
    REQUIRED DOUBLE quality; REQUIRED DOUBLE volume; REQUIRED DOUBLE x; REQUIRED DOUBLE y; REQUIRED DOUBLE z; \
    REQUIRED INT64 v0; REQUIRED INT64 v1; REQUIRED INT64 v2; REQUIRED INT64 v3; ";
/// `h` is the edge length wanted there. A vertex of an interface is in the file of each of its sub-domains.
const VERTICES: &str = "message vertices { REQUIRED INT64 id; REQUIRED DOUBLE x; REQUIRED DOUBLE y; \
    REQUIRED DOUBLE z; REQUIRED FLOAT h; REQUIRED INT32 tag; ";

/// A file under way.
struct Table {
    path: PathBuf,
    writer: SerializedFileWriter<BufWriter<std::fs::File>>,
}

type Group<'a> = SerializedRowGroupWriter<'a, BufWriter<std::fs::File>>;

fn failed(path: &Path, error: ParquetError) -> WriteError {
    match error {
        ParquetError::External(inner) => match inner.downcast::<std::io::Error>() {
            Ok(io) => WriteError::io(path, *io),
            Err(other) => WriteError::io(path, std::io::Error::other(other.to_string())),
        },
        other => WriteError::io(path, std::io::Error::other(other)),
    }
}

impl Table {
    fn create(
        outputs: &mut OutputFiles,
        out: &Path,
        (schema, fields): (&str, &[FieldRow]),
        bytes: u64,
    ) -> Result<Self> {
        let path = outputs.create(out, bytes)?;
        let file = OpenOptions::new().write(true).open(&path);
        let file = BufWriter::new(file.map_err(|e| WriteError::io(&path, e))?);
        let columns = fields.iter().flat_map(|field| {
            let kind = match field.number {
                FieldNumber::F32 => "FLOAT",
                FieldNumber::F64 => "DOUBLE",
                FieldNumber::I32 => "INT32",
                FieldNumber::I64 => "INT64",
            };
            field.columns().into_iter().map(move |name| format!("REQUIRED {kind} {name}; "))
        });
        let schema = format!("{schema}{}}}", columns.collect::<String>());
        let schema = Arc::new(parse_message_type(&schema).expect("the schemas are well formed"));
        let packing = Compression::ZSTD(ZstdLevel::default());
        let properties = WriterProperties::builder()
            .set_compression(packing)
            .set_created_by(concat!("tetdb ", env!("CARGO_PKG_VERSION")).to_owned())
            .build();
        let writer = SerializedFileWriter::new(file, schema, Arc::new(properties));
        let writer = writer.map_err(|e| failed(&path, e))?;
        Ok(Self { path, writer })
    }

    /// Writes a group of rows.
    fn group(
        &mut self,
        columns: impl FnOnce(&mut Group) -> std::result::Result<(), ParquetError>,
    ) -> Result<()> {
        check_cancelled();
        let written = self.writer.next_row_group().and_then(|mut group| {
            columns(&mut group)?;
            group.close().map(drop)
        });
        written.map_err(|e| failed(&self.path, e))
    }

    fn finish(self) -> Result<()> {
        let closed = self.writer.close();
        closed.map(drop).map_err(|e| failed(&self.path, e))
    }
}

/// Writes the next column of a group.
fn column<T: DataType>(
    group: &mut Group,
    values: &[T::T],
) -> std::result::Result<(), ParquetError> {
    let next = group.next_column()?;
    let mut column = next.expect("a column for each of the schema");
    column.typed::<T>().write_batch(values, None, None)?;
    column.close()
}

/// Words of the values of fields in a group of rows, a column for each component.
struct FieldColumns(Vec<(FieldNumber, Vec<u64>)>);

impl FieldColumns {
    fn new(fields: &[FieldRow]) -> Self {
        let columns = fields.iter().flat_map(|f| {
            std::iter::repeat_with(|| (f.number, Vec::new())).take(f.components as usize)
        });
        Self(columns.collect())
    }

    /// Adds the values of the next row.
    fn push(&mut self, words: &[u64]) {
        self.0.iter_mut().zip(words).for_each(|((_, column), word)| column.push(*word));
    }

    /// Writes the columns of a group, and empties them.
    fn write(&mut self, group: &mut Group) -> std::result::Result<(), ParquetError> {
        for (number, words) in &mut self.0 {
            let words = std::mem::take(words).into_iter();
            match number {
                FieldNumber::F32 => {
                    let values: Vec<_> = words.map(|word| f32::from_bits(word as u32)).collect();
                    column::<FloatType>(group, &values)?;
                }
                FieldNumber::F64 => {
                    column::<DoubleType>(group, &words.map(f64::from_bits).collect::<Vec<_>>())?;
                }
                FieldNumber::I32 => {
                    column::<Int32Type>(group, &words.map(|word| word as i32).collect::<Vec<_>>())?;
                }
                FieldNumber::I64 => {
                    column::<Int64Type>(group, &words.map(|word| word as i64).collect::<Vec<_>>())?;
                }
            }
        }
        Ok(())
    }
}

pub(super) fn write(
    store: &mut Catalog,
    outputs: &mut OutputFiles,
    out: &Path,
    selection: &ExportSelection,
    memory: usize,
    report: &dyn Fn(u64, u64),
) -> Result<FileCounts> {
    let mine: BTreeSet<u32> = (store.subdomains()?.iter().map(|row| row.rank))
        .filter(|&rank| selection.writes_piece(rank))
        .collect();
    let scope = Scope { ranks: &mine, ..Scope::WHOLE };
    let sources = match mine.is_empty() {
        true => Vec::new(),
        false => sources(store, scope, outputs.dir(), memory)?,
    };
    let all: u64 = sources.iter().map(|source| source.n_tets).sum();
    let (at_vertices, at_tets): (Vec<_>, Vec<_>) =
        store.fields()?.into_iter().partition(|field| field.place == FieldPlace::Vertices);
    let mut counts = FileCounts::default();
    for source in sources {
        let row = &source.row;
        let mut part = store.open_subdomain(row.rank, memory / 2)?;
        let piece = piece_path(out, row.rank, "parquet");
        let mut table = Table::create(outputs, &piece, (TETS, &at_tets), row.tets * 32)?;
        let mut tets = Tets::default();
        let mut fields = FieldColumns::new(&at_tets);
        let mut files = open_fields(store, &at_tets, &part)?;
        for chunk in 0..row.chunks[0] {
            let n = tets.ids.len();
            tets.add(&mut part, chunk)?;
            let values = FieldChunk::read(&mut files, chunk)?;
            (0..tets.ids.len() - n).for_each(|i| fields.push(&values.row(i)));
            if tets.ids.len() >= GROUP_ROWS {
                tets.write(&mut table, row.rank, &mut fields)?;
            }
            report(counts.tets + tets.done, all);
        }
        tets.write(&mut table, row.rank, &mut fields)?;
        table.finish()?;
        counts.tets += row.tets;
        counts.vertices += source.n_vertices;
        let name = piece.file_stem().unwrap_or_default().to_string_lossy();
        let beside = piece.with_file_name(format!("{name}_vertices.parquet"));
        let schema = (VERTICES, &*at_vertices);
        let mut table = Table::create(outputs, &beside, schema, source.n_vertices * 24)?;
        let files = open_fields(store, &at_vertices, &part)?;
        let fields = (files, FieldColumns::new(&at_vertices));
        vertices(&mut part, source.subset()?, &mut table, fields)?;
        table.finish()?;
    }
    Ok(counts)
}

/// Columns of a group of tetrahedra.
#[derive(Default)]
struct Tets {
    ids: Vec<i64>,
    regions: Vec<i32>,
    /// Quality, volume, centroid.
    numbers: [Vec<f64>; 5],
    vertices: [Vec<i64>; 4],
    done: u64,
}

impl Tets {
    fn add(&mut self, part: &mut Subdomain, chunk: u32) -> Result<()> {
        let records = part.tet_chunk(chunk)?;
        for (local, tet) in (records.first..).zip(&records.records) {
            let corners = part.corners(tet.nodes)?;
            let id = TetId::new(part.id(), local).expect("the reader counted the tetrahedra");
            self.ids.push(id.number() as i64);
            self.regions.push(tet.region as i32);
            let points = corners.map(|c| c.point);
            let shape = Shape::new(points);
            let [x, y, z] = (points.iter().copied().sum::<Point>() * 0.25).to_array();
            let numbers = [shape.quality, shape.volume, x, y, z];
            for (column, number) in self.numbers.iter_mut().zip(numbers) {
                column.push(number);
            }
            for (column, corner) in self.vertices.iter_mut().zip(corners) {
                column.push(corner.id as i64);
            }
        }
        self.done += records.records.len() as u64;
        Ok(())
    }

    fn write(&mut self, table: &mut Table, rank: u32, fields: &mut FieldColumns) -> Result<()> {
        if self.ids.is_empty() {
            return Ok(());
        }
        let ranks = vec![rank as i32; self.ids.len()];
        table.group(|group| {
            column::<Int64Type>(group, &self.ids)?;
            column::<Int32Type>(group, &ranks)?;
            column::<Int32Type>(group, &self.regions)?;
            for numbers in &self.numbers {
                column::<DoubleType>(group, numbers)?;
            }
            for vertices in &self.vertices {
                column::<Int64Type>(group, vertices)?;
            }
            fields.write(group)
        })?;
        let done = self.done;
        *self = Self { done, ..Self::default() };
        Ok(())
    }
}

/// Writes the vertices of `subset`, or all.
fn vertices(
    part: &mut Subdomain,
    subset: Option<Subset>,
    table: &mut Table,
    (mut files, mut fields): (Vec<FieldFile>, FieldColumns),
) -> Result<()> {
    let (mut ids, mut h, mut tags) = (Vec::new(), Vec::new(), Vec::new());
    let mut points: [Vec<f64>; 3] = Default::default();
    let last = part.row().chunks[1];
    for (done, chunk) in (1..).zip(part.vertex_chunks()) {
        let values = FieldChunk::read(&mut files, done - 1)?;
        let chunk = chunk?;
        for (i, vertex) in chunk.records.into_iter().enumerate() {
            let local = chunk.first + i as u32;
            if subset.as_ref().is_some_and(|subset| subset.vertices.rank(local).is_none()) {
                continue;
            }
            fields.push(&values.row(i));
            ids.push(vertex.id as i64);
            for (column, x) in points.iter_mut().zip(vertex.point) {
                column.push(x);
            }
            h.push(vertex.h);
            tags.push(vertex.tag as i32);
        }
        if ids.len() < GROUP_ROWS && done < last {
            continue;
        }
        table.group(|group| {
            column::<Int64Type>(group, &ids)?;
            for column_of in &points {
                column::<DoubleType>(group, column_of)?;
            }
            column::<FloatType>(group, &h)?;
            column::<Int32Type>(group, &tags)?;
            fields.write(group)
        })?;
        ids.clear();
        h.clear();
        tags.clear();
        points.iter_mut().for_each(Vec::clear);
    }
    Ok(())
}
