//! Arguments of the commands on surfaces: `check`, `wrap`, `refine-surface`, `remesh-surface` and `sample`.

use std::path::PathBuf;

use tetdb_engine::api::RepairKind;

use super::shape::InsideArgs;
use super::words::word_of;

/// Sheets inside the surface.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Inside the surface")]
pub struct SheetArgs {
    /// A file of sheets inside, open or closed: their triangles become faces with tetrahedra on both sides; may be repeated
    #[arg(long, value_name = "FILE")]
    pub embed: Vec<String>,
    /// A file of edges inside (.obj, .vtk, .poly): they become edges of the mesh; may be repeated
    #[arg(long, value_name = "FILE")]
    pub embed_edges: Vec<String>,
    /// A file of points inside (.csv, .node, .obj, .vtk): they become vertices of the mesh; may be repeated
    #[arg(long, value_name = "FILE")]
    pub embed_points: Vec<String>,
    /// What an embedded file is called [default: its own name]; may be repeated
    #[arg(long, value_name = "FILE=NAME")]
    pub name: Vec<String>,
    /// Treat the parts of the surface that are not closed as sheets
    #[arg(long)]
    pub allow_open: bool,
}

impl SheetArgs {
    /// All files to embed.
    pub fn files(&self) -> impl Iterator<Item = &String> {
        (self.embed.iter()).chain(&self.embed_edges).chain(&self.embed_points)
    }
}

/// A repair before anything else.
#[derive(Debug, Default, clap::Args)]
pub struct RepairArgs {
    /// Repair the surface first: resolve divides triangles that cross along their intersections, and the others stay as they are; winding
    /// then closes holes, turns shells outward and unites what overlaps; wrap puts a closed surface around all, as `tetdb wrap` does; auto
    /// takes the first of joining near points, resolve, winding and wrap that leaves no defect
    #[arg(long, value_name = "HOW", value_parser = word_of::<RepairKind>(&[]))]
    pub repair: Option<RepairKind>,
    /// With --repair wrap: openings narrower than about twice this are closed [default: 1%]
    #[arg(long, value_name = "DIST", allow_hyphen_values = true, requires = "repair")]
    pub wrap_gap: Option<String>,
    /// With --repair wrap: greatest distance of its vertices from the surface [default: 0.1%]
    #[arg(long, value_name = "DIST", allow_hyphen_values = true, requires = "repair")]
    pub wrap_offset: Option<String>,
}

/// A remeshing before anything is meshed.
#[derive(Debug, clap::Args)]
pub struct RemeshArgs {
    /// Remesh the surface first, after any --repair: even triangles within a tolerance, as `tetdb remesh-surface` makes them, with the lengths of
    /// --hsiz or --hmax, --hmin, --hgrad, the shapes and --size-expr
    #[arg(long)]
    pub remesh_surface: bool,
    /// With --remesh-surface: greatest distance of either surface from the other [default: 0.05%]
    #[arg(long, value_name = "DIST", allow_hyphen_values = true, requires = "remesh_surface")]
    pub remesh_tolerance: Option<String>,
    /// With --remesh-surface: edges that bend by more degrees than this are kept as curves [default: 40]
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, requires = "remesh_surface")]
    pub remesh_angle: Option<f64>,
}

/// What is wrong with a surface, and what mesh it allows. Nothing is changed unless --repair is given.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb check part.stl\n  tetdb check part.stl --json\n  tetdb check part.stl --write-bad bad.vtu\n  tetdb check part.stl --embed-points sensors.csv --embed-outside skip\n  \
    tetdb check part.stl --repair --write fixed.stl\n  tetdb check part.stl --repair --weld 1e-6 --write fixed.stl\n  tetdb check parts.stl --repair=resolve --write united.stl\n\n\
    Exit code 0: the surface can be meshed; 3: it has defects. With --repair this is said of what was written."
)]
pub struct CheckArgs {
    /// Surface files, a sample such as sample:balls,count=100, or - for the standard input
    #[arg(required = true, value_name = "SURFACE")]
    pub surfaces: Vec<String>,
    #[command(flatten)]
    pub sheets: SheetArgs,
    #[command(flatten)]
    pub inside: InsideArgs,
    /// Write the defective triangles to this .vtu file, the kind of defect as cell data
    #[arg(long, value_name = "FILE")]
    pub write_bad: Option<PathBuf>,
    /// Drop triangles without area and repeated ones, divide triangles at T-junctions, turn triangles so that neighbors face the same side;
    /// --repair=resolve instead divides triangles that cross along their intersections, --repair=winding closes holes, --repair=wrap puts a
    /// closed surface around all, --repair=auto takes what is needed
    #[arg(long, requires = "write", value_name = "HOW", num_args = 0..=1, require_equals = true, value_parser = word_of::<RepairKind>(&[]))]
    pub repair: Option<Option<RepairKind>>,
    /// With --repair: first join points not farther apart than this share of the box diagonal
    #[arg(long, value_name = "R", requires = "repair", allow_hyphen_values = true)]
    pub weld: Option<String>,
    /// With --repair: where to write the repaired surface (.stl, .ply, .obj, .off)
    #[arg(long, value_name = "OUT", requires = "repair")]
    pub write: Option<PathBuf>,
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb sample balls,count=1000,h=0.0093 -o balls.stl\n  tetdb sample box,h=0.1 -o box.off\n  tetdb sample knot -o - | tetdb check -\n\n\
    Keys, each with a default:
  balls   count, seed, h      a cube with empty balls of many sizes in it
  box     x, y, z, h          sides of a box
  broken  kind, count, seed, h  kind is holes, crossings, doubled, cracks, turned, tjunctions or soup
  caps    count, seed         a column with flat ends of many corners, badly cut into triangles
  ellipsoids  count, seed, h  as balls, with ellipsoids in place of them
  faults  count, seed, cells, shift  a box with sheets in it that cut each other and end inside
  grains  count, seed, h      disjoint convex polyhedra in a box; mesh them with --regions all
  knot    tube, h             a knotted tube
  needles count, holes, seed  a fan, slats and a perforated plate, as CAD programs write them
  shells  count, kind, h      one inside the other; kind is spheres or boxes
  sphere  radius, h
  steps   count, step, seed   a slab with steps of 1e-2 to 1e-8 of its length
  wells   count, seed, cells, layers, points, shift  a box with layers, wells through them, and sensors
h is the length of the edges."
)]
pub struct SampleArgs {
    /// NAME,key=value,... with the names balls, box, broken, caps, ellipsoids, faults, grains, knot, needles, shells, sphere, steps, wells
    #[arg(value_name = "SAMPLE")]
    pub sample: String,
    /// The file to write: .stl (text), .off, .obj or .ply, all exact; - is the standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// With -o -: stl, off, obj or ply [default: stl]
    #[arg(long, value_name = "FORMAT")]
    pub format: Option<String>,
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

/// A surface of even triangles within a tolerance of the given one.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb remesh-surface part.stl even.stl\n  tetdb remesh-surface part.stl even.obj --tolerance 0.02% --hsiz 2%\n  tetdb mesh even.stl -o part.tetdb"
)]
pub struct RemeshSurfaceArgs {
    /// A surface file, or a sample
    #[arg(value_name = "IN")]
    pub surface: String,
    /// The file to write: .stl (text), .off, .obj or .ply, all exact
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// Greatest distance of either surface from the other: a length, or a share of the box diagonal
    #[arg(long, value_name = "DIST", default_value = "0.05%", allow_hyphen_values = true)]
    pub tolerance: String,
    /// Edges that bend by more degrees than this are kept as curves
    #[arg(long, value_name = "DEGREES", default_value_t = 40.0, allow_hyphen_values = true)]
    pub feature_angle: f64,
    /// Wanted edge length: a length, or 1% of the box diagonal; shorter where curvature or thickness ask for that
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hsiz: Option<String>,
    /// Least edge length asked for [default: twice the tolerance]
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hmin: Option<String>,
    /// Greatest edge length [default: none]
    #[arg(long, value_name = "H", conflicts_with = "hsiz", allow_hyphen_values = true)]
    pub hmax: Option<String>,
    /// Greatest ratio of neighboring edge lengths [default: 1.4]
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub hgrad: Option<String>,
    /// Write even over the surface that is read
    #[arg(long)]
    pub force: bool,
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

/// The lengths of a wrap.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct WrapLengths {
    /// Openings narrower than about twice this are closed, and triangles have about this size: a length, or a share of the box diagonal [default: 1%]
    #[arg(long, value_name = "DIST", allow_hyphen_values = true)]
    pub gap: Option<String>,
    /// Greatest distance of the vertices from the surface: a length, or a share of the box diagonal [default: 0.1%]
    #[arg(long, value_name = "DIST", allow_hyphen_values = true)]
    pub offset: Option<String>,
}

/// A closed surface around anything.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb wrap scan.ply -o closed.obj\n  tetdb wrap housing.stl lid.stl -o both.stl --gap 2% --offset 0.2%\n  tetdb mesh closed.obj -o part.tetdb\n\n\
    Smaller gaps enter narrower openings and give more triangles: half the gap, about four times as many."
)]
pub struct WrapArgs {
    /// Surface files, or a sample
    #[arg(required = true, value_name = "IN")]
    pub surfaces: Vec<String>,
    /// The file to write: .stl (text), .off, .obj or .ply, all exact
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    #[command(flatten)]
    pub lengths: WrapLengths,
    /// Write even over a surface that is read
    #[arg(long)]
    pub force: bool,
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Number of threads [default: all cores]; the wrap is the same for any number
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
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
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hsiz: String,
    /// Greatest ratio of neighboring edge lengths [default: 1.3]
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub hgrad: Option<String>,
    /// Write even over the surface that is read
    #[arg(long)]
    pub force: bool,
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}
