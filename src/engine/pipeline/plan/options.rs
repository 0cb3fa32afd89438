//! What decides a mesh, and what decides a run.

use super::Plan;
use crate::pipeline::work::Hands;
use tetdb_kernel::bisect::Method;
use tetdb_kernel::boundary::RegionRule;
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::sizing::SizeOptions;
use tetdb_store::sealed::Form;

/// Sub-domains smaller than this are nearly all refined zone, so none is planned.
const TETS_MIN: f64 = 25_000.0;

/// Options of one run: those that shape the mesh, and those of the run itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// What decides the mesh; on record.
    pub mesh: MeshOptions,
    /// How this run works; not on record.
    pub run: RunOptions,
}

/// What decides the mesh, besides the surface; the job has it on record as [`OptionsText`](super::OptionsText).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshOptions {
    /// Wanted edge lengths.
    pub sizes: SizeOptions,
    /// Wanted edge lengths in a file.
    pub size_field: Option<SizeFile>,
    /// Which regions are filled, and their names.
    pub regions: RegionRule,
    /// How far tetrahedra are improved.
    pub optimize: Mode,
    /// Into how many sub-domains the mesh is divided.
    pub subdomains: Subdomains,
    /// Whether coarse snapshots are dropped, so that sub-domains cannot be meshed again. It does not shape the mesh.
    pub drop_coarse: bool,
    /// How finished sub-domains are stored. It does not shape the mesh.
    pub seal: Form,
    /// Whether the meshes before and after each zone is refined are kept to be looked at. The finished mesh is the same.
    pub keep_stages: bool,
    /// Whether the surface's triangles are divided to the wanted lengths first. The store keeps the divided surface.
    pub refine_surface: bool,
}

/// A file of wanted edge lengths at the vertices of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeFile {
    /// Its full path, or the name of the copy in the store.
    pub path: String,
    /// Hash of the file and the mesh beside it, 32 hex digits, once they were read: a changed file is noticed.
    pub hash: Option<String>,
}

/// Into how many sub-domains the mesh is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Subdomains {
    /// One up to two million predicted tetrahedra. Above that an even number with at most five million each, in large meshes ten million.
    #[default]
    Auto,
    /// So many, from 1; fewer where they would have less than 25,000 tetrahedra.
    Exactly(u32),
}

impl Subdomains {
    /// The number asked for; `None` for one that follows from the predicted size of the mesh.
    pub fn count(self) -> Option<u32> {
        match self {
            Self::Auto => None,
            Self::Exactly(n) => Some(n),
        }
    }
}

/// How one run works; nothing of it is on record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunOptions {
    /// Whether the run ends with the coarse mesh and tasks do the rest.
    pub coarse_only: bool,
    /// Other processes that share the work.
    pub hands: Hands,
    /// How cuts are chosen, for comparisons. A resumed run cuts as usual.
    pub method: Method,
    /// Settings of tests.
    pub trial: Trial,
}

/// Settings that make a small mesh a test of what happens to large ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trial {
    /// Allows sub-domains of any size.
    pub subdomains_small: bool,
    /// Frames and buffers that are no shares of the cap. With very few, pages leave memory and sorts have several runs.
    pub plan: Option<Plan>,
}

impl From<MeshOptions> for Options {
    fn from(mesh: MeshOptions) -> Self {
        Self { mesh, run: RunOptions::default() }
    }
}

impl RunOptions {
    /// Fewest tetrahedra of a sub-domain.
    pub fn subdomain_tets_min(&self) -> f64 {
        match self.trial.subdomains_small {
            true => 1.0,
            false => TETS_MIN,
        }
    }
}
