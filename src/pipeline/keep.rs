//! Coarse leaves: what a sub-domain is made from is kept, so that it can be made again.

use super::PipelineError;
use crate::catalog::{CatalogError, CoarseLeaf, CoarseRow, CoarseWriter};
use crate::mesh::{Mesh, Workspace};
use crate::store::{Backing, DiskPath, Pager, Pages, stop_if_requested};

/// Writes the working mesh of sub-domain `rank`, which has no gaps, to `path`. Errors: the disk.
pub(super) fn keep<P: Pages>(
    mesh: &mut Mesh<P>,
    path: &DiskPath,
    rank: u32,
    generation: u32,
    memory: u64,
) -> Result<CoarseRow, PipelineError> {
    assert!(
        mesh.is_dense(),
        "the coarse mesh of sub-domain {rank} has gaps"
    );
    let mut writer = CoarseWriter::create(path, rank, generation, memory as usize)?;
    for n in 0..mesh.n_vertices() {
        writer.push_vertex(mesh.kept_vertex(n))?;
    }
    for n in 0..mesh.n_tets() {
        writer.push_tet(mesh.kept_tet(n))?;
        if n & 0xffff == 0 {
            stop_if_requested();
        }
    }
    for n in 0..mesh.n_facets() {
        writer.push_facet(mesh.kept_facet(n))?;
    }
    for n in 0..mesh.n_interface_faces() {
        writer.push_face(mesh.kept_face(n))?;
    }
    Ok(writer.finish()?)
}

/// Opens a kept mesh as it was: the same ids, in the same order.
///
/// Not restored are sizes and `tet_of`, which the fine step sets anew. Errors: damage; the disk.
pub(super) fn reopen(
    leaf: &mut CoarseLeaf,
    backing: Backing,
    frames: u64,
    space: &Workspace,
) -> Result<Mesh, PipelineError> {
    let (rank, path) = (leaf.row().rank, backing.work_path.clone());
    let damaged = |what: &str| CatalogError::Content {
        path: path.path().to_owned(),
        subdomain: rank,
        what: format!("its coarse leaf has {what}"),
    };
    let mut mesh = Mesh::new(Pager::new(frames, Some(backing)));
    for chunk in leaf.vertices() {
        chunk?.records.iter().for_each(|v| mesh.add_kept_vertex(v));
    }
    for chunk in leaf.tets() {
        for tet in &chunk?.records {
            if !mesh.add_kept_tet(tet) {
                return Err(damaged("a tetrahedron without its vertices").into());
            }
        }
    }
    let n_vertices = mesh.n_vertices();
    let is_here = |v: &[u32; 3]| v.iter().all(|&v| v < n_vertices);
    for chunk in leaf.facets() {
        for facet in chunk?.records.iter() {
            if !is_here(&facet.vertices) {
                return Err(damaged("a facet without its vertices").into());
            }
            mesh.add_kept_facet(facet);
        }
    }
    for chunk in leaf.faces() {
        for face in chunk?.records.iter() {
            if !is_here(&face.vertices) {
                return Err(damaged("an interface face without its vertices").into());
            }
            mesh.add_kept_face(face);
        }
    }
    mesh.match_neighbors(space)?;
    Ok(mesh)
}
