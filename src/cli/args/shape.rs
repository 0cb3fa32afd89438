//! What shapes a mesh: sizes, regions, optimization, sub-domains.

use std::path::PathBuf;

use tetdb_engine::api::{EmbedOutside, Optimize, Regions, Seal};

use super::words::word_of;

const REGIONS: &[&str] = &[
    "Regions that an odd number of shells separates from the outside: a shell in a shell is a hole",
    "Every bounded region",
    "Only the region directly behind the outermost shells",
    "Regions behind triangles whose front side looks away from them",
    "Regions with a seed (--region-seed, --seeds, or regions in the surface's files); where only holes are given, all others",
    "Every bounded region without a hole (--hole, --seeds, or holes in the surface's files)",
];
const OPTIMIZE: &[&str] = &[
    "Nothing after the last vertex is inserted",
    "Only changes that keep the mesh locally Delaunay",
    "Until no badly shaped tetrahedron can be improved",
];
const OUTSIDE: &[&str] =
    &["Refuse them, with the first one", "Leave them out, and count them in a note"];
const SEAL: &[&str] = &[
    "In chunks, packed",
    "As the pages they are worked in: no time is taken to pack or unpack them, at six times the bytes",
];

/// Wanted edge lengths.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
#[command(next_help_heading = "Sizes")]
pub struct SizeArgs {
    /// Edge length inside: a length, or 1% of the box diagonal [default: from the surface's edges]
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hsiz: Option<String>,
    /// Least edge length inside
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hmin: Option<String>,
    /// Greatest edge length inside
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hmax: Option<String>,
    /// Greatest ratio of neighboring edge lengths [default: 1.3, and 2 next to needles of the surface]
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub hgrad: Option<String>,
    /// Edge length in a box, and at most OUTSIDE away from it; may be repeated
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1,H[,OUTSIDE]", allow_hyphen_values = true)]
    pub size_box: Vec<String>,
    /// Edge length in a sphere, and at most OUTSIDE away from it; R may be a share such as 2%; may be repeated
    #[arg(long, value_name = "X,Y,Z,R,H[,OUTSIDE]", allow_hyphen_values = true)]
    pub size_sphere: Vec<String>,
    /// Edge length in a cylinder around the axis between two points; may be repeated
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1,R,H[,OUTSIDE]", allow_hyphen_values = true)]
    pub size_cylinder: Vec<String>,
    /// Edge length in a region, by its number in `tetdb info` or a label of triangles around it; may be repeated
    #[arg(long, value_name = "REGION_OR_LABEL,H", allow_hyphen_values = true)]
    pub size_region: Vec<String>,
    /// Edge length on triangles with a label, growing away from them, or from DISTANCE on; may be repeated
    #[arg(long, value_name = "LABEL,H[,DISTANCE]", allow_hyphen_values = true)]
    pub size_label: Vec<String>,
    /// Edge lengths at the vertices of a mesh: a MEDIT .sol with its background .mesh of tetrahedra beside it, or with one length for each of the surface's vertices; or .csv, .npy, .msh, .vtu, .mtr
    #[arg(long, value_name = "FILE")]
    pub size_field: Option<String>,
    /// Edge length as an expression in x, y and z, such as 'max(0.02, 0.1*sqrt(x^2+y^2))'
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub size_expr: Option<String>,
}

/// Treatment of embedded edges and points.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Inside the surface")]
pub struct InsideArgs {
    /// Move embedded points and ends of embedded edges onto triangles nearer than this, and divide the triangles there: a length, or 1%
    /// of the box diagonal
    #[arg(long, value_name = "DIST", allow_hyphen_values = true)]
    pub snap_embedded: Option<String>,
    /// Treatment of embedded points and edges outside the filled regions [default: error]
    #[arg(long, value_name = "HOW", value_parser = word_of::<EmbedOutside>(OUTSIDE))]
    pub embed_outside: Option<EmbedOutside>,
}

/// What shapes the mesh, besides the surface.
#[derive(Debug, clap::Args)]
pub struct ShapeArgs {
    #[command(flatten)]
    pub sizes: SizeArgs,
    /// Options from a TOML file, such as hsiz = "2%"; the command line takes precedence
    #[arg(long, value_name = "FILE", help_heading = None)]
    pub config: Option<PathBuf>,
    /// First divide the surface's triangles where embedded points lie on them, and until their edges are as short as the wanted lengths,
    /// without moving the surface
    #[arg(long, help_heading = "Sizes")]
    pub refine_surface: bool,
    #[command(flatten)]
    pub inside: InsideArgs,
    /// Which regions to fill [default: what the surface's files say, else parity; with seeds or holes: seeds]
    #[arg(long, value_name = "RULE", value_parser = word_of::<Regions>(REGIONS), help_heading = "Regions")]
    pub regions: Option<Regions>,
    /// A point inside a region, and what it is called; may be repeated
    #[arg(long, value_name = "X,Y,Z[,NAME]", allow_hyphen_values = true, help_heading = "Regions")]
    pub region_seed: Vec<String>,
    /// A point inside a region that stays empty; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, help_heading = "Regions")]
    pub hole: Vec<String>,
    /// Seeds and holes from a file: a line `x y z name` or `x y z hole` for each, or with commas or semicolons
    #[arg(long, value_name = "FILE", help_heading = "Regions")]
    pub seeds: Option<PathBuf>,
    /// How much to improve the shapes of tetrahedra [default: full]
    #[arg(long, value_name = "HOW", value_parser = word_of::<Optimize>(OPTIMIZE), help_heading = None)]
    pub optimize: Option<Optimize>,
    /// Do not keep coarse snapshots: the store is smaller, and `tetdb resaturate` cannot mesh its sub-domains again
    #[arg(long, help_heading = "Store")]
    pub drop_coarse: bool,
    /// How finished sub-domains are kept [default: packed]
    #[arg(long, value_name = "HOW", value_parser = word_of::<Seal>(SEAL), help_heading = "Store")]
    pub seal: Option<Seal>,
    /// Number of sub-domains: auto, or a number [default: auto, one for each 10 million tetrahedra]
    #[arg(long, value_name = "N", alias = "domains", help_heading = "Store")]
    pub subdomains: Option<String>,
    /// Keep the meshes before and after refinement for each cut, and its interface before and after faces are chosen, for `tetdb snapshot --stage`
    #[arg(long, help_heading = "Store")]
    pub keep_stages: bool,
}
