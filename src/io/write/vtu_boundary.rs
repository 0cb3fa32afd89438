//! The boundary faces as a VTK file, `.vtu` or `.vtkhdf`, with vertices of their own.
//!
//! `input_id` is -1 on faces shared with another sub-domain; there `neighbor` is its number, `cut` and `cut_face` name the face for both.
//! Its vertices are those of the faces, in the order of the mesh; `mesh_vertex` tells where each is in
//! the file of the tetrahedra. Label names stand in the field array `label_names`.

use std::path::{Path, PathBuf};

use super::draft::Draft;
use super::error::Result;
use super::merged::Merged;
use super::midpoints::Midpoints;
use super::stream::{Records, scratch};
use super::vtu_layout::{Array, Container, Group, Index, Layout};
use tetdb_base::storage::{Sorted, Sorter, sort_record};

/// VTK's numbers of a triangle, alone and with the middles of its edges.
const TRIANGLE: u8 = 5;
const QUADRATIC_TRIANGLE: u8 = 22;

/// Points that stand together in the file of the tetrahedra: all, or those of a sub-domain; vertices, then middles of edges.
pub(super) struct Partition {
    pub rank: u32,
    pub first_vertex: u64,
    pub n_vertices: u64,
    pub first_middle: u64,
    pub n_middles: u64,
    pub n_tets: u64,
}

impl Partition {
    pub fn n_points(&self) -> u64 {
        self.n_vertices + self.n_middles
    }
}

/// One partition, or for `.vtkhdf` one of each sub-domain.
pub(super) fn partitions(
    mesh: &Merged,
    is_hdf: bool,
    middles: Option<&Midpoints>,
) -> Vec<Partition> {
    if !is_hdf {
        return vec![Partition {
            rank: 0,
            first_vertex: 0,
            n_vertices: mesh.n_vertices(),
            first_middle: 0,
            n_middles: middles.map_or(0, Midpoints::n),
            n_tets: mesh.n_tets(),
        }];
    }
    let mut first_middle = 0;
    let parts = mesh.parts().into_iter().enumerate();
    parts
        .map(|(p, part)| {
            let n_middles = middles.map_or(0, |m| m.counts[p]);
            first_middle += n_middles;
            Partition {
                rank: part.rank,
                first_vertex: part.first_vertex,
                n_vertices: part.n_vertices,
                first_middle: first_middle - n_middles,
                n_middles,
                n_tets: part.n_tets,
            }
        })
        .collect()
}

sort_record! {
    /// A corner of a face and its vertex in the mesh.
    struct Corner {
        vertex: u64,
        /// Its place among the corners of all faces; middles of edges follow the corners of theirs.
        place: u64,
    }
}

sort_record! {
    /// A corner of a face and the dense number of its vertex.
    struct CornerNumber {
        /// As above.
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
pub(super) fn write(
    mesh: &mut Merged,
    draft: &mut Draft,
    out: &Path,
    is_hdf: bool,
    middles: Option<&Midpoints>,
) -> Result<u64> {
    let n_corners = if middles.is_some() { 6 } else { 3 };
    let partitions = partitions(mesh, is_hdf, middles);
    let mut middle_points = middles.map(Midpoints::points).transpose()?;
    let corners = corners(mesh, mesh.dir(), middles)?;
    let n_faces = mesh.n_faces();
    let container = match is_hdf {
        true => Container::Hdf(vec![[corners.n_vertices, n_faces]]),
        false => Container::Xml,
    };
    let index = Index::within(is_hdf, corners.n_vertices, n_corners * n_faces);
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
    let counts = [corners.n_vertices, n_faces, n_corners];
    let layout = Layout::new(&container, &arrays, counts, ("label_names", &label_names(mesh)));
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
    let mut put = |row: u64, id: i64, point: [f64; 3]| {
        numbers.put(&row.to_le_bytes())?;
        ids.put(&id.to_le_bytes())?;
        (point.iter()).try_for_each(|x| points.put(&x.to_le_bytes()))
    };
    mesh.vertices(|number, vertex| {
        if next != Some(number.to_be_bytes()) {
            return Ok(());
        }
        next = used.next()?;
        let p = partitions.partition_point(|p| p.first_vertex <= number) - 1;
        put(number + partitions[p].first_middle, vertex.id as i64, vertex.point)
    })?;
    let mut edge = 0;
    while let (Some(points), Some(wanted)) = (&mut middle_points, next) {
        let Some(point) = points.next()? else { break };
        if u64::from_be_bytes(wanted) == mesh.n_vertices() + edge {
            next = used.next()?;
            let p = partitions.partition_point(|p| p.first_middle <= edge) - 1;
            let vertices = partitions[p].first_vertex + partitions[p].n_vertices;
            put(vertices + edge, -1, point)?;
        }
        edge += 1;
    }
    for corner in corners.dense {
        index.put(&mut nodes, corner?.number)?;
    }
    let mut end = 0;
    if is_hdf {
        index.put(&mut ends, end)?;
    }
    mesh.faces().each(|face| {
        end += n_corners;
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
        types.put(&[match n_corners {
            3 => TRIANGLE,
            _ => QUADRATIC_TRIANGLE,
        }])
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

fn corners(mesh: &Merged, dir: &Path, middles: Option<&Midpoints>) -> Result<Corners> {
    let mut edges = middles.map(Midpoints::faces).transpose()?;
    let mut by_vertex = Sorter::new(dir, mesh.sorter_bytes());
    let mut place = 0u64;
    mesh.faces().each(|face| {
        for vertex in face.vertices {
            by_vertex.push(Corner { vertex, place })?;
            place += 1;
        }
        if let Some(edges) = &mut edges {
            for edge in edges.next()? {
                let vertex = mesh.n_vertices() + edge;
                by_vertex.push(Corner { vertex, place })?;
                place += 1;
            }
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
    Ok(Corners { n_vertices, used, dense: by_place.finish()? })
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
