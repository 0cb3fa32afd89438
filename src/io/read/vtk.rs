//! Legacy VTK files, text or binary, of versions 2 to 5.1: points with polygons, flat cells, lines and vertices.
//!
//! Source: the file formats chapter of the VTK user's guide. What is binary is big-endian.

use std::io::BufRead;

use super::embedded_sink::{EmbeddedSink, WireKind};
use super::feed::{Feed, Result};
use super::{ReadError, ReadFault, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::{NoteKind, SurfaceError};

/// Kinds of cells with one vertex or several, and lines of two or more.
const VERTEX: i64 = 1;
const POLY_VERTEX: i64 = 2;
const LINE: i64 = 3;
const POLY_LINE: i64 = 4;

/// A list of cells: the vertices of each.
type Cells = Vec<Vec<u32>>;
/// Bytes of a cell beside its vertices.
const CELL_BYTES: u64 = 56;

/// Note of a file with values at cells, which may be numbers of regions or materials.
pub(super) const CELL_VALUES: &str = "the values at cells were left out; they give no labels";

struct Vtk<R> {
    feed: Feed<R>,
    is_binary: bool,
    n_points: u64,
    has_cell_data: bool,
}

/// What points are read into.
trait Target {
    fn point(&mut self, p: Point) -> std::result::Result<(), SurfaceError>;
    fn check_bytes(&self, more: u64) -> std::result::Result<(), SurfaceError>;
}

impl Target for EmbeddedSink {
    fn point(&mut self, p: Point) -> std::result::Result<(), SurfaceError> {
        self.point(p)
    }

    fn check_bytes(&self, more: u64) -> std::result::Result<(), SurfaceError> {
        self.check_bytes(more)
    }
}

impl Target for SurfaceSink<'_> {
    fn point(&mut self, p: Point) -> std::result::Result<(), SurfaceError> {
        self.builder.vertex(p)
    }

    fn check_bytes(&self, more: u64) -> std::result::Result<(), SurfaceError> {
        self.builder.check_more(more)
    }
}

/// The role of a cell for a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// A face of that many corners, which come first; 0 for all vertices.
    Face(usize),
    /// A quadrilateral whose corners run along rows.
    Pixel,
    Strip,
    /// Points and lines.
    Thin,
    Solid,
}

/// The role of a type of cell of VTK; `None` for one that is not known.
pub(super) fn shape(kind: i64) -> Option<Shape> {
    Some(match kind {
        VERTEX..=POLY_LINE | 21 | 35 => Shape::Thin,
        6 => Shape::Strip,
        5 | 22 | 34 | 69 => Shape::Face(3),
        7 => Shape::Face(0),
        8 => Shape::Pixel,
        9 | 23 | 28 | 30 | 70 => Shape::Face(4),
        10..=14 | 24..=27 | 29 | 31..=33 | 37 | 41 | 42 | 71..=74 => Shape::Solid,
        _ => return None,
    })
}

/// Counts of cells that are not taken as they are.
#[derive(Default)]
pub(super) struct CellCounts {
    n_solids: u64,
    n_thin: u64,
    n_curved: u64,
}

impl CellCounts {
    /// Adds the triangles of a cell.
    pub fn add(
        &mut self,
        cell: &[u32],
        shape: Option<Shape>,
        label: u32,
        target: &mut SurfaceSink,
    ) -> std::result::Result<(), ReadFault> {
        let added = match (shape, cell) {
            (Some(Shape::Face(n)), _) if cell.len() >= n.max(3) => {
                self.n_curved += u64::from(n > 0 && cell.len() > n);
                let n = if n == 0 { cell.len() } else { n };
                target.builder.polygon(&cell[..n], label)
            }
            (Some(Shape::Pixel), &[a, b, c, d]) => target.builder.polygon(&[a, b, d, c], label),
            (Some(Shape::Strip), _) => cell.windows(3).enumerate().try_for_each(|(k, t)| {
                let corners = if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
                target.builder.triangle(corners, label)
            }),
            (Some(Shape::Thin), _) => {
                self.n_thin += 1;
                Ok(())
            }
            (Some(Shape::Solid), _) => {
                self.n_solids += 1;
                Ok(())
            }
            (None, _) => return Err(ReadFault::Unsupported("a cell of this type".to_owned())),
            _ => {
                let (expected, found) =
                    ("a face of its corners", format!("{} vertices", cell.len()));
                return Err(ReadFault::Unexpected { expected: expected.to_owned(), found });
            }
        };
        added.map_err(ReadFault::Surface)
    }

    /// Notes what was left out or taken as flat.
    pub fn note(&self, target: &mut SurfaceSink) {
        for (what, n) in [("solid elements", self.n_solids), ("lines and points", self.n_thin)] {
            if n > 0 {
                target.builder.note(NoteKind::SkippedElements { what, n });
            }
        }
        if self.n_curved > 0 {
            target.builder.note(NoteKind::CurvedFaces { n: self.n_curved });
        }
    }
}

/// Reads the lines or the vertices among the cells.
pub(super) fn read<R: BufRead>(
    feed: Feed<R>,
    kind: WireKind,
    sink: &mut EmbeddedSink,
) -> Result<()> {
    let mut vtk = Vtk { feed, is_binary: false, n_points: 0, has_cell_data: false };
    let label = sink.label("");
    for (cell, kind_of_cell) in vtk.read_cells(sink)? {
        vtk.feed.placed(match (kind, kind_of_cell) {
            (WireKind::Edges, LINE | POLY_LINE) => sink.line(&cell, label),
            (WireKind::Points, VERTEX | POLY_VERTEX) => {
                cell.iter().try_for_each(|&v| sink.mark(v, label))
            }
            _ => Ok(()),
        })?;
    }
    Ok(())
}

/// Reads polygons, strips and flat cells.
pub(super) fn read_surface<R: BufRead>(feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut vtk = Vtk { feed, is_binary: false, n_points: 0, has_cell_data: false };
    let cells = vtk.read_cells(target)?;
    let label = target.label("");
    let mut counts = CellCounts::default();
    for (n, (cell, kind)) in cells.into_iter().enumerate() {
        let added = counts.add(&cell, shape(kind), label, target);
        added
            .map_err(|fault| match fault {
                ReadFault::Unsupported(what) => {
                    ReadFault::Unsupported(format!("{what} ({kind}, cell {n})"))
                }
                fault => fault,
            })
            .map_err(|fault| vtk.feed.refuse(fault))?;
    }
    counts.note(target);
    if vtk.has_cell_data {
        target.builder.note(NoteKind::Said(CELL_VALUES.to_owned()));
    }
    vtk.feed.finish(target.builder)
}

impl<R: BufRead> Vtk<R> {
    /// Reads a file: points into `target`, and returns all cells with their types.
    fn read_cells(&mut self, target: &mut impl Target) -> Result<Vec<(Vec<u32>, i64)>> {
        let mut line = Vec::new();
        self.feed.read_line(&mut line)?;
        if !line.starts_with(b"# vtk DataFile Version") {
            return Err(self.feed.unexpected("`# vtk DataFile Version`", &line));
        }
        self.feed.skip_line()?;
        self.feed.need_word("ASCII or BINARY")?;
        self.is_binary = match self.feed.word() {
            b"ASCII" => false,
            b"BINARY" => true,
            word => return Err(self.feed.unexpected("ASCII or BINARY", word)),
        };
        self.feed.need_keyword("DATASET")?;
        self.feed.need_word("POLYDATA or UNSTRUCTURED_GRID")?;
        if ![&b"POLYDATA"[..], b"UNSTRUCTURED_GRID"].contains(&self.feed.word()) {
            return Err(self.feed.unexpected("POLYDATA or UNSTRUCTURED_GRID", self.feed.word()));
        }
        let (mut cells, mut mixed) = (Vec::new(), Cells::new());
        while self.feed.next_word()? {
            let of_kind = |list: Cells, kind: i64| list.into_iter().map(move |cell| (cell, kind));
            match self.feed.word() {
                b"POINTS" => self.points(target)?,
                b"LINES" => cells.extend(of_kind(self.cells(target)?, POLY_LINE)),
                b"VERTICES" => cells.extend(of_kind(self.cells(target)?, POLY_VERTEX)),
                b"POLYGONS" => cells.extend(of_kind(self.cells(target)?, 7)),
                b"TRIANGLE_STRIPS" => cells.extend(of_kind(self.cells(target)?, 6)),
                b"CELLS" => mixed = self.cells(target)?,
                b"METADATA" => self.skip_metadata()?,
                b"CELL_TYPES" => {
                    let n = self.feed.count("cell types", 1)?;
                    if n != mixed.len() as u64 {
                        let found = format!("{} cells", mixed.len());
                        return Err(self.feed.miscounted("cell types", n, found));
                    }
                    self.begin_data()?;
                    for cell in std::mem::take(&mut mixed) {
                        cells.push((cell, self.integer(b"int")?));
                    }
                }
                b"FIELD" => self.skip_field()?,
                // Values at points and cells follow.
                b"CELL_DATA" => self.has_cell_data = true,
                b"POINT_DATA" => {
                    self.has_cell_data = self.feed.skip_past(b"\nCELL_DATA ").is_ok();
                }
                word => {
                    return Err(self.feed.unexpected("POINTS, LINES, VERTICES or CELLS", word));
                }
            }
            if self.has_cell_data || self.feed.word() == b"POINT_DATA" {
                break;
            }
        }
        match mixed.is_empty() {
            true => Ok(cells),
            false => Err(self.feed.truncated("CELL_TYPES")),
        }
    }

    /// Skips arrays that belong to the whole file.
    fn skip_field(&mut self) -> Result<()> {
        self.feed.need_word("the name of a field")?;
        for _ in 0..self.feed.count("arrays", 4)? {
            self.feed.need_word("the name of an array")?;
            if self.feed.word() == b"METADATA" {
                self.skip_metadata()?;
                self.feed.need_word("the name of an array")?;
            }
            let (n, m) = (self.feed.count("components", 1)?, self.feed.count("values", 1)?);
            let n = self.feed.check_count("values", n.saturating_mul(m) as i64, 1)?;
            self.feed.need_word("a type of numbers")?;
            let bytes = match self.feed.word() {
                b"char" | b"unsigned_char" => 1,
                b"short" | b"unsigned_short" => 2,
                b"int" | b"unsigned_int" | b"float" => 4,
                b"long" | b"unsigned_long" | b"double" | b"vtktypeint64" | b"vtkIdType" => 8,
                _ => return Err(self.feed.unexpected("a type of numbers", self.feed.word())),
            };
            self.feed.skip_line()?;
            match self.is_binary {
                true => self.feed.skip_bytes(n * bytes)?,
                false => (0..n).try_for_each(|_| self.feed.need_word("a number"))?,
            }
        }
        Ok(())
    }

    /// Begins a list of numbers: binary ones begin after the end of the line.
    fn begin_data(&mut self) -> Result<()> {
        if self.is_binary {
            self.feed.skip_line()?;
        }
        Ok(())
    }

    fn real(&mut self, kind: &[u8]) -> Result<f64> {
        match (self.is_binary, kind) {
            (false, _) => self.feed.coordinate(),
            (true, b"float") => Ok(f64::from(f32::from_be_bytes(self.feed.bytes()?))),
            (true, _) => Ok(f64::from_be_bytes(self.feed.bytes()?)),
        }
    }

    fn integer(&mut self, kind: &[u8]) -> Result<i64> {
        match (self.is_binary, kind) {
            (false, _) => self.feed.integer("a whole number"),
            (true, b"vtktypeint64") => Ok(i64::from_be_bytes(self.feed.bytes()?)),
            (true, _) => Ok(i64::from(i32::from_be_bytes(self.feed.bytes()?))),
        }
    }

    fn points(&mut self, sink: &mut impl Target) -> Result<()> {
        self.n_points = self.feed.count("points", 6)?;
        self.feed.need_word("the type of coordinates")?;
        let kind = self.feed.word().to_vec();
        if ![&b"float"[..], b"double"].contains(&kind.as_slice()) {
            return Err(self.feed.unexpected("float or double", &kind));
        }
        self.begin_data()?;
        for _ in 0..self.n_points {
            let p = [self.real(&kind)?, self.real(&kind)?, self.real(&kind)?];
            let mut checked = [0.0; 3];
            for (x, found) in checked.iter_mut().zip(p) {
                *x = self.feed.checked(found)?;
            }
            self.feed.placed(sink.point(Point::from_array(checked)))?;
        }
        Ok(())
    }

    /// Cells: each with its number of vertices before them, or, since version 5.1, offsets and then all vertices.
    fn cells(&mut self, sink: &impl Target) -> Result<Cells> {
        let n = self.feed.integer("the number of cells")?;
        let size = self.feed.integer("how many numbers follow")?;
        let n = self.feed.check_count("cells", n, 1)?;
        let size = self.feed.check_count("numbers of cells", size, 1)?;
        let bytes = n.saturating_mul(CELL_BYTES).saturating_add(8 * size);
        self.feed.placed(sink.check_bytes(bytes))?;
        self.feed.skip_line()?;
        if self.feed.peek()? == Some(b'O') {
            return self.cells_of_offsets(n, size);
        }
        let mut cells = Cells::new();
        let mut left = size;
        for _ in 0..n {
            let length = self.integer(b"int")?;
            let length = u64::try_from(length).ok().filter(|&l| l < left);
            let length = length.ok_or_else(|| self.too_many(size))?;
            left -= 1 + length;
            let vertices = (0..length).map(|_| self.vertex(b"int"));
            cells.push(vertices.collect::<Result<_>>()?);
        }
        Ok(cells)
    }

    fn cells_of_offsets(&mut self, n: u64, size: u64) -> Result<Cells> {
        self.feed.need_keyword("OFFSETS")?;
        self.feed.need_word("the type of offsets")?;
        let kind = self.feed.word().to_vec();
        self.begin_data()?;
        let offsets = (0..n).map(|_| self.integer(&kind)).collect::<Result<Vec<_>>>()?;
        self.feed.need_keyword("CONNECTIVITY")?;
        self.feed.need_word("the type of vertex numbers")?;
        let kind = self.feed.word().to_vec();
        self.begin_data()?;
        let vertices = (0..size).map(|_| self.vertex(&kind)).collect::<Result<Vec<u32>>>()?;
        let cell = |ends: &[i64]| {
            let [from, to] = [ends[0], ends[1]].map(|k| usize::try_from(k).unwrap_or(usize::MAX));
            vertices.get(from..to).map(<[u32]>::to_vec)
        };
        let cells = offsets.windows(2).map(cell).collect::<Option<_>>();
        cells.ok_or_else(|| self.too_many(size))
    }

    fn vertex(&mut self, kind: &[u8]) -> Result<u32> {
        let v = self.integer(kind)?;
        self.feed.check_index(v, 0, self.n_points)
    }

    fn too_many(&self, size: u64) -> ReadError {
        self.feed.miscounted("numbers of cells", size, "the cells need others")
    }

    /// Up to the empty line that ends it.
    fn skip_metadata(&mut self) -> Result<()> {
        self.feed.skip_line()?;
        let mut line = Vec::new();
        while self.feed.read_line(&mut line)? && !line.trim_ascii().is_empty() {
            line.clear();
        }
        Ok(())
    }
}
