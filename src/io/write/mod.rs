//! Meshes and surfaces as files for other programs.
//!
//! A store becomes one conforming mesh: vertices and tetrahedra numbered densely in (sub-domain,
//! local) order, a vertex that several sub-domains share once, and every input triangle that bounds
//! a filled region as a boundary face, in the order of the input. All is streamed: memory does not
//! grow with the mesh. Files are made in a folder beside their place and renamed when they are whole
//! and synced. Coordinates are never rounded.
//!
//! Reading order: [`export`] (which format), `merged` (the sub-domains as one mesh), `numbering`
//! (shared vertices), `faces` (input triangles), `draft` and `stream` (files), then one file per format.

mod abaqus;
mod defects;
mod draft;
mod error;
mod faces;
mod gmsh;
mod medit;
mod merged;
mod npy;
mod numbering;
mod selected;
mod stream;
mod surface;
#[cfg(test)]
mod tests;
mod vtu;
mod vtu_boundary;
mod vtu_layout;

use std::path::{Path, PathBuf};

pub use defects::defects;
pub use error::WriteError;
pub use npy::{NpyField, NpyTable, TextFile};
pub use selected::{SelectedTet, SelectedVtu};
pub use surface::{SurfaceReport, surface};

use crate::catalog::Store;
use crate::store::attempt;
use draft::Draft;
use merged::{Merged, Progress};

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

/// Writes the finished mesh of `store` to `out` in the format its extension tells, replacing what is there.
///
/// Holds about `memory_bytes`, and tells progress as (done, total) in records read. The files depend on the
/// mesh alone. Errors: [`WriteError`]; no file of `out`'s name is touched before all are whole.
pub fn export(
    store: &mut Store,
    out: &Path,
    memory_bytes: usize,
    tell: &dyn Fn(u64, u64),
) -> Result<ExportReport> {
    let format = MeshFormat::of_extension(out).ok_or_else(|| WriteError::UnknownFormat {
        path: out.to_owned(),
        known: ".vtu, .mesh, .meshb, .msh or .inp",
    })?;
    attempt(|| export_as(format, store, out, memory_bytes, tell))?
}

fn export_as(
    format: MeshFormat,
    store: &mut Store,
    out: &Path,
    memory_bytes: usize,
    tell: &dyn Fn(u64, u64),
) -> Result<ExportReport> {
    let mut draft = Draft::new(out)?;
    let progress = Progress::new(tell);
    let mut mesh = Merged::open(store, draft.dir(), memory_bytes, progress)?;
    match format {
        MeshFormat::Vtu => vtu::write(&mut mesh, &mut draft, out)?,
        MeshFormat::Medit => medit::write_text(&mut mesh, &mut draft, out)?,
        MeshFormat::MeditBinary => medit::write_binary(&mut mesh, &mut draft, out)?,
        MeshFormat::Gmsh => gmsh::write(&mut mesh, &mut draft, out)?,
        MeshFormat::Abaqus => abaqus::write(&mut mesh, &mut draft, out)?,
    }
    mesh.tell_end();
    Ok(ExportReport {
        vertices: mesh.n_vertices(),
        tets: mesh.n_tets(),
        triangles: mesh.n_faces(),
        files: draft.publish()?,
    })
}
