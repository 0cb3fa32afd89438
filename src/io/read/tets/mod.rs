//! Tetrahedral meshes of other programs, read as streams into arrays that may spill to disk.
//!
//! Every reader fills a [`RawMesh`]: vertices, tetrahedra with their region and part, triangles with their label. Vertex numbers of a file
//! become positions. Second-order tetrahedra are taken by their corners. Lines and points are counted; other volume cells are errors.

mod abaqus;
mod companion;
mod gmsh;
mod gmsh_data;
mod gmsh_sink;
mod hdf_rows;
mod medit;
mod npy;
mod numbers;
mod raw;
#[cfg(test)]
mod tests;
mod tetgen;
mod vtkhdf;
mod vtu;

use std::path::Path;

use super::feed::Feed;
use super::open::open;
use super::{FilePlace, Format, ReadError, ReadFault, Result};
pub(super) use gmsh_sink::TetSink;
pub use npy::tets_file;
pub use raw::{Groups, MeshFields, RawField, RawMesh};

const ENDINGS: ReadFault = ReadFault::UnknownFormat(
    "name the file .mesh, .meshb, .msh, .vtu, .vtkhdf, .ele, .inp or .npy after what it holds, with .gz or .zst behind it where it is packed",
);

/// Reads the mesh in a file into the memory and scratch files of `mesh`.
///
/// # Errors
/// The first fault of the file with its place. Unwinds where the disk fails.
pub fn read_tets(path: &Path, fields: MeshFields, mesh: &mut RawMesh) -> Result<()> {
    let place = FilePlace::new(path);
    let format = Format::from_extension(path);
    let limit = mesh.space.cap() / 4;
    mesh.stem = super::stem(path);
    let is = |ending| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    if is("npy") || is("vtkhdf") {
        match is("npy") {
            true => npy::read(path, fields, mesh)?,
            false => companion::read_both(path, vtkhdf::open, fields, mesh)?,
        }
        mesh.end();
        return Ok(());
    }
    let only_arrays = |name: &Option<&str>| {
        let what =
            format!("the array {:?} of cells from a format without arrays", name.unwrap_or(""));
        place.refuse(ReadFault::Unsupported(what))
    };
    if !matches!(format, Some(Format::VtkXml))
        && let Some(name) = [fields.region, fields.part.filter(|_| format != Some(Format::Gmsh))]
            .iter()
            .find(|f| f.is_some())
    {
        return Err(only_arrays(name));
    }
    match format {
        Some(Format::Medit) => medit::read(open(path, limit)?, false, mesh)?,
        Some(Format::MeditBinary) => medit::read(open(path, limit)?, true, mesh)?,
        Some(Format::Gmsh) => gmsh::read(open(path, limit)?, fields, mesh)?,
        Some(Format::VtkXml) => {
            let open = |path: &Path, cap| vtu::Grid::open(path, cap / 16);
            companion::read_both(path, open, fields, mesh)?;
        }
        Some(Format::TetgenEle) => tetgen::read(path, limit, mesh)?,
        Some(Format::Abaqus) => abaqus::read(open(path, limit)?, mesh)?,
        _ => return Err(place.refuse(ENDINGS)),
    }
    mesh.end();
    Ok(())
}
