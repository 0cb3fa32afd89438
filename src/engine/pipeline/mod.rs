//! The recipe: from a closed surface to a sealed store, in steps that can each be lost but never be half done.
//!
//! | wing | state after it | what |
//! |---|---|---|
//! | `plan` | | options, the size field and what it predicts, how the memory cap is shared out |
//! | `mesh::coarse` | coarse | validate; Delaunay mesh of the surface's vertices; recover every triangle; color and empty regions |
//! | `mesh::divide` | bisected | as often as there are sub-domains less one: refine a band, choose the interface, write two children |
//! | `work::subdomain`, `seal` | sealed | each sub-domain alone: divide edges; optimize; sort, compress and seal |
//! | `work`, `tasks` | | a cut or a sub-domain as an order and a receipt that any process can do and write; batches of them for schedulers |
//! | `remesh` | sealed | sub-domains of a finished store again, from their coarse snapshots, with other sizes or because they are damaged; and back |
//!
//! Inserting the surface's vertices may begin before there is a store (`mesh::head_start`). The pipeline receives a surface, not a
//! path, and prints nothing: it reports [`Event`]s to a [`Watcher`].

mod error;
mod mesh;
mod plan;
mod progress;
mod remesh;
mod seal;
mod tasks;
mod tree;
mod work;
mod workers;

pub use error::PipelineError;
pub use mesh::coarse_mesh;
pub use mesh::{CoarseReport, HeadStart, Summary, ahead, mesh, mesh_prepared};
pub use plan::{
    Estimate, MEMORY_MIN, MeshOptions, Options, OptionsText, Plan, Prepared, RECIPE, RunOptions,
    SizeFile, Subdomains, Trial, least_for, prepare, recipe_of, record_recipe,
};
pub use progress::silent;
pub use progress::{Event, Watcher};
pub use remesh::{
    Forecast, NewSizes, Remade, ResaturateSummary, Resaturation, Values, asked, changed, forecast,
    forget, resaturate, undo,
};
pub use tasks::serve;
pub use tasks::{
    Gathered, Performed, Planned, Stage, StageKind, TASKS_MAX, TaskSettings, TaskState, end_plan,
    gather, is_being_worked, perform, plan as plan_tasks, status,
};
pub use tetdb_schema::work::{WorkKind, from_bytes, to_bytes};
pub use work::{FineReport, Hands, Helpers, stage_faces};
pub use workers::{Hand, work_off};
