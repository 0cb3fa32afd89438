//! GIFTI, `.gii`: surfaces of brains as XML, with arrays as text or base64, plain or compressed.
//!
//! Each array of points begins a surface, to which the next array of triangles belongs. Source: the GIFTI format, version 1.0.
//! The file is held in memory.

use std::io::{BufRead, Read};

use super::feed::{Feed, check_point, parse, quote};
use super::xml::{Lines, Tag, base64_word, numbers};
use super::{FilePlace, ReadError, ReadFault, Result, Spot, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

/// A matrix of a file.
struct Matrix {
    rows: Vec<[f64; 3]>,
    place: FilePlace,
}

pub(super) fn read<R: BufRead>(
    mut feed: Feed<R>,
    limit: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let text = feed.rest(limit)?;
    let file = feed.file().to_owned();
    let (mut at, mut lines) = (0, Lines::default());
    let (mut is_gifti, mut is_whole, mut n_others, mut is_moved) = (false, false, 0, false);
    let mut n_points = None;
    let label = target.label("");
    while let Some(tag) = Tag::next(&text, at) {
        at = tag.end;
        lines.advance(&text, at);
        match (tag.name, tag.is_end) {
            ("GIFTI", is_end) => (is_gifti, is_whole) = (true, is_end),
            ("MatrixData", false) => is_moved |= !is_identity(&text[at..]),
            ("DataArray", false) => {
                let place = FilePlace { file: file.clone(), spot: Spot::Line(lines.line()) };
                let intent = tag.get("Intent").unwrap_or_default();
                match intent.trim_start_matches("NIFTI_INTENT_") {
                    "POINTSET" => {
                        let first = target.builder.n_file_vertices() as u64;
                        let points = matrix(&tag, &text, place, limit)?;
                        n_points = Some((first, points.rows.len() as u64));
                        add_points(&points, target)?;
                    }
                    "TRIANGLE" => {
                        let triangles = matrix(&tag, &text, place, limit)?;
                        let (first, n) = n_points.unwrap_or_default();
                        add_triangles(&triangles, first, n, label, target)?;
                    }
                    _ => n_others += 1,
                }
            }
            _ => {}
        }
    }
    let whole = FilePlace { file, spot: Spot::File };
    if !is_gifti {
        let (expected, found) = ("a tag `GIFTI`".to_owned(), "none".to_owned());
        return Err(whole.refuse(ReadFault::Unexpected { expected, found }));
    }
    if !is_whole {
        let (expected, found) =
            ("the end of the tag `GIFTI`".to_owned(), "the end of the file".to_owned());
        return Err(whole.refuse(ReadFault::Truncated { expected, found }));
    }
    if n_others > 0 {
        let what = match n_others {
            1 => "1 array of values at vertices was left out".to_owned(),
            n => format!("{n} arrays of values at vertices were left out"),
        };
        target.builder.note(NoteKind::Said(what));
    }
    if is_moved {
        let text = "coordinates are taken as they are: a matrix of the file into another space was not applied";
        target.builder.note(NoteKind::Said(text.to_owned()));
    }
    match target.builder.n_file_triangles() {
        0 => Err(whole.refuse(ReadFault::Empty)),
        _ => target.builder.end_file().map_err(|source| whole.refuse(ReadFault::Surface(source))),
    }
}

/// Returns whether the sixteen numbers at the beginning of a text are those of no change.
fn is_identity(text: &[u8]) -> bool {
    let text = text.split(|&b| b == b'<').next().unwrap_or_default();
    let words = text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    words.enumerate().all(|(i, word)| parse(word) == Some(f64::from(u8::from(i % 5 == 0))))
}

fn add_points(points: &Matrix, target: &mut SurfaceSink) -> Result<()> {
    for &row in &points.rows {
        let p = Point::from_array(row);
        check_point(p, &points.place)?;
        let added = target.builder.vertex(p);
        added.map_err(|source| points.place.refuse(ReadFault::Surface(source)))?;
    }
    Ok(())
}

/// Adds triangles of the `n` points from number `first` on.
fn add_triangles(
    triangles: &Matrix,
    first: u64,
    n: u64,
    label: u32,
    target: &mut SurfaceSink,
) -> Result<()> {
    for row in &triangles.rows {
        let vertex = |x: f64| match x >= 0.0 && x < n as f64 && x.fract() == 0.0 {
            true => Ok((first + x as u64) as u32),
            false => Err(triangles.place.refuse(ReadFault::IndexOutOfRange {
                index: x as i64,
                low: 0,
                high: n as i64 - 1,
            })),
        };
        let corners = [vertex(row[0])?, vertex(row[1])?, vertex(row[2])?];
        let added = target.builder.polygon(&corners, label);
        added.map_err(|source| triangles.place.refuse(ReadFault::Surface(source)))?;
    }
    Ok(())
}

/// Reads an array of three columns, whose tag is in `text`.
fn matrix(tag: &Tag, text: &[u8], place: FilePlace, limit: u64) -> Result<Matrix> {
    let unsupported = |what: String| place.refuse(ReadFault::Unsupported(what));
    let dimension =
        |key| tag.get(key).and_then(|n: &str| n.trim().parse::<u64>().ok()).unwrap_or(1);
    let (n, width) = (dimension("Dim0"), dimension("Dim1"));
    if width != 3 || tag.get("Dimensionality").is_some_and(|n| n.trim() != "2") {
        return Err(unsupported(format!(
            "an array of {n} times {width} values, not three columns,"
        )));
    }
    let wrong = |found: String| -> ReadError {
        let (what, declared) = ("values of an array", format!("{n} rows of three"));
        place.refuse(ReadFault::CountMismatch { what, declared, found })
    };
    let (kind, bytes_each) = match tag.get("DataType").unwrap_or_default() {
        "NIFTI_TYPE_FLOAT32" => ("Float32", 4),
        "NIFTI_TYPE_FLOAT64" => ("Float64", 8),
        "NIFTI_TYPE_INT32" => ("Int32", 4),
        "NIFTI_TYPE_UINT32" => ("UInt32", 4),
        "NIFTI_TYPE_INT64" => ("Int64", 8),
        "NIFTI_TYPE_UINT8" => ("UInt8", 1),
        other => return Err(unsupported(format!("values of type {}", quote(other.as_bytes())))),
    };
    let most = n.checked_mul(3 * bytes_each).filter(|&n| n <= limit);
    let most = most.ok_or_else(|| {
        let needed = n.saturating_mul(3 * bytes_each);
        place.refuse(ReadFault::TooLarge { what: "an array", needed, limit })
    })?;
    let data = data_of(tag.end, text);
    let data = data.ok_or_else(|| wrong("no tag `Data` behind it".to_owned()))?;
    let is_big = tag.get("Endian") == Some("BigEndian");
    let encoding = tag.get("Encoding").unwrap_or_default();
    let in_full = |bytes: Vec<u8>| {
        (bytes.len() as u64 == most).then(|| numbers(kind, is_big, &bytes)).flatten()
    };
    let values = match encoding {
        "ASCII" => {
            let words = data.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
            words.map(parse).collect::<Option<Vec<f64>>>()
        }
        "Base64Binary" => bytes_of(data).and_then(in_full),
        "GZipBase64Binary" => bytes_of(data).and_then(|packed| {
            let mut bytes = Vec::new();
            let unpack = flate2::read::ZlibDecoder::new(&packed[..]);
            unpack.take(most + 1).read_to_end(&mut bytes).ok()?;
            in_full(bytes)
        }),
        other => {
            return Err(unsupported(format!("data with the encoding {}", quote(other.as_bytes()))));
        }
    };
    let values = values.ok_or_else(|| wrong(format!("not to be read as {kind} in {encoding}")))?;
    if values.len() as u64 != 3 * n {
        return Err(wrong(format!("{} in the data", values.len())));
    }
    let n = n as usize;
    let rows = match tag.get("ArrayIndexingOrder") {
        Some("ColumnMajorOrder") => {
            (0..n).map(|i| [values[i], values[n + i], values[2 * n + i]]).collect()
        }
        _ => values.as_chunks::<3>().0.to_vec(),
    };
    Ok(Matrix { rows, place })
}

/// The content of the tag `Data` of an array whose tag ends at a byte.
fn data_of(mut at: usize, text: &[u8]) -> Option<&[u8]> {
    loop {
        let tag = Tag::next(text, at)?;
        at = tag.end;
        match (tag.name, tag.is_end) {
            ("Data", false) if tag.is_empty => return Some(&[]),
            ("Data", false) => return text[at..].split(|&b| b == b'<').next(),
            ("DataArray", _) => return None,
            _ => {}
        }
    }
}

/// All bytes of a text in base64.
fn bytes_of(mut text: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    loop {
        text = text.trim_ascii();
        if text.is_empty() {
            return Some(bytes);
        }
        let (word, n) = base64_word(&mut text)?;
        bytes.extend_from_slice(&word[..n]);
    }
}
