//! Words and numbers of files, and how messages show them.

use super::error::{FilePlace, ReadError, ReadFault};
use tetdb_base::geom::Point;

/// Wanted lengths are kept in single precision, which ends at 3e38; the rest is left for sums and squares.
pub(super) const COORDINATE_MAX: f64 = 1e30;

/// The error of a coordinate that is not finite or too large to compute with.
pub(super) fn check_point(p: Point, place: &FilePlace) -> Result<(), ReadError> {
    match p.to_array().into_iter().find(|x| !x.is_finite() || x.abs() >= COORDINATE_MAX) {
        None => Ok(()),
        Some(x) if x.is_finite() => Err(place.refuse(ReadFault::CoordinateRange(x))),
        Some(x) => Err(not_a_number(place, "a coordinate", x.to_string().as_bytes())),
    }
}

/// The error of a word that is no finite number.
pub(super) fn not_a_number(place: &FilePlace, what: &'static str, found: &[u8]) -> ReadError {
    place.refuse(ReadFault::NotANumber { what, found: quote(found) })
}

/// `bytes` as a number in plain decimal text.
pub(super) fn parse<T: std::str::FromStr>(bytes: &[u8]) -> Option<T> {
    std::str::from_utf8(bytes).ok()?.parse().ok()
}

/// A short printable form of bytes from a file.
pub(super) fn quote(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(40)]);
    let clean: String = text.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    format!("`{clean}`")
}

/// A name from a file: trimmed, printable.
pub(super) fn name(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    text.trim().chars().filter(|c| !c.is_control()).take(200).collect()
}
