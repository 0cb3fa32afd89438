//! What can be typed behind `snapshot`, `report`, `view`, `completions` and `man`.

use std::path::PathBuf;

use super::run::{AtArgs, ReadArgs};

/// A cut through the mesh by a plane, seen from the side its direction points to; or surfaces in space. Reads only what is seen.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb snapshot part.tetdb cut.png\n  tetdb snapshot part.tetdb cut.png --plane 0,0,0,1,0.5,0 --crinkle --color quality\n  \
    tetdb snapshot part.tetdb bad.svg --where \"quality > 2\" --crinkle\n  tetdb snapshot part.tetdb whole.png --surface --color label\n  tetdb snapshot part.tetdb inside.png --surface --plane 0,0,0,1,0,0\n  \
    tetdb snapshot part.tetdb shell.png --shell 3 --from 1,1,0.5\n  tetdb snapshot stages.tetdb coarse.png --stage 2:coarse\n  tetdb snapshot stages.tetdb refined.png --stage 2:refined\n  \
    tetdb snapshot stages.tetdb natural.png --stage 2:natural\n  tetdb snapshot stages.tetdb interface.png --stage 2:interface\n\n\
    Two meshes compared: give both the same --plane, --color and --size; quality is always colored from 1 to 3.\n\
    Stages need a store made with --keep-stages."
)]
pub struct SnapshotArgs {
    /// The store, a directory that `tetdb mesh` wrote
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
    /// The whole surface in space, shaded; with --plane, the part in front of the plane is left out, and the tetrahedra it cuts are seen
    #[arg(long, conflicts_with_all = ["crinkle", "condition"])]
    pub surface: bool,
    /// The faces around one sub-domain in space, shaded: input triangles in its color, interfaces in that of the neighbor; with --plane as above
    #[arg(long, value_name = "SUBDOMAIN", conflicts_with_all = ["surface", "crinkle", "condition"])]
    pub shell: Option<u32>,
    /// An intermediate stage of a cut, of a store meshed with --keep-stages: coarse or refined (the mesh, with the plane of the cut as a line),
    /// natural or interface (the interface in space, before and after its faces were chosen)
    #[arg(long, value_name = "CUT:WHAT", conflicts_with_all = ["surface", "shell"])]
    pub stage: Option<String>,
    /// The direction towards the viewer of what is shown in space
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub from: Option<String>,
    /// What colors stand for: subdomain, region, quality, size, label, or a field such as temperature or u.x; size is the mean of the longest and the shortest edge, label that of input triangles with --surface or --shell
    #[arg(long, default_value = "subdomain", value_name = "WHAT")]
    pub color: String,
    /// Draw only tetrahedra for which this holds, as in `tetdb query`
    #[arg(long = "where", value_name = "EXPRESSION", allow_hyphen_values = true)]
    pub condition: Option<String>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1600x1200")]
    pub size: String,
    #[command(flatten)]
    pub at: AtArgs,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// A page for any browser, in one file and without a network: numbers, tables, charts, and the mesh in space to turn and cut.
/// Below 20 MB whatever the mesh.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  tetdb report part.tetdb part.html")]
pub struct ReportArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// The page to write: .html; one that is there is replaced
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    #[command(flatten)]
    pub at: AtArgs,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb view part.tetdb\n  tetdb view part.tetdb --no-open --port 8080\n  tetdb view part.tetdb --at-version first --memory 1GiB\n\n\
    The address holds a token. Only who has it sees the mesh. From another machine, forward the port:\n\
    `ssh -L 8080:127.0.0.1:8080 HOST`. Exit code 0 after Ctrl-C."
)]
pub struct ViewArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// The port to listen to [default: any that is free]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
    /// Open no browser
    #[arg(long)]
    pub no_open: bool,
    #[command(flatten)]
    pub at: AtArgs,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Threads for one answer [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
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
