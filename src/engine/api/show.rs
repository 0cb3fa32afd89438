//! Files for other programs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::store::open_finished;
use super::targets::{check_target, inputs_of};
use super::{Error, Settings, Store, guarded};
use tetdb_io::write::{self, Content, ElementOrder, ExportSelection, MeshFormat, Share, Writers};

/// A writer holds no more than this, however large the cap.
const MEMORY_MAX: u64 = 512 << 20;

/// What of a mesh is written; by default all of it, in one file.
#[derive(Clone, Debug, Default)]
pub struct ExportOptions {
    selection: ExportSelection,
}

/// What was written.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Exported {
    /// Each file with its length in bytes.
    pub files: Vec<(PathBuf, u64)>,
    /// Vertices.
    pub vertices: u64,
    /// Tetrahedra.
    pub tets: u64,
    /// Boundary faces.
    pub triangles: u64,
}

impl ExportOptions {
    /// All of the mesh, in one file.
    pub fn new() -> Self {
        Self::default()
    }

    /// Only these sub-domains; what bounds them towards others is boundary.
    pub fn subdomains(mut self, ranks: &[u32]) -> Self {
        self.selection.subdomains = ranks.iter().copied().collect::<BTreeSet<_>>();
        self
    }

    /// Only these regions, by their numbers; what bounds them is boundary.
    pub fn regions(mut self, regions: &[u32]) -> Self {
        self.selection.regions = regions.iter().copied().collect();
        self
    }

    /// Each sub-domain in a file of its own.
    pub fn pieces(mut self) -> Self {
        self.selection.pieces = true;
        self
    }

    /// Of the pieces the `number`-th of so many shares, from 1, for processes that together write all of them.
    pub fn share(mut self, number: u32, of: u32) -> Self {
        self.selection.share = Some(Share { number, of });
        self
    }

    /// Only input triangles and interface faces; `.vtu` and `.vtkhdf`.
    pub fn boundary(mut self) -> Self {
        self.selection.content = Content::Boundary;
        self
    }

    /// Only interface faces; `.vtu` and `.vtkhdf`.
    pub fn interfaces(mut self) -> Self {
        self.selection.content = Content::Interfaces;
        self
    }

    /// This format, whatever the name ends with.
    pub fn format(mut self, format: MeshFormat) -> Self {
        self.selection.format = Some(format);
        self
    }

    /// Text instead of binary numbers, where the format has both.
    pub fn ascii(mut self) -> Self {
        self.selection.ascii = true;
        self
    }

    /// Elements with the middles of edges as nodes: tetrahedra of ten, triangles of six; `.vtu`, `.pvtu`, `.vtkhdf`, `.msh` and `.inp`.
    pub fn second_order(mut self) -> Self {
        self.selection.order = ElementOrder::Second;
        self
    }

    /// Sheets as slits: their vertices once for each side, their triangles boundary of both; the pairs in `NAME_pairs.csv`.
    pub fn split_sheets(mut self) -> Self {
        self.selection.split_sheets = true;
        self
    }

    /// For each partition the tetrahedra of others that touch it; `.msh`.
    pub fn ghosts(mut self) -> Self {
        self.selection.ghosts = true;
        self
    }
}

impl Store {
    /// Writes the mesh for another program, in the format the ending of `out` names: `.vtu`, `.pvtu`, `.vtkhdf`, `.foam` (OpenFOAM), `.msh`,
    /// `.mesh`, `.meshb`, `.mfem`, `.ele` (TetGen), `.inp`, `.npy`, `.json` (who neighbors whom), and `.parquet` with that feature.
    ///
    /// Streamed; nothing has its name before it is whole. Errors: `usage` for a folder or the surface the store was made from; `unknown-format`, `format-limit`, `disk-full`; damage.
    #[doc(hidden)]
    pub fn export(
        &self,
        out: impl AsRef<Path>,
        options: &ExportOptions,
    ) -> Result<Exported, Error> {
        guarded(self.settings(), || {
            check_target(out.as_ref(), &inputs_of(self.path()))?;
            export(self.path(), out.as_ref(), &options.selection, self.settings())
        })
    }
}

/// What regions 1, 2, … of a finished store are called.
#[doc(hidden)]
pub fn region_names(store: &Path) -> Result<Vec<String>, Error> {
    Ok(open_finished(store)?.region_names()?)
}

/// Writes one file, and what belongs to it.
#[doc(hidden)]
pub fn export(
    store: &Path,
    out: &Path,
    selection: &ExportSelection,
    settings: &Settings,
) -> Result<Exported, Error> {
    export_with(store, (out, selection), settings, None)
}

/// The same, as one of several processes that write the file together.
#[doc(hidden)]
pub fn export_with(
    store: &Path,
    (out, selection): (&Path, &ExportSelection),
    settings: &Settings,
    writers: Option<&dyn Writers>,
) -> Result<Exported, Error> {
    let mut catalog = open_finished(store)?;
    let memory = (settings.cap()? / 2).min(MEMORY_MAX) as usize;
    let what = (out, selection);
    let report = write::export_with(
        &mut catalog,
        what,
        memory,
        &|done, total| settings.count("export", done, total, "records"),
        writers,
    )?;
    Ok(Exported {
        files: report.files,
        vertices: report.vertices,
        tets: report.tets,
        triangles: report.triangles,
    })
}
