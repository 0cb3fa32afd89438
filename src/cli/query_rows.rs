//! Output of a query's answers: a table, values, JSON objects, files.

use std::path::PathBuf;

use super::console::Console;
use super::failure::Failure;
use tetdb_engine::api::{AnswerColumn, AnswerFile, AnswerRow, AnswerValue, csv_head};

/// Formats a number for people, with about seven digits.
fn shown(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        1e-4..1e7 => format!("{x:.6}"),
        _ => format!("{x:.5e}"),
    }
}

/// Destination of the rows.
pub enum Sink {
    Table,
    Values,
    Objects,
    File(Box<AnswerFile>, PathBuf),
}

/// A line of a table. All rows have the widths of the head.
fn line(columns: &[AnswerColumn], row: Option<&AnswerRow>) -> String {
    let mut line = String::new();
    for &column in columns {
        let text = match row {
            None => column.name().to_owned(),
            Some(row) => {
                let words = row.values(column).into_iter().map(|cell| match cell {
                    AnswerValue::Text(text) => text,
                    AnswerValue::Integer(n) => n.to_string(),
                    AnswerValue::Number(x) => shown(x),
                    AnswerValue::Missing => "-".to_owned(),
                });
                words.collect::<Vec<_>>().join(" ")
            }
        };
        let width = match column {
            AnswerColumn::Id => 14,
            AnswerColumn::Point => 32,
            AnswerColumn::Barycentric => 38,
            AnswerColumn::Vertices => 48,
            AnswerColumn::Points => 120,
            _ if column.is_integer() => 9,
            AnswerColumn::Variable(_) | AnswerColumn::Field { .. } => 12,
        };
        line += &format!("{text:>width$}  ");
    }
    line.trim_end().to_owned()
}

/// Lines are collected up to this many bytes.
const LINES_BYTES: usize = 8 << 10;

/// Writer of rows. Writing to the standard output stops when it is closed.
pub struct Writer {
    sink: Sink,
    columns: Vec<AnswerColumn>,
    console: Console,
    /// Lines not yet written to the standard output.
    lines: String,
    closed: bool,
    rows: u64,
    /// Number of rows after which nothing is written.
    rows_max: Option<u64>,
    is_cut: bool,
}

impl Writer {
    /// A writer of at most `rows_max` rows.
    pub fn new(
        sink: Sink,
        columns: Vec<AnswerColumn>,
        rows_max: Option<u64>,
        console: &Console,
    ) -> Self {
        let mut writer = Self {
            sink,
            columns,
            console: console.clone(),
            lines: String::new(),
            closed: false,
            rows: 0,
            rows_max,
            is_cut: false,
        };
        match writer.sink {
            Sink::Table => writer.print(&line(&writer.columns, None)),
            Sink::Values => writer.print(&csv_head(&writer.columns)),
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

    pub fn rows_max(&self) -> Option<u64> {
        self.rows_max
    }

    /// Returns whether a row was not written because there were enough.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Writes a row. Returns `false` once there are enough, or writing to the standard output has failed.
    pub fn put(&mut self, row: &AnswerRow) -> Result<bool, Failure> {
        if self.rows_max.is_some_and(|most| self.rows >= most) {
            self.is_cut = true;
            return Ok(false);
        }
        self.rows += 1;
        let text = match &mut self.sink {
            Sink::Table => line(&self.columns, Some(row)),
            Sink::Values => row.csv(&self.columns),
            Sink::Objects => row.object(&self.columns).to_string(),
            Sink::File(file, _) => {
                file.put(row)?;
                return Ok(true);
            }
        };
        self.print(&text);
        Ok(!self.closed)
    }

    /// Ends the answer. For a file, returns its name and length.
    pub fn finish(mut self) -> Result<Option<(PathBuf, u64)>, Failure> {
        self.flush();
        match self.sink {
            Sink::File(file, path) => Ok(Some((path, file.finish()?))),
            _ => Ok(None),
        }
    }
}
