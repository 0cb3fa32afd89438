//! Answers of a query as rows of named cells, and where they go: a table, values, objects, files.

use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use serde_json::{Map, Value, json};
use tetdb_schema::ids::VertexId;

use super::console::Console;
use super::failure::Failure;
use tetdb_io::write::{NpyField, NpyTable, SelectedTet, SelectedVtu, TextFile};
use tetdb_store::query::{Hit, LocatedPoint, VARIABLES};

/// A column of the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueryColumn {
    /// Of a question about points: the point, and the shares of the corners.
    Point,
    Barycentric,
    Id,
    Vertices,
    Points,
    /// One of [`VARIABLES`].
    Variable(usize),
}

const REGION: usize = 1;
const SUBDOMAIN: usize = 2;

impl QueryColumn {
    /// The column of this name.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "id" => Self::Id,
            "vertices" => Self::Vertices,
            "points" => Self::Points,
            _ => Self::Variable(VARIABLES.iter().position(|v| *v == name)?),
        })
    }

    fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Barycentric => "barycentric",
            Self::Id => "id",
            Self::Vertices => "vertices",
            Self::Points => "points",
            Self::Variable(v) => VARIABLES[v],
        }
    }

    fn is_whole(self) -> bool {
        matches!(self, Self::Variable(REGION | SUBDOMAIN))
    }

    /// How NumPy names its type; places without a tetrahedron have -1 and NaN.
    fn field(self) -> NpyField {
        let (kind, shape) = match self {
            Self::Point => ("<f8", "3"),
            Self::Barycentric => ("<f8", "4"),
            Self::Id => ("<i8", ""),
            Self::Vertices => ("<i8", "4"),
            Self::Points => ("<f8", "4, 3"),
            _ if self.is_whole() => ("<i8", ""),
            Self::Variable(_) => ("<f8", ""),
        };
        NpyField { name: self.name(), kind, shape }
    }

    /// How many values it has in a line of values.
    fn width(self) -> usize {
        match self {
            Self::Point => 3,
            Self::Barycentric | Self::Vertices => 4,
            Self::Points => 12,
            Self::Id | Self::Variable(_) => 1,
        }
    }
}

/// An answer: a tetrahedron, or a point and perhaps its tetrahedron.
pub struct Row {
    pub found: Option<Hit>,
    pub located: Option<LocatedPoint>,
}

/// A value of a row.
enum CellValue {
    Text(String),
    Totals(i64),
    Number(f64),
    /// Nothing is there.
    Missing,
}

impl Row {
    fn cells(&self, column: QueryColumn) -> Vec<CellValue> {
        let numbers = |list: &[f64]| list.iter().map(|&x| CellValue::Number(x)).collect();
        let located = self.located.as_ref();
        if let (QueryColumn::Point, Some(located)) = (column, located) {
            return numbers(&located.point.to_array());
        }
        let Some(found) = &self.found else {
            return (0..column.width()).map(|_| CellValue::Missing).collect();
        };
        match column {
            QueryColumn::Point => Vec::new(),
            QueryColumn::Barycentric => numbers(&located.map_or([f64::NAN; 4], |l| l.barycentric)),
            QueryColumn::Id => vec![CellValue::Text(found.id.to_string())],
            QueryColumn::Vertices => found.vertices.map(vertex).map(CellValue::Text).into(),
            QueryColumn::Points => numbers(&found.corners.map(|c| c.to_array()).concat()),
            QueryColumn::Variable(v) if column.is_whole() => {
                vec![CellValue::Totals(found.values()[v] as i64)]
            }
            QueryColumn::Variable(v) => vec![CellValue::Number(found.values()[v])],
        }
    }

    fn object(&self, columns: &[QueryColumn]) -> Value {
        let mut object = Map::new();
        object.insert("schema".to_owned(), json!(1));
        for &column in columns {
            let mut values: Vec<Value> = self.cells(column).into_iter().map(value).collect();
            let value = match column {
                QueryColumn::Points if self.found.is_some() => {
                    values.chunks(3).map(|c| Value::from(c.to_vec())).collect()
                }
                _ if self.found.is_none() && column != QueryColumn::Point => Value::Null,
                _ if column.width() == 1 => values.remove(0),
                _ => Value::from(values),
            };
            object.insert(column.name().to_owned(), value);
        }
        Value::Object(object)
    }

    /// As NumPy's row.
    fn bytes(&self, columns: &[QueryColumn], bytes: &mut Vec<u8>) {
        bytes.clear();
        for &column in columns {
            match (column, &self.found) {
                (QueryColumn::Id, found) => {
                    let id = found.map_or(-1, |f| f.id.number() as i64);
                    bytes.extend_from_slice(&id.to_le_bytes());
                }
                (QueryColumn::Vertices, found) => {
                    let ids = found.map_or([-1; 4], |f| f.vertices.map(|v| v as i64));
                    bytes.extend(ids.iter().flat_map(|v| v.to_le_bytes()));
                }
                _ => bytes.extend(self.cells(column).iter().flat_map(|cell| match cell {
                    CellValue::Totals(n) => n.to_le_bytes(),
                    CellValue::Number(x) => x.to_le_bytes(),
                    CellValue::Text(_) | CellValue::Missing if column.is_whole() => {
                        (-1i64).to_le_bytes()
                    }
                    CellValue::Text(_) | CellValue::Missing => f64::NAN.to_le_bytes(),
                })),
            }
        }
    }
}

fn vertex(number: u64) -> String {
    VertexId::from_number(number).map_or_else(|| number.to_string(), |id| id.to_string())
}

fn value(cell: CellValue) -> Value {
    match cell {
        CellValue::Text(text) => text.into(),
        CellValue::Totals(n) => n.into(),
        CellValue::Number(x) => x.into(),
        CellValue::Missing => Value::Null,
    }
}

/// A number for people: seven digits or so.
fn shown(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        1e-4..1e7 => format!("{x:.6}"),
        _ => format!("{x:.5e}"),
    }
}

/// Where rows go.
pub enum Sink {
    Table,
    Values,
    Objects,
    File(Box<FileSink>, PathBuf),
}

/// A file of rows.
pub enum FileSink {
    Values(TextFile),
    Objects(TextFile),
    Npy(NpyTable),
    Vtu(SelectedVtu),
}

impl FileSink {
    /// The kind of file a name's ending tells. Errors: it tells none; the folder cannot be written.
    pub fn new(out: &Path, columns: &[QueryColumn], memory: u64) -> Result<Self, Failure> {
        let ending = out.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let mut file = match ending.to_ascii_lowercase().as_str() {
            "csv" => Self::Values(TextFile::new(out)?),
            "jsonl" => Self::Objects(TextFile::new(out)?),
            "npy" => {
                let fields: Vec<NpyField> = columns.iter().map(|c| c.field()).collect();
                Self::Npy(NpyTable::new(out, &fields)?)
            }
            "vtu" => Self::Vtu(SelectedVtu::new(out, memory)?),
            _ => {
                let message = "the format of a file of answers does not follow from its name";
                return Err(Failure::new(Code::UnknownFormat, message)
                    .at(out.display())
                    .help("end the name with .csv, .jsonl, .npy or .vtu"));
            }
        };
        if let Self::Values(file) = &mut file {
            file.line(&heads(columns))?;
        }
        Ok(file)
    }

    fn put(
        &mut self,
        row: &Row,
        columns: &[QueryColumn],
        bytes: &mut Vec<u8>,
    ) -> Result<(), Failure> {
        match self {
            Self::Values(file) => file.line(&values(row, columns))?,
            Self::Objects(file) => file.line(&row.object(columns).to_string())?,
            Self::Npy(table) => {
                row.bytes(columns, bytes);
                table.row(bytes)?;
            }
            Self::Vtu(file) => {
                if let Some(found) = &row.found {
                    file.push(&selected(found))?;
                }
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<u64, Failure> {
        Ok(match self {
            Self::Values(file) | Self::Objects(file) => file.finish()?,
            Self::Npy(table) => table.finish()?,
            Self::Vtu(file) => file.finish()?,
        })
    }
}

fn selected(found: &Hit) -> SelectedTet {
    SelectedTet {
        id: found.id.number(),
        subdomain: found.id.subdomain().rank(),
        region: found.region,
        quality: found.shape.quality,
        vertices: found.vertices,
        corners: found.corners.map(|c| c.to_array()),
    }
}

fn heads(columns: &[QueryColumn]) -> String {
    let names = columns.iter().flat_map(|&column| {
        let name = column.name();
        let one = column.width() == 1;
        (0..column.width()).map(move |i| match (one, column) {
            (true, _) => name.to_owned(),
            (_, QueryColumn::Point) => format!("point_{}", ["x", "y", "z"][i]),
            (_, QueryColumn::Points) => format!("{}{}", ["x", "y", "z"][i % 3], i / 3),
            _ => format!("{name}{i}"),
        })
    });
    names.collect::<Vec<_>>().join(",")
}

fn values(row: &Row, columns: &[QueryColumn]) -> String {
    let cells = columns.iter().flat_map(|&c| row.cells(c));
    let words = cells.map(|cell| match cell {
        CellValue::Text(text) => text,
        CellValue::Totals(n) => n.to_string(),
        CellValue::Number(x) => x.to_string(),
        CellValue::Missing => String::new(),
    });
    words.collect::<Vec<_>>().join(",")
}

/// A line of a table; all rows have the widths of the head.
fn line(columns: &[QueryColumn], row: Option<&Row>) -> String {
    let mut line = String::new();
    for &column in columns {
        let text = match row {
            None => column.name().to_owned(),
            Some(row) => {
                let words = row.cells(column).into_iter().map(|cell| match cell {
                    CellValue::Text(text) => text,
                    CellValue::Totals(n) => n.to_string(),
                    CellValue::Number(x) => shown(x),
                    CellValue::Missing => "-".to_owned(),
                });
                words.collect::<Vec<_>>().join(" ")
            }
        };
        let width = match column {
            QueryColumn::Id => 14,
            QueryColumn::Point => 32,
            QueryColumn::Barycentric => 38,
            QueryColumn::Vertices => 48,
            QueryColumn::Points => 120,
            _ if column.is_whole() => 9,
            QueryColumn::Variable(_) => 12,
        };
        line += &format!("{text:>width$}  ");
    }
    line.trim_end().to_owned()
}

/// Lines are collected to so many bytes.
const LINES_BYTES: usize = 8 << 10;

/// Writes rows; to the standard output until it is closed.
pub struct Writer {
    sink: Sink,
    columns: Vec<QueryColumn>,
    console: Console,
    /// Lines on their way to the standard output.
    lines: String,
    bytes: Vec<u8>,
    closed: bool,
}

impl Writer {
    pub fn new(sink: Sink, columns: Vec<QueryColumn>, console: &Console) -> Self {
        let mut writer = Self {
            sink,
            columns,
            console: console.clone(),
            lines: String::new(),
            bytes: Vec::new(),
            closed: false,
        };
        match writer.sink {
            Sink::Table => writer.print(&line(&writer.columns, None)),
            Sink::Values => writer.print(&heads(&writer.columns)),
            Sink::Objects | Sink::File(..) => {}
        }
        writer
    }

    fn print(&mut self, text: &str) {
        self.lines += text;
        self.lines.push('\n');
        if self.lines.len() > LINES_BYTES {
            self.flush();
        }
    }

    fn flush(&mut self) {
        self.closed |= !self.console.write(self.lines.as_bytes());
        self.lines.clear();
    }

    /// Writes a row; `false` when nobody listens any more.
    pub fn put(&mut self, row: &Row) -> Result<bool, Failure> {
        let text = match &mut self.sink {
            Sink::Table => line(&self.columns, Some(row)),
            Sink::Values => values(row, &self.columns),
            Sink::Objects => row.object(&self.columns).to_string(),
            Sink::File(file, _) => {
                file.put(row, &self.columns, &mut self.bytes)?;
                return Ok(true);
            }
        };
        self.print(&text);
        Ok(!self.closed)
    }

    /// Ends the answer; of a file, returns its name and length.
    pub fn finish(mut self) -> Result<Option<(PathBuf, u64)>, Failure> {
        self.flush();
        match self.sink {
            Sink::File(file, path) => Ok(Some((path, file.finish()?))),
            _ => Ok(None),
        }
    }
}
