//! Meshes and surfaces as files for other programs.
//!
//! A store becomes one conforming mesh: vertices and tetrahedra numbered densely in (sub-domain,
//! local) order, a vertex that several sub-domains share once, and every input triangle that bounds
//! a filled region as a boundary face, in the order of the input. Or each sub-domain becomes a mesh of its own, numbered as in the
//! store, and the faces that it shares with others are boundary faces too. All is streamed: memory does not
//! grow with the mesh. Files are made in a folder beside their place and renamed when they are whole
//! and synced. Coordinates are never rounded.
//!
//! Reading order: [`export`] (what is written, in which format), `pieces` (a file for each sub-domain), `merged` (sub-domains as one mesh),
//! `numbering` (shared vertices), `faces` (its boundary), `draft` and `stream` (files), then one file per format.

mod abaqus;
mod defects;
mod draft;
mod error;
mod faces;
mod gmsh;
mod medit;
mod merged;
mod npy;
mod npy_columns;
mod numbering;
#[cfg(feature = "parquet")]
mod parquet;
mod pieces;
mod selected;
mod stream;
mod surface;
#[cfg(test)]
mod tests;
mod topology;
mod vtu;
mod vtu_boundary;
mod vtu_layout;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub use defects::defects;
pub use error::WriteError;
pub use npy::{NpyField, NpyTable, TextFile, bytes};
pub use selected::{SelectedTet, SelectedVtu};
pub use surface::{SurfaceReport, surface};

use crate::storage::attempt;
use crate::store::{Catalog, StoreError};
use draft::Draft;
use merged::{FaceSet, Merged, Progress, Scope};

type Result<T> = std::result::Result<T, WriteError>;

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

/// What was exported.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ExportReport {
    /// Each file with its length in bytes.
    pub files: Vec<(PathBuf, u64)>,
    pub vertices: u64,
    pub tets: u64,
    /// Boundary faces.
    pub triangles: u64,
}

/// Endings of the formats.
pub const ENDINGS: &str = if cfg!(feature = "parquet") {
    ".vtu, .pvtu, .mesh, .meshb, .msh, .inp, .npy, .parquet or .json"
} else {
    ".vtu, .pvtu, .mesh, .meshb, .msh, .inp, .npy or .json (.parquet needs a build with `--features parquet`)"
};

/// What of a mesh is written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Ranks of sub-domains; none stands for all. What bounds them towards others is boundary.
    pub subdomains: BTreeSet<u32>,
    /// Each sub-domain in a file of its own.
    pub pieces: bool,
    pub content: Content,
}

/// Which elements are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// Tetrahedra and boundary faces.
    #[default]
    Mesh,
    /// Input triangles and interface faces; only as [`MeshFormat::Vtu`].
    Boundary,
    /// Interface faces; only as [`MeshFormat::Vtu`].
    Interfaces,
}

/// Writes what `selection` says of the finished mesh of `store` to `out` in the format its extension tells, replacing what is there.
///
/// Holds about `memory_bytes`, and tells progress as (done, total) in records read. The files depend on the
/// mesh alone. Errors: [`WriteError`]; no file of `out`'s name is touched before all are whole.
pub fn export(
    store: &mut Catalog,
    out: &Path,
    selection: &Selection,
    memory_bytes: usize,
    tell: &dyn Fn(u64, u64),
) -> Result<ExportReport> {
    let unknown = |known| WriteError::UnknownFormat {
        path: out.to_owned(),
        known,
    };
    let format = MeshFormat::of_extension(out).ok_or_else(|| unknown(ENDINGS))?;
    if selection.content != Content::Mesh && format != MeshFormat::Vtu {
        return Err(unknown(
            ".vtu, the only format for faces without tetrahedra",
        ));
    }
    attempt(|| {
        let catalog = &mut *store;
        let path = catalog.dir().to_owned();
        if !catalog.state()?.is_finished() {
            return Err(StoreError::Unfinished { path }.into());
        }
        for &rank in &selection.subdomains {
            store.subdomain(rank)?;
        }
        let mut draft = Draft::new(out)?;
        let counts = match format {
            MeshFormat::Topology => topology::write(store, &mut draft, out, memory_bytes)?,
            #[cfg(feature = "parquet")]
            MeshFormat::Parquet => {
                parquet::write(store, &mut draft, out, selection, memory_bytes, tell)?
            }
            MeshFormat::Pvtu => {
                pieces::write(store, &mut draft, out, selection, memory_bytes, tell)?
            }
            _ if selection.pieces => {
                pieces::write(store, &mut draft, out, selection, memory_bytes, tell)?
            }
            _ => {
                let scope = Scope {
                    ranks: &selection.subdomains,
                    faces: match selection.content {
                        Content::Mesh => FaceSet::Skin,
                        Content::Boundary => FaceSet::SkinAndInterfaces,
                        Content::Interfaces => FaceSet::Interfaces,
                    },
                };
                let progress = Progress::new(tell);
                let dir = draft.dir().to_owned();
                let mut mesh = Merged::open(store, scope, &dir, memory_bytes, progress)?;
                write(format, selection.content, &mut mesh, &mut draft, out)?
            }
        };
        Ok(ExportReport {
            vertices: counts.vertices,
            tets: counts.tets,
            triangles: counts.triangles,
            files: draft.publish()?,
        })
    })?
}

/// What was written.
#[derive(Clone, Copy, Default)]
struct FileCounts {
    vertices: u64,
    tets: u64,
    triangles: u64,
}

/// Writes a mesh as one file, and what belongs to it.
fn write(
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
    mesh.tell_end();
    Ok(counts)
}
