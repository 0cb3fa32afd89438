//! VTK's XML files of polygons (`.vtp`) and cells (`.vtu`): arrays as text, base64 or raw, plain or compressed with zlib.
//!
//! Source: the XML file formats of VTK's documentation. The file is held in memory.

use std::io::{BufRead, Read};

use super::feed::{Feed, check_point, quote};
use super::vtk::{CELL_VALUES, CellCounts, Shape, shape};
use super::xml::{Tag, base64_word, line_of, numbers};
use super::{FilePlace, ReadFault, Result, Spot, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

/// An array of a piece.
pub(super) struct Array {
    /// The tag around it, such as `Points` or `PointData`.
    pub section: String,
    pub name: String,
    pub n_components: usize,
    pub values: Vec<f64>,
}

/// A piece of a grid: its arrays.
#[derive(Default)]
pub(super) struct Piece {
    pub arrays: Vec<Array>,
}

impl Piece {
    pub fn values(&self, section: &str, name: &str) -> &[f64] {
        let is_it = |a: &&Array| a.section == section && (name.is_empty() || a.name == name);
        self.arrays.iter().find(is_it).map_or(&[], |a| &a.values)
    }

    pub fn points(&self) -> impl ExactSizeIterator<Item = Point> {
        self.values("Points", "").chunks_exact(3).map(Point::from_slice)
    }

    /// The vertices of each cell of a section. Errors: offsets or vertices that do not fit.
    pub fn cells(&self, section: &str, place: &FilePlace) -> Result<Vec<Vec<u32>>> {
        let (vertices, ends) =
            (self.values(section, "connectivity"), self.values(section, "offsets"));
        let n = self.points().len();
        let mut from = 0;
        let cell = |&end: &f64| {
            let cell = vertices.get(from..end as usize);
            from = end as usize;
            let cell = cell.ok_or_else(|| {
                let (declared, found) =
                    (end.to_string(), format!("{} in the array", vertices.len()));
                place.refuse(ReadFault::CountMismatch {
                    what: "vertices of cells",
                    declared,
                    found,
                })
            })?;
            let vertex = |&v: &f64| match v >= 0.0 && v < n as f64 {
                true => Ok(v as u32),
                false => Err(place.refuse(ReadFault::IndexOutOfRange {
                    index: v as i64,
                    low: 0,
                    high: n as i64 - 1,
                })),
            };
            cell.iter().map(vertex).collect()
        };
        let cells = ends.iter().map(cell).collect::<Result<Vec<_>>>()?;
        let used = ends.last().map_or(0, |&end| end as usize);
        match used == vertices.len() {
            true => Ok(cells),
            false => Err(place.refuse(ReadFault::CountMismatch {
                what: "vertices of cells",
                declared: used.to_string(),
                found: format!("{} in the array", vertices.len()),
            })),
        }
    }
}

/// Bytes of arrays: raw, or base64 in parts that may each end in padding.
enum Bytes<'t> {
    Raw(&'t [u8]),
    Base64 { text: &'t [u8], ready: Vec<u8> },
}

impl Bytes<'_> {
    fn take(&mut self, n: usize) -> Option<Vec<u8>> {
        match self {
            Self::Raw(bytes) => {
                let (taken, rest) = bytes.split_at_checked(n)?;
                *bytes = rest;
                Some(taken.to_vec())
            }
            Self::Base64 { text, ready } => {
                while ready.len() < n {
                    let (bytes, k) = base64_word(text)?;
                    ready.extend(&bytes[..k]);
                }
                Some(ready.drain(..n).collect())
            }
        }
    }
}

/// How the arrays of a file are written.
struct Layout<'t> {
    is_big: bool,
    /// Bytes of a length before an array.
    header: usize,
    is_packed: bool,
    /// The arrays behind the tags, and whether they are base64.
    appended: Option<(&'t [u8], bool)>,
    bytes_max: u64,
}

impl Layout<'_> {
    fn length(&self, bytes: &mut Bytes) -> Option<usize> {
        let mut word = bytes.take(self.header)?;
        if self.is_big {
            word.reverse();
        }
        let number = word.iter().rev().fold(0u64, |n, &b| n << 8 | u64::from(b));
        usize::try_from(number).ok().filter(|&n| n as u64 <= self.bytes_max)
    }

    /// The bytes of an array, unpacked.
    fn content(&self, bytes: &mut Bytes) -> Option<Vec<u8>> {
        let n = self.length(bytes)?;
        if !self.is_packed {
            return bytes.take(n);
        }
        let (_, _) = (self.length(bytes)?, self.length(bytes)?);
        let sizes = (0..n).map(|_| self.length(bytes)).collect::<Option<Vec<usize>>>()?;
        let mut content = Vec::new();
        for size in sizes {
            let block = bytes.take(size)?;
            let left = self.bytes_max.checked_sub(content.len() as u64)?;
            let unpack = flate2::read::ZlibDecoder::new(&block[..]);
            unpack.take(left).read_to_end(&mut content).ok()?;
        }
        Some(content)
    }

    /// The numbers of an array whose tag is followed by `text`.
    fn array(&self, tag: &Tag, text: &[u8]) -> Option<Vec<f64>> {
        let format = tag.get("format").unwrap_or("ascii");
        let mut bytes = match (format, self.appended) {
            ("ascii", _) => {
                let text = text.split(|&b| b == b'<').next()?;
                let words = text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
                return words.map(super::feed::parse).collect();
            }
            ("appended", Some((data, is_base64))) => {
                let text = data.get(tag.get("offset")?.parse::<usize>().ok()?..)?;
                match is_base64 {
                    true => Bytes::Base64 { text, ready: Vec::new() },
                    false => Bytes::Raw(text),
                }
            }
            ("binary", _) => Bytes::Base64 { text, ready: Vec::new() },
            _ => return None,
        };
        let content = self.content(&mut bytes)?;
        numbers(tag.get("type").unwrap_or_default(), self.is_big, &content)
    }
}

/// Reads all arrays of numbers, holding at most `limit` bytes.
pub(super) fn pieces<R: BufRead>(mut feed: Feed<R>, limit: u64) -> Result<Vec<Piece>> {
    let text = feed.rest(limit)?;
    let whole = FilePlace { file: feed.file().to_owned(), spot: Spot::File };
    let place_of = |byte| FilePlace { file: whole.file.clone(), spot: line_of(&text, byte) };
    let unsupported =
        |byte: usize, what: String| place_of(byte).refuse(ReadFault::Unsupported(what));
    let expected = |byte: usize, what: &str| {
        let (expected, found) = (what.to_owned(), "something else".to_owned());
        place_of(byte).refuse(ReadFault::Unexpected { expected, found })
    };
    let mut layout =
        Layout { is_big: false, header: 4, is_packed: false, appended: None, bytes_max: limit };
    let start = text.windows(13).position(|w| w == b"<AppendedData");
    if let Some(tag) = start.and_then(|start| Tag::next(&text, start)) {
        let mark = text[tag.end..].iter().position(|&b| b == b'_');
        let from = mark.map(|k| tag.end + k + 1);
        let from = from.ok_or_else(|| expected(tag.end, "`_` before appended data"))?;
        layout.appended = Some((&text[from..], tag.get("encoding") == Some("base64")));
    }
    let tags = &text[..start.unwrap_or(text.len())];
    let (mut at, mut pieces, mut sections) = (0, Vec::<Piece>::new(), Vec::new());
    let mut is_vtk = false;
    while let Some(tag) = Tag::next(tags, at) {
        at = tag.end;
        match (tag.name, tag.is_end) {
            ("VTKFile", false) => {
                is_vtk = true;
                layout.is_big = tag.get("byte_order") == Some("BigEndian");
                layout.header = if tag.get("header_type") == Some("UInt64") { 8 } else { 4 };
                let compressor = tag.get("compressor");
                layout.is_packed = compressor.is_some();
                let kind = tag.get("type").unwrap_or_default();
                if !["PolyData", "UnstructuredGrid"].contains(&kind) {
                    return Err(unsupported(
                        at,
                        format!("a VTK file of type {}", quote(kind.as_bytes())),
                    ));
                }
                if let Some(other) = compressor.filter(|name| *name != "vtkZLibDataCompressor") {
                    return Err(unsupported(
                        at,
                        format!("data packed by {}", quote(other.as_bytes())),
                    ));
                }
            }
            ("Piece", false) => pieces.push(Piece::default()),
            ("DataArray", false) => {
                let kind = tag.get("type").unwrap_or_default();
                if kind == "String" {
                    continue;
                }
                let values = layout.array(&tag, &tags[at..]);
                let values = values.ok_or_else(|| expected(at, "the numbers of an array"))?;
                if let (Some(piece), Some(&section)) = (pieces.last_mut(), sections.last()) {
                    piece.arrays.push(Array {
                        section: str::to_owned(section),
                        name: tag.get("Name").unwrap_or_default().to_owned(),
                        n_components: tag
                            .get("NumberOfComponents")
                            .and_then(|n| n.parse().ok())
                            .unwrap_or(1),
                        values,
                    });
                }
            }
            (name, false) if !tag.is_empty => sections.push(name),
            (name, true) if sections.last() == Some(&name) => drop(sections.pop()),
            _ => {}
        }
    }
    match is_vtk {
        true => Ok(pieces),
        false => Err(expected(0, "a tag `VTKFile`")),
    }
}

/// Reads the polygons and strips of a surface, or the flat cells of a grid.
pub(super) fn read<R: BufRead>(feed: Feed<R>, limit: u64, target: &mut SurfaceSink) -> Result<()> {
    let place = FilePlace { file: feed.file().to_owned(), spot: Spot::File };
    let refuse = |source| place.refuse(ReadFault::Surface(source));
    let label = target.label("");
    let (mut first, mut cells_of) = (0, CellCounts::default());
    let mut has_cell_data = false;
    for piece in pieces(feed, limit)? {
        has_cell_data |= piece.arrays.iter().any(|array| array.section == "CellData");
        for p in piece.points() {
            check_point(p, &place)?;
            target.builder.vertex(p).map_err(refuse)?;
        }
        let mut shapes: Vec<(Vec<u32>, Option<Shape>)> = Vec::new();
        for (section, kind) in [("Polys", 7), ("Strips", 6), ("Lines", 4), ("Verts", 2)] {
            let cells = piece.cells(section, &place)?;
            shapes.extend(cells.into_iter().map(|cell| (cell, shape(kind))));
        }
        let kinds = piece.values("Cells", "types");
        let cells = piece.cells("Cells", &place)?;
        if cells.len() != kinds.len() {
            return Err(place.refuse(ReadFault::CountMismatch {
                what: "types of cells",
                declared: kinds.len().to_string(),
                found: format!("{} cells", cells.len()),
            }));
        }
        let cells = cells.into_iter();
        shapes.extend(cells.zip(kinds).map(|(cell, &kind)| (cell, shape(kind as i64))));
        for (mut cell, shape) in shapes {
            cell.iter_mut().for_each(|v| *v += first);
            cells_of.add(&cell, shape, label, target).map_err(|fault| place.refuse(fault))?;
        }
        first = target.builder.n_file_vertices() as u32;
    }
    cells_of.note(target);
    if has_cell_data {
        target.builder.note(NoteKind::Said(CELL_VALUES.to_owned()));
    }
    match target.builder.n_file_triangles() {
        0 => Err(place.refuse(ReadFault::Empty)),
        _ => target.builder.end_file().map_err(refuse),
    }
}
