//! The front door: whoever calls it gets validation, refusal before anything is written, the job on record, verification and resume.
//!
//! Reading order: `surface`, `sizes` and `options` (what is asked for), `settings` (memory, threads, cancelling, progress), `mesher`
//! (a new store), `store` (a finished one), `ask` (questions), `remesh` (sub-domains again), `tasks` (many
//! machines), `show` (files, pictures, the page),
//! `error`. Private: `job` (what is put on record), `preflight` (what is refused before it begins), `replace` (one store in the place of
//! another), `guard` (nothing unwinds into the caller).

mod answer_file;
mod answer_rows;
mod ask;
mod compare;
mod condition;
mod defects;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod field_arrays;
mod from_errors;
#[doc(hidden)]
pub mod guard;
mod info;
#[doc(hidden)]
pub mod job;
mod located;
mod memory;
mod mesher;
#[cfg(feature = "mpi")]
pub mod mpi;
mod names;
mod options;
#[doc(hidden)]
pub mod page;
mod picture;
mod prediction;
#[doc(hidden)]
pub mod preflight;
mod remesh;
mod remesh_sizes;
#[doc(hidden)]
pub mod replace;
mod resume;
mod settings;
mod show;
mod sizes;
#[doc(hidden)]
pub mod store;
mod suggestions;
#[doc(hidden)]
pub mod surface;
mod surface_arrays;
mod surface_limits;
mod surface_repair;
mod surface_report;
mod surface_wires;
#[doc(hidden)]
pub mod targets;
mod tasks;
mod tasks_status;
#[doc(hidden)]
pub mod verify;
#[cfg(any(test, feature = "mpi"))]
mod verify_server;
mod verify_shared;

pub use crate::pipeline::{MeshOptions, OptionsText};
pub use crate::view::Excess;
pub use answer_file::AnswerFile;
pub use answer_rows::{AnswerColumn, AnswerRow, AnswerValue, csv_head};
pub use ask::{Answers, ChunkCounts, Order, Query, TetId, VertexId};
pub use compare::Comparison;
pub use condition::{Condition, ExprError, VARIABLES};
pub use defects::DefectPlace;
pub use error::Error;
#[doc(hidden)]
pub use guard::guarded;
pub use info::{EmbeddedInfo, RegionInfo, StageInfo, StoreInfo, SubdomainInfo};
#[doc(hidden)]
pub use memory::default_cap;
pub use memory::peak_bytes;
#[doc(hidden)]
pub use memory::show_bytes;
pub use memory::{Bytes, MEMORY_LEAST};
pub use mesher::{Created, Existing, Mesher, PageTraffic};
#[doc(hidden)]
pub use mesher::{divide, predict};
pub use options::{Length, Optimize, Regions, Seal, Subdomains, typed};
pub use page::{Reported, ShownTriangles};
pub use picture::{ColorBy, Snapped, Snapshot};
pub use prediction::{Prediction, WorkersPrediction};
pub use remesh::{Remesh, RemeshForecast, Remeshed};
#[doc(hidden)]
pub use resume::resume_reported;
pub use settings::{Event, Settings};
pub use show::{ExportOptions, Exported, MESH_ENDINGS, MeshFormat, Share, Writers};
pub use sizes::Sizes;
pub use store::{Store, Summary};
pub use suggestions::Suggestion;
pub use surface::{CheckReport, Surface};
pub use surface_repair::{RepairReport, WELD_SHARE_MAX};
pub use surface_report::SurfaceReport;
pub use targets::{check_target, inputs_of};
pub use tasks::Tasks;
pub use tasks_status::{GatherReport, TaskReport, TaskStage, TaskStatus, task_ranges};
pub use tetdb_base::geom::short;
pub use tetdb_base::storage::CancelToken;
pub use tetdb_base::surface::show as show_point;
pub use tetdb_base::surface::{Defect, SplitReport};
pub use tetdb_base::surface::{Seed, SeedKind};
pub use tetdb_io::read::WireKind as EmbeddedKind;
pub use tetdb_io::write::SurfaceWritten;
pub use tetdb_kernel::samples::PREFIX as SAMPLE_PREFIX;
pub use tetdb_kernel::sizing::SizeWarning;
pub use tetdb_schema::catalog::{QualityRow, StoreState};
pub use tetdb_schema::code::Code;
pub use tetdb_schema::word::Word;
pub use tetdb_store::audit::{Population, Qualities};
pub use verify::{Verification, VerifyLevel};
