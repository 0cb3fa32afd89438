//! What can be typed behind `info`, `digest`, `verify`, `compare` and `export`.

use std::path::PathBuf;

use super::run::{AtArgs, ReadArgs};
use super::surface::{RepairArgs, SheetArgs};
use tetdb_engine::api::Share;

#[derive(Debug, clap::Args)]
pub struct StoreArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    #[command(flatten)]
    pub at: AtArgs,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb info part.tetdb\n  tetdb info part.tetdb --json\n  tetdb info part.tetdb --excess"
)]
pub struct InfoArgs {
    #[command(flatten)]
    pub of: StoreArgs,
    /// Also measure by how much tetrahedra are worse than the surface forces them to be (reads all of them)
    #[arg(long)]
    pub excess: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    mut_arg("repair", |arg| arg.help("With --against: repair that surface first, as `tetdb mesh --repair` does [default: as the store has on record]").long_help(None)),
    mut_arg("allow_open", |arg| arg.help("With --against: treat the parts of that surface that are not closed as sheets")),
    after_help = "Examples:\n  tetdb verify part.tetdb\n  tetdb verify part.tetdb --full --against part.stl\n\n\
    Exit code 0: the mesh is valid; 7: it is not; 4: the store is damaged, and what is damaged is listed."
)]
pub struct VerifyArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Also count the faces that are locally Delaunay
    #[arg(long)]
    pub full: bool,
    /// The surface whose triangles must all be there [default: what the store was meshed from]; may be repeated
    #[arg(long, value_name = "SURFACE")]
    pub against: Vec<String>,
    /// Threads to use [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub at: AtArgs,
    #[command(flatten)]
    pub read: ReadArgs,
    /// The repair of the surface that --against names.
    #[command(flatten)]
    pub repair: RepairArgs,
    /// What was embedded, where --against names the surface.
    #[command(flatten)]
    pub sheets: SheetArgs,
}

/// Two meshes side by side: tetrahedra by quality; those forced by the surface and those at interfaces apart.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  tetdb compare one.tetdb four.tetdb\n\nExit code 0: the same mesh, bit by bit; 7: another."
)]
pub struct CompareArgs {
    /// A store; --at-version names its version
    #[arg(value_name = "A")]
    pub first: PathBuf,
    /// The other one
    #[arg(value_name = "B")]
    pub second: PathBuf,
    #[command(flatten)]
    pub at: AtArgs,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// `3/64`.
fn share(text: &str) -> Result<Share, String> {
    let numbers = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
    match numbers {
        Some((number, of)) if (1..=of).contains(&number) => Ok(Share { number, of }),
        _ => Err("give which share and of how many, such as 3/64".to_owned()),
    }
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb export part.tetdb part.vtu part.msh\n  tetdb export part.tetdb part.pvtu topology.json\n  \
    tetdb export part.tetdb piece.meshb --pieces --subdomain 3,5\n  tetdb export part.tetdb cuts.vtu --interfaces\n  \
    tetdb export part.tetdb case/part.foam --pieces\n  tetdb export part.tetdb - --format mesh"
)]
pub struct ExportArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Files to write; the extension tells the format: .vtu, .pvtu, .vtkhdf, .xdmf, .exo and .e (Exodus II), .foam (OpenFOAM, in its folder), .msh, .mesh, .meshb, .mfem (MFEM), .ele (TetGen),
    /// .inp, .bdf and .nas (Nastran), .su2, .npy (one file per array), .json (topology), .csv and .jsonl (the rows of `tetdb query`), .parquet (where built in); `-` with --format is standard output
    #[arg(required = true, value_name = "OUT")]
    pub out: Vec<PathBuf>,
    /// The format, where the name does not tell it: vtu, msh and so on, or msh22 for Gmsh's old format
    #[arg(long, value_name = "FORMAT")]
    pub format: Option<String>,
    /// A file for each sub-domain, NAME_00007.mesh, with the faces it shares with others; .pvtu always does so; for .foam folders processorN
    #[arg(long)]
    pub pieces: bool,
    /// Write the K-th of N shares of the pieces, for several processes that write all of them together, such as the tasks of an array
    #[arg(long, value_name = "K/N", value_parser = share)]
    pub share: Option<Share>,
    /// Text instead of binary numbers (.msh, .foam)
    #[arg(long)]
    pub ascii: bool,
    /// Nodes of the elements: 1, corners; 2, also the midpoints of edges (.vtu, .pvtu, .vtkhdf, .xdmf, .exo, .msh, .inp, .bdf)
    #[arg(long, value_name = "ORDER", default_value = "1", value_parser = clap::value_parser!(u8).range(1..=2))]
    pub order: u8,
    /// List in .msh, for each partition, the tetrahedra of others that touch it
    #[arg(long)]
    pub ghosts: bool,
    /// All sub-domains as one partition, each vertex once (.vtkhdf); some programs ask for it, DOLFINx among them
    #[arg(long)]
    pub one_partition: bool,
    /// Split embedded sheets: their vertices are written once for each side, those on free edges once; NAME_pairs.csv lists the pairs
    #[arg(long)]
    pub split_sheets: bool,
    /// Only these sub-domains, as numbers with commas between them
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        alias = "domain",
        alias = "subdomains"
    )]
    pub subdomain: Vec<u32>,
    /// Only these regions, as numbers or names in `tetdb info`, with commas between them; their outer faces become boundary
    #[arg(long, value_name = "LIST")]
    pub region: Option<String>,
    /// Only input triangles and faces between sub-domains (.vtu, .vtkhdf)
    #[arg(long, conflicts_with = "interfaces")]
    pub boundary: bool,
    /// Only faces between sub-domains (.vtu, .vtkhdf)
    #[arg(long)]
    pub interfaces: bool,
    /// Write even over the surface the store was meshed from
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub at: AtArgs,
    #[command(flatten)]
    pub read: ReadArgs,
}
