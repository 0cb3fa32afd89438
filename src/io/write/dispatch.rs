//! One file of a mesh in the requested format.

use std::path::Path;

use super::embedded_list::write_list;
use super::error::Result;
use super::format::MeshFormat;
use super::merged::Merged;
use super::midpoints::Midpoints;
use super::output_files::OutputFiles;
use super::periodic::WrittenPeriodic;
use super::report::FileCounts;
use super::selection::{Content, ElementOrder, ExportSelection};
use super::writers::{Writers, is_first};
use super::{
    abaqus, exodus, foam, gmsh, gmsh22, medit, mfem, nastran, npy_columns, su2, tetgen, vtk, xdmf,
};

/// Writes a mesh as one file with its side files. Several `writers` may share the tetrahedra of `.vtkhdf`; the first writes the rest.
pub(super) fn write(
    format: MeshFormat,
    selection: &ExportSelection,
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    writers: Option<&dyn Writers>,
) -> Result<FileCounts> {
    let midpoints = match selection.order {
        ElementOrder::First => None,
        ElementOrder::Second => {
            let has_fields = format.has_fields() && selection.content == Content::Mesh;
            let [fields, _] = match has_fields {
                true => mesh.fields_read(true, format.has_doubles())?,
                false => Default::default(),
            };
            Some(Midpoints::gather(mesh, format == MeshFormat::Gmsh, &fields)?)
        }
    };
    let midpoints = midpoints.as_ref();
    let periodic = match selection.has_periodic(format) {
        true => WrittenPeriodic::gather(mesh, midpoints, mesh.memory as u64 / 4)?,
        false => WrittenPeriodic::default(),
    };
    let mut counts = FileCounts {
        vertices: mesh.n_vertices() + midpoints.map_or(0, Midpoints::n),
        tets: mesh.n_tets(),
        triangles: mesh.n_faces(),
    };
    let is_lagrange = selection.one_partition;
    let cells = if is_lagrange { vtk::VtkCells::Lagrange } else { vtk::VtkCells::OfOrder };
    let hdf = (format == MeshFormat::VtkHdf).then_some(cells);
    match format {
        MeshFormat::Vtu | MeshFormat::VtkHdf if selection.content != Content::Mesh => {
            mesh.expect_passes(1, 0);
            counts.vertices = vtk::write_boundary(mesh, outputs, out, hdf, midpoints)?;
            counts.tets = 0;
        }
        MeshFormat::Vtu | MeshFormat::Pvtu => {
            vtk::write(mesh, outputs, out, None, midpoints, None)?
        }
        MeshFormat::VtkHdf => {
            vtk::write(mesh, outputs, out, hdf, midpoints, writers)?;
            if !is_first(writers) {
                return Ok(FileCounts::default());
            }
        }
        MeshFormat::Medit => medit::write_text(mesh, outputs, out)?,
        MeshFormat::MeditBinary => medit::write_binary(mesh, outputs, out)?,
        MeshFormat::Gmsh => {
            counts = gmsh::write(mesh, outputs, out, (selection, midpoints, &periodic))?
        }
        MeshFormat::Gmsh22 => gmsh22::write(mesh, outputs, out)?,
        MeshFormat::Abaqus => abaqus::write(mesh, outputs, out, midpoints)?,
        MeshFormat::Exodus => exodus::write(mesh, outputs, out, midpoints)?,
        MeshFormat::Xdmf => xdmf::write(mesh, outputs, out, midpoints)?,
        MeshFormat::Nastran => nastran::write(mesh, outputs, out, midpoints)?,
        MeshFormat::Su2 => counts.triangles = su2::write(mesh, outputs, out)?,
        MeshFormat::Numpy => npy_columns::write(mesh, outputs, out, &periodic)?,
        #[cfg(feature = "parquet")]
        MeshFormat::Parquet => unreachable!("its pieces are written elsewhere"),
        MeshFormat::OpenFoam => counts = foam::write(mesh, outputs, out, selection)?,
        MeshFormat::Mfem => counts = mfem::write(mesh, outputs, out, selection)?,
        MeshFormat::TetGen => tetgen::write(mesh, outputs, out)?,
        MeshFormat::Topology => unreachable!("the topology is no mesh"),
    }
    let is_mesh = selection.content == Content::Mesh;
    write_beside(mesh, outputs, out, (format, is_mesh, &periodic))?;
    mesh.report_end();
    Ok(counts)
}

/// Writes lists of what the format has no place for: embedded edges and points, periodic pairs.
fn write_beside(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    (format, is_mesh, periodic): (MeshFormat, bool, &WrittenPeriodic),
) -> Result<()> {
    let has_lines = matches!(
        format,
        MeshFormat::Medit
            | MeshFormat::MeditBinary
            | MeshFormat::Gmsh
            | MeshFormat::Gmsh22
            | MeshFormat::Abaqus
            | MeshFormat::TetGen
    );
    // TetGen's files have edges and no points.
    let lacks_points = format == MeshFormat::TetGen && !mesh.embedded().points.is_empty();
    if (!has_lines || lacks_points) && is_mesh {
        write_list(mesh, outputs, out)?;
    }
    if !matches!(format, MeshFormat::Gmsh | MeshFormat::Numpy) {
        periodic.write_list(mesh, outputs, out)?;
    }
    Ok(())
}
