//! Faces and nodes of files of finite elements: Nastran `.nas` and `.bdf`. Abaqus is in `abaqus`, I-DEAS in `unv`.
//!
//! Each reads shells, membranes and flat elements as faces; curved ones by their corners. Solid elements name regions, beams are left
//! out with a note. What would move nodes, such as other coordinate systems, is refused.

use std::collections::HashMap;
use std::io::BufRead;

use super::element_sets::ElementSets;
use super::feed::{Feed, Result, parse, quote};
use super::gmsh_numbers::NodeTags;
use super::solids::Solids;
use super::{FilePlace, ReadError, ReadFault, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

/// A line of a file and its place.
pub(super) type DeckLine = (String, FilePlace);

/// A file being read.
pub(super) struct Elements<'a, 'b> {
    pub(super) target: &'a mut SurfaceSink<'b>,
    pub(super) nodes: NodeTags,
    /// Solid elements to come: nodes, name, place.
    pub(super) late_solids: Vec<(Vec<i64>, String, FilePlace)>,
    /// Vertices of the file before the nodes of this part.
    pub(super) first: u32,
    pub(super) solids: Solids,
    pub(super) n_thin: u64,
    pub(super) n_curved: u64,
    /// Faces to come, for files with elements before nodes or groups.
    pub(super) faces: Vec<Face>,
    /// Those of them whose corners are vertices of the file, no longer numbers of nodes.
    n_with_vertices: usize,
    /// Parts before this one.
    pub(super) part: u32,
    pub(super) sets: ElementSets,
}

/// A face and the place that names it.
pub(super) struct Face {
    part: u32,
    id: i64,
    corners: Vec<i64>,
    /// The set it is in anyway.
    set: Option<u32>,
    place: FilePlace,
}

pub(super) fn unexpected(place: &FilePlace, expected: &str, found: impl AsRef<[u8]>) -> ReadError {
    let (expected, found) = (expected.to_owned(), quote(found.as_ref()));
    place.refuse(ReadFault::Unexpected { expected, found })
}

pub(super) fn unsupported(place: &FilePlace, what: impl Into<String>) -> ReadError {
    place.refuse(ReadFault::Unsupported(what.into()))
}

impl<'a, 'b> Elements<'a, 'b> {
    pub(super) fn new(target: &'a mut SurfaceSink<'b>) -> Self {
        Self {
            target,
            nodes: NodeTags::default(),
            late_solids: Vec::new(),
            first: 0,
            solids: Solids::default(),
            n_thin: 0,
            n_curved: 0,
            faces: Vec::new(),
            n_with_vertices: 0,
            part: 0,
            sets: ElementSets::default(),
        }
    }

    pub(super) fn node(&mut self, tag: i64, xyz: [f64; 3], place: &FilePlace) -> Result<()> {
        if !self.nodes.push(tag) {
            return Err(unexpected(place, "nodes of different numbers", tag.to_string()));
        }
        let p = Point::from_array(xyz);
        super::feed::check_point(p, place)?;
        let added = self.target.builder.vertex(p);
        added.map_err(|source| place.refuse(ReadFault::Surface(source)))
    }

    pub(super) fn corners(&self, tags: &[i64], place: &FilePlace) -> Result<Vec<u32>> {
        let find = |&tag: &i64| {
            let known = self.nodes.get(tag).map(|v| v + self.first);
            known.ok_or_else(|| unexpected(place, "the number of a node", tag.to_string()))
        };
        tags.iter().map(find).collect()
    }

    /// Keeps a face until all nodes and sets are known. `set` is empty or the name of a set that has it.
    pub(super) fn face(
        &mut self,
        id: i64,
        tags: &[i64],
        n_nodes: usize,
        set: &str,
        place: &FilePlace,
    ) {
        self.n_curved += u64::from(n_nodes > tags.len());
        let part = self.part;
        let set = (!set.is_empty()).then(|| self.sets.exact(part, set));
        self.faces.push(Face { part, id, corners: tags.to_vec(), set, place: place.clone() });
    }

    /// Finds the vertices of the faces kept so far, and adds the solid elements.
    pub(super) fn end_part(&mut self) -> Result<()> {
        let mut faces = std::mem::take(&mut self.faces);
        for face in &mut faces[self.n_with_vertices..] {
            let vertices = self.corners(&face.corners, &face.place)?;
            face.corners = vertices.into_iter().map(i64::from).collect();
        }
        (self.n_with_vertices, self.faces) = (faces.len(), faces);
        for (tags, name, place) in std::mem::take(&mut self.late_solids) {
            self.solid(&tags, &name, &place)?;
        }
        Ok(())
    }

    /// Adds the faces kept so far with the labels of their sets. Returns the number of sets with other elements than faces.
    pub(super) fn take_faces(&mut self) -> Result<u64> {
        self.end_part()?;
        let faces = std::mem::take(&mut self.faces);
        let elements: Vec<(u32, i64)> = faces.iter().map(|face| (face.part, face.id)).collect();
        let (of, n_with_others) = self.sets.by_element(&elements);
        let mut labels: HashMap<Vec<u32>, u32> = HashMap::new();
        for face in faces {
            let others = of.get(&(face.part, face.id)).into_iter().flatten();
            let mut sets: Vec<u32> = face.set.into_iter().chain(others.copied()).collect();
            self.sets.with_parents(&mut sets);
            let label = match labels.get(&sets) {
                Some(&label) => label,
                None => {
                    let names: Vec<&str> = sets.iter().map(|&set| self.sets.name(set)).collect();
                    let label = self.target.label_of_all(&names);
                    labels.insert(sets, label);
                    label
                }
            };
            let corners: Vec<u32> = face.corners.iter().map(|&v| v as u32).collect();
            let added = self.target.builder.polygon(&corners, label);
            added.map_err(|source| face.place.refuse(ReadFault::Surface(source)))?;
        }
        Ok(n_with_others)
    }

    pub(super) fn solid(&mut self, tags: &[i64], name: &str, place: &FilePlace) -> Result<()> {
        let corners = self.corners(tags, place)?;
        let added = self.solids.add(&corners, name, self.target);
        added.map_err(|source| place.refuse(ReadFault::Surface(source)))
    }

    pub(super) fn finish<R: BufRead>(self, feed: &Feed<R>) -> Result<()> {
        if self.n_thin > 0 {
            let what = "beams and points";
            self.target.builder.note(NoteKind::SkippedElements { what, n: self.n_thin });
        }
        if self.n_curved > 0 {
            self.target.builder.note(NoteKind::CurvedFaces { n: self.n_curved });
        }
        self.solids.finish("solid elements", self.target);
        feed.finish(self.target.builder)
    }
}

/// A real number, also with `d` for the exponent or, in Nastran, with nothing between.
pub(super) fn real(text: &str, place: &FilePlace) -> Result<f64> {
    let text = text.trim().to_ascii_lowercase().replace('d', "e");
    let signed = text.rfind(['+', '-']).filter(|&k| k > 0 && !text[..k].ends_with('e'));
    let number = match signed {
        Some(k) if !text.contains('e') => format!("{}e{}", &text[..k], &text[k..]).parse(),
        _ => text.parse(),
    };
    let number = number.ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| super::feed::not_a_number(place, "a coordinate", text.as_bytes()))
}

pub(super) fn integer(text: &str, place: &FilePlace) -> Result<i64> {
    let number = parse(text.trim().as_bytes());
    number.ok_or_else(|| unexpected(place, "a whole number", text))
}

/// The next line that is no comment, and its place.
pub(super) fn line<R: BufRead>(
    feed: &mut Feed<R>,
    comment: &str,
) -> Result<Option<(String, FilePlace)>> {
    let mut bytes = Vec::new();
    loop {
        let place = feed.place();
        bytes.clear();
        if !feed.read_line(&mut bytes)? {
            return Ok(None);
        }
        let text = super::feed::text(&bytes).trim_end().to_owned();
        if !text.trim().is_empty() && !text.trim_start().starts_with(comment) {
            return Ok(Some((text, place)));
        }
    }
}

/// The fields of a bulk data card: between commas, or 8 or 16 characters wide.
fn fields(text: &str) -> Vec<String> {
    if text.contains(',') {
        return text.split(',').take(9).map(|f| f.trim().to_owned()).collect();
    }
    // A tab ends a field: it leads to the next column that is a multiple of 8.
    let mut bytes = Vec::new();
    for b in text.bytes() {
        match b {
            b'\t' => bytes.resize((bytes.len() + 1).next_multiple_of(8), b' '),
            _ => bytes.push(b),
        }
    }
    let cut = |from: usize, to: usize| {
        let part = bytes.get(from.min(bytes.len())..to.min(bytes.len())).unwrap_or_default();
        String::from_utf8_lossy(part).trim().to_owned()
    };
    let first = cut(0, 8);
    let width = if first.ends_with('*') || first.starts_with('*') { 16 } else { 8 };
    let rest = (0..64 / width).map(|k| cut(8 + k * width, 8 + (k + 1) * width));
    std::iter::once(first).chain(rest).collect()
}

/// The next line of Nastran. Errors: a tab behind a field that is full, which some programs pass over and others do not.
fn nastran_line<R: BufRead>(feed: &mut Feed<R>) -> Result<Option<DeckLine>> {
    let next = line(feed, "$")?;
    if let Some((text, place)) = next.as_ref().filter(|(text, _)| !text.contains(',')) {
        let mut column = 0usize;
        let mut before = b'\t';
        for b in text.bytes() {
            if b == b'\t' && before != b'\t' && column.is_multiple_of(8) {
                return Err(unsupported(place, "a tab behind a field of 8 characters"));
            }
            column = if b == b'\t' { (column + 1).next_multiple_of(8) } else { column + 1 };
            before = b;
        }
    }
    Ok(next)
}

/// Returns whether a line continues a card: its first field is empty or a mark.
fn continues(text: &str) -> bool {
    let first = fields(text).swap_remove(0);
    first.is_empty() || first.starts_with(['+', '*'])
}

/// Reads bulk data of Nastran: `GRID` and shells, in every field format; the property of an element is its label.
pub(super) fn read_nastran<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut mesh = Elements::new(target);
    let mut n_sets = 0;
    let mut next = nastran_line(&mut feed)?;
    while let Some((text, place)) = next {
        next = nastran_line(&mut feed)?;
        let mut card = fields(&text);
        let kind = card[0].trim_end_matches('*').to_ascii_uppercase();
        n_sets += u64::from(kind.starts_with("SET ") && text.contains('='));
        if kind == "ENDDATA" {
            break;
        }
        if kind == "INCLUDE" || text.trim_start().to_ascii_uppercase().starts_with("INCLUDE ") {
            return Err(unsupported(&place, "INCLUDE"));
        }
        while let Some((more, _)) = &next
            && continues(more)
        {
            // A line has 8 fields of 8 characters, or 4 of 16.
            let n_fields = if card[0].ends_with('*') { 4 } else { 8 };
            card.resize((card.len() - 1).next_multiple_of(n_fields) + 1, String::new());
            card.extend(fields(more).into_iter().skip(1));
            next = nastran_line(&mut feed)?;
        }
        card[0] = kind;
        let field = |k: usize| card.get(k).map_or("", String::as_str);
        let n_corners = match card[0].as_str() {
            "GRID" => {
                if !["", "0"].contains(&field(2)) {
                    return Err(unsupported(&place, "a GRID in a coordinate system of its own"));
                }
                let x =
                    |k: usize| if field(k).is_empty() { Ok(0.0) } else { real(field(k), &place) };
                mesh.node(integer(field(1), &place)?, [x(3)?, x(4)?, x(5)?], &place)?;
                0
            }
            "GRDSET" if !["", "0"].contains(&field(2)) => {
                return Err(unsupported(&place, "nodes in a coordinate system of their own"));
            }
            "CTRIA3" | "CTRIAR" | "CTRIA6" => 3,
            "CQUAD4" | "CQUADR" | "CQUAD8" | "CSHEAR" => 4,
            kind if kind.starts_with("CTRI") || kind.starts_with("CQUAD") => {
                return Err(unsupported(&place, format!("the element {kind}")));
            }
            "SET1" | "SET3" => {
                n_sets += 1;
                0
            }
            "CTETRA" => -4,
            "CPENTA" => -6,
            "CPYRAM" => -5,
            "CHEXA" => -8,
            "CBAR" | "CBEAM" | "CBEND" | "CROD" | "CONROD" | "CTUBE" | "CBUSH" | "CBUSH1D"
            | "CELAS1" | "CELAS2" | "CGAP" | "CMASS1" | "CMASS2" | "CONM1" | "CONM2" | "CDAMP1"
            | "CDAMP2" | "CVISC" | "CWELD" | "CFAST" | "PLOTEL" => {
                mesh.n_thin += 1;
                0
            }
            _ => 0i32,
        };
        let tags = (0..n_corners.unsigned_abs() as usize).map(|k| integer(field(3 + k), &place));
        let tags = tags.collect::<Result<Vec<i64>>>()?;
        let property = field(2).to_owned();
        if n_corners > 0 {
            let id = integer(field(1), &place)?;
            let n_nodes =
                if ["CTRIA6", "CQUAD8"].contains(&card[0].as_str()) { 8 } else { tags.len() };
            mesh.face(id, &tags, n_nodes, &property, &place);
        } else if n_corners < 0 {
            mesh.late_solids.push((tags, format!("property_{property}"), place));
        }
    }
    mesh.take_faces()?;
    if n_sets > 0 {
        let what = "sets (SET, SET1, SET3), which have no names";
        mesh.target.builder.note(NoteKind::SkippedElements { what, n: n_sets });
    }
    mesh.finish(&feed)
}
