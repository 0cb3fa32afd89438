//! VTK unstructured grids, XML or HDF5: the tetrahedra in one file, the boundary faces in another beside it.
//!
//! A `.vtkhdf` file has a partition for each sub-domain, with vertices of its own. Source: the VTK file formats document, appended
//! raw data with 64-bit lengths; for `.vtkhdf` see `vtu_layout`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::draft::Draft;
use super::error::{Result, WriteError};
use super::merged::{Measured, Merged};
use super::midpoints::{MiddlePoints, Midpoints};
use super::selection::Share;
use super::vtu_boundary::{self, Partition, partitions};
use super::vtu_layout::{Array, Container, Group, Index, Layout};
use super::writers::Writers;
use tetdb_base::storage::RemoteFailure;

/// VTK's number of a tetrahedron.
pub(super) const TETRA: u8 = 10;

/// VTK's number of a tetrahedron with the middles of its edges.
const QUADRATIC_TETRA: u8 = 24;
/// The lasting id of a vertex that has none: the middle of an edge.
const NO_ID: i64 = -1;

/// Writes both; for `.vtkhdf` the mesh is one whose vertices are numbered apart, and several processes may write partitions.
pub(super) fn write(
    mesh: &mut Merged,
    draft: &mut Draft,
    out: &Path,
    is_hdf: bool,
    middles: Option<&Midpoints>,
    writers: Option<&dyn Writers>,
) -> Result<()> {
    mesh.expect_passes(2, 1);
    let partitions = partitions(mesh, is_hdf, middles);
    let layout = layout(mesh, &partitions, is_hdf, middles.is_some());
    let mut begin = || {
        let path = draft.create(out, layout.file_bytes())?;
        layout.begin(&path).map(|()| path)
    };
    let n = partitions.len();
    let Some(writers) = writers else {
        let path = begin()?;
        write_partitions(mesh, (&layout, &path), &partitions, 0..n, (is_hdf, middles))?;
        return vtu_boundary::write(mesh, draft, &boundary_path(out), is_hdf, middles).map(drop);
    };
    let Share { number, of } = writers.share();
    let write_own = |mesh: &mut Merged, path: &Path| -> Result<()> {
        for p in (0..n).filter(|&p| p as u32 % of == number - 1) {
            mesh.look_at(p..p + 1);
            write_partitions(mesh, (&layout, path), &partitions, p..p + 1, (true, None))?;
        }
        Ok(())
    };
    if number == 1 {
        let path = begin().inspect(|path| writers.announce(path))?;
        write_own(mesh, &path)?;
        mesh.look_at(0..n);
        vtu_boundary::write(mesh, draft, &boundary_path(out), true, None)?;
        return writers.wait().map_err(WriteError::Elsewhere);
    }
    let Some(path) = writers.hear() else {
        return Ok(());
    };
    let done = write_own(mesh, &path);
    writers.say(
        done.as_ref()
            .copied()
            .map_err(|error| RemoteFailure { code: error.code(), message: error.to_string() }),
    );
    done
}

/// Connectivity and offsets of the file of the tetrahedra.
fn index(partitions: &[Partition], is_hdf: bool, corners: u64) -> Index {
    let n_points = partitions.iter().map(Partition::n_points).sum();
    let n_tets: u64 = partitions.iter().map(|p| p.n_tets).sum();
    Index::within(is_hdf, n_points, corners * n_tets)
}

/// Of the file of the tetrahedra.
fn layout(mesh: &Merged, partitions: &[Partition], is_hdf: bool, is_quadratic: bool) -> Layout {
    let counts_of = |p: &Partition| [p.n_points(), p.n_tets];
    let container = match is_hdf {
        true => Container::Hdf(partitions.iter().map(counts_of).collect()),
        false => Container::Xml,
    };
    let corners = corners(is_quadratic);
    let index = index(partitions, is_hdf, corners);
    let arrays = vec![
        Array::new(Group::PointData, "global_id", "Int64"),
        Array::new(Group::CellData, "subdomain", "UInt32"),
        Array::new(Group::CellData, "region", "UInt32"),
        Array::new(Group::CellData, "quality", "Float64"),
        Array::new(Group::CellData, "excess", "Float64"),
        Array::new(Group::CellData, "global_id", "Int64"),
        Array::new(Group::Points, "Points", "Float64").vectors(),
        Array::new(Group::Cells, "connectivity", index.kind()),
        Array::new(Group::Cells, "offsets", index.kind()),
        Array::new(Group::Cells, "types", "UInt8"),
    ];
    let n_points = partitions.iter().map(Partition::n_points).sum();
    let counts = [n_points, mesh.n_tets(), corners];
    Layout::new(&container, &arrays, counts, ("region_names", &mesh.region_names()))
}

fn corners(is_quadratic: bool) -> u64 {
    if is_quadratic { 10 } else { 4 }
}

/// Points, cells and partitions of some.
fn rows(partitions: &[Partition]) -> [u64; 3] {
    let points = partitions.iter().map(Partition::n_points).sum();
    let cells = partitions.iter().map(|p| p.n_tets).sum();
    [points, cells, partitions.len() as u64]
}

/// Writes partitions of the file of the tetrahedra, those that the mesh now looks at.
fn write_partitions(
    mesh: &mut Merged,
    (layout, path): (&Layout, &Path),
    all: &[Partition],
    which: Range<usize>,
    (is_hdf, middles): (bool, Option<&Midpoints>),
) -> Result<()> {
    let corners = corners(middles.is_some());
    let index = index(all, is_hdf, corners);
    let partitions = &all[which.clone()];
    let [
        mut vertex_ids,
        mut ranks,
        mut regions,
        mut qualities,
        mut excesses,
        mut ids,
        mut points,
        mut nodes,
        mut ends,
        mut types,
    ] = layout.strips(path, rows(&all[..which.start]), rows(partitions))?;
    let mut put = |id: i64, point: [f64; 3]| {
        vertex_ids.put(&id.to_le_bytes())?;
        (point.iter()).try_for_each(|x| points.put(&x.to_le_bytes()))
    };
    // The middles of a partition stand behind its vertices.
    let mut middle_points = middles.map(Midpoints::points).transpose()?;
    let mut put_middles = |n: u64, put: &mut dyn FnMut(i64, [f64; 3]) -> Result<()>| {
        (0..n).try_for_each(|_| {
            let point = middle_points.as_mut().map(MiddlePoints::next).transpose()?;
            point.flatten().map_or(Ok(()), |point| put(NO_ID, point))
        })
    };
    let mut of_points = partitions.iter();
    let mut current = of_points.next();
    mesh.vertices(|number, vertex| {
        while let Some(part) = current.filter(|part| number >= part.first_vertex + part.n_vertices)
        {
            put_middles(part.n_middles, &mut put)?;
            current = of_points.next();
        }
        put(vertex.id as i64, vertex.point)
    })?;
    for part in current.into_iter().chain(of_points) {
        put_middles(part.n_middles, &mut put)?;
    }
    let mut part = &partitions[0];
    let mut edges = middles.map(Midpoints::tets).transpose()?;
    let mut end = 0;
    let mut coming = partitions.iter().filter(|_| is_hdf).peekable();
    mesh.measured_tets(Measured::Excess, |tet| {
        if let Some(next) = coming.next_if(|part| part.rank == tet.subdomain) {
            (part, end) = (next, 0);
            index.put(&mut ends, end)?;
        }
        end += corners;
        ranks.put(&tet.subdomain.to_le_bytes())?;
        regions.put(&tet.region.to_le_bytes())?;
        qualities.put(&tet.quality.to_le_bytes())?;
        excesses.put(&tet.excess.to_le_bytes())?;
        ids.put(&tet.id.number().to_le_bytes())?;
        for v in tet.nodes {
            index.put(&mut nodes, v - part.first_vertex)?;
        }
        if let Some(edges) = &mut edges {
            for edge in edges.next()? {
                index.put(&mut nodes, part.n_vertices + edge - part.first_middle)?;
            }
        }
        index.put(&mut ends, end)?;
        types.put(&[if corners == 10 { QUADRATIC_TETRA } else { TETRA }])
    })?;
    for strip in [vertex_ids, ranks, regions, qualities, excesses, ids, points, nodes, ends, types]
    {
        strip.finish()?;
    }
    Ok(())
}

/// `NAME_boundary.vtu` beside `NAME.vtu`.
pub(super) fn boundary_path(out: &Path) -> PathBuf {
    let mut name = out.file_stem().unwrap_or_default().to_owned();
    name.push("_boundary.");
    name.push(out.extension().unwrap_or_default());
    out.with_file_name(name)
}
