//! Surface files read as streams: STL, OFF, OBJ, PLY, MEDIT, Gmsh, TetGen, VTK, Abaqus, Nastran, I-DEAS, 3MF, GIFTI; sizes at the vertices of
//! meshes; files of edges and points.
//!
//! A declared count is compared with the length of the file before it is used; every error
//! has its line (text) or byte (binary). Decimal text becomes the nearest double, binary floats
//! become doubles exactly. Polygons are cut into triangles, vertices with identical bits
//! are one.

mod abaqus;
mod cells;
mod element_sets;
mod embedded;
mod embedded_sink;
mod error;
mod feed;
mod fem;
mod field_table;
mod gifti;
mod gmsh;
mod gmsh_numbers;
mod gmsh_old;
mod lengths;
mod medit;
mod medit_numbers;
mod obj;
mod off;
mod open;
mod ply;
mod point_table;
mod sink;
mod sizes;
mod solids;
mod stl;
mod tetgen;
mod tets;
mod three_mf;
mod three_mf_model;
mod unv;
mod volume_cells;
mod vtk;
mod vtk_xml;
mod words;
mod xml;

#[cfg(test)]
mod collection;
#[cfg(test)]
mod tests;

use std::io::BufRead;
use std::path::{Path, PathBuf};

pub use cells::boundary_of;
pub use embedded::{read_seeds, read_wires};
pub use embedded_sink::WireKind;
pub use error::{FilePlace, ReadError, ReadFault, Spot};
use feed::{Feed, Result};
pub use field_table::{FieldTable, FieldValue};
pub use lengths::read_lengths;
pub use open::is_stream;
use open::{is_binary_stl, open, stem, unpacked_name};
pub use point_table::{PointColumns, PointRow, PointTable};
use sink::SurfaceSink;
pub use sizes::{FileSizes, read_sizes, size_files};
pub use tets::{Groups, MeshFields, RawField, RawMesh, read_tets, tets_file};
use volume_cells::VolumeCells;

use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{Surface, SurfaceBuilder, SurfaceError};

/// A kind of surface file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// STL, text or binary.
    Stl,
    /// OFF, the Object File Format.
    Off,
    /// Wavefront OBJ.
    Obj,
    /// PLY, text or binary.
    Ply,
    /// Medit text, `.mesh`.
    Medit,
    /// Medit binary, `.meshb`.
    MeditBinary,
    /// Gmsh, `.msh`.
    Gmsh,
    /// TetGen `.smesh`.
    TetgenSmesh,
    /// TetGen `.poly`.
    TetgenPoly,
    /// TetGen `.ele`, tetrahedra; their boundary is the surface.
    TetgenEle,
    /// Legacy VTK, `.vtk`.
    Vtk,
    /// VTK's XML files, `.vtp` and `.vtu`.
    VtkXml,
    /// Abaqus, `.inp`.
    Abaqus,
    /// Nastran, `.nas` and `.bdf`.
    Nastran,
    /// I-DEAS universal file, `.unv`.
    Unv,
    /// 3MF, `.3mf`.
    ThreeMf,
    /// GIFTI, `.gii`.
    Gifti,
}

impl Format {
    /// The format of a file name's extension; a final `.gz` or `.zst` is skipped.
    pub fn from_extension(path: &Path) -> Option<Self> {
        let path = unpacked_name(path);
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "stl" | "stla" | "stlb" => Self::Stl,
            "off" => Self::Off,
            "obj" => Self::Obj,
            "ply" => Self::Ply,
            "mesh" => Self::Medit,
            "meshb" => Self::MeditBinary,
            "msh" => Self::Gmsh,
            "smesh" => Self::TetgenSmesh,
            "poly" => Self::TetgenPoly,
            "ele" => Self::TetgenEle,
            "vtk" => Self::Vtk,
            "inp" => Self::Abaqus,
            "nas" | "bdf" => Self::Nastran,
            "unv" => Self::Unv,
            "vtp" | "vtu" => Self::VtkXml,
            "3mf" => Self::ThreeMf,
            "gii" => Self::Gifti,
            _ => return None,
        })
    }

    /// Returns whether files of this format can have volume cells.
    fn has_cells(self) -> bool {
        matches!(self, Self::Medit | Self::MeditBinary | Self::Gmsh | Self::TetgenEle)
    }

    /// The format of a file's first bytes, for names without a known extension.
    fn from_head(head: &[u8], length: u64) -> Option<Self> {
        let starts = |word: &str| {
            head.get(..word.len()).is_some_and(|h| h.eq_ignore_ascii_case(word.as_bytes()))
        };
        if starts("ply\n") || starts("ply\r") {
            Some(Self::Ply)
        } else if starts("# vtk DataFile") {
            Some(Self::Vtk)
        } else if starts("$MeshFormat") || starts("$NOD") {
            Some(Self::Gmsh)
        } else if starts("MeshVersionFormatted") {
            Some(Self::Medit)
        } else if starts("OFF") || starts("COFF") || starts("NOFF") {
            Some(Self::Off)
        } else if starts("solid") || is_binary_stl(head, length) {
            Some(Self::Stl)
        } else if starts("PK\x03\x04") {
            Some(Self::ThreeMf)
        } else if starts("v ") {
            Some(Self::Obj)
        } else {
            None
        }
    }
}

/// The kind of solid model, for files without triangles.
fn solid_model(path: &Path, head: &[u8]) -> Option<&'static str> {
    let name = unpacked_name(path);
    let extension = name.extension().unwrap_or_default().to_string_lossy();
    match extension.to_ascii_lowercase().as_str() {
        "step" | "stp" => Some("STEP"),
        "iges" | "igs" => Some("IGES"),
        "brep" | "brp" => Some("BREP"),
        _ if head.starts_with(b"ISO-10303-21") => Some("STEP"),
        _ => None,
    }
}

/// Smaller surfaces are refused: single precision, in which wanted lengths are kept, ends at 1e-38.
const EXTENT_MIN: f64 = 1e-24;

/// Reads files as one surface; with several files, each label begins with the name of its file.
///
/// `cap`: bytes of memory for the surface. Packed files (`.gz`, `.zst`), pipes and `-`, the standard input, are held unpacked while
/// they are read, in at most a quarter of `cap`.
///
/// # Errors
/// The first [`ReadError`], with its file and place; nothing is repaired beyond welding and fanning.
pub fn read_surface(paths: &[PathBuf], cap: u64) -> Result<Surface> {
    read_surface_in(paths, &ScratchSpace::new(cap, std::env::temp_dir()))
}

/// Like [`read_surface`], with the memory and the folder of `space`.
///
/// Behind `boundary-of:` a path names a mesh whose volume cells bound the surface. So it is of a file with volume cells alone.
///
/// # Errors
/// As [`read_surface`]. Unwinds where the disk fails.
pub fn read_surface_in(paths: &[PathBuf], space: &ScratchSpace) -> Result<Surface> {
    let cap = space.cap();
    let mut builder = SurfaceBuilder::within(cap);
    let mut prefixes: Vec<String> = Vec::new();
    for path in paths {
        let inner = boundary_of(path);
        let (path, is_bounded) = (inner.as_deref().unwrap_or(path), inner.is_some());
        let stem = stem(path);
        let prefix = (paths.len() > 1).then(|| unique(&stem, &prefixes));
        prefixes.extend(prefix.clone());
        let cells = match is_bounded {
            true => VolumeCells::bounding(space),
            false => VolumeCells::default(),
        };
        let mut target = SurfaceSink { builder: &mut builder, stem, prefix, cells };
        let read = read_file(path, cap / 4, &mut target);
        if read.is_err() && target.has_cells_alone() && !is_stream(path) {
            target.builder.restart_file();
            target.cells = VolumeCells::bounding(space);
            read_file(path, cap / 4, &mut target)?;
        } else {
            read?;
        }
    }
    let surface = builder.finish();
    let bounds = surface.bounds();
    let extent = (bounds.high - bounds.low).max_element();
    // Validation refuses surfaces of points alone.
    if extent > 0.0 && extent < EXTENT_MIN {
        let place = FilePlace::new(paths.first().map_or(Path::new(""), |path| path));
        return Err(place.refuse(ReadFault::Surface(SurfaceError::TooSmall { extent })));
    }
    Ok(surface)
}

/// Reads a file from memory; messages name it `file`. For tests and fuzzing.
///
/// TetGen files that refer to a separate `.node` file are refused.
///
/// # Errors
/// As [`read_surface`].
pub fn read_memory(format: Format, file: &str, bytes: &[u8]) -> Result<Surface> {
    let mut builder = SurfaceBuilder::new();
    let (stem, cells) = (stem(Path::new(file)), VolumeCells::default());
    let mut target = SurfaceSink { builder: &mut builder, stem, prefix: None, cells };
    target.builder.begin_file(file);
    let feed = Feed::new(file, bytes, bytes.len() as u64);
    read_feed(format, feed, None, bytes.len() as u64 * 16, &mut target)?;
    Ok(builder.finish())
}

const UNKNOWN_FORMAT: ReadFault = ReadFault::UnknownFormat(
    "name the file .stl, .off, .obj, .ply, .mesh, .meshb, .msh, .smesh, .poly, .ele, .vtk, .vtp, .vtu, .inp, .nas, .bdf, .unv, .3mf or .gii after what it holds, with .gz or .zst behind it where it is packed",
);

fn unique(stem: &str, taken: &[String]) -> String {
    let mut name = stem.to_owned();
    let mut n = 1;
    while taken.contains(&name) {
        n += 1;
        name = format!("{stem}~{n}");
    }
    name
}

fn read_file(path: &Path, limit: u64, target: &mut SurfaceSink) -> Result<()> {
    let place = FilePlace::new(path);
    if let Some(kind) = solid_model(path, b"") {
        return Err(place.refuse(ReadFault::SolidModel(kind)));
    }
    let mut feed = open(path, limit)?;
    let format = match Format::from_extension(path) {
        Some(format) => format,
        None => {
            let (length, head) = (feed.len, feed.head()?);
            let found = Format::from_head(head, length);
            let kind = solid_model(path, head);
            found.ok_or_else(|| place.refuse(kind.map_or(UNKNOWN_FORMAT, ReadFault::SolidModel)))?
        }
    };
    if target.cells.are_wanted() && !format.has_cells() {
        let what = "the boundary of volume cells in a file that has none by its format".to_owned();
        return Err(place.refuse(ReadFault::Unsupported(what)));
    }
    target.builder.begin_file(feed.file());
    let nodes = matches!(format, Format::TetgenSmesh | Format::TetgenPoly | Format::TetgenEle)
        .then(|| unpacked_name(path).with_extension("node"));
    read_feed(format, feed, nodes.as_deref(), limit, target)
}

fn read_feed<R: BufRead>(
    format: Format,
    feed: Feed<R>,
    nodes: Option<&Path>,
    limit: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    if feed.len == 0 {
        return Err(feed.empty());
    }
    match format {
        Format::Stl => stl::read(feed, target),
        Format::Off => off::read(feed, target),
        Format::Obj => obj::read(feed, target),
        Format::Ply => ply::read(feed, target),
        Format::Medit => medit::read(feed, false, target),
        Format::MeditBinary => medit::read(feed, true, target),
        Format::Gmsh => gmsh::read(feed, target),
        Format::TetgenEle => cells::read_ele(feed, nodes, limit, target),
        Format::TetgenSmesh => tetgen::read(feed, tetgen::FacetLayout::Smesh, nodes, limit, target),
        Format::Vtk => vtk::read_surface(feed, target),
        Format::Abaqus => abaqus::read_abaqus(feed, target),
        Format::Nastran => fem::read_nastran(feed, target),
        Format::Unv => unv::read_unv(feed, target),
        Format::VtkXml => vtk_xml::read(feed, limit, target),
        Format::ThreeMf => three_mf::read(feed, limit, target),
        Format::Gifti => gifti::read(feed, limit, target),
        Format::TetgenPoly => tetgen::read(feed, tetgen::FacetLayout::Poly, nodes, limit, target),
    }
}
