//! Wavefront OBJ: `v` and `f` lines; groups, objects or materials as labels.
//!
//! A face names vertices from 1, or backwards from the last one as −1. Texture and normal numbers after slashes are skipped. A backslash
//! continues a line, `#` begins a comment; names of groups may have one.

use std::collections::HashMap;
use std::io::BufRead;

use super::embedded_sink::{EmbeddedSink, WireKind};
use super::feed::{Feed, not_a_number, parse, quote};
use super::{FilePlace, ReadError, ReadFault, Result, Spot, SurfaceSink};
use tetdb_base::geom::{Point, counted};
use tetdb_base::surface::NoteKind;

/// Names in force; the first of group, object and material that is not empty is the label of a face.
#[derive(Default)]
struct Names {
    group: String,
    object: String,
    material: String,
}

impl Names {
    /// Takes the name of a line that names the elements after it; returns whether the line is one.
    fn take(&mut self, word: &[u8], line: &[u8]) -> bool {
        let name = || super::feed::name(&line[word.len()..]);
        match word {
            b"g" => self.group = name(),
            b"o" => {
                self.object = name();
                self.group.clear();
            }
            b"usemtl" => self.material = name(),
            _ => return false,
        }
        true
    }

    fn best(&self) -> &str {
        let all = [&self.group, &self.object, &self.material];
        all.into_iter().find(|n| !n.is_empty()).map_or("", |n| n.as_str())
    }
}

/// Labels whose faces differ in a name that is none.
#[derive(Default)]
struct Merged {
    /// Label -> object and material of its first face.
    known: HashMap<String, (String, String)>,
    first: Option<String>,
}

impl Merged {
    fn check(&mut self, names: &Names) {
        let new = (names.object.clone(), names.material.clone());
        let known = self.known.entry(names.best().to_owned()).or_insert_with(|| new.clone());
        if *known != new {
            self.first.get_or_insert_with(|| names.best().to_owned());
        }
    }
}

/// Words of lines that neither add nor name faces, the empty one among them.
const IGNORED: [&[u8]; 16] = [
    b"",
    b"vn",
    b"vt",
    b"vp",
    b"s",
    b"mg",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
    b"end",
];

/// Labels that comments of tetdb declare.
#[derive(Default)]
struct Declared {
    labels: Vec<u32>,
    /// Names of labels for several.
    sets: HashMap<String, u32>,
}

impl Declared {
    /// Takes a comment that declares a label, or one for the labels of these positions.
    fn take(&mut self, line: &[u8], target: &mut SurfaceSink) {
        let text = super::feed::name(line);
        if let Some(text) = text.strip_prefix("# tetdb labels ") {
            let (numbers, name) = text.split_once(" = ").unwrap_or_default();
            let label = |n: &str| self.labels.get(n.parse::<usize>().ok()?).copied();
            let members: Vec<u32> = numbers.split(' ').filter_map(label).collect();
            if !members.is_empty() {
                let label = target.builder.label_of_all(&members);
                self.sets.insert(name.to_owned(), label);
                self.labels.push(label);
            }
        } else if let Some(name) = text.strip_prefix("# tetdb label ") {
            self.labels.push(target.label(name));
        }
    }
}

pub(super) fn read<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut names = Names::default();
    let (mut label, mut declared) = (None, Declared::default());
    let mut line = Vec::new();
    let mut corners = Vec::new();
    // Vertex numbers beyond those known when they were named, each larger than the one before.
    let mut ahead: Vec<(u32, FilePlace)> = Vec::new();
    let mut merged = Merged::default();
    let (mut n_lines_points, mut n_unknown, mut unknown) = (0, 0, None);
    loop {
        let place = feed.place();
        line.clear();
        if !read_logical_line(&mut feed, &mut line)? {
            break;
        }
        let mut words = words(&line);
        match words.next().unwrap_or_default() {
            b"v" => {
                let p = vertex(&feed, words, &place)?;
                feed.placed(target.builder.vertex(p))?;
            }
            b"f" | b"fo" => {
                corners.clear();
                let known = target.builder.n_file_vertices() as u32;
                for word in words {
                    let index = corner(word, known, &place)?;
                    if index >= known && ahead.last().is_none_or(|(last, _)| index > *last) {
                        ahead.push((index, place.clone()));
                    }
                    corners.push(index);
                }
                if corners.len() < 3 {
                    return Err(unexpected(&place, "a face of at least 3 corners", &line));
                }
                let label = *label.get_or_insert_with(|| {
                    merged.check(&names);
                    let known = declared.sets.get(names.best()).copied();
                    known.unwrap_or_else(|| target.label(names.best()))
                });
                let added = target.builder.polygon(&corners, label);
                added.map_err(|source| place.refuse(ReadFault::Surface(source)))?;
            }
            b"l" | b"p" => n_lines_points += 1,
            b"" if line.starts_with(b"# tetdb label") => declared.take(&line, target),
            word if names.take(word, &line) => label = None,
            b"curv" | b"curv2" | b"surf" => {
                let what = "a free-form curve or surface".to_owned();
                return Err(place.refuse(ReadFault::Unsupported(what)));
            }
            word if IGNORED.contains(&word) => {}
            word => {
                unknown.get_or_insert_with(|| (quote(word), place.spot));
                n_unknown += 1;
            }
        }
    }
    if let Some(name) = merged.first {
        let name = quote(name.as_bytes());
        let what =
            format!("faces of the label {name} differ in object or material, which were left out");
        target.builder.note(NoteKind::Said(what));
    }
    if let Some((word, Spot::Line(line))) = unknown {
        let left_out = "[line|lines] of no known kind [was|were] left out, the first one";
        let what = format!("{} {word} in line {line}", counted(n_unknown, left_out));
        target.builder.note(NoteKind::Said(what));
    }
    let known = target.builder.n_file_vertices() as u32;
    if let Some((index, place)) = ahead.into_iter().find(|(index, _)| *index >= known) {
        return Err(out_of_range(&place, i64::from(index) + 1, i64::from(known)));
    }
    if n_lines_points > 0 {
        target
            .builder
            .note(NoteKind::SkippedElements { what: "lines and points", n: n_lines_points });
    }
    feed.finish(target.builder)
}

/// The words of a line before a comment.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let text = line.split(|&b| b == b'#').next().unwrap_or_default();
    let all = text.split(u8::is_ascii_whitespace);
    all.filter(|w| !w.is_empty())
}

/// The three coordinates of a vertex.
fn vertex<'a, R: BufRead>(
    feed: &Feed<R>,
    mut words: impl Iterator<Item = &'a [u8]>,
    place: &FilePlace,
) -> Result<Point> {
    let mut p = [0.0; 3];
    for x in &mut p {
        let word = words.next().ok_or_else(|| unexpected(place, "three coordinates", b"fewer"))?;
        *x = feed.coordinate_of(word, place)?;
    }
    Ok(Point::from_array(p))
}

/// Reads `l` lines as edges, or `p` lines as points; a line of them may name vertices that come later.
pub(super) fn read_embedded<R: BufRead>(
    mut feed: Feed<R>,
    kind: WireKind,
    sink: &mut EmbeddedSink,
) -> Result<()> {
    let mut names = Names::default();
    let mut line = Vec::new();
    let mut ahead = Vec::new();
    loop {
        let place = feed.place();
        line.clear();
        if !read_logical_line(&mut feed, &mut line)? {
            break;
        }
        let mut words = words(&line);
        match (words.next().unwrap_or_default(), kind) {
            (b"v", _) => feed.placed(sink.point(vertex(&feed, words, &place)?))?,
            (b"l", WireKind::Edges) | (b"p", WireKind::Points) => {
                let known = sink.set.points.len() as u32;
                let corners = words.map(|word| corner(word, known, &place));
                let corners = corners.collect::<Result<Vec<u32>>>()?;
                let label = sink.label(names.best());
                ahead.extend(corners.iter().max().map(|&v| (v, place)));
                feed.placed(match kind {
                    WireKind::Edges => sink.line(&corners, label),
                    WireKind::Points => corners.iter().try_for_each(|&v| sink.mark(v, label)),
                })?;
            }
            (word, _) => {
                names.take(word, &line);
            }
        }
    }
    let n = sink.set.points.len();
    match ahead.into_iter().find(|(v, _)| *v as usize >= n) {
        None => Ok(()),
        Some((v, place)) => Err(out_of_range(&place, i64::from(v) + 1, n as i64)),
    }
}

/// A line with its continuations, leading white space removed.
fn read_logical_line<R: BufRead>(feed: &mut Feed<R>, line: &mut Vec<u8>) -> Result<bool> {
    let mut any = false;
    loop {
        any |= feed.read_line(line)?;
        if line.last() == Some(&b'\r') {
            line.pop();
        }
        if line.last() == Some(&b'\\') {
            line.pop();
            line.push(b' ');
            if feed.peek()?.is_some() {
                continue;
            }
        }
        let start = line.len() - line.trim_ascii_start().len();
        line.drain(..start);
        return Ok(any);
    }
}

/// The 0-based vertex of one corner, `known` being the number of vertices so far.
fn corner(word: &[u8], known: u32, place: &FilePlace) -> Result<u32> {
    let number = word.split(|&b| b == b'/').next().unwrap_or_default();
    let index: i64 = parse(number).ok_or_else(|| not_a_number(place, "a vertex number", word))?;
    let zero_based = if index > 0 { index - 1 } else { i64::from(known).saturating_add(index) };
    match u32::try_from(zero_based) {
        Ok(i) if index != 0 && i < u32::MAX => Ok(i),
        _ => Err(out_of_range(place, index, i64::from(known))),
    }
}

fn out_of_range(place: &FilePlace, index: i64, high: i64) -> ReadError {
    place.refuse(ReadFault::IndexOutOfRange { index, low: 1, high })
}

fn unexpected(place: &FilePlace, expected: &str, found: &[u8]) -> ReadError {
    place.refuse(ReadFault::Unexpected { expected: expected.to_owned(), found: quote(found) })
}
