//! MEDIT `.mesh` text: keywords, each with a count and that many records of numbers.

use std::collections::BTreeMap;
use std::io::BufRead;

use super::feed::Feed;
use super::{ReadError, Result, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

/// Solid elements, left out with a note.
const SOLIDS: [&str; 4] = ["Hexahedra", "Prisms", "Pyramids", "TetrahedraP2"];

pub(super) fn read<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    feed.comment = Some(b'#');
    feed.need_keyword("MeshVersionFormatted")?;
    feed.integer("the version")?;
    let mut n_vertices = 0;
    let mut more = feed.next_word()?;
    while more {
        let keyword = String::from_utf8_lossy(feed.word()).into_owned();
        match keyword.to_ascii_lowercase().as_str() {
            "end" => break,
            "dimension" => {
                let dimension = feed.integer("the dimension")?;
                if dimension != 3 {
                    return Err(feed.unsupported(format!("a mesh of dimension {dimension}")));
                }
                more = feed.next_word()?;
            }
            "vertices" => {
                n_vertices += read_vertices(&mut feed, target)?;
                more = feed.next_word()?;
            }
            "triangles" => {
                read_faces(&mut feed, "triangles", 3, n_vertices, target)?;
                more = feed.next_word()?;
            }
            "quadrilaterals" => {
                read_faces(&mut feed, "quadrilaterals", 4, n_vertices, target)?;
                more = feed.next_word()?;
            }
            "tetrahedra" => {
                read_tets(&mut feed, n_vertices, target)?;
                more = feed.next_word()?;
            }
            "trianglesp2" | "quadrilateralsq2" => return Err(feed.unsupported("curved triangles")),
            _ if feed.word().first().is_some_and(u8::is_ascii_alphabetic) => {
                more = skip_section(&mut feed, &keyword, target)?;
            }
            _ => return Err(feed.unexpected("a MEDIT keyword", feed.word())),
        }
    }
    feed.finish(target.builder)
}

fn read_vertices<R: BufRead>(feed: &mut Feed<R>, target: &mut SurfaceSink) -> Result<u64> {
    let n = feed.count("vertices", 8)?;
    for i in 0..n {
        if feed.at_end()? {
            return Err(feed.too_few("vertices", n, i));
        }
        let p: Point = feed.point()?;
        feed.integer("a vertex reference")?;
        feed.placed(target.builder.vertex(p))?;
    }
    Ok(n)
}

fn read_faces<R: BufRead>(
    feed: &mut Feed<R>,
    what: &'static str,
    n_corners: usize,
    n_vertices: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let n = feed.count(what, 2 * (n_corners as u64 + 1))?;
    let mut labels = RefLabels::default();
    for i in 0..n {
        if feed.at_end()? {
            return Err(feed.too_few(what, n, i));
        }
        let mut corners = [0; 4];
        for corner in &mut corners[..n_corners] {
            *corner = feed.index(1, n_vertices)?;
        }
        let label = labels.of(feed.integer("a reference")?, target);
        feed.placed(target.builder.polygon(&corners[..n_corners], label))?;
    }
    Ok(())
}

/// Tetrahedra are left out, but for one of each reference: it marks a region.
fn read_tets<R: BufRead>(
    feed: &mut Feed<R>,
    n_vertices: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let n = feed.count("tetrahedra", 10)?;
    let mut first = BTreeMap::new();
    for i in 0..n {
        if feed.at_end()? {
            return Err(feed.too_few("tetrahedra", n, i));
        }
        let mut corners = [0; 4];
        for corner in &mut corners {
            *corner = feed.index(1, n_vertices)?;
        }
        note_reference(&mut first, feed.integer("a reference")?, corners);
    }
    note_tets(n, &first, target);
    Ok(())
}

/// Keeps the first tetrahedron of each reference but 0, which means none.
pub(super) fn note_reference(
    first: &mut BTreeMap<String, Vec<[u32; 4]>>,
    reference: i64,
    corners: [u32; 4],
) {
    if reference != 0 {
        let known = first.entry(format!("ref_{reference}"));
        known.or_insert_with(|| vec![corners]);
    }
}

/// Says that tetrahedra were left out, and what regions they mark.
pub(super) fn note_tets(n: u64, first: &BTreeMap<String, Vec<[u32; 4]>>, target: &mut SurfaceSink) {
    if n > 0 {
        let what = "tetrahedra";
        target.builder.note(NoteKind::SkippedElements { what, n });
        target.regions_of_mesh(first);
    }
}

/// Label ids of integer references; remembers the last, because neighbors in a file mostly agree.
#[derive(Default)]
pub(super) struct RefLabels {
    last: Option<(i64, u32)>,
}

impl RefLabels {
    pub fn of(&mut self, reference: i64, target: &mut SurfaceSink) -> u32 {
        match self.last {
            Some((known, label)) if known == reference => label,
            _ => {
                let label = target.label(&reference.to_string());
                self.last = Some((reference, label));
                label
            }
        }
    }
}

/// Passes over a section that is not needed; true when another keyword is now the last word.
fn skip_section<R: BufRead>(
    feed: &mut Feed<R>,
    keyword: &str,
    target: &mut SurfaceSink,
) -> Result<bool> {
    let solid = SOLIDS.iter().find(|s| s.eq_ignore_ascii_case(keyword));
    let mut first = true;
    while feed.next_word()? {
        if feed.word().first().is_some_and(u8::is_ascii_alphabetic) {
            return Ok(true);
        }
        if let (true, Some(what)) = (first, solid) {
            let n: u64 = feed.parse("the number of elements")?;
            if n > 0 {
                target.builder.note(NoteKind::SkippedElements { what: lower(what), n });
            }
        }
        first = false;
    }
    if solid.is_some() && first {
        return Err(ReadError::Truncated {
            place: feed.place(),
            expected: "the number of elements".to_owned(),
            found: "the end of the file".to_owned(),
        });
    }
    Ok(false)
}

fn lower(what: &str) -> &'static str {
    match what {
        "Hexahedra" => "hexahedra",
        "Prisms" => "prisms",
        "Pyramids" => "pyramids",
        _ => "tetrahedra",
    }
}
