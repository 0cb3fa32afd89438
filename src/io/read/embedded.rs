//! Files of edges and points to embed: OBJ (`l`, `p`), legacy VTK, TetGen `.poly` and `.node`, and text of one point a line.

use std::path::Path;

use super::embedded_sink::{EmbeddedSink, WireKind};
use super::error::{FilePlace, ReadFault};
use super::feed::{Feed, Result, name, parse};
use super::open::{Reader, open, stem, unpacked_name};
use super::{obj, tetgen, vtk};
use tetdb_base::geom::Point;
use tetdb_base::surface::EmbeddedSet;

/// Reads the edges or the points of a file; labels are its groups or markers, else the name of the file. `cap`: bytes of memory allowed.
///
/// # Errors
/// The first [`ReadError`](super::ReadError) with its place; a file without any is one.
pub fn read_wires(path: &Path, kind: WireKind, cap: u64) -> Result<EmbeddedSet> {
    let mut feed = open(path, cap / 4)?;
    let mut sink = EmbeddedSink::called(stem(path), cap / 4);
    let named = unpacked_name(path);
    let extension = named.extension().unwrap_or_default().to_string_lossy();
    match (extension.to_ascii_lowercase().as_str(), kind) {
        ("obj", _) => obj::read_embedded(feed, kind, &mut sink)?,
        ("vtk", _) => vtk::read(feed, kind, &mut sink)?,
        ("poly", WireKind::Edges) => {
            let nodes = named.with_extension("node");
            tetgen::read_segments(feed, &nodes, cap / 4, &mut sink)?;
        }
        ("node", WireKind::Points) => tetgen::read_nodes(&mut feed, &mut sink)?,
        ("csv" | "txt" | "xyz", WireKind::Points) => read_table(&mut feed, &mut sink)?,
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

/// Lines of three numbers, and a name behind them; between them commas, semicolons or blanks. A first line of words is a heading.
fn read_table(feed: &mut Feed<Reader>, sink: &mut EmbeddedSink) -> Result<()> {
    let mut line = Vec::new();
    let mut is_first = true;
    loop {
        let place = feed.place();
        line.clear();
        if !feed.read_line(&mut line)? {
            return Ok(());
        }
        let text = line.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }
        let is_break = |b: &u8| matches!(b, b',' | b';' | b'\t' | b' ');
        let has_commas = text.iter().any(|b| matches!(b, b',' | b';'));
        let parts = text.split(|b| if has_commas { matches!(b, b',' | b';') } else { is_break(b) });
        let words: Vec<&[u8]> =
            (parts.map(<[u8]>::trim_ascii)).filter(|w| has_commas || !w.is_empty()).collect();
        let is_heading = is_first && words.iter().all(|w| parse::<f64>(w).is_none());
        is_first = false;
        if is_heading {
            continue;
        }
        let mut p = [0.0; 3];
        for (k, x) in p.iter_mut().enumerate() {
            let word = words.get(k).copied().unwrap_or_default();
            *x = feed.coordinate_of(word, &place)?;
        }
        let label = match has_commas {
            true => words.get(3).map(|w| name(w)),
            false => Some(name(&words.get(3..).unwrap_or_default().join(&b' '))),
        };
        let label = sink.label(label.unwrap_or_default().trim_matches('"'));
        feed.placed(sink.mark(sink.set.points.len() as u32, label))?;
        feed.placed(sink.point(Point::from_array(p)))?;
    }
}
