//! VTK unstructured grids, XML or HDF5: the tetrahedra in one file, the boundary faces in another beside it.
//!
//! A `.vtkhdf` file has a partition for each sub-domain, with vertices of its own. Source: the VTK file formats document, appended
//! raw data with 64-bit lengths; for `.vtkhdf` see `vtu_layout`.

use std::path::{Path, PathBuf};

use super::draft::Draft;
use super::error::Result;
use super::merged::Merged;
use super::vtu_boundary;
use super::vtu_layout::{Array, Container, Group, Index, Layout};

/// VTK's number of a tetrahedron.
pub(super) const TETRA: u8 = 10;

/// Writes both; for `.vtkhdf` the mesh is one whose vertices are numbered apart.
pub(super) fn write(mesh: &mut Merged, draft: &mut Draft, out: &Path, is_hdf: bool) -> Result<()> {
    mesh.expect_passes(2, 1);
    let parts = mesh.parts();
    let container = match is_hdf {
        true => Container::Hdf(parts.iter().map(|p| [p.n_vertices, p.n_tets]).collect()),
        false => Container::Xml,
    };
    let index = Index::within(&container, mesh.n_vertices(), 4 * mesh.n_tets());
    let arrays = vec![
        Array::new(Group::PointData, "global_id", "Int64"),
        Array::new(Group::CellData, "subdomain", "UInt32"),
        Array::new(Group::CellData, "region", "UInt32"),
        Array::new(Group::CellData, "quality", "Float64"),
        Array::new(Group::CellData, "global_id", "Int64"),
        Array::new(Group::Points, "Points", "Float64").vectors(),
        Array::new(Group::Cells, "connectivity", index.kind()),
        Array::new(Group::Cells, "offsets", index.kind()),
        Array::new(Group::Cells, "types", "UInt8"),
    ];
    let counts = [mesh.n_vertices(), mesh.n_tets(), 4];
    let layout = Layout::new(&container, &arrays, counts, ("", &[]));
    let path = draft.create(out, layout.file_bytes())?;
    let [
        mut vertex_ids,
        mut ranks,
        mut regions,
        mut qualities,
        mut ids,
        mut points,
        mut nodes,
        mut ends,
        mut types,
    ] = layout.open(&path)?;
    mesh.vertices(|_, vertex| {
        vertex_ids.put(&vertex.id.to_le_bytes())?;
        vertex
            .point
            .iter()
            .try_for_each(|x| points.put(&x.to_le_bytes()))
    })?;
    let (mut end, mut first_vertex) = (0, 0);
    let mut coming = parts.iter().filter(|_| is_hdf).peekable();
    mesh.tets_with_quality(|tet| {
        if let Some(part) = coming.next_if(|part| part.rank == tet.subdomain) {
            (end, first_vertex) = (0, part.first_vertex);
            index.put(&mut ends, end)?;
        }
        end += 4;
        ranks.put(&tet.subdomain.to_le_bytes())?;
        regions.put(&tet.region.to_le_bytes())?;
        qualities.put(&tet.quality.to_le_bytes())?;
        ids.put(&tet.id.number().to_le_bytes())?;
        tet.nodes
            .iter()
            .try_for_each(|&v| index.put(&mut nodes, v - first_vertex))?;
        index.put(&mut ends, end)?;
        types.put(&[TETRA])
    })?;
    for strip in [
        vertex_ids, ranks, regions, qualities, ids, points, nodes, ends, types,
    ] {
        strip.finish()?;
    }
    vtu_boundary::write(mesh, draft, &boundary_path(out), is_hdf)?;
    Ok(())
}

/// `NAME_boundary.vtu` beside `NAME.vtu`.
pub(super) fn boundary_path(out: &Path) -> PathBuf {
    let mut name = out.file_stem().unwrap_or_default().to_owned();
    name.push("_boundary.");
    name.push(out.extension().unwrap_or_default());
    out.with_file_name(name)
}
