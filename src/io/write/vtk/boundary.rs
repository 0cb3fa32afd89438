//! The boundary faces as a VTK file, `.vtu` or `.vtkhdf`, with vertices of their own.
//!
//! `input_id` is -1 on faces shared with another sub-domain. There `neighbor` is the number of that sub-domain, and `cut` and `cut_face` name
//! the face for both. The vertices are those of the faces, in the order of the mesh; `mesh_vertex` is the place of each in the file of the
//! tetrahedra. Label names are in the field array `label_names`.

use std::collections::BTreeSet;
use std::path::Path;

use super::grid::{Container, GridWriter, VtkCells, VtkGrid};
use crate::write::columns::{TableColumn, column};
use crate::write::error::Result;
use crate::write::faces::MergedFace;
use crate::write::merged::Merged;
use crate::write::midpoints::Midpoints;
use crate::write::numbering::{CornerSorter, DenseCorners};
use crate::write::output_files::OutputFiles;
use crate::write::stream::{RecordReader, scratch};

/// Consecutive points in the file of the tetrahedra, all or those of a sub-domain: vertices, then midpoints of edges.
pub(super) struct Partition {
    /// The sub-domain; none stands for all.
    rank: Option<u32>,
    pub first_vertex: u64,
    pub n_vertices: u64,
    pub first_midpoint: u64,
    pub n_midpoints: u64,
    pub n_tets: u64,
}

impl Partition {
    pub fn n_points(&self) -> u64 {
        self.n_vertices + self.n_midpoints
    }

    /// Returns whether the tetrahedra of a sub-domain belong to the partition.
    pub fn holds(&self, subdomain: u32) -> bool {
        self.rank.is_none_or(|rank| rank == subdomain)
    }
}

/// One partition, or one for each sub-domain where their vertices are apart.
pub(super) fn partitions(mesh: &Merged, midpoints: Option<&Midpoints>) -> Vec<Partition> {
    if !mesh.is_apart {
        return vec![Partition {
            rank: None,
            first_vertex: 0,
            n_vertices: mesh.n_vertices(),
            first_midpoint: 0,
            n_midpoints: midpoints.map_or(0, Midpoints::n),
            n_tets: mesh.n_tets(),
        }];
    }
    let partition = |(p, part): (usize, crate::write::merged::Part)| Partition {
        rank: Some(part.rank),
        first_vertex: part.first_vertex,
        n_vertices: part.n_vertices,
        first_midpoint: midpoints.map_or(0, |m| m.first_of(p)),
        n_midpoints: midpoints.map_or(0, |m| m.counts[p]),
        n_tets: part.n_tets,
    };
    mesh.parts().into_iter().enumerate().map(partition).collect()
}

/// The lasting id of a point that has none: the midpoint of an edge.
pub(in crate::write) const NO_ID: i64 = -1;

/// Most groups that get a flag for each face. A byte for each is half of a face's bytes then, and the file would be mostly zeros.
const GROUPS_MAX: usize = 64;

/// Columns of the groups, 1 where a face is in one, if any face is in two.
pub(in crate::write) fn group_columns(mesh: &Merged) -> Vec<TableColumn<MergedFace>> {
    let groups = mesh.overlapping_groups().into_iter().take(GROUPS_MAX);
    let is_in = |(name, labels): (String, BTreeSet<u32>)| {
        column(name, move |face: &MergedFace| u8::from(labels.contains(&face.label)))
    };
    groups.map(is_in).collect()
}

/// A point of the file: its place in the file of the tetrahedra, and its lasting id or -1.
type PointRow = (u64, i64);

/// Writes the faces; returns the number of their vertices.
pub(in crate::write) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    hdf: Option<VtkCells>,
    midpoints: Option<&Midpoints>,
) -> Result<u64> {
    let n_corners = if midpoints.is_some() { 6 } else { 3 };
    let used = mesh.dir().join("corners");
    let (n_vertices, mut nodes) = dense_corners(mesh, &used, midpoints)?;
    let n_faces = mesh.n_faces();
    let container = match hdf {
        Some(cells) => Container::Hdf(cells, vec![[n_vertices, n_faces]]),
        None => Container::Xml,
    };
    let points = vec![
        column("mesh_vertex", |point: &PointRow| point.0 as i64),
        column("global_id", |point: &PointRow| point.1),
    ];
    let cut_of = |face: &MergedFace| face.cut().map(|(cut, _)| cut);
    let mut faces = vec![
        column("label", |face: &MergedFace| face.label),
        column("input_id", |face: &MergedFace| or_none(face.triangle())),
        column("region_front", |face: &MergedFace| face.regions[0]),
        column("region_back", |face: &MergedFace| face.regions[1]),
        column("subdomain", |face: &MergedFace| face.subdomain),
        column("neighbor", move |face: &MergedFace| or_none(cut_of(face).and(Some(face.neighbor)))),
        column("cut", move |face: &MergedFace| or_none(cut_of(face))),
        column("cut_face", |face: &MergedFace| or_none(face.cut().map(|(_, index)| index))),
    ];
    faces.extend(group_columns(mesh));
    let counts = [n_vertices, n_faces, n_corners];
    let texts = ("label_names", &*label_names(mesh));
    let grid = VtkGrid::new(&container, counts, texts, points, faces);
    let path = outputs.create(out, grid.file_bytes())?;
    let mut file = grid.open(&path)?;
    write_points(mesh, &mut file, &used, &partitions(mesh, midpoints), midpoints)?;
    file.begin_partition()?;
    mesh.faces().each(|face| file.cell(face, nodes.by_ref().take(n_corners as usize)))?;
    file.finish()?;
    Ok(n_vertices)
}

/// Writes the vertices and midpoints whose numbers are in the file `used`.
fn write_points(
    mesh: &mut Merged,
    file: &mut GridWriter<PointRow, MergedFace>,
    used: &Path,
    partitions: &[Partition],
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    let mut used = RecordReader::<[u8; 8]>::open(used, 0)?;
    let mut next = used.next()?;
    mesh.vertices(|number, vertex| {
        if next != Some(number.to_be_bytes()) {
            return Ok(());
        }
        next = used.next()?;
        let p = partitions.partition_point(|p| p.first_vertex <= number) - 1;
        file.point(&(number + partitions[p].first_midpoint, vertex.id as i64), vertex.point)
    })?;
    let Some(midpoints) = midpoints else {
        return Ok(());
    };
    for (edge, position) in (0..).zip(midpoints.points()?) {
        if next.is_none() {
            break;
        }
        if next == Some((mesh.n_vertices() + edge).to_be_bytes()) {
            next = used.next()?;
            let p = partitions.partition_point(|p| p.first_midpoint <= edge) - 1;
            let vertices = partitions[p].first_vertex + partitions[p].n_vertices;
            file.point(&(vertices + edge, NO_ID), position?)?;
        }
    }
    Ok(())
}

/// A number, or -1.
fn or_none(number: Option<impl Into<u64>>) -> i64 {
    number.map_or(-1, |n| n.into() as i64)
}

/// Numbers the vertices and midpoints of the faces densely, and writes their numbers in the mesh to the file `used`, ascending.
fn dense_corners(
    mesh: &Merged,
    used: &Path,
    midpoints: Option<&Midpoints>,
) -> Result<(u64, DenseCorners)> {
    let mut edges = midpoints.map(Midpoints::faces).transpose()?;
    let mut corners = CornerSorter::new(mesh.dir(), mesh.sorter_bytes());
    mesh.faces().each(|face| {
        for vertex in face.vertices {
            corners.push(vertex, [0.0; 3])?;
        }
        if let Some(edges) = &mut edges {
            for edge in edges.next()? {
                corners.push(mesh.n_vertices() + edge, [0.0; 3])?;
            }
        }
        Ok(())
    })?;
    let mut stream = scratch(used)?;
    let numbered = corners.finish(|vertex, _| {
        stream.bytes(&vertex.to_be_bytes());
        stream.end()
    })?;
    stream.finish()?;
    Ok(numbered)
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
