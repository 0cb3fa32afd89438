//! PLY, text and binary of both byte orders; properties other than positions and corners are passed over.

use std::io::BufRead;

use super::feed::{Feed, parse, quote};
use super::{Result, Spot, SurfaceSink};
use tetdb_base::geom::{Point, counted};
use tetdb_base::surface::NoteKind;

/// Whole numbers of faces that name no region.
const COLORS: [&str; 5] = ["red", "green", "blue", "alpha", "flags"];

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Text,
    Little,
    Big,
}

/// A scalar type of the header.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

struct Property {
    name: String,
    /// Type of the count in front, for lists.
    count: Option<Scalar>,
    value: Scalar,
}

struct Element {
    name: String,
    n: i64,
    properties: Vec<Property>,
    /// Line of the header that declares it.
    line: u64,
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
}

/// The elements of a file being read.
struct PlyReader<R> {
    feed: Feed<R>,
    encoding: Encoding,
}

pub(super) fn read<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let header = read_header(&mut feed)?;
    let encoding = header.encoding;
    feed.at.is_binary = encoding != Encoding::Text;
    let mut reader = PlyReader { feed, encoding };
    let n_vertices = header.elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.n);
    for element in &header.elements {
        let n = check_count(&reader.feed, encoding, element)?;
        match element.name.as_str() {
            "vertex" => reader.read_vertices(element, n, target)?,
            "face" => reader.read_faces(element, n, n_vertices, target)?,
            "tristrips" if n > 0 => {
                return Err(reader.feed.unsupported("PLY triangle strips"));
            }
            _ => {
                for _ in 0..n {
                    for property in &element.properties {
                        reader.skip(property)?;
                    }
                }
                note_skipped(&element.name, n, target);
            }
        }
    }
    reader.feed.note_rest(target.builder)?;
    reader.feed.finish(target.builder)
}

/// Notes elements that are neither vertices nor faces.
fn note_skipped(element: &str, n: u64, target: &mut SurfaceSink) {
    let name = quote(element.as_bytes());
    let records = counted(n, "[record|records] of the element");
    let what = format!("{records} {name} {} left out", if n == 1 { "was" } else { "were" });
    match (n, element) {
        (0, _) => {}
        (_, "edge") => target.builder.note(NoteKind::SkippedElements { what: "edges", n }),
        _ => target.builder.note(NoteKind::Said(what)),
    }
}

/// Compares an element's count with the bytes left: each property takes its size, or two in text.
fn check_count<R: BufRead>(feed: &Feed<R>, encoding: Encoding, element: &Element) -> Result<u64> {
    let bytes: u64 = match encoding {
        Encoding::Text => 2 * element.properties.len() as u64,
        _ => element.properties.iter().map(|p| p.count.unwrap_or(p.value).bytes()).sum(),
    };
    let name = match element.name.as_str() {
        "vertex" => "vertices",
        "face" => "faces",
        _ => "elements",
    };
    let counted = feed.check_count(name, element.n, bytes.max(1));
    counted.map_err(|e| e.at_spot(Spot::Line(element.line)))
}

fn read_header<R: BufRead>(feed: &mut Feed<R>) -> Result<Header> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut bytes = Vec::new();
    let mut first = true;
    loop {
        bytes.clear();
        let line = feed.at.line;
        if !feed.read_line(&mut bytes)? {
            return Err(feed.truncated("`end_header`"));
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let words: Vec<&str> = text.split_whitespace().collect();
        let wrong = |feed: &Feed<R>, expected: &str| {
            Err(feed.unexpected(expected, &bytes).at_spot(Spot::Line(line)))
        };
        match words.as_slice() {
            ["ply"] if first => {}
            _ if first => return wrong(feed, "`ply`"),
            [] | ["comment" | "obj_info", ..] => {}
            ["format", kind, _] => {
                encoding = Some(match *kind {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    _ => return wrong(feed, "a PLY format"),
                });
            }
            ["element", name, count] => match parse(count.as_bytes()) {
                Some(n) => elements.push(Element {
                    name: (*name).to_owned(),
                    n,
                    properties: Vec::new(),
                    line,
                }),
                None => return wrong(feed, "a number of elements"),
            },
            ["property", types @ .., name] => {
                let scalars: Option<Vec<Scalar>> =
                    types.iter().filter(|t| **t != "list").map(|t| Scalar::named(t)).collect();
                let (count, value) = match (types, scalars.as_deref()) {
                    (["list", _, _], Some([count, value])) => (Some(*count), *value),
                    ([_], Some([value])) => (None, *value),
                    _ => return wrong(feed, "a property of known type"),
                };
                match elements.last_mut() {
                    Some(e) => {
                        e.properties.push(Property { name: (*name).to_owned(), count, value })
                    }
                    None => return wrong(feed, "an element before its properties"),
                }
            }
            ["end_header"] => break,
            _ => return wrong(feed, "a line of a PLY header"),
        }
        first = false;
    }
    match encoding {
        Some(encoding) => Ok(Header { encoding, elements }),
        None => Err(feed.unexpected("a `format` line in the header", b"none")),
    }
}

impl<R: BufRead> PlyReader<R> {
    /// One scalar as a double; every type of the format fits.
    fn scalar(&mut self, kind: Scalar) -> Result<f64> {
        macro_rules! number {
            ($type:ty, $n:literal) => {{
                let bytes = self.feed.bytes::<$n>()?;
                f64::from(if self.encoding == Encoding::Little {
                    <$type>::from_le_bytes(bytes)
                } else {
                    <$type>::from_be_bytes(bytes)
                })
            }};
        }
        if self.encoding == Encoding::Text {
            self.feed.need_word("a number")?;
            return self.feed.parse("a number");
        }
        Ok(match kind {
            Scalar::I8 => number!(i8, 1),
            Scalar::U8 => number!(u8, 1),
            Scalar::I16 => number!(i16, 2),
            Scalar::U16 => number!(u16, 2),
            Scalar::I32 => number!(i32, 4),
            Scalar::U32 => number!(u32, 4),
            Scalar::F32 => number!(f32, 4),
            Scalar::F64 => number!(f64, 8),
        })
    }

    fn integer(&mut self, kind: Scalar) -> Result<i64> {
        let value = self.scalar(kind)?;
        if value.fract() != 0.0 || value.abs() > 9e15 {
            let text = value.to_string();
            return Err(self.feed.unexpected("a whole number", text.as_bytes()));
        }
        Ok(value as i64)
    }

    /// The length of a list, compared with the bytes left.
    fn list_len(&mut self, count: Scalar, value: Scalar) -> Result<u64> {
        let n = self.integer(count)?;
        let bytes = if self.encoding == Encoding::Text { 2 } else { value.bytes() };
        self.feed.check_count("list items", n, bytes)
    }

    fn skip(&mut self, property: &Property) -> Result<()> {
        let n = match property.count {
            Some(count) => self.list_len(count, property.value)?,
            None => 1,
        };
        if self.encoding != Encoding::Text {
            return self.feed.skip_bytes(n * property.value.bytes());
        }
        for _ in 0..n {
            self.feed.need_word("a number")?;
        }
        Ok(())
    }

    fn read_vertices(&mut self, element: &Element, n: u64, target: &mut SurfaceSink) -> Result<()> {
        let axis =
            |p: &Property| ["x", "y", "z"].iter().position(|a| p.count.is_none() && *a == p.name);
        let axes: Vec<Option<usize>> = element.properties.iter().map(axis).collect();
        if (0..3).any(|a| axes.iter().filter(|x| **x == Some(a)).count() != 1) {
            return Err(self.feed.unexpected("vertex properties x, y and z", b"others"));
        }
        for i in 0..n {
            self.feed.need_record("vertices", n, i)?;
            let mut p = [0.0; 3];
            for (property, axis) in element.properties.iter().zip(&axes) {
                match axis {
                    Some(a) => {
                        let x = self.scalar(property.value)?;
                        p[*a] = self.feed.checked(x)?;
                    }
                    None => self.skip(property)?,
                }
            }
            self.feed.placed(target.builder.vertex(Point::from_array(p)))?;
        }
        Ok(())
    }

    fn read_faces(
        &mut self,
        element: &Element,
        n: u64,
        n_vertices: i64,
        target: &mut SurfaceSink,
    ) -> Result<()> {
        let is_corners = |p: &Property| {
            p.count.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index")
        };
        if n > 0 && element.properties.iter().filter(|p| is_corners(p)).count() != 1 {
            return Err(self.feed.unexpected("a face property `vertex_indices`", b"none"));
        }
        let is_number = |p: &&Property| p.count.is_none() && p.value.is_integer();
        let own = element.properties.iter().filter(is_number).map(|p| p.name.as_str());
        let own: Vec<&str> = own.filter(|name| !COLORS.contains(name)).collect();
        if n > 0 && !own.is_empty() {
            let what = format!(
                "properties of faces that may name regions were left out: {}",
                own.join(", ")
            );
            target.builder.note(NoteKind::Said(what));
        }
        let n_vertices = u64::try_from(n_vertices).unwrap_or(0);
        let label = target.label("");
        let mut corners = Vec::new();
        for i in 0..n {
            self.feed.need_record("faces", n, i)?;
            for property in &element.properties {
                let Some(count) = property.count.filter(|_| is_corners(property)) else {
                    self.skip(property)?;
                    continue;
                };
                let len = self.list_len(count, property.value)?;
                if len < 3 {
                    return Err(self
                        .feed
                        .unexpected("a face of at least 3 corners", len.to_string().as_bytes()));
                }
                corners.clear();
                for _ in 0..len {
                    let index = self.integer(property.value)?;
                    corners.push(self.feed.check_index(index, 0, n_vertices)?);
                }
            }
            self.feed.placed(target.builder.polygon(&corners, label))?;
        }
        Ok(())
    }
}
