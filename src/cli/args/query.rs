//! What can be typed behind `query`.

use std::path::PathBuf;

use super::run::AtArgs;

/// Tetrahedra by place, number, neighborhood or condition. All that is given must hold; nothing given means all.
#[derive(Debug, Default, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb query part.tetdb --point 0.1,0.2,0.3\n  tetdb query part.tetdb --points probes.txt --json\n  \
    tetdb query part.tetdb --sphere 0,0,0,0.5 --inside -o ball.vtu\n  \
    tetdb query part.tetdb --where \"quality > 2 and region = 1\" --order-by quality --desc --limit 10\n  \
    tetdb query part.tetdb --neighbors 0:12 --select id,quality,vertices\n\n\
    Variables and columns: quality, region, subdomain, volume, x, y, z (of the centroid), edge_min, edge_max, \
    angle_min, angle_max (dihedral, degrees), excess (quality over the least that the faces on the surface allow); columns also: id, vertices, points."
)]
pub struct QueryArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// The tetrahedron that holds a point; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, conflicts_with_all = PLACES)]
    pub point: Vec<String>,
    /// The same for each line of a file, or of the standard input (-)
    #[arg(long, value_name = "FILE", conflicts_with_all = PLACES)]
    pub points: Option<PathBuf>,
    /// Tetrahedra that meet a box
    #[arg(long = "box", value_name = "X0,Y0,Z0,X1,Y1,Z1", allow_hyphen_values = true)]
    pub boxes: Vec<String>,
    /// Tetrahedra that meet a ball
    #[arg(long, value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    pub sphere: Vec<String>,
    /// Tetrahedra that meet the plane through a point, orthogonal to a direction
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", allow_hyphen_values = true)]
    pub plane: Vec<String>,
    /// Only those that lie wholly in the boxes and balls
    #[arg(long, conflicts_with = "plane")]
    pub inside: bool,
    /// Tetrahedra of these sub-domains, such as 0,3
    #[arg(long, value_name = "LIST", alias = "domain")]
    pub subdomain: Option<String>,
    /// Tetrahedra of these regions, as numbers or names in `tetdb info`
    #[arg(long, value_name = "LIST")]
    pub region: Option<String>,
    /// Tetrahedra with a face on an input triangle of one of these labels, names or numbers
    #[arg(long, value_name = "LIST")]
    pub label: Option<String>,
    /// Tetrahedra with a vertex of the surface
    #[arg(long)]
    pub touching_surface: bool,
    /// Tetrahedra with a face on an embedded sheet
    #[arg(long)]
    pub touching_sheet: bool,
    /// Tetrahedra with a face on the interface of two sub-domains
    #[arg(long, value_name = "A,B")]
    pub interface: Option<String>,
    /// Tetrahedra for which this holds, such as "quality > 6 and region = 2"
    #[arg(long = "where", value_name = "EXPRESSION", allow_hyphen_values = true)]
    pub condition: Option<String>,
    /// These tetrahedra, by id, such as 7:1048211
    #[arg(long, value_name = "LIST")]
    pub tet: Option<String>,
    /// Tetrahedra that share a face with this one
    #[arg(long, value_name = "TETRAHEDRON", conflicts_with_all = ["ball", "shell"])]
    pub neighbors: Option<String>,
    /// Tetrahedra that have this vertex, such as surface:12 or 7:40
    #[arg(long, value_name = "VERTEX", conflicts_with = "shell")]
    pub ball: Option<String>,
    /// Tetrahedra that have both vertices of an edge
    #[arg(long, value_name = "VERTEX,VERTEX")]
    pub shell: Option<String>,
    /// Columns to answer with, such as id,quality,vertices
    #[arg(long, value_name = "COLUMNS")]
    pub select: Option<String>,
    /// Sort by a column of numbers [default: by id]
    #[arg(long, value_name = "COLUMN", allow_hyphen_values = true)]
    pub order_by: Option<String>,
    /// From the greatest down
    #[arg(long, requires = "order_by")]
    pub desc: bool,
    /// No more than so many
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub limit: Option<u64>,
    /// Answer with comma-separated values
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
    /// Write the answers to this file: .csv, .jsonl, .npy or .vtu
    #[arg(short, long, value_name = "FILE", conflicts_with = "csv")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub at: AtArgs,
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object per line
    #[arg(long)]
    pub json: bool,
}

impl QueryArgs {
    /// Returns whether any argument restricts the tetrahedra that are answered.
    pub fn has_condition(&self) -> bool {
        let lists = [&self.boxes, &self.sphere, &self.plane];
        let places = [&self.subdomain, &self.region, &self.label, &self.interface, &self.condition];
        let ids = [&self.tet, &self.neighbors, &self.ball, &self.shell];
        lists.iter().any(|list| !list.is_empty())
            || places.into_iter().chain(ids).any(Option::is_some)
            || self.touching_surface
            || self.touching_sheet
    }
}

/// What makes no sense together with points.
const PLACES: [&str; 17] = [
    "boxes",
    "sphere",
    "plane",
    "inside",
    "subdomain",
    "region",
    "label",
    "touching_surface",
    "touching_sheet",
    "interface",
    "condition",
    "tet",
    "neighbors",
    "ball",
    "shell",
    "order_by",
    "limit",
];
