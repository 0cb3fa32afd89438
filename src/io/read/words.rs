//! Words and numbers of files, and how messages show them.

use std::borrow::Cow;

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

/// Characters of the bytes 0x80 to 0x9f in Windows-1252; its gaps have those of code page 850.
const UPPER: &str = "€ü‚ƒ„…†‡ˆ‰Š‹ŒìŽÅÉ‘’“”•–—˜™š›œØžŸ";

/// Text of a file in UTF-8, else in the code page of Windows, so that different names stay different.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    let decode = |&b: &u8| match b {
        0x80..0xa0 => UPPER.chars().nth(usize::from(b - 0x80)).unwrap_or('?'),
        _ => char::from(b),
    };
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(decode).collect()),
    }
}

/// A name from a file: trimmed, printable.
pub(super) fn name(bytes: &[u8]) -> String {
    text(bytes).trim().chars().filter(|c| !c.is_control()).take(200).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_old_code_pages_stay_different() {
        assert_eq!(name(b" Au\xdfenwand\r"), "Außenwand");
        assert_eq!(name("c\u{f4}t\u{e9}".as_bytes()), "côté");
        let all: std::collections::HashSet<String> =
            (0x80..=0xffu8).map(|b| name(&[b, b'x'])).collect();
        // Code page 850 gives five letters that Latin-1 has too; 0xa0 is a blank.
        assert_eq!(all.len(), 128 - 5);
        assert!(all.iter().all(|n| n.ends_with('x')));
    }
}
