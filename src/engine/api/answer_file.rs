//! Files of answers: `.csv`, `.jsonl`, `.npy` and `.vtu`.

use std::path::Path;

use super::{AnswerColumn, AnswerRow, AnswerValue, Code, Error, Settings, csv_head};
use tetdb_io::write::{NpyField, NpyTable, SelectedTet, SelectedVtu, TextFile};
use tetdb_store::query::Hit;

/// Share of the memory cap for writing a file of answers.
const MEMORY_SHARE: u64 = 16;

/// A file of answers, written row by row. The ending of its name selects the format.
///
/// The file gets its name when it is finished.
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// # let mut store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.2")?).create(&path)?;
/// use tetdb::{AnswerColumn, AnswerFile, Settings};
///
/// let columns = ["id", "quality"].map(|name| AnswerColumn::from_name(name).expect("a column"));
/// let mut file = AnswerFile::create(dir.path().join("all.csv"), &columns, &Settings::new())?;
/// for hit in store.query().answers()? {
///     file.put(&hit?.into())?;
/// }
/// assert!(file.finish()? > 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct AnswerFile {
    columns: Vec<AnswerColumn>,
    format: Format,
    /// Scratch buffer for one row.
    bytes: Vec<u8>,
}

enum Format {
    Csv(TextFile),
    JsonLines(TextFile),
    Npy(NpyTable),
    /// Tetrahedra with a fixed set of columns.
    Vtu(SelectedVtu),
}

impl AnswerFile {
    /// Creates a file with these columns. A `.vtu` file has a fixed set of columns instead. Errors: `unknown-format`; the disk.
    pub fn create(
        out: impl AsRef<Path>,
        columns: &[AnswerColumn],
        settings: &Settings,
    ) -> Result<Self, Error> {
        let out = out.as_ref();
        let ending = out.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let format = match ending.to_ascii_lowercase().as_str() {
            "csv" => {
                let mut file = TextFile::new(out)?;
                file.line(&csv_head(columns))?;
                Format::Csv(file)
            }
            "jsonl" => Format::JsonLines(TextFile::new(out)?),
            "npy" => {
                let fields: Vec<NpyField> = columns.iter().map(|&c| field(c)).collect();
                Format::Npy(NpyTable::new(out, &fields)?)
            }
            "vtu" => Format::Vtu(SelectedVtu::new(out, settings.cap()? / MEMORY_SHARE)?),
            _ => {
                let message = "the format of a file of answers does not follow from its name";
                return Err(Error::new(Code::UnknownFormat, message)
                    .at(out.display())
                    .with_help("end the name with .csv, .jsonl, .npy or .vtu"));
            }
        };
        Ok(Self { columns: columns.to_vec(), format, bytes: Vec::new() })
    }

    /// Writes a row. Errors: the disk.
    pub fn put(&mut self, row: &AnswerRow) -> Result<(), Error> {
        match &mut self.format {
            Format::Csv(file) => file.line(&row.csv(&self.columns))?,
            Format::JsonLines(file) => file.line(&row.object(&self.columns).to_string())?,
            Format::Npy(table) => {
                numpy_row(row, &self.columns, &mut self.bytes);
                table.row(&self.bytes)?;
            }
            Format::Vtu(file) => {
                if let Some(hit) = &row.hit {
                    file.push(&selected(hit))?;
                }
            }
        }
        Ok(())
    }

    /// Finishes the file and gives it its name. Returns its length in bytes. Errors: the disk.
    pub fn finish(self) -> Result<u64, Error> {
        Ok(match self.format {
            Format::Csv(file) | Format::JsonLines(file) => file.finish()?,
            Format::Npy(table) => table.finish()?,
            Format::Vtu(file) => file.finish()?,
        })
    }
}

/// NumPy type of a column. Rows without a tetrahedron have -1 or NaN.
fn field(column: AnswerColumn) -> NpyField {
    let (kind, shape) = match column {
        AnswerColumn::Point => ("<f8", "3"),
        AnswerColumn::Barycentric => ("<f8", "4"),
        AnswerColumn::Id => ("<i8", ""),
        AnswerColumn::Vertices => ("<i8", "4"),
        AnswerColumn::Points => ("<f8", "4, 3"),
        _ if column.is_integer() => ("<i8", ""),
        AnswerColumn::Variable(_) | AnswerColumn::Field { .. } => ("<f8", ""),
    };
    NpyField { name: column.name(), kind, shape }
}

/// Encodes a row in NumPy's binary layout.
fn numpy_row(row: &AnswerRow, columns: &[AnswerColumn], bytes: &mut Vec<u8>) {
    bytes.clear();
    for &column in columns {
        match (column, &row.hit) {
            (AnswerColumn::Id, hit) => {
                let id = hit.map_or(-1, |hit| hit.id.number() as i64);
                bytes.extend_from_slice(&id.to_le_bytes());
            }
            (AnswerColumn::Vertices, hit) => {
                let ids = hit.map_or([-1; 4], |hit| hit.vertices.map(|v| v as i64));
                bytes.extend(ids.iter().flat_map(|v| v.to_le_bytes()));
            }
            _ => bytes.extend(row.values(column).iter().flat_map(|value| match value {
                AnswerValue::Integer(n) => n.to_le_bytes(),
                AnswerValue::Number(x) => x.to_le_bytes(),
                AnswerValue::Text(_) | AnswerValue::Missing if column.is_integer() => {
                    (-1i64).to_le_bytes()
                }
                AnswerValue::Text(_) | AnswerValue::Missing => f64::NAN.to_le_bytes(),
            })),
        }
    }
}

fn selected(hit: &Hit) -> SelectedTet {
    SelectedTet {
        id: hit.id.number(),
        subdomain: hit.id.subdomain().rank(),
        region: hit.region,
        quality: hit.shape.quality,
        vertices: hit.vertices,
        corners: hit.corners.map(|c| c.to_array()),
    }
}
