//! Legacy VTK files, text or binary, of versions 2 to 5.1: points with line and vertex cells.
//!
//! Source: the file formats chapter of the VTK user's guide. What is binary is big-endian.

use std::io::BufRead;

use super::ReadError;
use super::embedded_sink::{EmbeddedSink, WireKind};
use super::feed::{Feed, Result};
use tetdb_base::geom::Point;

/// Kinds of cells with one vertex or several, and lines of two or more.
const VERTEX: i64 = 1;
const POLY_VERTEX: i64 = 2;
const LINE: i64 = 3;
const POLY_LINE: i64 = 4;

/// A list of cells: the vertices of each.
type Cells = Vec<Vec<u32>>;
/// Bytes of a cell beside its vertices.
const CELL_BYTES: u64 = 56;

struct Vtk<R> {
    feed: Feed<R>,
    is_binary: bool,
    n_points: u64,
}

/// Reads the lines or the vertices among the cells.
pub(super) fn read<R: BufRead>(
    feed: Feed<R>,
    kind: WireKind,
    sink: &mut EmbeddedSink,
) -> Result<()> {
    let mut vtk = Vtk { feed, is_binary: false, n_points: 0 };
    let mut line = Vec::new();
    vtk.feed.read_line(&mut line)?;
    if !line.starts_with(b"# vtk DataFile Version") {
        return Err(vtk.feed.unexpected("`# vtk DataFile Version`", &line));
    }
    vtk.feed.skip_line()?;
    vtk.feed.need_word("ASCII or BINARY")?;
    vtk.is_binary = match vtk.feed.word() {
        b"ASCII" => false,
        b"BINARY" => true,
        word => return Err(vtk.feed.unexpected("ASCII or BINARY", word)),
    };
    vtk.feed.need_keyword("DATASET")?;
    vtk.feed.need_word("POLYDATA or UNSTRUCTURED_GRID")?;
    if ![&b"POLYDATA"[..], b"UNSTRUCTURED_GRID"].contains(&vtk.feed.word()) {
        return Err(vtk.feed.unexpected("POLYDATA or UNSTRUCTURED_GRID", vtk.feed.word()));
    }
    let (mut lines, mut vertices, mut mixed) = (Cells::new(), Cells::new(), Cells::new());
    while vtk.feed.next_word()? {
        match vtk.feed.word() {
            b"POINTS" => vtk.points(sink)?,
            b"LINES" => lines = vtk.cells(sink)?,
            b"VERTICES" => vertices = vtk.cells(sink)?,
            b"CELLS" => mixed = vtk.cells(sink)?,
            b"POLYGONS" | b"TRIANGLE_STRIPS" => drop(vtk.cells(sink)?),
            b"METADATA" => vtk.skip_metadata()?,
            b"CELL_TYPES" => {
                let n = vtk.feed.count("cell types", 1)?;
                vtk.begin_data()?;
                for k in 0..n as usize {
                    let cell = mixed.get(k).cloned().unwrap_or_default();
                    match vtk.integer(b"int")? {
                        LINE | POLY_LINE => lines.push(cell),
                        VERTEX | POLY_VERTEX => vertices.push(cell),
                        _ => {}
                    }
                }
            }
            // Values at points and cells follow.
            b"POINT_DATA" | b"CELL_DATA" | b"FIELD" => break,
            word => {
                return Err(vtk.feed.unexpected("POINTS, LINES, VERTICES or CELLS", word));
            }
        }
    }
    let label = sink.label("");
    vtk.feed.placed(match kind {
        WireKind::Edges => lines.iter().try_for_each(|line| sink.line(line, label)),
        WireKind::Points => (vertices.iter().flatten()).try_for_each(|&v| sink.mark(v, label)),
    })
}

impl<R: BufRead> Vtk<R> {
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

    fn points(&mut self, sink: &mut EmbeddedSink) -> Result<()> {
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
    fn cells(&mut self, sink: &EmbeddedSink) -> Result<Cells> {
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
