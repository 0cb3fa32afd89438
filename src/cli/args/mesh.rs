//! What can be typed behind `mesh`, `estimate` and `resume`.

use std::path::PathBuf;

use super::run::RunArgs;
use super::{PeriodicPairArgs, RemeshArgs, RepairArgs, ShapeArgs, SheetArgs};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb mesh part.stl\n  tetdb mesh part.stl -o part.tetdb --hsiz 2% --memory 2GiB --export part.vtu\n  \
    tetdb mesh sample:balls,count=100 -o balls.tetdb"
)]
pub struct MeshArgs {
    /// Surface files (STL, PLY, OBJ, OFF, 3MF, GIFTI, MEDIT, Gmsh, TetGen, VTK, Abaqus, Nastran, I-DEAS), boundary-of:FILE for that of volume cells, or a sample such as
    /// sample:balls,count=100
    #[arg(required = true, value_name = "SURFACE")]
    pub surfaces: Vec<String>,
    /// The store to write [default: the surface's name with .tetdb, in the current folder]
    #[arg(short, long, value_name = "STORE")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub repair: RepairArgs,
    #[command(flatten)]
    pub remesh: RemeshArgs,
    #[command(flatten)]
    pub sheets: SheetArgs,
    #[command(flatten)]
    pub shape: ShapeArgs,
    #[command(flatten)]
    pub periodic: PeriodicPairArgs,
    /// Replace the store if it is there
    #[arg(long, help_heading = "Store")]
    pub force: bool,
    /// Stop after the coarse mesh, and leave the rest to `tetdb plan` or `tetdb resume`
    #[arg(long, conflicts_with_all = ["force", "export"], help_heading = "Run")]
    pub coarse_only: bool,
    /// Start even when disk or memory are expected not to hold the mesh
    #[arg(long, hide = true)]
    pub no_preflight: bool,
    #[command(flatten)]
    pub run: RunArgs,
}

/// What a mesh will be and what it will take, before any work. Nothing is refused but a bad surface or option.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb estimate part.stl\n  tetdb estimate part.stl --hsiz 1% --memory 2GiB\n  tetdb estimate sample:balls,count=100 --json"
)]
pub struct EstimateArgs {
    /// Surface files, or a sample such as sample:balls,count=100
    #[arg(required = true, value_name = "SURFACE")]
    pub surfaces: Vec<String>,
    /// Where the store would be [default: in the current folder]
    #[arg(short, long, value_name = "STORE")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub repair: RepairArgs,
    #[command(flatten)]
    pub remesh: RemeshArgs,
    #[command(flatten)]
    pub sheets: SheetArgs,
    #[command(flatten)]
    pub shape: ShapeArgs,
    /// Most memory the run would hold [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE", help_heading = "Run")]
    pub memory: Option<String>,
    /// Threads the run would use [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = "Run")]
    pub threads: Option<usize>,
    /// Also say how long so many ranks or tasks at once would take, with a thread each
    #[arg(long, value_name = "N", help_heading = "Run", value_parser = clap::value_parser!(u32).range(1..))]
    pub workers: Option<u32>,
    /// Answer with one JSON object
    #[arg(long, help_heading = "Run")]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  tetdb resume part.tetdb --memory 2GiB")]
pub struct ResumeArgs {
    /// The store whose run was killed or stopped
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    #[command(flatten)]
    pub run: RunArgs,
}
