//! Kinds of mesh files, by the endings of their names.

use std::path::Path;

/// A kind of mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFormat {
    /// VTK XML, the boundary in a second file `NAME_boundary.vtu`.
    Vtu,
    /// MEDIT text.
    Medit,
    /// MEDIT binary, version 4.
    MeditBinary,
    /// Gmsh 2.2 binary.
    Gmsh,
    /// Abaqus input.
    Abaqus,
    /// NumPy arrays, a file each: `NAME_points.npy`, `NAME_tets.npy` and others.
    Numpy,
    /// VTK XML, each sub-domain a piece in a file of its own.
    Pvtu,
    /// Apache Parquet: of each sub-domain the tetrahedra `NAME_00007.parquet` and the vertices `NAME_00007_vertices.parquet`.
    #[cfg(feature = "parquet")]
    Parquet,
    /// JSON: who neighbors whom, and the vertices and faces that each two sub-domains share.
    Topology,
}

impl MeshFormat {
    /// The format a file name's extension tells.
    pub fn of_extension(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "vtu" => Self::Vtu,
            "mesh" => Self::Medit,
            "meshb" => Self::MeditBinary,
            "msh" => Self::Gmsh,
            "inp" => Self::Abaqus,
            "npy" => Self::Numpy,
            "pvtu" => Self::Pvtu,
            #[cfg(feature = "parquet")]
            "parquet" => Self::Parquet,
            "json" => Self::Topology,
            _ => return None,
        })
    }
}

/// Endings of the formats.
pub const ENDINGS: &str = if cfg!(feature = "parquet") {
    ".vtu, .pvtu, .mesh, .meshb, .msh, .inp, .npy, .parquet or .json"
} else {
    ".vtu, .pvtu, .mesh, .meshb, .msh, .inp, .npy or .json (.parquet needs a build with the feature `parquet`)"
};
