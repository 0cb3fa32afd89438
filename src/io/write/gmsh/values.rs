//! Values of fields at nodes and elements: `$NodeData` and `$ElementData`, doubles by their tags.
//!
//! A symmetric tensor has its nine components, since Gmsh has values of 1, 3 and 9 numbers.

use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::merged_fields::{FieldChunk, open_fields, to_doubles};
use super::out::Out;
use super::piece::GmshPiece;
use tetdb_schema::field::{FieldPlace, FieldRow};

/// Places of the components of a symmetric tensor in its rows.
const ROWS: [usize; 9] = [0, 3, 5, 3, 1, 4, 5, 4, 2];

/// Writes a section for each field. Ghosts have no values. Errors: damage, the disk.
pub(super) fn write(
    mesh: &mut Merged,
    out: &mut Out,
    piece: &GmshPiece,
    fields: &[FieldRow],
) -> Result<()> {
    for field in fields {
        let section = match field.place {
            FieldPlace::Vertices => "NodeData",
            FieldPlace::Tets => "ElementData",
        };
        out.section(section, |out| values(mesh, out, piece, field))?;
    }
    Ok(())
}

fn values(mesh: &mut Merged, out: &mut Out, piece: &GmshPiece, field: &FieldRow) -> Result<()> {
    let is_of_vertices = field.place == FieldPlace::Vertices;
    let parts = mesh.parts();
    let is_merged = piece.which.len() == parts.len();
    let here = piece.which.iter().map(|&p| parts[p]);
    // Vertices that several partitions have are there once in a file of all of them.
    let n = match is_of_vertices {
        true if is_merged => mesh.n_vertices(),
        true => here.map(|part| part.n_vertices).sum(),
        false => here.map(|part| part.n_tets).sum(),
    };
    let n_components = if field.components == 6 { 9 } else { field.components };
    // A text, the time, then step, components and values.
    out.text(&format!("1\n\"{}\"\n1\n0\n3\n0\n{n_components}\n{n}\n", field.name));
    let first = if is_of_vertices { 1 } else { mesh.n_faces() + 1 };
    let row = std::slice::from_ref(field);
    let mut found = 0;
    for &p in piece.which {
        let OpenedPart { part, numbers } = mesh.open_part(p)?;
        let mut files = open_fields(mesh.store, row, &part)?;
        let counts: Vec<u32> = match is_of_vertices {
            true => part.vertex_summaries().iter().map(|summary| summary.count).collect(),
            false => part.tet_summaries().iter().map(|summary| summary.count).collect(),
        };
        let mut local = 0;
        for (chunk, n) in (0..).zip(counts) {
            let words = FieldChunk::read(&mut files, chunk)?;
            for i in 0..n as usize {
                let number = match is_of_vertices {
                    true if is_merged => numbers.own(local),
                    true => numbers.vertex(local),
                    false => numbers.tet(local),
                };
                local += 1;
                let Some(number) = number else { continue };
                found += 1;
                out.int((first + number) as u32);
                let words = words.row(i);
                let numbers: Vec<f64> = to_doubles(row, &words).collect();
                match numbers[..] {
                    [_, _, _, _, _, _] => ROWS.iter().for_each(|&i| out.double(numbers[i])),
                    _ => numbers.into_iter().for_each(|x| out.double(x)),
                }
                out.end()?;
            }
        }
    }
    mesh.expect_count("values", n, found)
}
