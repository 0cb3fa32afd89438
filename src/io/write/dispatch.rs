//! One file of a mesh in the format asked for.

use std::path::Path;

use super::draft::Draft;
use super::error::Result;
use super::format::MeshFormat;
use super::merged::Merged;
use super::report::FileCounts;
use super::selection::Content;
use super::{abaqus, gmsh, medit, npy_columns, vtu, vtu_boundary};

/// Writes a mesh as one file, and what belongs to it.
pub(super) fn write(
    format: MeshFormat,
    content: Content,
    mesh: &mut Merged,
    draft: &mut Draft,
    out: &Path,
) -> Result<FileCounts> {
    let mut counts = FileCounts {
        vertices: mesh.n_vertices(),
        tets: mesh.n_tets(),
        triangles: mesh.n_faces(),
    };
    match format {
        MeshFormat::Vtu if content != Content::Mesh => {
            mesh.expect_passes(1, 0);
            counts.vertices = vtu_boundary::write(mesh, draft, out)?;
            counts.tets = 0;
        }
        MeshFormat::Vtu | MeshFormat::Pvtu => vtu::write(mesh, draft, out)?,
        MeshFormat::Medit => medit::write_text(mesh, draft, out)?,
        MeshFormat::MeditBinary => medit::write_binary(mesh, draft, out)?,
        MeshFormat::Gmsh => gmsh::write(mesh, draft, out)?,
        MeshFormat::Abaqus => abaqus::write(mesh, draft, out)?,
        MeshFormat::Numpy => npy_columns::write(mesh, draft, out)?,
        #[cfg(feature = "parquet")]
        MeshFormat::Parquet => unreachable!("its pieces are written elsewhere"),
        MeshFormat::Topology => unreachable!("the topology is no mesh"),
    }
    mesh.report_end();
    Ok(counts)
}
