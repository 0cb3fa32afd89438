//! The boundary faces as a VTK file, `.vtu` or `.vtkhdf`, with vertices of their own.
//!
//! `input_id` is -1 on faces shared with another sub-domain; there `neighbor` is its number, `cut` and `cut_face` name the face for both.
//! Its vertices are those of the faces, in the order of the mesh; `mesh_vertex` tells where each is in
//! the file of the tetrahedra. Label names stand in the field array `label_names`.

use std::path::{Path, PathBuf};

use super::draft::Draft;
use super::error::Result;
use super::merged::Merged;
use super::stream::{Records, scratch};
use super::vtu_layout::{Array, Container, Group, Index, Layout};
use crate::storage::{Sorted, Sorter, sort_record};

/// VTK's number of a triangle.
const TRIANGLE: u8 = 5;

sort_record! {
    /// A corner of a face and its vertex in the mesh.
    struct Corner {
        vertex: u64,
        /// 3 · face + corner.
        place: u64,
    }
}

sort_record! {
    /// A corner of a face and the dense number of its vertex.
    struct CornerNumber {
        /// 3 · face + corner.
        place: u64,
        number: u64,
    }
}

/// The vertices of the faces, numbered densely.
struct Corners {
    n_vertices: u64,
    /// Their numbers in the mesh, ascending; 8 bytes each.
    used: PathBuf,
    dense: Sorted<CornerNumber>,
}

/// Writes the faces; returns the number of their vertices.
pub(super) fn write(mesh: &mut Merged, draft: &mut Draft, out: &Path, is_hdf: bool) -> Result<u64> {
    let corners = corners(mesh, mesh.dir())?;
    let n_faces = mesh.n_faces();
    let container = match is_hdf {
        true => Container::Hdf(vec![[corners.n_vertices, n_faces]]),
        false => Container::Xml,
    };
    let index = Index::within(&container, corners.n_vertices, 3 * n_faces);
    let arrays = vec![
        Array::new(Group::PointData, "mesh_vertex", "Int64"),
        Array::new(Group::PointData, "global_id", "Int64"),
        Array::new(Group::CellData, "label", "UInt32"),
        Array::new(Group::CellData, "input_id", "Int64"),
        Array::new(Group::CellData, "region_front", "UInt32"),
        Array::new(Group::CellData, "region_back", "UInt32"),
        Array::new(Group::CellData, "subdomain", "UInt32"),
        Array::new(Group::CellData, "neighbor", "Int64"),
        Array::new(Group::CellData, "cut", "Int64"),
        Array::new(Group::CellData, "cut_face", "Int64"),
        Array::new(Group::Points, "Points", "Float64").vectors(),
        Array::new(Group::Cells, "connectivity", index.kind()),
        Array::new(Group::Cells, "offsets", index.kind()),
        Array::new(Group::Cells, "types", "UInt8"),
    ];
    let counts = [corners.n_vertices, n_faces, 3];
    let layout = Layout::new(
        &container,
        &arrays,
        counts,
        ("label_names", &label_names(mesh)),
    );
    let path = draft.create(out, layout.file_bytes())?;
    let [
        mut numbers,
        mut ids,
        mut labels,
        mut triangles,
        mut fronts,
        mut backs,
        mut ranks,
        mut neighbors,
        mut cuts,
        mut cut_faces,
        mut points,
        mut nodes,
        mut ends,
        mut types,
    ] = layout.open(&path)?;
    let mut used = Records::<8>::open(&corners.used, 0)?;
    let mut next = used.next()?;
    mesh.vertices(|number, vertex| {
        if next != Some(number.to_be_bytes()) {
            return Ok(());
        }
        next = used.next()?;
        numbers.put(&number.to_le_bytes())?;
        ids.put(&vertex.id.to_le_bytes())?;
        vertex
            .point
            .iter()
            .try_for_each(|x| points.put(&x.to_le_bytes()))
    })?;
    for corner in corners.dense {
        index.put(&mut nodes, corner?.number)?;
    }
    let mut end = 0;
    if is_hdf {
        index.put(&mut ends, end)?;
    }
    mesh.faces().each(|face| {
        end += 3;
        labels.put(&face.label.to_le_bytes())?;
        triangles.put(&or_none(face.triangle()).to_le_bytes())?;
        fronts.put(&face.regions[0].to_le_bytes())?;
        backs.put(&face.regions[1].to_le_bytes())?;
        ranks.put(&face.subdomain.to_le_bytes())?;
        let cut = face.cut();
        neighbors.put(&or_none(cut.map(|_| u64::from(face.neighbor))).to_le_bytes())?;
        cuts.put(&or_none(cut.map(|c| u64::from(c.0))).to_le_bytes())?;
        cut_faces.put(&or_none(cut.map(|c| u64::from(c.1))).to_le_bytes())?;
        index.put(&mut ends, end)?;
        types.put(&[TRIANGLE])
    })?;
    for strip in [
        numbers, ids, labels, triangles, fronts, backs, ranks, neighbors, cuts, cut_faces, points,
        nodes, ends, types,
    ] {
        strip.finish()?;
    }
    Ok(corners.n_vertices)
}

/// A number, or -1.
fn or_none(number: Option<u64>) -> i64 {
    number.map_or(-1, |n| n as i64)
}

fn corners(mesh: &Merged, dir: &Path) -> Result<Corners> {
    let mut by_vertex = Sorter::new(dir, mesh.sorter_bytes());
    let mut place = 0u64;
    mesh.faces().each(|face| {
        for vertex in face.vertices {
            by_vertex.push(Corner { vertex, place })?;
            place += 1;
        }
        Ok(())
    })?;
    let mut by_place = Sorter::new(dir, mesh.sorter_bytes());
    let used = dir.join("corners");
    let mut stream = scratch(&used)?;
    let (mut n_vertices, mut last) = (0, None);
    for corner in by_vertex.finish()? {
        let Corner { vertex, place } = corner?;
        if last != Some(vertex) {
            last = Some(vertex);
            n_vertices += 1;
            stream.bytes(&vertex.to_be_bytes());
            stream.end()?;
        }
        let number = n_vertices - 1;
        by_place.push(CornerNumber { place, number })?;
    }
    stream.finish()?;
    Ok(Corners {
        n_vertices,
        used,
        dense: by_place.finish()?,
    })
}

/// Names of labels 0, 1, .., up to the last one a face has, a zero after each.
fn label_names(mesh: &Merged) -> Vec<u8> {
    let labels = mesh.labels();
    let last = labels.keys().next_back().copied().unwrap_or_default();
    (0..=last)
        .flat_map(|label| {
            let name = labels.get(&label).map_or("", String::as_str);
            name.bytes().chain([0])
        })
        .collect()
}
