//! The meshing pipeline: turns a closed surface into a sealed store, one committed step after another. An interrupted step leaves
//! the store as it was before the step.
//!
//! | module | state after it | work |
//! |---|---|---|
//! | `plan` | | options, the size field and the estimate from it, shares of the memory cap |
//! | `mesh::coarse` | coarse | validate; Delaunay mesh of the surface's vertices; recover every triangle; color and empty regions |
//! | `mesh::divide` | bisected | one cut fewer than sub-domains; each refines a zone, chooses the interface and writes two children |
//! | `work::subdomain`, `seal` | sealed | each sub-domain alone: divide edges; optimize; sort, compress and seal |
//! | `work`, `tasks` | | a cut or a sub-domain as an order, which any process can perform, and a receipt; batches for schedulers |
//! | `import` | sealed | a mesh made elsewhere: checked, placed in sub-domains, sealed |
//! | `adapt` | | lengths for sub-domains to remesh, from the error of a field |
//! | `remesh` | sealed | remesh sub-domains of a finished store from coarse snapshots, with other sizes or to repair damage; restore older versions |
//!
//! The insertion of the surface's vertices may begin before the store exists (`mesh::head_start`). The pipeline receives a
//! surface, not a path. It prints nothing: it reports [`Event`]s to a [`Watcher`].

mod adapt;
mod error;
mod import;
mod mesh;
mod plan;
mod progress;
mod remesh;
mod seal;
mod tasks;
mod tree;
mod work;
mod workers;

pub use adapt::{
    AdaptForecast, AdaptPlan, AdaptRequest, ErrorEstimate, LongFaces, plan_adaptation,
};
pub use error::PipelineError;
pub use import::{BadMesh, Placed, StoreValues, place, write as write_placed};
pub use mesh::coarse_mesh;
pub use mesh::{CoarseReport, HeadStart, Summary, head_start, mesh, mesh_prepared};
pub use plan::{
    EmbedOutside, Estimate, MEMORY_MIN, MeshOptions, Options, OptionsText, OuterEmbedded, Plan,
    Prepared, RECIPE, REFUSED_BELOW, RunOptions, SizeFile, Subdomains, Trial, least_for,
    outer_embedded, prepare, recipe_of, record_recipe, refuse_outer,
};
pub use progress::silent;
pub use progress::{Event, Watcher};
pub use remesh::{
    FieldChange, Forecast, NewSizes, ResaturateSummary, Resaturated, Resaturation, Values, changed,
    forecast, forget, previous, recorded_request, resaturate, restore, shells,
};
pub use seal::totals::prepared_row;
pub use tasks::serve;
pub use tasks::{
    Gathered, Performed, Planned, Stage, StageKind, TASKS_MAX, TaskSettings, TaskState, end_plan,
    gather, is_being_worked, is_planned, perform, plan as plan_tasks, status,
};
pub use tetdb_schema::work::{WorkKind, from_bytes, to_bytes};
pub use tree::bounds;
pub use work::{FineReport, RemoteWorkers, WorkerPool, stage_faces};
pub use workers::{WorkerFn, run_jobs};
