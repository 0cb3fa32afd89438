//! Lengths, or points with lengths, from a NumPy array file of floating point numbers.
//!
//! Source: the NPY format, versions 1 to 3, of NumPy's documentation (NEP 1).

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::error::{FilePlace, ReadError, ReadFault, Spot};
use super::feed::Result;
use super::open::open_plain;

const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Shorter lengths do not fit single precision with their inverse cubes in sums.
const LENGTH_MIN: f64 = 1e-30;
/// Longest head that is read.
const HEAD_MAX: usize = 1 << 16;

/// Reads lengths above zero, holding at most `limit` bytes.
///
/// # Errors
/// Another kind of file, more than one dimension, numbers other than floating point of 4 or 8 bytes; the place of a bad length.
pub fn read_lengths(path: &Path, limit: u64) -> Result<Vec<f64>> {
    read_array(path, None, limit)
}

/// Reads points with lengths above zero: rows of x, y, z and a length, one behind the other. Errors: as [`read_lengths`].
pub(super) fn read_rows(path: &Path, limit: u64) -> Result<Vec<f64>> {
    read_array(path, Some(4), limit)
}

/// Reads a list, or rows of a number of columns, of which the last is a length.
fn read_array(path: &Path, columns: Option<u64>, limit: u64) -> Result<Vec<f64>> {
    let (from, length_of_file) = open_plain(path)?;
    let mut file = ArrayFile { from, name: path.display().to_string(), at: 0 };
    let (n, kind) = file.head(columns)?;
    let needed = n.saturating_mul(8);
    if needed > limit {
        let fault = ReadFault::TooLarge { what: "the lengths", needed, limit };
        return Err(file.place(Spot::File).refuse(fault));
    }
    let mut lengths = Vec::with_capacity(n.min(length_of_file) as usize);
    for i in 0..n {
        let h = file.number(kind)?;
        let is_length = columns.is_none_or(|columns| (i + 1) % columns == 0);
        if is_length && !(LENGTH_MIN..1.0 / LENGTH_MIN).contains(&h) {
            let expected = format!("a length from {LENGTH_MIN:e} to {:e}", 1.0 / LENGTH_MIN);
            return Err(file.unexpected(Spot::File, &expected, format!("{h} as number {i}")));
        }
        if !h.is_finite() {
            let found = format!("{h} as number {i}");
            return Err(file.unexpected(Spot::File, "a coordinate", found));
        }
        lengths.push(h);
    }
    if !file.from.fill_buf().is_ok_and(<[u8]>::is_empty) {
        let expected = "the end of the file behind its last number";
        return Err(file.unexpected(Spot::File, expected, "more bytes".to_owned()));
    }
    Ok(lengths)
}

/// Bytes of a number, and whether the high ones come first.
type NumberFormat = (usize, bool);

/// An array file, read from its beginning on.
pub(super) struct ArrayFile {
    pub from: BufReader<File>,
    pub name: String,
    at: u64,
}

impl ArrayFile {
    /// Errors: the file cannot be opened.
    pub fn open(path: &Path) -> Result<Self> {
        let (from, _) = open_plain(path)?;
        Ok(Self { from, name: path.display().to_string(), at: 0 })
    }

    /// Bytes taken so far.
    pub fn taken(&self) -> u64 {
        self.at
    }

    fn place(&self, spot: Spot) -> FilePlace {
        FilePlace { file: self.name.clone(), spot }
    }

    pub fn unexpected(&self, spot: Spot, expected: &str, found: String) -> ReadError {
        let expected = expected.to_owned();
        self.place(spot).refuse(ReadFault::Unexpected { expected, found })
    }

    pub fn take(&mut self, n: usize) -> Result<Vec<u8>> {
        let mut bytes = vec![0; n];
        let read = self.from.read_exact(&mut bytes);
        read.map_err(|e| {
            let (expected, found) = (format!("{n} more bytes"), e.to_string());
            self.place(Spot::Byte(self.at)).refuse(ReadFault::Truncated { expected, found })
        })?;
        self.at += n as u64;
        Ok(bytes)
    }

    fn number(&mut self, (bytes, big): NumberFormat) -> Result<f64> {
        let mut word = self.take(bytes)?;
        if big {
            word.reverse();
        }
        Ok(match bytes {
            8 => f64::from_le_bytes(std::array::from_fn(|i| word[i])),
            _ => f64::from(f32::from_le_bytes(std::array::from_fn(|i| word[i]))),
        })
    }

    /// Reads the head: type of the numbers, whether they lie in C order, and the shape as text.
    pub fn head_words(&mut self) -> Result<(String, bool, String)> {
        let start = self.take(8)?;
        if !start.starts_with(MAGIC) {
            let found = format!("{:x?}", &start[..6]);
            return Err(self.unexpected(Spot::Byte(0), "an array file of NumPy", found));
        }
        let length = self.take(if start[6] == 1 { 2 } else { 4 })?;
        let length = (length.iter().rev()).fold(0, |n, &b| n << 8 | usize::from(b));
        if length > HEAD_MAX {
            let found = format!("{length} bytes");
            return Err(self.unexpected(Spot::Byte(8), "a short head", found));
        }
        let head = String::from_utf8_lossy(&self.take(length)?).into_owned();
        let kind = value_of(&head, "descr").unwrap_or_default();
        let is_by_rows = value_of(&head, "fortran_order").as_deref() == Some("False");
        let shape = value_of(&head, "shape").unwrap_or_default();
        Ok((kind.trim_matches(['\'', '"']).to_owned(), is_by_rows, shape))
    }

    /// Reads the head: how many numbers follow, and their kind. With `columns`, they are rows of so many.
    fn head(&mut self, columns: Option<u64>) -> Result<(u64, NumberFormat)> {
        let (kind, is_by_rows, shape) = self.head_words()?;
        let kind = match &*kind {
            "<f8" | "=f8" => (8, false),
            "<f4" | "=f4" => (4, false),
            ">f8" => (8, true),
            ">f4" => (4, true),
            kind => {
                let expected = "floating point numbers of 4 or 8 bytes (float32 or float64)";
                return Err(self.unexpected(Spot::Byte(8), expected, format!("type {kind}")));
            }
        };
        let sides = sides_of(&shape);
        let n = match (&sides[..], columns) {
            ([n], None) => n.parse().ok(),
            ([n, row], Some(columns)) if is_by_rows && row.parse() == Ok(columns) => {
                n.parse().ok().and_then(|n: u64| n.checked_mul(columns))
            }
            _ => None,
        };
        let n = n.ok_or_else(|| {
            let found = format!("an array of shape {shape}");
            let expected = match columns {
                None => "a list of one dimension",
                Some(_) => "rows of four numbers x, y, z and h, in C order",
            };
            self.unexpected(Spot::Byte(8), expected, found)
        })?;
        Ok((n, kind))
    }
}

/// The sides of an array, from the text of its shape.
pub(super) fn sides_of(shape: &str) -> Vec<&str> {
    let sides = shape.trim_matches(['(', ')']).split(',').map(str::trim);
    sides.filter(|side| !side.is_empty()).collect()
}

/// The text of a key's value in a head, up to the comma that ends it.
fn value_of(head: &str, key: &str) -> Option<String> {
    let rest = head.split_once(&format!("'{key}':"))?.1.trim_start();
    let end = match rest.starts_with(['(', '[']) {
        true => rest.find([')', ']'])? + 1,
        false => rest.find([',', '}'])?,
    };
    Some(rest[..end].trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((head.len() as u16).to_le_bytes());
        bytes.extend(head.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn read(bytes: &[u8]) -> Result<Vec<f64>> {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("h.npy");
        std::fs::write(&path, bytes).expect("the folder takes files");
        read_lengths(&path, 1 << 20)
    }

    #[test]
    fn lengths_come_back_and_all_else_is_told() {
        let two: Vec<u8> = [0.5f64, 2.0].iter().flat_map(|h| h.to_le_bytes()).collect();
        assert_eq!(read(&file("<f8", "(2,)", &two)).ok(), Some(vec![0.5, 2.0]));
        let single: Vec<u8> = [0.5f32].iter().flat_map(|h| h.to_be_bytes()).collect();
        assert_eq!(read(&file(">f4", "(1,)", &single)).ok(), Some(vec![0.5]));
        assert_eq!(read(&file("<f8", "(0,)", &[])).ok(), Some(Vec::new()));
        for (kind, shape, data, code) in [
            ("<f8", "(2,)", &two[..15], "truncated-file"),
            ("<f8", "(1,)", &two[..], "unexpected-text"),
            ("<i8", "(2,)", &two[..], "unexpected-text"),
            ("<f8", "(2, 1)", &two[..], "unexpected-text"),
            ("<f8", "(1,)", &[0; 8][..], "unexpected-text"),
            ("<f8", "(1,)", &1e-300f64.to_le_bytes()[..], "unexpected-text"),
            ("<f8", "(9000000000,)", &two[..], "memory"),
            ("<f8", "()", &two[..], "unexpected-text"),
        ] {
            let found = read(&file(kind, shape, data)).expect_err(code);
            assert_eq!(found.code(), code, "{kind} {shape}: {found}");
        }
        assert!(read(b"OFF\n").is_err() && read(b"PK\x03\x04 something else").is_err());
    }
}
