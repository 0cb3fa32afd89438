//! What can be typed.

mod adapt;
mod field;
mod import;
mod mesh;
mod periodic;
mod query;
mod resaturate;
mod run;
mod shape;
mod show;
mod store;
mod surface;
mod tasks;
mod transfer;
mod version;
mod words;

use clap::{Parser, Subcommand};

pub use adapt::AdaptArgs;
pub use field::{AddFieldArgs, FieldAction, FieldArgs};
pub use import::ImportArgs;
pub use mesh::{EstimateArgs, MeshArgs, ResumeArgs};
pub use periodic::{PeriodicArgs, PeriodicPairArgs};
pub use query::QueryArgs;
pub use resaturate::ResaturateArgs;
pub use run::RunArgs;
pub use shape::{InsideArgs, ShapeArgs, SizeArgs};
pub use show::{CompletionsArgs, ManArgs, ReportArgs, SnapshotArgs, ViewArgs};
pub use store::{CompareArgs, ExportArgs, InfoArgs, StoreArgs, VerifyArgs};
pub use surface::{
    CheckArgs, RefineSurfaceArgs, RemeshArgs, RemeshSurfaceArgs, RepairArgs, SampleArgs, SheetArgs,
    WrapArgs, WrapLengths,
};
pub use tasks::{GatherArgs, PlanArgs, WorkArgs};
pub use transfer::TransferArgs;
pub use version::{VersionAction, VersionArgs};

/// Fill closed triangle surfaces with tetrahedra, in stores on disk that can be larger than memory
#[derive(Debug, Parser)]
#[command(name = "tetdb", version, max_term_width = 110)]
#[command(
    after_help = "`tetdb mesh` writes the mesh into a store, which is a directory; most other commands take a store and read it. \
    `tetdb resume` continues a run that was stopped. Every input triangle is kept. Generated surfaces such as sample:balls,count=100 stand \
    wherever a surface file can.\n\n\
    Examples:\n  tetdb check part.stl\n  tetdb mesh part.stl --export part.vtu\n  tetdb info part.tetdb\n  tetdb report part.tetdb part.html\n  \
    tetdb mesh sample:balls,count=100 -o balls.tetdb --memory 256MiB\n\nExit codes: 0 done, 1 internal error, 2 usage, 3 bad input, 4 store damaged, 5 store busy, \
    6 memory or disk, 7 the answer is no, 8 store unusable as it is, 129/130/143 stopped."
)]
pub struct Args {
    /// Say nothing but warnings, errors and what a command is asked for
    #[arg(long, short, global = true, display_order = 990)]
    pub quiet: bool,
    /// Say more: steps and their seconds, bytes of each part of a store
    #[arg(long, short, global = true, conflicts_with = "quiet", display_order = 991)]
    pub verbose: bool,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Mesh a closed surface into a store, and verify it
    Mesh(Box<MeshArgs>),
    /// Take over a tetrahedral mesh that another program made
    ///
    /// The mesh is checked: each tetrahedron positive, faces shared as wholes. No vertex moves; vertices at one place are joined, unused
    /// ones left out. The store is finished: all that works on a mesh of tetdb works on it, `resaturate` and `adapt` too.
    Import(ImportArgs),
    /// Predict a mesh and the memory, disk and time it takes, without meshing
    ///
    /// Nothing is refused but a bad surface or option.
    Estimate(Box<EstimateArgs>),
    /// Go on with an unfinished store
    Resume(ResumeArgs),
    /// Plan the rest of a store as tasks for a batch scheduler
    ///
    /// The store has its coarse mesh. Tasks run in stages, in any order and on any machines that see the store; between stages `tetdb gather`
    /// commits what they did. The mesh is that of one process.
    Plan(PlanArgs),
    /// Do one task of a plan
    ///
    /// It can be killed and done again, also twice at the same time.
    Work(WorkArgs),
    /// Commit what tasks have done, and let the next ones begin
    Gather(GatherArgs),
    /// Mesh sub-domains again: with other sizes, or damaged ones
    ///
    /// Each is meshed from its coarse snapshot in the store. Interfaces and all other sub-domains stay as they are. Sizes stay what they were
    /// unless options say otherwise: single lengths replace those of the first run, shapes and regions are added to its. Without any, the
    /// sub-domains are meshed as they were.
    Resaturate(Box<ResaturateArgs>),
    /// Mesh sub-domains again with the lengths that are best for a field
    ///
    /// The error of the field, linear in tetrahedra, is estimated at each vertex; lengths get shorter where it is large and longer where it
    /// is small, for a wanted number of tetrahedra. The surface and interfaces stay, fields are evaluated on the new mesh, and
    /// `tetdb resaturate --undo` brings back what was before.
    Adapt(Box<AdaptArgs>),
    /// Say whether a surface can be meshed, and where it cannot
    ///
    /// Holes, T-junctions, triangles without area, repeated ones and crossings are listed with their places. Nothing is changed unless
    /// --repair is given.
    Check(CheckArgs),
    /// Say what a store holds
    Info(InfoArgs),
    /// Find tetrahedra by place, number, neighborhood or condition
    ///
    /// All that is given must hold; nothing given means all tetrahedra. Only the parts of the store that matter are read.
    Query(Box<QueryArgs>),
    /// Keep values with a mesh: temperatures, displacements, marks
    ///
    /// Fields have a value at each vertex or tetrahedron. `tetdb query`, exports and pictures take them by name.
    Field(Box<FieldArgs>),
    /// Evaluate fields of a store on the mesh of another
    ///
    /// They are added to it under their names, in one step; Ctrl-C leaves it as it was. Outside of the old mesh, values are those of its
    /// nearest point.
    Transfer(TransferArgs),
    /// Pair labels that are the same at two places, for periodic conditions
    ///
    /// Their triangles must be the same up to a translation or a rotation, which is found from them. The mesh does not change: its pairs
    /// are kept in the store, and exports have them.
    Periodic(PeriodicArgs),
    /// Keep states of a store under names, compare them, bring them back
    ///
    /// A version has mesh and fields. Files never change, so it copies none: it keeps from removal what later changes replace. Commands that
    /// read a store read a version with --at-version.
    Version(VersionArgs),
    /// Prove that a store holds a valid mesh
    ///
    /// All tetrahedra positive by exact signs, each face paired or on the surface, each input triangle there, checksums and digest as they
    /// were written.
    Verify(VerifyArgs),
    /// Compare the qualities of two meshes
    ///
    /// Tetrahedra by quality; those that the surface forces to be bad and those at interfaces are also counted separately.
    Compare(CompareArgs),
    /// Print the digest of a store's mesh
    ///
    /// 32 hex digits: equal ones mean equal meshes, down to the last bit of each coordinate.
    #[command(after_help = "Example:\n  tetdb digest part.tetdb")]
    Digest(StoreArgs),
    /// Write a mesh file for other programs
    Export(ExportArgs),
    /// Write the same surface in finer triangles
    ///
    /// Edges longer than wanted are halved, no triangle leaves its place.
    RefineSurface(RefineSurfaceArgs),
    /// Write a surface of even triangles within a tolerance of the given one
    ///
    /// Needles vanish. Edges between faces, borders of labels and corners are kept; no point of either surface is farther than the
    /// tolerance from the other.
    RemeshSurface(RemeshSurfaceArgs),
    /// Write a closed surface around anything: soups, open surfaces, parts that cross
    ///
    /// The surface encloses all triangles, and its vertices are at most the offset away. Openings narrower than about twice the gap are
    /// closed, and what only they lead to is filled.
    Wrap(WrapArgs),
    /// Draw a cut through the mesh, or its surfaces in space
    ///
    /// A cut is seen from the side its direction points to. Only what is seen is read.
    Snapshot(SnapshotArgs),
    /// Write a page about a mesh, with everything in it to look at
    ///
    /// For any browser, in one file and without a network: numbers, tables, charts, and the mesh in space to turn and cut. Below 20 MB
    /// whatever the mesh.
    Report(ReportArgs),
    /// Show a store in the browser: turn it, cut it anywhere, point at tetrahedra
    ///
    /// Prints the address of a page, opens it in a browser, and serves it until Ctrl-C. Other machines cannot reach it. A cut reads only the
    /// parts of the store that it meets; nothing is written.
    View(ViewArgs),
    /// Write a generated surface to a file
    Sample(SampleArgs),
    /// Print a completion script for a shell
    Completions(CompletionsArgs),
    /// Print a manual page, or write them all
    Man(ManArgs),
}

impl Command {
    /// Whether output is for programs.
    pub fn is_json(&self) -> bool {
        match self {
            Self::Mesh(a) => a.run.json,
            Self::Import(a) => a.run.json,
            Self::Estimate(a) => a.json,
            Self::Resume(a) => a.run.json,
            Self::Plan(a) => a.json,
            Self::Work(a) => a.json,
            Self::Gather(a) => a.json,
            Self::Resaturate(a) => a.run.json,
            Self::Adapt(a) => a.run.json,
            Self::Check(a) => a.json,
            Self::Info(a) => a.of.json,
            Self::Digest(a) => a.json,
            Self::Query(a) => a.json,
            Self::Field(a) => a.is_json(),
            Self::Transfer(a) => a.read.json,
            Self::Periodic(a) => a.read.json,
            Self::Version(a) => a.read().json,
            Self::Verify(a) => a.read.json,
            Self::Compare(a) => a.read.json,
            Self::Export(a) => a.read.json,
            Self::RefineSurface(a) => a.json,
            Self::RemeshSurface(a) => a.json,
            Self::Wrap(a) => a.json,
            Self::Snapshot(a) => a.read.json,
            Self::Report(a) => a.read.json,
            Self::Sample(a) => a.json,
            Self::View(_) | Self::Completions(_) | Self::Man(_) => false,
        }
    }
}
