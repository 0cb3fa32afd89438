//! Rows as text: a table, lines of values, or an object for each row.

use std::io::Write;

use arrow::array::RecordBatch;
use arrow::csv;
use arrow::datatypes::SchemaRef;
use arrow::error::ArrowError;
use arrow::json::WriterBuilder;
use arrow::json::writer::LineDelimited;
use arrow::util::pretty::pretty_format_batches_with_schema;

/// Most rows of a table: all of them are held to know how wide the columns are.
pub const ROWS_MAX: usize = 1000;

/// The form of the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    Table,
    Csv,
    Json,
}

/// Writes rows as they come.
pub enum RowWriter<W: Write> {
    Table { out: W, schema: SchemaRef, batches: Vec<RecordBatch>, n_rows: usize },
    Csv(Box<csv::Writer<W>>),
    Json(arrow::json::Writer<W, LineDelimited>),
}

impl<W: Write> RowWriter<W> {
    /// Errors: the output.
    pub fn new(form: Form, schema: SchemaRef, out: W) -> Result<Self, ArrowError> {
        Ok(match form {
            Form::Table => Self::Table { out, schema, batches: Vec::new(), n_rows: 0 },
            Form::Csv => {
                let mut writer = csv::Writer::new(out);
                // The head, also where no row follows.
                writer.write(&RecordBatch::new_empty(schema))?;
                Self::Csv(Box::new(writer))
            }
            Form::Json => Self::Json(WriterBuilder::new().with_explicit_nulls(true).build(out)),
        })
    }

    /// Returns whether more rows are wanted. Errors: the output.
    pub fn write(&mut self, batch: RecordBatch) -> Result<bool, ArrowError> {
        match self {
            Self::Table { batches, n_rows, .. } => {
                *n_rows += batch.num_rows();
                batches.push(batch);
                return Ok(*n_rows <= ROWS_MAX);
            }
            Self::Csv(writer) => writer.write(&batch)?,
            Self::Json(writer) => writer.write(&batch)?,
        }
        Ok(true)
    }

    /// Writes what is left; returns whether rows of a table were left out. Errors: the output.
    pub fn finish(self) -> Result<bool, ArrowError> {
        match self {
            Self::Table { mut out, schema, batches, n_rows } => {
                let mut left = ROWS_MAX;
                let shown = batches.into_iter().map(|batch| {
                    let n = batch.num_rows().min(left);
                    left -= n;
                    batch.slice(0, n)
                });
                let shown: Vec<RecordBatch> = shown.collect();
                writeln!(out, "{}", pretty_format_batches_with_schema(schema, &shown)?)?;
                out.flush()?;
                return Ok(n_rows > ROWS_MAX);
            }
            Self::Csv(writer) => (*writer).into_inner().flush()?,
            Self::Json(mut writer) => {
                writer.finish()?;
                writer.into_inner().flush()?;
            }
        }
        Ok(false)
    }
}
