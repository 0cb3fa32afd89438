//! One file written front to back, one array written into its place in a file, and scratch files of records.

use std::fs::{File, OpenOptions};
use std::io::{BufReader, BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use super::error::{Result, WriteError};
use super::output_files::STDOUT;
use tetdb_base::storage::{SortBytes, SortRecord, Sorted};

/// Bytes gathered before a write.
const BUFFER_BYTES: usize = 256 << 10;

/// A file being written as text or bytes.
pub(super) struct Stream {
    path: PathBuf,
    file: Box<dyn Write>,
    /// Bytes written to the file so far.
    written: u64,
    buffer: Vec<u8>,
    integers: itoa::Buffer,
    doubles: zmij::Buffer,
}

impl Stream {
    /// Writes `path`, which exists, from its beginning; or standard output.
    pub fn open(path: &Path) -> Result<Self> {
        let file: Box<dyn Write> = match path == Path::new(STDOUT) {
            true => Box::new(std::io::stdout()),
            false => {
                let file = OpenOptions::new().write(true).open(path);
                Box::new(file.map_err(|e| WriteError::io(path, e))?)
            }
        };
        Ok(Self {
            path: path.to_owned(),
            file,
            written: 0,
            buffer: Vec::with_capacity(BUFFER_BYTES + 4096),
            integers: itoa::Buffer::new(),
            doubles: zmij::Buffer::new(),
        })
    }

    pub fn bytes(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
    }

    pub fn text(&mut self, text: &str) {
        self.bytes(text.as_bytes());
    }

    /// A number in decimal and the byte after it.
    pub fn integer(&mut self, value: u64, after: u8) {
        let text = self.integers.format(value);
        self.buffer.extend_from_slice(text.as_bytes());
        self.buffer.push(after);
    }

    /// A number in decimal and spaces, together `width` bytes.
    pub fn integer_padded(&mut self, value: u64, width: usize) {
        let text = self.integers.format(value);
        self.buffer.extend_from_slice(text.as_bytes());
        let end = self.buffer.len() + width.saturating_sub(text.len());
        self.buffer.resize(end, b' ');
    }

    /// Numbers in decimal, `between` them one byte and `after` them another.
    pub fn integers(&mut self, values: impl IntoIterator<Item = u64>, between: u8, after: u8) {
        values.into_iter().for_each(|value| self.integer(value, between));
        self.end_list(after);
    }

    /// The shortest decimal that reads back as the same bits, and the byte after it. Coordinates are finite.
    pub fn double(&mut self, value: f64, after: u8) {
        let text = self.doubles.format(value);
        self.buffer.extend_from_slice(text.as_bytes());
        self.buffer.push(after);
    }

    /// Numbers as [`Stream::double`], `between` them one byte and `after` them another.
    pub fn doubles(&mut self, values: impl IntoIterator<Item = f64>, between: u8, after: u8) {
        values.into_iter().for_each(|value| self.double(value, between));
        self.end_list(after);
    }

    fn end_list(&mut self, after: u8) {
        *self.buffer.last_mut().expect("a list has a number") = after;
    }

    /// Numbers as bytes, little end first.
    pub fn double_bytes(&mut self, values: impl IntoIterator<Item = f64>) {
        values.into_iter().for_each(|x| self.bytes(&x.to_le_bytes()));
    }

    /// Ends a record: a full buffer is written.
    #[inline]
    pub fn end(&mut self) -> Result<()> {
        if self.buffer.len() < BUFFER_BYTES {
            return Ok(());
        }
        self.flush()
    }

    /// Writes a record of a scratch file.
    #[inline]
    pub fn record<R: SortRecord>(&mut self, record: &R) -> Result<()> {
        self.bytes(record.to_bytes().as_ref());
        self.end()
    }

    fn flush(&mut self) -> Result<()> {
        let written = self.file.write_all(&self.buffer);
        let written = written.and_then(|()| self.file.flush());
        let bytes = self.buffer.len() as u64;
        self.buffer.clear();
        match written {
            Ok(()) => {
                self.written += bytes;
                Ok(())
            }
            Err(source) if self.path != Path::new(STDOUT) => {
                Err(WriteError::io(&self.path, source))
            }
            Err(source) if source.kind() == ErrorKind::BrokenPipe => {
                // The reader has read enough; all that follows is dropped.
                self.file = Box::new(std::io::sink());
                Ok(())
            }
            Err(source) => Err(WriteError::StandardOutput { written: self.written, source }),
        }
    }

    /// Writes the rest.
    pub fn finish(mut self) -> Result<()> {
        self.flush()
    }
}

/// An array of known length being written at its place in a file that others write too.
pub(super) struct Strip {
    path: PathBuf,
    out: BufWriter<File>,
    left: u64,
}

impl Strip {
    /// The `bytes` bytes of `path` from `start` on; the file exists.
    pub fn open(path: &Path, start: u64, bytes: u64) -> Result<Self> {
        let io = |e| WriteError::io(path, e);
        let mut file = OpenOptions::new().write(true).open(path).map_err(io)?;
        file.seek(SeekFrom::Start(start)).map_err(io)?;
        let out = BufWriter::with_capacity(BUFFER_BYTES, file);
        Ok(Self { path: path.to_owned(), out, left: bytes })
    }

    #[inline]
    pub fn put(&mut self, bytes: &[u8]) -> Result<()> {
        let left = self.left.checked_sub(bytes.len() as u64);
        self.left = left.expect("arrays were measured by the same counts");
        let written = self.out.write_all(bytes);
        written.map_err(|e| WriteError::io(&self.path, e))
    }

    /// Ends the array, which must be full.
    pub fn finish(mut self) -> Result<()> {
        assert_eq!(self.left, 0, "bytes missing in {}", self.path.display());
        self.out.flush().map_err(|e| WriteError::io(&self.path, e))
    }
}

/// Reads records from a scratch file.
pub(super) struct RecordReader<R> {
    path: PathBuf,
    file: BufReader<File>,
    /// Number of the next record.
    next: u64,
    kind: PhantomData<R>,
}

impl<R: SortRecord> RecordReader<R> {
    const BYTES: u64 = size_of::<R::Bytes>() as u64;

    /// Begins at record `first`. Errors: the disk.
    pub fn open(path: &Path, first: u64) -> Result<Self> {
        let io = |e| WriteError::io(path, e);
        let mut file = File::open(path).map_err(io)?;
        file.seek(SeekFrom::Start(first * Self::BYTES)).map_err(io)?;
        let file = BufReader::with_capacity(BUFFER_BYTES, file);
        Ok(Self { path: path.to_owned(), file, next: first, kind: PhantomData })
    }

    /// Goes to record `record`; the buffer is not read again. Errors: the disk.
    pub fn seek(&mut self, record: u64) -> Result<()> {
        let records = record.cast_signed() - self.next.cast_signed();
        self.next = record;
        let moved = self.file.seek_relative(records * Self::BYTES as i64);
        moved.map_err(|e| WriteError::io(&self.path, e))
    }

    /// The next record; `None` at the end. Errors: the disk.
    pub fn next(&mut self) -> Result<Option<R>> {
        let mut record = R::Bytes::ZERO;
        self.next += 1;
        match self.file.read_exact(record.as_mut()) {
            Ok(()) => Ok(Some(R::from_bytes(&record))),
            Err(e) if e.kind() == ErrorKind::UnexpectedEof => Ok(None),
            Err(e) => Err(WriteError::io(&self.path, e)),
        }
    }

    /// Calls `each` with all records that are left. Errors: the disk, those of `each`.
    pub fn each(mut self, mut each: impl FnMut(&R) -> Result<()>) -> Result<()> {
        while let Some(record) = self.next()? {
            each(&record)?;
        }
        Ok(())
    }

    /// Calls `each` with the next `n` records. Errors: the disk, those of `each`.
    pub fn each_of(mut self, n: u64, mut each: impl FnMut(&R) -> Result<()>) -> Result<()> {
        for _ in 0..n {
            let Some(record) = self.next()? else { break };
            each(&record)?;
        }
        Ok(())
    }
}

/// Begins a scratch file, which must not exist yet. Errors: the disk.
pub(super) fn scratch(path: &Path) -> Result<Stream> {
    File::create_new(path).map_err(|e| WriteError::io(path, e))?;
    Stream::open(path)
}

/// Writes sorted records to a new scratch file, each after a look at it. Errors: the disk.
pub(super) fn save<R: SortRecord>(
    records: Sorted<R>,
    path: &Path,
    mut look: impl FnMut(&R),
) -> Result<()> {
    let mut stream = scratch(path)?;
    for record in records {
        let record = record?;
        look(&record);
        stream.record(&record)?;
    }
    stream.finish()
}
