//! MEDIT meshes, `.mesh` and `.meshb`: triangles and quadrilaterals, references as labels.
//!
//! Solid elements are left out with a note. One tetrahedron of each reference but 0 marks a region.

use std::collections::BTreeMap;
use std::io::BufRead;

use super::feed::Feed;
use super::medit_numbers::{MeditNumbers, SectionRead};
use super::{Result, SurfaceSink};
use tetdb_base::surface::NoteKind;

pub(super) fn read<R: BufRead>(
    feed: Feed<R>,
    is_binary: bool,
    target: &mut SurfaceSink,
) -> Result<()> {
    let mut numbers = MeditNumbers::open(feed, is_binary)?;
    numbers.text_version()?;
    let mut n_vertices = 0;
    numbers.sections(SectionRead::Whole, |numbers, keyword| {
        match keyword {
            "dimension" => {
                let dimension = numbers.small_integer("the dimension")?;
                if dimension != 3 {
                    let what = format!("a mesh of dimension {dimension}");
                    return Err(numbers.feed.unsupported(what));
                }
            }
            "vertices" => n_vertices += read_vertices(numbers, target)?,
            "triangles" => read_faces::<3, _>(numbers, "triangles", n_vertices, target)?,
            "quadrilaterals" => read_faces::<4, _>(numbers, "quadrilaterals", n_vertices, target)?,
            "tetrahedra" if target.cells.are_wanted() => {
                read_cells::<4, _>(numbers, n_vertices, target)?;
            }
            "tetrahedra" => read_tets(numbers, n_vertices, target)?,
            "trianglesp2" | "quadrilateralsq2" => {
                return Err(numbers.feed.unsupported("curved triangles"));
            }
            _ => {
                if target.cells.are_wanted() && cells_of(numbers, keyword, n_vertices, target)? {
                    return Ok(SectionRead::Whole);
                }
                if let Some(what) = solid(keyword) {
                    let n = numbers.skipped_count()?;
                    target.leave_out_cells(n);
                    note_skipped(what, n, target);
                }
                return Ok(SectionRead::Part);
            }
        }
        Ok(SectionRead::Whole)
    })?;
    target.end_cells(&numbers.feed)?;
    numbers.feed.finish(target.builder)
}

/// Name of the solid elements of a section that is skipped.
fn solid(keyword: &str) -> Option<&'static str> {
    Some(match keyword {
        "hexahedra" => "hexahedra",
        "prisms" => "prisms",
        "pyramids" => "pyramids",
        "tetrahedrap2" => "tetrahedra",
        _ => return None,
    })
}

fn note_skipped(what: &'static str, n: u64, target: &mut SurfaceSink) {
    if n > 0 {
        target.builder.note(NoteKind::SkippedElements { what, n });
    }
}

fn read_vertices<R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    target: &mut SurfaceSink,
) -> Result<u64> {
    let n = numbers.count("vertices", 3, 1)?;
    for i in 0..n {
        numbers.feed.need_record("vertices", n, i)?;
        let p = numbers.point()?;
        numbers.integer("a vertex reference")?;
        numbers.feed.placed(target.builder.vertex(p))?;
    }
    Ok(n)
}

fn read_faces<const N: usize, R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    what: &'static str,
    n_vertices: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let n = numbers.count(what, 0, N as u64 + 1)?;
    // The last reference and its label: neighbors in a file mostly agree.
    let mut last = None;
    for i in 0..n {
        numbers.feed.need_record(what, n, i)?;
        let corners = numbers.corners::<N>(n_vertices)?;
        let reference = numbers.integer("a reference")?;
        if target.leaves_out_face() {
            continue;
        }
        let label = match last {
            Some((known, label)) if known == reference => label,
            _ => target.label(&reference.to_string()),
        };
        last = Some((reference, label));
        numbers.feed.placed(target.builder.polygon(&corners, label))?;
    }
    Ok(())
}

/// Reads solid elements other than tetrahedra; `false` for what are none.
fn cells_of<R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    keyword: &str,
    n_vertices: u64,
    target: &mut SurfaceSink,
) -> Result<bool> {
    match keyword {
        "hexahedra" => read_cells::<8, _>(numbers, n_vertices, target)?,
        "prisms" => read_cells::<6, _>(numbers, n_vertices, target)?,
        "pyramids" => read_cells::<5, _>(numbers, n_vertices, target)?,
        "tetrahedrap2" => {
            return Err(numbers.feed.unsupported("the boundary of curved tetrahedra"));
        }
        _ => return Ok(false),
    }
    Ok(true)
}

/// Reads cells whose boundary is the surface.
fn read_cells<const N: usize, R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    n_vertices: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let n = numbers.count("cells", 0, N as u64 + 1)?;
    for i in 0..n {
        numbers.feed.need_record("cells", n, i)?;
        let corners = numbers.corners::<N>(n_vertices)?;
        let name = match numbers.integer("a reference")? {
            0 => String::new(),
            reference => format!("ref_{reference}"),
        };
        target.cell(&numbers.feed, (&corners, N), &name)?;
    }
    Ok(())
}

/// Tetrahedra are left out, but for one of each reference: it marks a region.
fn read_tets<R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    n_vertices: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let n = numbers.count("tetrahedra", 0, 5)?;
    let mut first = BTreeMap::new();
    for i in 0..n {
        numbers.feed.need_record("tetrahedra", n, i)?;
        let corners = numbers.corners(n_vertices)?;
        let reference = numbers.integer("a reference")?;
        if reference != 0 {
            first.entry(format!("ref_{reference}")).or_insert_with(|| vec![corners]);
        }
    }
    target.leave_out_cells(n);
    note_skipped("tetrahedra", n, target);
    if n > 0 {
        target.regions_of_mesh(&first);
    }
    Ok(())
}
