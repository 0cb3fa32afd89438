//! What can be typed after `tetdb resaturate`.

use std::path::PathBuf;

use super::SizeArgs;
use super::run::RunArgs;

/// Mesh sub-domains of a finished store again, from their coarse snapshots. Interfaces and all other sub-domains stay as they are.
///
/// Sizes stay what they were unless options say otherwise: lengths replace those of the first run, shapes and regions are added to its. Without any, sub-domains are meshed as they were.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("size_field", |arg| arg.help("Edge lengths from a file: .npy, one for each tetrahedron (or vertex) of the named sub-domains in the order in which `tetdb export --subdomain` writes them; or a MEDIT .sol with its background .mesh of tetrahedra beside it, .csv, .msh, .vtu or .mtr, as for `tetdb mesh`")),
    mut_arg("hsiz", |arg| arg.help("Edge length inside: a length, or 1% of the box diagonal [default: as it was]")),
    mut_arg("hgrad", |arg| arg.help("Greatest ratio of neighboring edge lengths [default: as it was]")),
    after_help = "Examples:\n  tetdb resaturate part.tetdb --subdomain 5,9 --hsiz 1%\n  tetdb resaturate part.tetdb --subdomain 5 --refine-by 0.5\n  \
    tetdb resaturate part.tetdb --subdomain 5 --size-field h.npy\n  tetdb resaturate part.tetdb --changed --size-sphere 0,0,0,0.1,0.01 --dry-run\n  \
    tetdb resaturate part.tetdb --undo\n  tetdb resaturate part.tetdb --repair"
)]
pub struct ResaturateArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// The sub-domains to mesh again, as numbers with commas between them
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        alias = "domain",
        alias = "subdomains"
    )]
    pub subdomain: Vec<u32>,
    /// Mesh those again whose wanted lengths would differ by 5 % somewhere
    #[arg(long, conflicts_with_all = ["subdomain", "undo", "forget", "repair"])]
    pub changed: bool,
    #[command(flatten)]
    pub sizes: SizeArgs,
    /// Multiply lengths: those asked for, or else those the sub-domain was meshed with
    #[arg(long, value_name = "FACTOR")]
    pub refine_by: Option<String>,
    /// Only list what would be meshed again, with the predicted tetrahedra
    #[arg(long, conflicts_with_all = ["undo", "forget", "repair"], help_heading = None)]
    pub dry_run: bool,
    /// Bring back what was before the last change
    #[arg(long, conflicts_with_all = ["subdomain", "forget", "repair"], help_heading = None)]
    pub undo: bool,
    /// Drop what was before the last change: the store gets smaller, and --undo becomes impossible
    #[arg(long, conflicts_with_all = ["subdomain", "repair"], help_heading = None)]
    pub forget: bool,
    /// Mesh damaged sub-domains again as they were; without --subdomain all that are damaged
    #[arg(long, help_heading = None)]
    pub repair: bool,
    /// Drop all fields of the store; without it, their values are evaluated on the new mesh
    #[arg(long, conflicts_with_all = ["undo", "forget", "dry_run"], help_heading = None)]
    pub drop_fields: bool,
    #[command(flatten)]
    pub run: RunArgs,
}
