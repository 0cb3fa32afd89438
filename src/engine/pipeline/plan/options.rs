//! Options: those that determine the mesh, and those of one run.

use super::Plan;
use crate::pipeline::work::RemoteWorkers;
use tetdb_kernel::bisect::PlaneChoice;
use tetdb_kernel::boundary::RegionRule;
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::sizing::{Length, SizeOptions};
use tetdb_schema::word::Word;
use tetdb_store::sealed::Form;

/// Fewest tetrahedra of a planned sub-domain; a smaller one would be almost entirely refined zone.
const TETS_MIN: f64 = 25_000.0;

/// Options of one run: those that shape the mesh, and those of the run itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Options that determine the mesh; the job records them.
    pub mesh: MeshOptions,
    /// Settings of this run; not recorded.
    pub run: RunOptions,
}

/// Options that, with the surface, determine the mesh. The job records them as [`OptionsText`](super::OptionsText).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshOptions {
    /// Wanted edge lengths.
    pub sizes: SizeOptions,
    /// File of wanted edge lengths, if any.
    pub size_field: Option<SizeFile>,
    /// The rule for filled regions, and names of regions.
    pub regions: RegionRule,
    /// Extent of the optimization.
    pub optimize: Mode,
    /// Number of sub-domains.
    pub subdomains: Subdomains,
    /// True to drop coarse snapshots; sub-domains then cannot be remeshed. The mesh does not depend on it.
    pub drop_coarse: bool,
    /// Storage form of finished sub-domains. The mesh does not depend on it.
    pub seal: Form,
    /// True to keep the meshes before and after each zone is refined, for inspection. The finished mesh is the same.
    pub keep_stages: bool,
    /// True to first divide the surface's triangles to the wanted lengths. The store keeps the divided surface.
    pub refine_surface: bool,
    /// Distance within which embedded points and ends of embedded edges were moved onto the surface. The record of what was asked
    /// for: the store keeps the surface with the moved points.
    pub snap_embedded: Option<Length>,
    /// Treatment of embedded edges and points outside the filled regions. The store keeps a surface without them.
    pub embed_outside: EmbedOutside,
}

/// Treatment of embedded edges and points outside all filled regions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmbedOutside {
    /// They are refused with the place of the first.
    #[default]
    Error,
    /// They are left out, and a note counts them.
    Skip,
}

impl Word for EmbedOutside {
    const WORDS: &'static [(Self, &'static str)] = &[(Self::Error, "error"), (Self::Skip, "skip")];
}

/// A file of wanted edge lengths at the vertices of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeFile {
    /// Full path of the file, or the name of its copy in the store.
    pub path: String,
    /// Hash of the file and of the mesh next to it, as 32 hex digits; set once they are read. It reveals a changed file.
    pub hash: Option<String>,
}

/// Number of sub-domains of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Subdomains {
    /// One for each ten million (10·2²⁰) predicted tetrahedra or part of them.
    #[default]
    Auto,
    /// This number, at least 1; fewer if they would have less than 25,000 tetrahedra.
    Exactly(u32),
}

impl Subdomains {
    /// The requested number; `None` if it follows from the predicted size of the mesh.
    pub fn count(self) -> Option<u32> {
        match self {
            Self::Auto => None,
            Self::Exactly(n) => Some(n),
        }
    }
}

/// Settings of one run; none is recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunOptions {
    /// True if the run ends with the coarse mesh, for tasks to do the rest.
    pub coarse_only: bool,
    /// Remote workers that share the work.
    pub remote: RemoteWorkers,
    /// Choice of the cutting planes, for comparisons. A resumed run uses the default.
    pub plane: PlaneChoice,
    /// Settings for tests.
    pub trial: Trial,
}

/// Settings with which a small mesh tests the behavior of large ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trial {
    /// True to allow sub-domains of any size.
    pub subdomains_small: bool,
    /// Frames and buffers to use instead of shares of the cap. With very few, pages leave memory and sorts have several runs.
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
