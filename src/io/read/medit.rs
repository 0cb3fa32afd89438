//! MEDIT meshes, `.mesh` and `.meshb`: triangles and quadrilaterals, references as labels.
//!
//! Solid elements are left out with a note; tetrahedra mark regions by their references. Triangles may come before their vertices.

use std::io::BufRead;

use super::feed::Feed;
use super::medit_numbers::{MeditNumbers, SectionRead};
use super::solids::Solids;
use super::{Result, SurfaceSink};
use tetdb_base::surface::NoteKind;

pub(super) fn read<R: BufRead>(
    feed: Feed<R>,
    is_binary: bool,
    target: &mut SurfaceSink,
) -> Result<()> {
    let mut numbers = MeditNumbers::open(feed, is_binary)?;
    numbers.text_version()?;
    let (mut n_vertices, mut solids, mut has_others) = (0, Solids::default(), false);
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
            "tetrahedra" if target.cells.are_wanted() => {
                read_cells::<4, _>(numbers, n_vertices, target)?;
            }
            "triangles" | "quadrilaterals" | "tetrahedra" => {
                // Vertices still to come are checked at the end of the file.
                let n = if n_vertices == 0 { u64::from(u32::MAX) } else { n_vertices };
                match keyword {
                    "triangles" => read_faces::<3, _>(numbers, "triangles", n, target)?,
                    "tetrahedra" => read_tets(numbers, n, &mut solids, target)?,
                    _ => read_faces::<4, _>(numbers, "quadrilaterals", n, target)?,
                }
            }
            "trianglesp2" | "trianglesp3" | "trianglesp4" | "quadrilateralsq2"
            | "quadrilateralsq3" | "quadrilateralsq4" => {
                return Err(numbers.feed.unsupported("curved triangles or quadrilaterals"));
            }
            "edges" | "edgesp2" | "edgesp3" | "edgesp4" => {
                note_skipped("edges", numbers.skipped_count()?, target);
                return Ok(SectionRead::Part);
            }
            _ => {
                if target.cells.are_wanted() && cells_of(numbers, keyword, n_vertices, target)? {
                    return Ok(SectionRead::Whole);
                }
                if let Some(what) = solid(keyword) {
                    let n = numbers.skipped_count()?;
                    target.leave_out_cells(n);
                    has_others |= n > 0;
                    note_skipped(what, n, target);
                }
                return Ok(SectionRead::Part);
            }
        }
        Ok(SectionRead::Whole)
    })?;
    target.leave_out_cells(solids.len());
    // What other solid elements fill is not known: then the file's regions do not count.
    match has_others {
        true => note_skipped("tetrahedra", solids.len(), target),
        false => solids.finish("tetrahedra", target),
    }
    target.end_cells(&numbers.feed)?;
    numbers.feed.finish(target.builder)
}

/// Name of the solid elements of a section that is skipped.
fn solid(keyword: &str) -> Option<&'static str> {
    Some(match keyword {
        "hexahedra" | "hexahedraq2" | "hexahedraq3" | "hexahedraq4" => "hexahedra",
        "prisms" | "prismsp2" | "prismsp3" | "prismsp4" => "prisms",
        "pyramids" | "pyramidsp2" | "pyramidsp3" | "pyramidsp4" => "pyramids",
        "tetrahedrap2" | "tetrahedrap3" | "tetrahedrap4" => "tetrahedra",
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
        _ if solid(keyword).is_some() => {
            return Err(numbers.feed.unsupported("the boundary of curved cells"));
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

/// Tetrahedra are left out; their references name regions.
fn read_tets<R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    n_vertices: u64,
    solids: &mut Solids,
    target: &SurfaceSink,
) -> Result<()> {
    let n = numbers.count("tetrahedra", 0, 5)?;
    for i in 0..n {
        numbers.feed.need_record("tetrahedra", n, i)?;
        let corners = numbers.corners::<4>(n_vertices)?;
        let name = match numbers.integer("a reference")? {
            0 => String::new(),
            reference => format!("ref_{reference}"),
        };
        numbers.feed.placed(solids.add(&corners, &name, target))?;
    }
    Ok(())
}
