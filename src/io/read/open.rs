//! Files opened for a reader: plain ones as they are, packed ones and pipes unpacked in memory, within a limit.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::{Path, PathBuf};

use super::error::{FilePlace, ReadError, ReadFault};
use super::feed::{self, Feed, Result};

/// Bytes of the read buffer of one file.
const BUFFER_BYTES: usize = 256 << 10;
/// Bytes at the beginning of a file that show its encoding.
const HEAD_BYTES: usize = 4096;
/// Largest window of a zstd frame, as a power of 2: 32 MiB, which is more than ordinary levels need.
const WINDOW_LOG_MAX: u32 = 25;

/// A reader that can go back.
pub(super) trait ReadSeek: BufRead + Seek {}
impl<T: BufRead + Seek> ReadSeek for T {}

/// A file of any kind.
pub(super) type Reader = Box<dyn ReadSeek>;

/// How the bytes of a file are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Compression {
    Gzip,
    Zstd,
}

/// The packing by the ending of a name, and the name without the ending.
fn packing(path: &Path) -> Option<(Compression, PathBuf)> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    let packing = match extension.as_str() {
        "gz" => Compression::Gzip,
        "zst" => Compression::Zstd,
        _ => return None,
    };
    Some((packing, path.with_extension("")))
}

/// A file's name without the ending of its packing.
pub(super) fn unpacked_name(path: &Path) -> PathBuf {
    packing(path).map_or_else(|| path.to_owned(), |(_, inner)| inner)
}

/// The name of a file without folder and endings.
pub(super) fn stem(path: &Path) -> String {
    let name = unpacked_name(path);
    let text = name.file_stem().unwrap_or_default().to_string_lossy();
    let name = feed::name(text.as_bytes());
    if name.is_empty() { "surface".to_owned() } else { name }
}

/// Returns whether a path can be read only once: a pipe, or `-`, the standard input.
pub fn is_stream(path: &Path) -> bool {
    path == Path::new("-") || std::fs::metadata(path).is_ok_and(|meta| is_pipe(&meta))
}

#[cfg(unix)]
fn is_pipe(meta: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    meta.file_type().is_fifo() || meta.file_type().is_socket()
}

#[cfg(not(unix))]
fn is_pipe(_: &std::fs::Metadata) -> bool {
    false
}

/// Opens a regular file, plain or packed, or a pipe. Packed and piped files are held unpacked, in at most `limit` bytes; so is text
/// in UTF-16, which becomes UTF-8, and text whose lines end in CR alone.
pub(super) fn open(path: &Path, limit: u64) -> Result<Feed<Reader>> {
    let (mut reader, length) = open_bytes(path, limit)?;
    let head = reader.fill_buf().map_err(|e| unreadable(path, e))?;
    let head = &head[..head.len().min(HEAD_BYTES)];
    let name = path.to_string_lossy();
    let is_plain = is_binary_stl(head, length);
    let has_mark = head.starts_with(b"\xef\xbb\xbf");
    let from_bytes = match utf16(head) {
        Some(order) if !is_plain => Some(order),
        _ => None,
    };
    let is_cr = !is_plain && ends_lines_in_cr(head);
    if from_bytes.is_none() && !is_cr {
        let mut feed = Feed::new(&name, reader, length);
        if has_mark && !is_plain {
            feed.skip_mark();
        }
        return Ok(feed);
    }
    let mut bytes = within(reader, path, limit / 2)?;
    if let Some(order) = from_bytes {
        let pairs = bytes.chunks(2).map(|b| order([b[0], *b.get(1).unwrap_or(&0)]));
        let text: String = (char::decode_utf16(pairs))
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .filter(|&c| c != '\u{feff}')
            .collect();
        bytes = text.into_bytes();
    }
    if ends_lines_in_cr(&bytes[..bytes.len().min(HEAD_BYTES)]) {
        bytes.iter_mut().filter(|b| **b == b'\r').for_each(|b| *b = b'\n');
    }
    let length = bytes.len() as u64;
    let mut feed = Feed::<Reader>::new(&name, Box::new(Cursor::new(bytes)), length);
    if has_mark {
        feed.skip_mark();
    }
    Ok(feed)
}

/// The byte order of a text in UTF-16, by its mark or by its first two characters.
fn utf16(head: &[u8]) -> Option<fn([u8; 2]) -> u16> {
    let is_letter = |b: u8| b.is_ascii_graphic() || b == b' ';
    match *head {
        [0xff, 0xfe, ..] => Some(u16::from_le_bytes),
        [0xfe, 0xff, ..] => Some(u16::from_be_bytes),
        [a, 0, b, 0, ..] if is_letter(a) && is_letter(b) => Some(u16::from_le_bytes),
        [0, a, 0, b, ..] if is_letter(a) && is_letter(b) => Some(u16::from_be_bytes),
        _ => None,
    }
}

/// Returns whether the beginning of a file is text whose lines end in CR alone.
fn ends_lines_in_cr(head: &[u8]) -> bool {
    head.contains(&b'\r') && head.iter().all(|&b| b >= b' ' || matches!(b, b'\r' | b'\t'))
}

/// The bytes of a file, unpacked, and their number.
fn open_bytes(path: &Path, limit: u64) -> Result<(Reader, u64)> {
    let unpack: Box<dyn BufRead> = match packing(path) {
        Some((Compression::Gzip, _)) => {
            let (reader, _) = open_plain(path)?;
            Box::new(BufReader::new(flate2::bufread::MultiGzDecoder::new(reader)))
        }
        Some((Compression::Zstd, _)) => {
            let (reader, _) = open_plain(path)?;
            let decoder = zstd::stream::read::Decoder::with_buffer(reader).and_then(|mut d| {
                d.window_log_max(WINDOW_LOG_MAX)?;
                Ok(d)
            });
            Box::new(BufReader::new(decoder.map_err(|e| unreadable(path, e))?))
        }
        None if path == Path::new("-") => Box::new(BufReader::new(std::io::stdin())),
        None if is_stream(path) => {
            let file = File::open(path).map_err(|e| unreadable(path, e))?;
            Box::new(BufReader::new(file))
        }
        None => {
            let (reader, length) = open_plain(path)?;
            return Ok((Box::new(reader), length));
        }
    };
    let bytes = within(unpack, path, limit)?;
    let length = bytes.len() as u64;
    Ok((Box::new(Cursor::new(bytes)), length))
}

/// All bytes, unless they are more than `limit`.
fn within(from: impl Read, path: &Path, limit: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = from.take(limit.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|e| unreadable(path, e))?;
    if bytes.len() as u64 > limit {
        let (what, needed) = ("the unpacked file", bytes.len() as u64);
        let fault = ReadFault::TooLarge { what, needed, limit };
        return Err(FilePlace::new(path).refuse(fault));
    }
    Ok(bytes)
}

/// Opens a regular file; returns its length too.
///
/// # Errors
/// A pipe or a device, before it is opened: opening or reading one could take for ever.
pub(super) fn open_plain(path: &Path) -> Result<(BufReader<File>, u64)> {
    let meta = std::fs::metadata(path).map_err(|e| unreadable(path, e))?;
    if !meta.is_file() {
        return Err(unreadable(path, "it is not a regular file"));
    }
    let file = File::open(path).map_err(|e| unreadable(path, e))?;
    Ok((BufReader::with_capacity(BUFFER_BYTES, file), meta.len()))
}

fn unreadable(path: &Path, reason: impl ToString) -> ReadError {
    FilePlace::new(path).refuse(ReadFault::Unreadable(reason.to_string()))
}

/// Returns whether a length is that of a binary STL with this head.
pub(super) fn is_binary_stl(head: &[u8], length: u64) -> bool {
    head.get(80..84)
        .and_then(|count| count.try_into().ok())
        .is_some_and(|count| length == 84 + 50 * u64::from(u32::from_le_bytes(count)))
}
