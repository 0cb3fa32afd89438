//! Tetrahedral meshes of other programs, read as streams into arrays that may spill to disk.
//!
//! Every reader fills a [`RawMesh`]: vertices, tetrahedra with their region and part, triangles with their label. Vertex numbers of a file
//! become positions. Second-order tetrahedra are taken by their corners. Lines and points are counted; other volume cells are errors.

mod medit;
mod raw;

use std::path::Path;

use super::feed::Feed;
use super::open::open;
use super::{FilePlace, Format, ReadFault, Result};
pub use raw::{Groups, RawMesh};

/// How a mesh file is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshFields<'a> {
    /// The array of cells that gives parts.
    pub part: Option<&'a str>,
    /// The array of cells that gives regions.
    pub region: Option<&'a str>,
}

const ENDINGS: ReadFault = ReadFault::UnknownFormat(
    "name the file .mesh, .meshb, .msh, .vtu, .ele, .inp or .npy after what it holds, with .gz or .zst behind it where it is packed",
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
    let _ = fields;
    match format {
        Some(Format::Medit) => medit::read(open(path, limit)?, false, mesh),
        Some(Format::MeditBinary) => medit::read(open(path, limit)?, true, mesh),
        _ => Err(place.refuse(ENDINGS)),
    }
}
