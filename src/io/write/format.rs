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
    /// SU2, without regions.
    Su2,
    /// NumPy arrays, a file each: `NAME_points.npy`, `NAME_tets.npy` and others.
    Numpy,
    /// VTK XML, each sub-domain a piece in a file of its own.
    Pvtu,
    /// Apache Parquet: of each sub-domain the tetrahedra `NAME_00007.parquet` and the vertices `NAME_00007_vertices.parquet`.
    #[cfg(feature = "parquet")]
    Parquet,
    /// Exodus II, netCDF classic: a block for each region, a side set for each label.
    Exodus,
    /// XDMF with arrays in `NAME.h5`, the boundary in `NAME_boundary.xdmf` and `.h5`.
    Xdmf,
    /// Nastran bulk data.
    Nastran,
    /// JSON: the neighbors of each sub-domain, and the vertices and faces that each two sub-domains share.
    Topology,
}

/// An ability of some formats: its bit, and its name in messages.
#[derive(Clone, Copy)]
pub(super) struct Ability(u16, &'static str);

pub(super) const TEXT: Ability = Ability(1, "text");
pub(super) const SECOND_ORDER: Ability = Ability(2, "elements of second order");
pub(super) const FACES_ALONE: Ability = Ability(4, "faces without tetrahedra");
pub(super) const SUBDOMAINS: Ability = Ability(8, "sub-domains apart");
pub(super) const REGIONS: Ability = Ability(16, "regions alone");
pub(super) const REGIONS_APART: Ability = Ability(32, "regions of sub-domains apart");
pub(super) const GHOSTS: Ability = Ability(64, "ghost cells");
pub(super) const STREAM: Ability = Ability(128, "stream that is written from beginning to end");

pub(super) const SLITS: Ability = Ability(256, "split sheets");
pub(super) const PARTITIONS: Ability = Ability(512, "partitions that can be one");

/// All formats: the word, which is also the ending of names except for `msh22`, and the abilities.
const FORMATS: &[(&str, MeshFormat, u16)] = {
    use MeshFormat::*;
    const PARTS: u16 = SUBDOMAINS.0 | REGIONS.0 | REGIONS_APART.0;
    const ORDER_2: u16 = SECOND_ORDER.0;
    &[
        ("vtu", Vtu, ORDER_2 | FACES_ALONE.0 | PARTS | SLITS.0),
        ("pvtu", Pvtu, ORDER_2 | PARTS),
        ("vtkhdf", VtkHdf, ORDER_2 | FACES_ALONE.0 | PARTS | PARTITIONS.0),
        // A process of MPI for each sub-domain, also where it has nothing of a region.
        ("foam", OpenFoam, TEXT.0 | SUBDOMAINS.0 | REGIONS.0),
        ("msh", Gmsh, TEXT.0 | ORDER_2 | PARTS | GHOSTS.0 | STREAM.0),
        ("msh22", Gmsh22, PARTS | STREAM.0 | SLITS.0),
        ("mesh", Medit, TEXT.0 | PARTS | STREAM.0 | SLITS.0),
        ("meshb", MeditBinary, PARTS | STREAM.0 | SLITS.0),
        ("mfem", Mfem, TEXT.0 | SUBDOMAINS.0 | REGIONS.0 | STREAM.0 | SLITS.0),
        ("ele", TetGen, TEXT.0 | PARTS | SLITS.0),
        ("inp", Abaqus, TEXT.0 | ORDER_2 | PARTS | STREAM.0 | SLITS.0),
        ("exo", Exodus, ORDER_2 | PARTS | SLITS.0),
        ("xdmf", Xdmf, ORDER_2 | PARTS | SLITS.0),
        ("bdf", Nastran, TEXT.0 | ORDER_2 | PARTS | STREAM.0 | SLITS.0),
        ("su2", Su2, TEXT.0 | PARTS | STREAM.0),
        ("npy", Numpy, PARTS | SLITS.0),
        #[cfg(feature = "parquet")]
        ("parquet", Parquet, SUBDOMAINS.0),
        ("json", Topology, TEXT.0 | STREAM.0),
    ]
};

/// Other endings, each with the word of its format.
const OTHER_ENDINGS: &[(&str, &str)] = &[("e", "exo"), ("nas", "bdf")];

impl MeshFormat {
    /// The format of a file name's extension.
    pub fn from_extension(path: &Path) -> Option<Self> {
        let word = path.extension()?.to_str()?.to_ascii_lowercase();
        let other = OTHER_ENDINGS.iter().find(|row| row.0 == word);
        Self::from_word(other.map_or(&word, |row| row.1))
    }

    /// The format of this word: an ending without its dot, or `msh22`.
    pub fn from_word(word: &str) -> Option<Self> {
        let row = FORMATS.iter().find(|row| row.0 == word)?;
        Some(row.1)
    }

    /// The word of this format.
    pub fn word(self) -> &'static str {
        self.row().0
    }

    fn row(self) -> &'static (&'static str, Self, u16) {
        let row = FORMATS.iter().find(|row| row.1 == self);
        row.expect("every format is in the list")
    }

    /// Nothing if it can this, else what it cannot and which formats can.
    pub(super) fn lacks(self, ability: Ability) -> Option<String> {
        let Ability(bit, noun) = ability;
        if self.row().2 & bit != 0 {
            return None;
        }
        let able = FORMATS.iter().filter(|row| row.2 & bit != 0);
        let words: Vec<_> = able.map(|row| row.0).collect();
        Some(format!("{noun}; these do: {}", words.join(", ")))
    }

    /// Returns whether the format has the values of fields.
    pub fn has_fields(self) -> bool {
        #[cfg(feature = "parquet")]
        if self == Self::Parquet {
            return true;
        }
        let keeps_types = [Self::Vtu, Self::Pvtu, Self::VtkHdf, Self::Xdmf, Self::Numpy];
        keeps_types.contains(&self) || self.has_doubles()
    }

    /// Returns whether the values of fields are doubles, whatever their type.
    pub fn has_doubles(self) -> bool {
        matches!(self, Self::Exodus | Self::Gmsh)
    }

    /// Returns whether pieces of the format have numbers of the whole, so that the whole is open while they are written.
    pub fn numbers_globally(self) -> bool {
        matches!(self, Self::OpenFoam | Self::Gmsh | Self::Mfem)
    }
}

/// Endings of the formats.
pub const ENDINGS: &str = if cfg!(feature = "parquet") {
    ".vtu, .pvtu, .vtkhdf, .xdmf, .exo, .foam, .msh, .mesh, .meshb, .mfem, .ele, .inp, .bdf, .su2, .npy, .parquet or .json"
} else {
    ".vtu, .pvtu, .vtkhdf, .xdmf, .exo, .foam, .msh, .mesh, .meshb, .mfem, .ele, .inp, .bdf, .su2, .npy or .json (.parquet needs a build with the feature `parquet`)"
};
