//! Defective triangles as a VTK file, to look at them.
//!
//! Each triangle has vertices of its own. Cell data: `defect`, the number of the first kind in [`KINDS`] it has;
//! `defects`, in how many it takes part; `input_id`; `label`. The words of the numbers stand in the field array
//! `defect_names`: bytes of UTF-8, a zero after each word.

use std::collections::BTreeMap;
use std::path::Path;

use super::draft::Draft;
use super::error::{Result, WriteError};
use super::vtu_layout::{Array, Container, Group, Index, Layout};
use tetdb_base::surface::{Defect, Surface};

/// VTK's number of a triangle.
const TRIANGLE: u8 = 5;
/// Words of defects by their number in the file; no triangle has number 0.
const KINDS: [&str; 5] =
    ["none", "degenerate-triangle", "duplicate-triangle", "open-surface", "self-intersection"];

/// Writes the triangles that `defects` are about to the `.vtu` file `out` and returns how many there are.
///
/// Errors: [`WriteError`]; `out` is not touched then.
pub fn defects(surface: &Surface, defects: &[Defect], out: &Path) -> Result<u64> {
    let is_vtu = out.extension().is_some_and(|e| e.eq_ignore_ascii_case("vtu"));
    if !is_vtu {
        return Err(WriteError::UnknownFormat { path: out.to_owned(), known: ".vtu" });
    }
    let bad = numbered(defects);
    let n = bad.len() as u64;
    let index = Index::new(3 * n, 3 * n);
    let arrays = vec![
        Array::new(Group::CellData, "defect", "Int32"),
        Array::new(Group::CellData, "defects", "Int32"),
        Array::new(Group::CellData, "input_id", "Int64"),
        Array::new(Group::CellData, "label", "UInt32"),
        Array::new(Group::Points, "Points", "Float64").vectors(),
        Array::new(Group::Cells, "connectivity", index.kind()),
        Array::new(Group::Cells, "offsets", index.kind()),
        Array::new(Group::Cells, "types", "UInt8"),
    ];
    let texts: Vec<u8> = KINDS.iter().flat_map(|word| word.bytes().chain([0])).collect();
    let texts = ("defect_names", texts.as_slice());
    let layout = Layout::new(&Container::Xml, &arrays, [3 * n, n, 3], texts);
    let mut draft = Draft::new(out)?;
    let path = draft.create(out, layout.file_bytes())?;
    let [mut kinds, mut counts, mut ids, mut labels, mut points, mut nodes, mut ends, mut types] =
        layout.open(&path)?;
    for (place, (&t, &(kind, count))) in (0u64..).zip(&bad) {
        kinds.put(&kind.to_le_bytes())?;
        counts.put(&count.to_le_bytes())?;
        ids.put(&i64::from(t).to_le_bytes())?;
        labels.put(&surface.labels[t as usize].to_le_bytes())?;
        for x in surface.corners(t).iter().flat_map(|p| p.to_array()) {
            points.put(&x.to_le_bytes())?;
        }
        for corner in 3 * place..3 * place + 3 {
            index.put(&mut nodes, corner)?;
        }
        index.put(&mut ends, 3 * place + 3)?;
        types.put(&[TRIANGLE])?;
    }
    for strip in [kinds, counts, ids, labels, points, nodes, ends, types] {
        strip.finish()?;
    }
    draft.publish()?;
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
