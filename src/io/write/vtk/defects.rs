//! Defective triangles of a surface as a VTK file, for viewers.
//!
//! Each triangle has vertices of its own. Cell data: `defect`, the number of the first kind in [`KINDS`] it has;
//! `defects`, the number of its defects; `input_id`; `label`. The words of the numbers are in the field array
//! `defect_names`: bytes of UTF-8, a zero after each word.

use std::collections::BTreeMap;
use std::path::Path;

use super::grid::{Container, VtkGrid};
use crate::write::columns::column;
use crate::write::error::{Result, WriteError};
use crate::write::output_files::OutputFiles;
use tetdb_base::surface::{Defect, Surface};

/// Words of defects by their number in the file; no triangle has number 0.
const KINDS: [&str; 5] =
    ["none", "degenerate-triangle", "duplicate-triangle", "open-surface", "self-intersection"];

/// A defective triangle: number of its first kind of defect, number of its defects, its place in the input, its label.
type DefectRow = (i32, i32, u32, u32);

/// Writes the triangles that have `defects` to the `.vtu` file `out` and returns their number.
///
/// Errors: [`WriteError`]; `out` is not touched then.
pub fn defects(surface: &Surface, defects: &[Defect], out: &Path) -> Result<u64> {
    let is_vtu = out.extension().is_some_and(|e| e.eq_ignore_ascii_case("vtu"));
    if !is_vtu {
        return Err(WriteError::UnknownFormat { path: out.to_owned(), known: ".vtu" });
    }
    let bad = numbered(defects);
    let n = bad.len() as u64;
    let columns = vec![
        column("defect", |row: &DefectRow| row.0),
        column("defects", |row: &DefectRow| row.1),
        column("input_id", |row: &DefectRow| i64::from(row.2)),
        column("label", |row: &DefectRow| row.3),
    ];
    let texts: Vec<u8> = KINDS.iter().flat_map(|word| word.bytes().chain([0])).collect();
    let texts = ("defect_names", texts.as_slice());
    let grid = VtkGrid::new(&Container::Xml, [3 * n, n, 3], texts, vec![], columns);
    let mut outputs = OutputFiles::new(out)?;
    let path = outputs.create(out, grid.file_bytes())?;
    let mut file = grid.open(&path)?;
    for (place, (&t, &(kind, count))) in (0u64..).zip(&bad) {
        for position in surface.corners(t) {
            file.point(&(), position.to_array())?;
        }
        let row = (kind, count, t, surface.labels[t as usize]);
        file.cell(&row, (3 * place..3 * place + 3).map(Ok))?;
    }
    file.finish()?;
    outputs.publish()?;
    Ok(n)
}

/// Triangle -> number of its first kind of defect, and in how many it takes part.
fn numbered(defects: &[Defect]) -> BTreeMap<u32, (i32, i32)> {
    let mut bad = BTreeMap::new();
    for defect in defects {
        let kind = KINDS.iter().position(|word| defect.code() == *word);
        let kind = kind.unwrap_or_default() as i32;
        for &t in defect.triangles() {
            let entry = bad.entry(t).or_insert((kind, 0));
            entry.0 = entry.0.min(kind);
            entry.1 += 1;
        }
    }
    bad
}
