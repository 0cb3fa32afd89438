//! What can be typed.

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};

/// Tetrahedral meshes of any size in a database, every input triangle kept.
#[derive(Debug, Parser)]
#[command(name = "tetdb", version, about, max_term_width = 110)]
#[command(
    after_help = "Examples:\n  tetdb mesh part.stl --export part.vtu\n  tetdb mesh sample:balls,count=100 -o balls.tetdb\n  \
    tetdb info balls.tetdb\n  tetdb check part.stl\n\nExit codes: 0 done, 1 internal error, 2 usage, 3 bad input, 4 store damaged, 5 store busy,\n\
    6 memory or disk, 7 the answer is no, 8 store unusable as it is, 130/143 stopped."
)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Mesh a closed surface into a store, and verify it
    Mesh(Box<MeshArgs>),
    /// Say what a mesh will be and what it will take, without making it
    Estimate(Box<EstimateArgs>),
    /// Go on with an unfinished store
    Resume(ResumeArgs),
    /// Make sub-domains again: with other sizes, or damaged ones
    Resaturate(Box<super::resaturate_args::ResaturateArgs>),
    /// Say whether a surface can be meshed, and where it cannot
    Check(CheckArgs),
    /// Say what a store holds
    #[command(after_help = "Examples:\n  tetdb info part.tetdb\n  tetdb info part.tetdb --json")]
    Info(StoreArgs),
    /// Ask for tetrahedra by place, number, neighborhood or condition
    Query(Box<super::query_args::QueryArgs>),
    /// Prove that a store holds a valid mesh
    Verify(VerifyArgs),
    /// Set the qualities of two meshes side by side
    Compare(CompareArgs),
    /// Print the digest of a store's mesh
    #[command(after_help = "Example:\n  tetdb digest part.tetdb")]
    Digest(StoreArgs),
    /// Write a mesh file for other programs
    Export(ExportArgs),
    /// Write the same surface in finer triangles
    RefineSurface(RefineSurfaceArgs),
    /// Draw a cut through the mesh
    Snapshot(SnapshotArgs),
    /// Write a page about a mesh, with everything in it to look at
    Report(ReportArgs),
    /// Write a made surface to a file
    Sample(SampleArgs),
    /// Print the completions of a shell
    Completions(CompletionsArgs),
    /// Print a manual page, or write them all
    Man(ManArgs),
}

impl Command {
    /// Whether output is for programs.
    pub fn is_json(&self) -> bool {
        match self {
            Self::Mesh(a) => a.run.json,
            Self::Estimate(a) => a.json,
            Self::Resume(a) => a.run.json,
            Self::Resaturate(a) => a.run.json,
            Self::Check(a) => a.json,
            Self::Info(a) | Self::Digest(a) => a.json,
            Self::Query(a) => a.json,
            Self::Verify(a) => a.json,
            Self::Compare(a) => a.json,
            Self::Export(a) => a.json,
            Self::RefineSurface(a) => a.json,
            Self::Snapshot(a) => a.json,
            Self::Report(a) => a.json,
            Self::Sample(a) => a.json,
            Self::Completions(_) | Self::Man(_) => false,
        }
    }
}

/// How to run; none of this changes the mesh.
#[derive(Debug, clap::Args)]
pub struct RunArgs {
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Threads to use [default: all cores]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Skip the verification at the end
    #[arg(long)]
    pub no_verify: bool,
    /// Also write these mesh files (.vtu, .pvtu, .mesh, .meshb, .msh, .inp, .npy)
    #[arg(long, value_name = "FILE")]
    pub export: Vec<PathBuf>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Regions {
    Parity,
    All,
    Outer,
    ByOrientation,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Optimize {
    None,
    Delaunay,
    Full,
}

/// Wanted edge lengths.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct SizeArgs {
    /// Edge length inside: a length, or 1% of the box diagonal [default: from the surface's edges]
    #[arg(long, value_name = "H")]
    pub hsiz: Option<String>,
    /// Least edge length inside
    #[arg(long, value_name = "H")]
    pub hmin: Option<String>,
    /// Greatest edge length inside
    #[arg(long, value_name = "H")]
    pub hmax: Option<String>,
    /// Greatest ratio of neighboring edge lengths [default: 1.3]
    #[arg(long, value_name = "RATIO")]
    pub hgrad: Option<String>,
    /// Edge length in a box, and at most OUTSIDE away from it; may be repeated
    #[arg(
        long,
        value_name = "X0,Y0,Z0,X1,Y1,Z1,H[,OUTSIDE]",
        allow_hyphen_values = true
    )]
    pub size_box: Vec<String>,
    /// Edge length in a sphere, and at most OUTSIDE away from it; may be repeated
    #[arg(long, value_name = "X,Y,Z,R,H[,OUTSIDE]", allow_hyphen_values = true)]
    pub size_sphere: Vec<String>,
    /// Edge length in a cylinder around the axis between two points; may be repeated
    #[arg(
        long,
        value_name = "X0,Y0,Z0,X1,Y1,Z1,R,H[,OUTSIDE]",
        allow_hyphen_values = true
    )]
    pub size_cylinder: Vec<String>,
    /// Edge length in a region, by its number in `tetdb info` or a label of triangles around it; may be repeated
    #[arg(long, value_name = "REGION_OR_LABEL,H")]
    pub size_region: Vec<String>,
    /// Edge lengths at the vertices of a mesh: a MEDIT .sol with its background .mesh of tetrahedra beside it, or with one length for each of the surface's vertices
    #[arg(long, value_name = "FILE")]
    pub size_field: Option<String>,
    /// Edge length as an expression in x, y and z, such as 'max(0.02, 0.1*sqrt(x^2+y^2))'
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub size_expr: Option<String>,
}

/// What shapes the mesh, besides the surface.
#[derive(Debug, clap::Args)]
pub struct ShapeArgs {
    #[command(flatten)]
    pub sizes: SizeArgs,
    /// Options from a TOML file, such as hsiz = "2%"; what the command line says goes first
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Which regions to fill [default: parity]
    #[arg(long, value_enum)]
    pub regions: Option<Regions>,
    /// How far to optimize [default: full]
    #[arg(long, value_enum)]
    pub optimize: Option<Optimize>,
    /// Do not keep what sub-domains are made from: a smaller store, in which none can be made again by `tetdb resaturate`
    #[arg(long)]
    pub drop_coarse: bool,
    /// Number of sub-domains: auto, or a number [default: auto, one for each 4 million tetrahedra]
    #[arg(long, value_name = "N", alias = "domains")]
    pub subdomains: Option<String>,
    /// Keep the meshes before and after each cut is refined, and the interface before and after it is chosen, for `tetdb snapshot --stage`
    #[arg(long)]
    pub keep_stages: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb mesh part.stl\n  tetdb mesh part.stl -o part.tetdb --hsiz 2% --memory 2GiB --export part.vtu\n  \
    tetdb mesh sample:balls,count=100 -o balls.tetdb"
)]
pub struct MeshArgs {
    /// Surface files (STL, PLY, OBJ, OFF, MEDIT, Gmsh, TetGen), or a sample such as sample:balls,count=100
    #[arg(required = true, value_name = "SURFACE")]
    pub surfaces: Vec<String>,
    /// The store to make [default: the surface's name with .tetdb, here]
    #[arg(short, long, value_name = "STORE")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub shape: ShapeArgs,
    /// Replace the store if it is there
    #[arg(long)]
    pub force: bool,
    /// Begin even when disk or memory are expected not to hold the mesh
    #[arg(long, hide = true)]
    pub no_preflight: bool,
    #[command(flatten)]
    pub run: RunArgs,
}

/// What a mesh will be and what it will take, before any of it is made. Nothing is refused but a bad surface or option.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb estimate part.stl\n  tetdb estimate part.stl --hsiz 1% --memory 2GiB\n  tetdb estimate sample:balls,count=100 --json"
)]
pub struct EstimateArgs {
    /// Surface files, or a sample such as sample:balls,count=100
    #[arg(required = true, value_name = "SURFACE")]
    pub surfaces: Vec<String>,
    /// Where the store would be [default: here]
    #[arg(short, long, value_name = "STORE")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub shape: ShapeArgs,
    /// Most memory the run would hold [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Threads the run would use [default: all cores]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  tetdb resume part.tetdb --memory 2GiB")]
pub struct ResumeArgs {
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    #[command(flatten)]
    pub run: RunArgs,
}

/// What is wrong with a surface, and what mesh it allows. Nothing is changed unless --repair is given.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb check part.stl\n  tetdb check part.stl --json\n  tetdb check part.stl --write-bad bad.vtu\n  \
    tetdb check part.stl --repair --write fixed.stl\n  tetdb check part.stl --repair --weld 1e-6 --write fixed.stl\n\n\
    Exit code 0: the surface can be meshed; 3: it has defects. With --repair this is said of what was written."
)]
pub struct CheckArgs {
    /// Surface files, or a sample such as sample:balls,count=100
    #[arg(required = true, value_name = "SURFACE")]
    pub surfaces: Vec<String>,
    /// Write the defective triangles to this .vtu file, the kind of defect as cell data
    #[arg(long, value_name = "FILE")]
    pub write_bad: Option<PathBuf>,
    /// Drop triangles without area and repeated ones, divide triangles at T-junctions, turn neighbors alike
    #[arg(long, requires = "write")]
    pub repair: bool,
    /// With --repair: first join points not farther apart than this share of the box diagonal
    #[arg(long, value_name = "R", requires = "repair")]
    pub weld: Option<String>,
    /// With --repair: where to write the repaired surface (.stl, .ply, .obj, .off)
    #[arg(long, value_name = "OUT", requires = "repair")]
    pub write: Option<PathBuf>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
pub struct StoreArgs {
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  tetdb verify part.tetdb --full --against part.stl")]
pub struct VerifyArgs {
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// All levels, the Delaunay share among them
    #[arg(long)]
    pub full: bool,
    /// The surface whose triangles must all be there [default: what the store was made from]
    #[arg(long, value_name = "SURFACE")]
    pub against: Vec<String>,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Two meshes side by side: tetrahedra by quality; those forced by the surface and those at interfaces apart.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  tetdb compare one.tetdb four.tetdb\n\nExit code 0: the same mesh, bit by bit; 7: another."
)]
pub struct CompareArgs {
    #[arg(value_name = "A")]
    pub first: PathBuf,
    #[arg(value_name = "B")]
    pub second: PathBuf,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb export part.tetdb part.vtu part.msh\n  tetdb export part.tetdb part.pvtu topology.json\n  \
    tetdb export part.tetdb piece.meshb --pieces --subdomain 3,5\n  tetdb export part.tetdb cuts.vtu --interfaces"
)]
pub struct ExportArgs {
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Files to write; the extension tells the format: .vtu, .pvtu, .mesh, .meshb, .msh, .inp, .npy (an array a file), .json (topology), .parquet (where built in)
    #[arg(required = true, value_name = "OUT")]
    pub out: Vec<PathBuf>,
    /// A file for each sub-domain, NAME_00007.mesh, with the faces it shares with others; .pvtu always does so
    #[arg(long)]
    pub pieces: bool,
    /// Only these sub-domains, as numbers with commas between them
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        alias = "domain",
        alias = "subdomains"
    )]
    pub subdomain: Vec<u32>,
    /// Only input triangles and faces between sub-domains (.vtu)
    #[arg(long, conflicts_with = "interfaces")]
    pub boundary: bool,
    /// Only faces between sub-domains (.vtu)
    #[arg(long)]
    pub interfaces: bool,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb sample balls,count=1000,h=0.0093 -o balls.stl\n  tetdb sample box,h=0.1 -o box.off"
)]
pub struct SampleArgs {
    /// NAME,key=value,... with the names balls, box, grains, knot, shells, sphere
    #[arg(value_name = "SAMPLE")]
    pub sample: String,
    /// The file to write: .stl (text), .off, .obj or .ply, all exact
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

/// The same surface in finer triangles: edges longer than wanted are halved, no triangle leaves its place.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  tetdb refine-surface part.stl fine.stl --hsiz 1%")]
pub struct RefineSurfaceArgs {
    /// A surface file, or a sample
    #[arg(value_name = "IN")]
    pub surface: String,
    /// The file to write: .stl (text), .off, .obj or .ply, all exact
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// Wanted edge length: a length, or 1% of the box diagonal; shorter edges stay
    #[arg(long, value_name = "H")]
    pub hsiz: String,
    /// Greatest ratio of neighboring edge lengths [default: 1.3]
    #[arg(long, value_name = "RATIO")]
    pub hgrad: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb completions bash > ~/.local/share/bash-completion/completions/tetdb\n  \
    tetdb completions zsh > ~/.zfunc/_tetdb\n  tetdb completions fish > ~/.config/fish/completions/tetdb.fish"
)]
pub struct CompletionsArgs {
    #[arg(value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb man query | man -l -\n  tetdb man --dir ~/.local/share/man/man1"
)]
pub struct ManArgs {
    /// The command whose page is wanted [default: that of the program]
    #[arg(value_name = "COMMAND")]
    pub command: Option<String>,
    /// Write all pages into this folder
    #[arg(long, value_name = "DIR", conflicts_with = "command")]
    pub dir: Option<PathBuf>,
}

/// What colors stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ColorBy {
    Subdomain,
    Region,
    Quality,
    Size,
}

/// A cut through the mesh by a plane, seen from the side its direction points to; or surfaces in space. Reads only what is seen.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb snapshot part.tetdb cut.png\n  tetdb snapshot part.tetdb cut.png --plane 0,0,0,1,0.5,0 --crinkle --color quality\n  \
    tetdb snapshot part.tetdb bad.svg --where \"quality > 2\" --crinkle\n  tetdb snapshot part.tetdb inside.png --surface --plane 0,0,0,1,0,0\n  \
    tetdb snapshot part.tetdb shell.png --shell 3 --from 1,1,0.5\n  tetdb snapshot part.tetdb refined.png --stage 2:refined"
)]
pub struct SnapshotArgs {
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// The picture to write: .png or .svg
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// A point of the plane and the direction towards the viewer [default: across the middle of the mesh]
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", allow_hyphen_values = true)]
    pub plane: Option<String>,
    /// Draw the tetrahedra that meet the plane whole, not the polygons it cuts out of them
    #[arg(long)]
    pub crinkle: bool,
    /// The whole surface in space, shaded; with --plane, what lies beyond it is left out and the inside is seen
    #[arg(long, conflicts_with_all = ["crinkle", "condition"])]
    pub surface: bool,
    /// What bounds one sub-domain in space, shaded: input triangles in its color, interfaces in that of the neighbor; with --plane as above
    #[arg(long, value_name = "SUBDOMAIN", conflicts_with_all = ["surface", "crinkle", "condition"])]
    pub shell: Option<u32>,
    /// What a cut had on its way, of a store made with --keep-stages: coarse or refined (the mesh, with the plane of the cut as a line),
    /// natural or interface (the interface in space, before and after its faces were chosen)
    #[arg(long, value_name = "CUT:WHAT", conflicts_with_all = ["surface", "shell"])]
    pub stage: Option<String>,
    /// The direction towards the viewer of what is shown in space
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub from: Option<String>,
    /// What colors stand for: size is the mean of the longest and the shortest edge
    #[arg(long, value_enum, default_value = "subdomain", value_name = "WHAT")]
    pub color: ColorBy,
    /// Draw only tetrahedra of which this holds, as in `tetdb query`
    #[arg(long = "where", value_name = "EXPRESSION", allow_hyphen_values = true)]
    pub condition: Option<String>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1600x1200")]
    pub size: String,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

/// A page for any browser, in one file and without a network: numbers, tables, charts, and the mesh in space to turn and cut.
/// Below 20 MB whatever the mesh.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  tetdb report part.tetdb part.html")]
pub struct ReportArgs {
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// The page to write: .html; one that is there is replaced
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}
