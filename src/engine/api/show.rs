//! Files for other programs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::store::open_finished;
use super::targets::{check_target, inputs_of};
use super::{Error, Store, guarded};
use tetdb_io::write::{self, Content, ElementOrder, ExportSelection};
pub use tetdb_io::write::{ENDINGS as MESH_ENDINGS, MeshFormat, Share, Writers};

/// A writer holds no more than this, however large the cap.
const MEMORY_MAX: u64 = 512 << 20;

/// What of a mesh is written; by default all of it, in one file.
#[derive(Clone, Debug, Default)]
pub struct ExportOptions {
    selection: ExportSelection,
    over_inputs: bool,
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

    /// Also writes over the surface the store was made from. Default: such a file is refused.
    pub fn over_inputs(mut self) -> Self {
        self.over_inputs = true;
        self
    }

    /// The format of `out`, if it can hold what these options select. Nothing is written.
    ///
    /// Errors: `unknown-format`, `format-limit`.
    pub fn check(&self, out: impl AsRef<Path>) -> Result<MeshFormat, Error> {
        Ok(write::check(out.as_ref(), &self.selection)?)
    }

    /// True if each sub-domain has files of its own, which processes can [share](Self::share).
    pub fn is_in_pieces(&self, format: MeshFormat) -> bool {
        self.selection.in_pieces(format)
    }

    /// True if several processes can write the one file together; see [`Store::export_together`].
    pub fn is_shared_file(&self, format: MeshFormat) -> bool {
        self.selection.is_shared_file(format)
    }
}

impl Store {
    /// Writes the mesh for another program, in the format the ending of `out` names: `.vtu`, `.pvtu`, `.vtkhdf`, `.foam` (OpenFOAM), `.msh`,
    /// `.mesh`, `.meshb`, `.mfem`, `.ele` (TetGen), `.inp`, `.npy`, `.json` (who neighbors whom), and `.parquet` with that feature.
    ///
    /// Streamed; nothing has its name before it is whole. Errors: `usage` for a folder or the surface the store was made from; `unknown-format`, `format-limit`, `disk-full`; damage.
    pub fn export(
        &self,
        out: impl AsRef<Path>,
        options: &ExportOptions,
    ) -> Result<Exported, Error> {
        self.write_export(out.as_ref(), options, None)
    }

    /// [`Store::export`] as one of several processes that write one file together, each of which calls it.
    ///
    /// Files and counts are those of the first. Errors: as [`Store::export`], also those of other processes.
    pub fn export_together(
        &self,
        out: impl AsRef<Path>,
        options: &ExportOptions,
        writers: &dyn Writers,
    ) -> Result<Exported, Error> {
        self.write_export(out.as_ref(), options, Some(writers))
    }

    fn write_export(
        &self,
        out: &Path,
        options: &ExportOptions,
        writers: Option<&dyn Writers>,
    ) -> Result<Exported, Error> {
        let settings = self.settings();
        guarded(settings, || {
            if !options.over_inputs {
                check_target(out, &inputs_of(self.path()))?;
            }
            let memory = (settings.cap()? / 2).min(MEMORY_MAX) as usize;
            let report = write::export_with(
                &mut open_finished(self.path())?,
                (out, &options.selection),
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
        })
    }
}
