//! Meshes in MEDIT files, `.mesh` and `.meshb`.

use std::io::BufRead;

use super::{Feed, RawMesh, Result};
use crate::read::medit_numbers::{MeditNumbers, SectionRead};

pub fn read<R: BufRead>(feed: Feed<R>, is_binary: bool, mesh: &mut RawMesh) -> Result<()> {
    let mut numbers = MeditNumbers::open(feed, is_binary)?;
    numbers.text_version()?;
    numbers.sections(SectionRead::Whole, |numbers, keyword| {
        match keyword {
            "dimension" => {
                let dimension = numbers.small_integer("the dimension")?;
                if dimension != 3 {
                    let what = format!("a mesh of dimension {dimension}");
                    return Err(numbers.feed.unsupported(what));
                }
            }
            "vertices" => vertices(numbers, mesh)?,
            "tetrahedra" => tets::<4, _>(numbers, mesh)?,
            "tetrahedrap2" => tets::<10, _>(numbers, mesh)?,
            "tetrahedrap3" => tets::<20, _>(numbers, mesh)?,
            "tetrahedrap4" => tets::<35, _>(numbers, mesh)?,
            "triangles" => triangles::<3, _>(numbers, mesh)?,
            "trianglesp2" => triangles::<6, _>(numbers, mesh)?,
            "trianglesp3" => triangles::<10, _>(numbers, mesh)?,
            "trianglesp4" => triangles::<15, _>(numbers, mesh)?,
            "edges" | "edgesp2" | "edgesp3" | "edgesp4" => {
                mesh.n_thin += numbers.skipped_count()?;
                return Ok(SectionRead::Part);
            }
            _ => {
                let others = ["hexahedra", "prisms", "pyramids", "quadrilaterals"];
                let other = others.iter().find(|other| keyword.starts_with(**other));
                if let Some(other) = other
                    && numbers.skipped_count()? > 0
                {
                    return Err(numbers.feed.unsupported(format!("a mesh with {other}")));
                }
                return Ok(SectionRead::Part);
            }
        }
        Ok(SectionRead::Whole)
    })
}

fn vertices<R: BufRead>(numbers: &mut MeditNumbers<R>, mesh: &mut RawMesh) -> Result<()> {
    let n = numbers.count("vertices", 3, 1)?;
    for i in 0..n {
        numbers.feed.need_record("vertices", n, i)?;
        mesh.point(numbers.point()?);
        numbers.integer("a vertex reference")?;
    }
    Ok(())
}

/// The last vertex number to expect: vertices may still come.
fn n_vertices(mesh: &RawMesh) -> u64 {
    match mesh.points.len() as u64 {
        0 => u64::from(u32::MAX),
        n => n,
    }
}

fn tets<const N: usize, R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    mesh: &mut RawMesh,
) -> Result<()> {
    let n = numbers.count("tetrahedra", 0, N as u64 + 1)?;
    let n_vertices = n_vertices(mesh);
    mesh.n_curved += if N > 4 { n } else { 0 };
    for i in 0..n {
        numbers.feed.need_record("tetrahedra", n, i)?;
        let corners = numbers.corners::<N>(n_vertices)?;
        let region = mesh.regions.number(numbers.integer("a reference")?);
        let taken = mesh.tet(std::array::from_fn(|k| corners[k]), region, 0);
        taken.map_err(|fault| numbers.feed.refuse(fault))?;
    }
    Ok(())
}

fn triangles<const N: usize, R: BufRead>(
    numbers: &mut MeditNumbers<R>,
    mesh: &mut RawMesh,
) -> Result<()> {
    let n = numbers.count("triangles", 0, N as u64 + 1)?;
    let n_vertices = n_vertices(mesh);
    mesh.n_curved += if N > 3 { n } else { 0 };
    for i in 0..n {
        numbers.feed.need_record("triangles", n, i)?;
        let corners = numbers.corners::<N>(n_vertices)?;
        let label = mesh.labels.number(numbers.integer("a reference")?);
        mesh.triangle(std::array::from_fn(|k| corners[k]), label);
    }
    Ok(())
}
