//! Files of edges and points to embed: OBJ (`l`, `p`), legacy VTK, TetGen `.poly` and `.node`, and text of one point a line.

use std::path::Path;

use super::embedded_sink::{EmbeddedSink, WireKind};
use super::error::{FilePlace, ReadFault};
use super::feed::Result;
use super::open::{open, stem, unpacked_name};
use super::{PointColumns, PointRow, PointTable, Spot, obj, tetgen, vtk};
use tetdb_base::geom::Point;
use tetdb_base::surface::{EmbeddedSet, Seed};

/// Reads the edges or the points of a file; labels are its groups or markers, else the name of the file. `cap`: bytes of memory allowed.
///
/// # Errors
/// The first [`ReadError`](super::ReadError) with its place; a file without any is one.
pub fn read_wires(path: &Path, kind: WireKind, cap: u64) -> Result<EmbeddedSet> {
    let mut sink = EmbeddedSink::called(stem(path), cap / 4);
    let named = unpacked_name(path);
    let extension = named.extension().unwrap_or_default().to_string_lossy();
    match (extension.to_ascii_lowercase().as_str(), kind) {
        ("obj", _) => obj::read_embedded(open(path, cap / 4)?, kind, &mut sink)?,
        ("vtk", _) => vtk::read(open(path, cap / 4)?, kind, &mut sink)?,
        ("poly", WireKind::Edges) => {
            let nodes = named.with_extension("node");
            tetgen::read_segments(open(path, cap / 4)?, &nodes, cap / 4, &mut sink)?;
        }
        ("node", WireKind::Points) => tetgen::read_nodes(&mut open(path, cap / 4)?, &mut sink)?,
        ("csv" | "txt" | "xyz" | "tsv" | "dat", WireKind::Points) => {
            read_table(path, cap, &mut sink)?
        }
        _ => {
            let help =
                "edges are read from .obj, .vtk and .poly, points from .csv, .node, .obj and .vtk";
            return Err(FilePlace::new(path).refuse(ReadFault::UnknownFormat(help)));
        }
    }
    let set = sink.set;
    let (is_empty, expected) = match kind {
        WireKind::Edges => (set.edges.is_empty(), "edges"),
        WireKind::Points => (set.marks.is_empty(), "points"),
    };
    if !is_empty {
        return Ok(set);
    }
    let (expected, found) = (expected.to_owned(), "none".to_owned());
    Err(FilePlace::new(path).refuse(ReadFault::Unexpected { expected, found }))
}

/// Points from a table, each with its name.
fn read_table(path: &Path, cap: u64, sink: &mut EmbeddedSink) -> Result<()> {
    for row in PointTable::open(path, PointColumns::Named, cap / 4)? {
        let PointRow { numbers: [x, y, z, _], name, place } = row?;
        let label = sink.label(&name);
        let v = sink.set.points.len() as u32;
        sink.set.mark_lines.push(match place.spot {
            Spot::Line(line) => u32::try_from(line).unwrap_or_default(),
            _ => 0,
        });
        let added = sink.mark(v, label).and_then(|()| sink.point(Point::new(x, y, z)));
        added.map_err(|source| place.refuse(ReadFault::Surface(source)))?;
    }
    Ok(())
}

/// Reads a file of seeds: points with the name of their region, without one, or with the name `hole`. `limit`: bytes of memory for pipes.
///
/// # Errors
/// As [`PointTable::open`].
pub fn read_seeds(path: &Path, limit: u64) -> Result<Vec<Seed>> {
    let rows = PointTable::open(path, PointColumns::Named, limit)?;
    let seed = |row: PointRow| {
        let [x, y, z, _] = row.numbers;
        Seed::named(Point::new(x, y, z), &row.name)
    };
    rows.map(|row| row.map(seed)).collect()
}
