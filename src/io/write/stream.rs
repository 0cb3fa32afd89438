//! One file written front to back, and one array written into its place in a file.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::draft::STDOUT;
use super::error::{Result, WriteError};

/// Bytes gathered before a write.
const BUFFER_BYTES: usize = 256 << 10;

/// A file being written as text or bytes.
pub(super) struct Stream {
    path: PathBuf,
    file: Box<dyn Write>,
    /// Bytes that are.
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

    /// The shortest decimal that reads back as the same bits, and the byte after it. Coordinates are finite.
    pub fn double(&mut self, value: f64, after: u8) {
        let text = self.doubles.format(value);
        self.buffer.extend_from_slice(text.as_bytes());
        self.buffer.push(after);
    }

    /// Ends a record: what was gathered is written when it is enough.
    #[inline]
    pub fn end(&mut self) -> Result<()> {
        if self.buffer.len() < BUFFER_BYTES {
            return Ok(());
        }
        self.flush()
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
            Err(source) if source.kind() == std::io::ErrorKind::BrokenPipe => {
                // Whoever reads has enough; what follows goes nowhere.
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
        Ok(Self {
            path: path.to_owned(),
            out: BufWriter::with_capacity(BUFFER_BYTES, file),
            left: bytes,
        })
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

/// Reads records of `N` bytes from a scratch file, from record `first` on; `None` at its end.
pub(super) struct Records<const N: usize> {
    path: PathBuf,
    file: std::io::BufReader<File>,
    /// Number of the next record.
    next: u64,
}

impl<const N: usize> Records<N> {
    pub fn open(path: &Path, first: u64) -> Result<Self> {
        let io = |e| WriteError::io(path, e);
        let mut file = File::open(path).map_err(io)?;
        file.seek(SeekFrom::Start(first * N as u64)).map_err(io)?;
        Ok(Self {
            path: path.to_owned(),
            file: std::io::BufReader::with_capacity(BUFFER_BYTES, file),
            next: first,
        })
    }

    /// Goes to record `record`; what is in the buffer already is not read again.
    pub fn seek(&mut self, record: u64) -> Result<()> {
        let records = record.cast_signed() - self.next.cast_signed();
        self.next = record;
        let moved = self.file.seek_relative(records * N as i64);
        moved.map_err(|e| WriteError::io(&self.path, e))
    }

    pub fn next(&mut self) -> Result<Option<[u8; N]>> {
        let mut record = [0; N];
        self.next += 1;
        match self.file.read_exact(&mut record) {
            Ok(()) => Ok(Some(record)),
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Ok(None),
            Err(e) => Err(WriteError::io(&self.path, e)),
        }
    }
}

/// A scratch file that does not exist yet.
pub(super) fn scratch(path: &Path) -> Result<Stream> {
    File::create_new(path).map_err(|e| WriteError::io(path, e))?;
    Stream::open(path)
}

/// Whether a record that was read is one that is looked for; errors are, to be seen.
pub(super) fn here<R>(
    record: &std::result::Result<R, tetdb_base::storage::StorageError>,
    is: impl Fn(&R) -> bool,
) -> bool {
    record.as_ref().map_or(true, is)
}
