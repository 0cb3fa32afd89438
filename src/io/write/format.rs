//! Kinds of mesh files, by the endings of their names.

use std::path::Path;

/// A kind of mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFormat {
    /// VTK XML, the boundary in a second file `NAME_boundary.vtu`.
    Vtu,
    /// VTKHDF 2, a partition for each sub-domain, boundary and interfaces in a second file `NAME_boundary.vtkhdf`.
    VtkHdf,
    /// MEDIT text.
    Medit,
    /// MEDIT binary, version 4.
    MeditBinary,
    /// Gmsh 4.1 with entities and partitions.
    Gmsh,
    /// Gmsh 2.2 binary, for programs that read no other.
    Gmsh22,
    /// OpenFOAM's `constant/polyMesh` in the folder of `NAME.foam`; in pieces `processorN/constant/polyMesh`.
    OpenFoam,
    /// MFEM 1.3, one mesh; in pieces `NAME.000000` and so on, a file for each process.
    Mfem,
    /// TetGen: `NAME.node`, `NAME.ele` and `NAME.face`.
    TetGen,
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

/// Words of the formats: each is also the ending of names, but for `msh22`.
const WORDS: &[(&str, MeshFormat)] = &[
    ("vtu", MeshFormat::Vtu),
    ("pvtu", MeshFormat::Pvtu),
    ("vtkhdf", MeshFormat::VtkHdf),
    ("foam", MeshFormat::OpenFoam),
    ("msh", MeshFormat::Gmsh),
    ("msh22", MeshFormat::Gmsh22),
    ("mesh", MeshFormat::Medit),
    ("meshb", MeshFormat::MeditBinary),
    ("mfem", MeshFormat::Mfem),
    ("ele", MeshFormat::TetGen),
    ("inp", MeshFormat::Abaqus),
    ("npy", MeshFormat::Numpy),
    #[cfg(feature = "parquet")]
    ("parquet", MeshFormat::Parquet),
    ("json", MeshFormat::Topology),
];

impl MeshFormat {
    /// The format a file name's extension tells.
    pub fn of_extension(path: &Path) -> Option<Self> {
        Self::of_word(&path.extension()?.to_str()?.to_ascii_lowercase())
    }

    /// The format of this word: an ending without its dot, or `msh22`.
    pub fn of_word(word: &str) -> Option<Self> {
        let row = WORDS.iter().find(|row| row.0 == word)?;
        Some(row.1)
    }

    /// The word of this format.
    pub fn word(self) -> &'static str {
        let row = WORDS.iter().find(|row| row.1 == self);
        row.expect("every format has a word").0
    }

    /// Whether it can be written as text.
    pub fn has_text(self) -> bool {
        matches!(self, Self::Gmsh | Self::OpenFoam) || self.is_text()
    }

    /// Whether it is never anything but text.
    fn is_text(self) -> bool {
        matches!(
            self,
            Self::Medit | Self::Abaqus | Self::Mfem | Self::TetGen | Self::Topology
        )
    }

    /// Whether elements of second order are written in it.
    pub fn has_second_order(self) -> bool {
        matches!(self, Self::Vtu | Self::Pvtu | Self::VtkHdf | Self::Abaqus)
    }

    /// Whether it can hold faces without tetrahedra.
    pub fn holds_faces_alone(self) -> bool {
        matches!(self, Self::Vtu | Self::VtkHdf)
    }

    /// Whether pieces in it carry numbers in the whole, so that all of it is open while they are written.
    pub fn numbers_globally(self) -> bool {
        matches!(self, Self::OpenFoam | Self::Gmsh | Self::Mfem)
    }

    /// Whether it is one file that is written from its beginning to its end.
    pub fn is_stream(self) -> bool {
        matches!(
            self,
            Self::Medit
                | Self::MeditBinary
                | Self::Gmsh
                | Self::Gmsh22
                | Self::Mfem
                | Self::Abaqus
                | Self::Topology
        )
    }
}

/// Endings of the formats.
pub const ENDINGS: &str = if cfg!(feature = "parquet") {
    ".vtu, .pvtu, .vtkhdf, .foam, .msh, .mesh, .meshb, .mfem, .ele, .inp, .npy, .parquet or .json"
} else {
    ".vtu, .pvtu, .vtkhdf, .foam, .msh, .mesh, .meshb, .mfem, .ele, .inp, .npy or .json (.parquet needs a build with the feature `parquet`)"
};
