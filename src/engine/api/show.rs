//! Export of meshes to files for other programs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::store::open_finished;
use super::targets::{check_target, inputs_of};
use super::{Error, Store, guarded};
use tetdb_io::write::{self, Content, ElementOrder, ExportSelection};
pub use tetdb_io::write::{ENDINGS as MESH_ENDINGS, MeshFormat, Share, Writers};
use tetdb_store::store::Catalog;

/// Largest memory of a writer, whatever the cap.
const MEMORY_MAX: u64 = 512 << 20;

/// Why a file of another format has no fields.
const FIELD_FORMATS: &str =
    "fields are written to .vtu, .pvtu, .vtkhdf, .xdmf, .exo, .msh, .npy and .parquet";

/// Options of an export. Default: the whole mesh, in one file.
#[derive(Clone, Debug, Default)]
pub struct ExportOptions {
    selection: ExportSelection,
    over_inputs: bool,
}

/// Files and counts of an export.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Exported {
    /// Each file with its length in bytes.
    pub files: Vec<(PathBuf, u64)>,
    /// Number of vertices.
    pub vertices: u64,
    /// Number of tetrahedra.
    pub tets: u64,
    /// Number of boundary faces.
    pub triangles: u64,
}

impl ExportOptions {
    /// Exports the whole mesh, in one file.
    pub fn new() -> Self {
        Self::default()
    }

    /// Exports only these sub-domains. Their faces towards other sub-domains become boundary.
    pub fn subdomains(mut self, ranks: &[u32]) -> Self {
        self.selection.subdomains = ranks.iter().copied().collect::<BTreeSet<_>>();
        self
    }

    /// Exports only these regions, by number. Their faces towards other regions become boundary.
    pub fn regions(mut self, regions: &[u32]) -> Self {
        self.selection.regions = regions.iter().copied().collect();
        self
    }

    /// Writes each sub-domain to a file of its own.
    pub fn pieces(mut self) -> Self {
        self.selection.pieces = true;
        self
    }

    /// Writes only share `number` of the pieces, from 1, out of `of` shares. Processes that write all shares together write all pieces.
    pub fn share(mut self, number: u32, of: u32) -> Self {
        self.selection.share = Some(Share { number, of });
        self
    }

    /// Exports only input triangles and interface faces; for `.vtu` and `.vtkhdf`.
    pub fn boundary(mut self) -> Self {
        self.selection.content = Content::Boundary;
        self
    }

    /// Exports only interface faces; for `.vtu` and `.vtkhdf`.
    pub fn interfaces(mut self) -> Self {
        self.selection.content = Content::Interfaces;
        self
    }

    /// Sets the format, whatever the file name ends with.
    pub fn format(mut self, format: MeshFormat) -> Self {
        self.selection.format = Some(format);
        self
    }

    /// Writes all sub-domains as one partition, each vertex once; for `.vtkhdf`, with cells of VTK's Lagrange kinds. DOLFINx asks for it.
    pub fn one_partition(mut self) -> Self {
        self.selection.one_partition = true;
        self
    }

    /// Writes numbers as text instead of binary, if the format has both.
    pub fn ascii(mut self) -> Self {
        self.selection.ascii = true;
        self
    }

    /// Writes elements with nodes in the middle of edges: 10 for a tetrahedron, 6 for a triangle. For `.vtu`, `.pvtu`, `.vtkhdf`, `.xdmf`,
    /// `.exo`, `.msh`, `.inp` and `.bdf`.
    pub fn second_order(mut self) -> Self {
        self.selection.order = ElementOrder::Second;
        self
    }

    /// Writes sheets as slits. Vertices of a sheet appear once for each side, and its triangles are boundary of both sides. The pairs
    /// are listed in `NAME_pairs.csv`.
    pub fn split_sheets(mut self) -> Self {
        self.selection.split_sheets = true;
        self
    }

    /// Adds to each partition the tetrahedra of others that touch it; for `.msh`.
    pub fn ghosts(mut self) -> Self {
        self.selection.ghosts = true;
        self
    }

    /// Allows an export to overwrite the surface that the store was made from. Default: such a file is refused.
    pub fn over_inputs(mut self) -> Self {
        self.over_inputs = true;
        self
    }

    /// The format of `out`, if it can hold the selected content. Nothing is written.
    ///
    /// Errors: `unknown-format`, `format-limit`.
    pub fn check(&self, out: impl AsRef<Path>) -> Result<MeshFormat, Error> {
        Ok(write::check(out.as_ref(), &self.selection)?)
    }

    /// Returns whether each sub-domain has files of its own, which processes can [share](Self::share).
    pub fn is_in_pieces(&self, format: MeshFormat) -> bool {
        self.selection.in_pieces(format)
    }

    /// Returns whether several processes can write the one file together; see [`Store::export_together`].
    pub fn is_shared_file(&self, format: MeshFormat) -> bool {
        self.selection.is_shared_file(format)
    }
}

impl Store {
    /// Writes the mesh for another program. The ending of `out` selects the format.
    ///
    /// Endings: `.vtu`, `.pvtu`, `.vtkhdf`, `.xdmf`, `.exo` and `.e` (Exodus II), `.foam` (OpenFOAM), `.msh`, `.mesh`, `.meshb`, `.mfem`, `.ele` (TetGen),
    /// `.inp`, `.bdf` and `.nas` (Nastran), `.su2`, `.npy`, `.json` (neighbors of sub-domains), and `.parquet` with that feature. The mesh is streamed. A file gets its name only when it is
    /// complete.
    ///
    /// Errors: `usage` for a folder or the surface that the store was made from; `unknown-format`, `format-limit`, `disk-full`; damage.
    pub fn export(
        &self,
        out: impl AsRef<Path>,
        options: &ExportOptions,
    ) -> Result<Exported, Error> {
        self.write_export(out.as_ref(), options, None)
    }

    /// Like [`Store::export`], by several processes that write one file together. Each of them makes this call.
    ///
    /// Returns the files and counts of the first process. Errors: as [`Store::export`], including those of other processes.
    pub fn export_together(
        &self,
        out: impl AsRef<Path>,
        options: &ExportOptions,
        writers: &dyn Writers,
    ) -> Result<Exported, Error> {
        self.write_export(out.as_ref(), options, Some(writers))
    }

    /// Says which fields a file will not have, and whether it lacks periodic pairs.
    fn note_left_out(
        &self,
        catalog: &mut Catalog,
        out: &Path,
        selection: &ExportSelection,
    ) -> Result<(), Error> {
        let format = write::check(out, selection)?;
        let has_midpoints = selection.order == ElementOrder::Second;
        let parts = catalog.field_parts()?;
        let mut lacking: Vec<(&str, Vec<String>)> = Vec::new();
        for field in catalog.fields()? {
            let why = if !format.has_fields() {
                FIELD_FORMATS
            } else if !write::has_values_at(&field, false, selection.split_sheets) {
                "it has vertices that the store does not have"
            } else if !write::has_values_at(&field, has_midpoints, false) {
                "integers have no means at the middles of edges"
            } else if format.has_doubles() && !write::fits_doubles(&field, &parts) {
                "doubles do not hold all of these integers"
            } else {
                continue;
            };
            match lacking.iter_mut().find(|row| row.0 == why) {
                Some(row) => row.1.push(field.name),
                None => lacking.push((why, vec![field.name])),
            }
        }
        for (why, names) in lacking.into_iter().filter(|_| selection.content == Content::Mesh) {
            let (out, names) = (out.display(), names.join(", "));
            self.settings().note(format!("note: {out} is written without {names}: {why}"));
        }
        let has_pairs = selection.has_periodic(format) || format == MeshFormat::Topology;
        if !has_pairs && selection.content == Content::Mesh && !catalog.periodic()?.is_empty() {
            let why = "they need one number for each vertex of the whole mesh";
            let out = out.display();
            self.settings()
                .note(format!("note: {out} is written without the periodic pairs: {why}"));
        }
        Ok(())
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
            let mut catalog = open_finished(self.path(), settings)?;
            self.note_left_out(&mut catalog, out, &options.selection)?;
            let report = write::export_with(
                &mut catalog,
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
