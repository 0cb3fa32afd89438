//! NumPy's array files, and other files written front to back.
//!
//! An array file has a head with type and shape, then the numbers, little end first.
//! Source: the NPY format, version 1.0, of NumPy's documentation (NEP 1).

use std::path::{Path, PathBuf};

use super::error::Result;
use super::output_files::OutputFiles;
use super::stream::{Stream, Strip};

/// Bytes of every head written here: a multiple of 64, as the format requires, and enough for any number of rows.
pub(super) const HEAD_BYTES: usize = 1024;
/// Magic, version 1.0.
const MAGIC: &[u8; 8] = b"\x93NUMPY\x01\x00";

/// The head of an array of `rows` entries of `kind` (`'<f8'`, or a list of fields) and inner shape `inner` (` 3` or nothing).
pub(super) fn head(kind: &str, rows: u64, inner: &str) -> Vec<u8> {
    let text = format!("{{'descr': {kind}, 'fortran_order': False, 'shape': ({rows},{inner}), }}");
    let length = HEAD_BYTES - MAGIC.len() - 2;
    assert!(text.len() < length, "fields are few and their names short");
    let mut head = MAGIC.to_vec();
    head.extend_from_slice(&(length as u16).to_le_bytes());
    head.extend_from_slice(text.as_bytes());
    head.resize(HEAD_BYTES - 1, b' ');
    head.push(b'\n');
    head
}

/// A field of a structured array: name, type of a number such as `<f8`, and numbers in a row (`4, 3`) where there are several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NpyField {
    /// Name of the field.
    pub name: &'static str,
    /// Type of its numbers, such as `<f8`.
    pub kind: &'static str,
    /// Shape of its numbers, such as `4, 3`; empty for one number.
    pub shape: &'static str,
}

/// Rows of fields being written to one file; nothing has its name until [`NpyTable::finish`].
pub struct NpyTable {
    outputs: OutputFiles,
    path: PathBuf,
    kind: String,
    out: Stream,
    rows: u64,
}

impl NpyTable {
    /// Begins `out`. Errors: its folder cannot be written.
    pub fn new(out: &Path, fields: &[NpyField]) -> Result<Self> {
        let mut outputs = OutputFiles::new(out)?;
        let path = outputs.create(out, HEAD_BYTES as u64)?;
        let fields: Vec<String> = fields
            .iter()
            .map(|f| match f.shape {
                "" => format!("('{}', '{}')", f.name, f.kind),
                shape => format!("('{}', '{}', ({shape},))", f.name, f.kind),
            })
            .collect();
        let kind = format!("[{}]", fields.join(", "));
        let mut stream = Stream::open(&path)?;
        stream.bytes(&head(&kind, 0, ""));
        Ok(Self { outputs, path, kind, out: stream, rows: 0 })
    }

    /// Adds a row, its fields one after the other. Errors: the disk.
    pub fn row(&mut self, bytes: &[u8]) -> Result<()> {
        self.rows += 1;
        self.out.bytes(bytes);
        self.out.end()
    }

    /// Writes the number of rows into the head and gives the file its name; returns its length. Errors: the disk.
    pub fn finish(self) -> Result<u64> {
        self.out.finish()?;
        let mut strip = Strip::open(&self.path, 0, HEAD_BYTES as u64)?;
        strip.put(&head(&self.kind, self.rows, ""))?;
        strip.finish()?;
        self.outputs.publish_one()
    }
}

/// Lines of text being written to one file; nothing has its name until [`TextFile::finish`].
pub struct TextFile {
    outputs: OutputFiles,
    out: Stream,
}

impl TextFile {
    /// Begins `out`. Errors: its folder cannot be written.
    pub fn new(out: &Path) -> Result<Self> {
        let mut outputs = OutputFiles::new(out)?;
        let path = outputs.create(out, 0)?;
        let out = Stream::open(&path)?;
        Ok(Self { outputs, out })
    }

    /// Adds a line. Errors: the disk.
    pub fn line(&mut self, text: &str) -> Result<()> {
        self.out.text(text);
        self.out.text("\n");
        self.out.end()
    }

    /// Gives the file its name; returns its length. Errors: the disk.
    pub fn finish(self) -> Result<u64> {
        self.out.finish()?;
        self.outputs.publish_one()
    }
}

/// Writes a whole file at once; returns its length. Errors: the disk.
pub fn bytes(out: &Path, content: &[u8]) -> Result<u64> {
    let mut outputs = OutputFiles::new(out)?;
    let path = outputs.create(out, content.len() as u64)?;
    let mut stream = Stream::open(&path)?;
    stream.bytes(content);
    stream.finish()?;
    outputs.publish_one()
}
