//! The front door: all public calls of the library.
//!
//! A call that creates a mesh validates its input and refuses a mesh that does not fit before anything is written. The store records the
//! job, so an interrupted run can be resumed. The finished mesh is verified. Failures are returned as [`Error`]; no call unwinds into
//! its caller.
//!
//! Reading order:
//!
//! | modules | subject |
//! |---|---|
//! | `surface`, `surface_arrays`, `surface_wires` | the input surface; embedded sheets, edges and points |
//! | `surface_limits`, `surface_repair`, `surface_resolve`, `surface_close`, `surface_auto`, `surface_remesh`, `defects`, `surface_report`, `suggestions` | calls within a memory limit; repairs; reports |
//! | `sizes`, `field_arrays`, `options` | wanted edge lengths and other options of a mesh |
//! | `settings`, `memory` | memory, threads, cancelling, progress |
//! | `mesher`, `prediction`, `resume` | a new store; predictions; interrupted runs |
//! | `store`, `info`, `names`, `located`, `compare` | a finished store; records; names; points in tetrahedra; two meshes compared |
//! | `verify`, `verify_shared`, `verify_server` | verification, by one or several processes |
//! | `ask`, `condition`, `answer_rows`, `answer_file` | questions and their answers |
//! | `fields`, `field_spec`, `field_sources`, `transfer` | values kept with a finished mesh, and brought to another |
//! | `import` | a mesh made by another program as a store |
//! | `remesh`, `remesh_sizes`, `adapt` | meshing sub-domains again, with given sizes or those that a field asks for |
//! | `versions` | states of a store under names |
//! | `tasks`, `tasks_status` | one mesh by the tasks of a batch scheduler |
//! | `mpi` | one mesh by the ranks of an MPI program |
//! | `show`, `picture`, `page`, `viewer`, `targets` | files for other programs, pictures, the page, a store looked at; protection of input files |
//! | `error`, `from_errors` | errors |
//! | `job`, `preflight`, `replace`, `guard` | internal: the job record; early refusals; replacing a store; the end of unwinding |

mod adapt;
mod answer_file;
mod answer_rows;
mod ask;
mod compare;
mod condition;
mod defects;
#[doc(hidden)]
pub mod error;
mod field_arrays;
mod field_sources;
mod field_spec;
mod fields;
mod from_errors;
mod guard;
mod import;
mod info;
mod job;
mod located;
mod memory;
mod mesher;
#[cfg(feature = "mpi")]
pub mod mpi;
mod names;
mod options;
mod page;
mod periodic;
mod picture;
mod prediction;
mod preflight;
mod remesh;
mod remesh_sizes;
mod replace;
mod resume;
mod settings;
mod show;
mod sizes;
mod store;
mod suggestions;
mod surface;
mod surface_arrays;
mod surface_auto;
mod surface_close;
mod surface_limits;
mod surface_remesh;
mod surface_repair;
mod surface_report;
mod surface_resolve;
mod surface_wires;
mod surface_wrap;
#[doc(hidden)]
pub mod targets;
mod tasks;
mod tasks_status;
mod transfer;
mod verify;
#[cfg(any(test, feature = "mpi"))]
mod verify_server;
mod verify_shared;
mod versions;
mod viewer;

pub use crate::pipeline::{AdaptForecast, AdaptPlan, ErrorEstimate, LongFaces};
pub use crate::pipeline::{MeshOptions, OptionsText};
pub use crate::view::Excess;
pub use adapt::{Adapt, Adapted};
pub use answer_file::AnswerFile;
pub use answer_rows::{AnswerColumn, AnswerRow, AnswerValue, csv_head};
pub use ask::{Answers, ChunkCounts, ChunkedQuery, Order, Query, TetChunk, TetId, VertexId};
pub use compare::Comparison;
pub use condition::{Condition, ExprError, VARIABLES};
pub use defects::DefectPlace;
pub use error::Error;
pub use field_sources::{FieldIds, FieldSource};
pub use field_spec::NewField;
pub use fields::{Field, FieldNumber, FieldPlace, FieldReader, FieldValues, Scalar};
#[doc(hidden)]
pub use guard::guarded;
pub use import::Import;
pub use info::{EmbeddedInfo, RegionInfo, StageInfo, StoreInfo, SubdomainInfo};
#[doc(hidden)]
pub use memory::default_cap;
pub use memory::peak_bytes;
#[doc(hidden)]
pub use memory::show_bytes;
pub use memory::{Bytes, MEMORY_LEAST};
use mesher::predict;
pub use mesher::{Created, Existing, Mesher, PageTraffic};
pub use options::{EmbedOutside, Length, Optimize, Regions, Seal, Subdomains, typed};
pub use page::{Reported, ShownTriangles};
pub use periodic::{MotionKind, Periodic, PeriodicLabels};
pub use picture::{ColorBy, Snapped, Snapshot};
pub use prediction::{Prediction, WorkersPrediction};
pub use remesh::{Remesh, RemeshForecast, Remeshed};
#[doc(hidden)]
pub use resume::resume_reported;
pub use settings::{Event, Settings};
pub use show::{ExportOptions, Exported, MESH_ENDINGS, MeshFormat, Share, Writers};
pub use sizes::Sizes;
pub use store::{Guard, Store, Summary};
pub use suggestions::Suggestion;
pub use surface::{CheckReport, Surface};
pub use surface_arrays::CellArrays;
pub use surface_auto::{RepairKind, RepairStep};
pub use surface_remesh::SurfaceRemesh;
pub use surface_repair::{RepairReport, WELD_SHARE_MAX};
pub use surface_report::SurfaceReport;
pub use surface_resolve::ResolveReport;
pub use surface_wrap::SurfaceWrap;
pub use targets::{check_target, inputs_of};
pub use tasks::Tasks;
pub use tasks_status::{GatherReport, TaskReport, TaskStage, TaskStatus, task_ranges};
pub use tetdb_base::geom::{count, short};
pub use tetdb_base::storage::CancelToken;
pub use tetdb_base::surface::show as show_point;
pub use tetdb_base::surface::{Defect, SplitReport};
pub use tetdb_base::surface::{Seed, SeedKind};
pub use tetdb_io::read::WireKind as EmbeddedKind;
#[doc(hidden)]
pub use tetdb_io::read::{PointColumns, PointTable, read_seeds};
pub use tetdb_io::write::SurfaceWritten;
pub use tetdb_kernel::samples::PREFIX as SAMPLE_PREFIX;
pub use tetdb_kernel::sizing::SizeWarning;
pub use tetdb_repair::close::{CloseReport, ClosedHole};
pub use tetdb_repair::remesh::RemeshReport as SurfaceRemeshReport;
pub use tetdb_repair::resolve::Resolved;
pub use tetdb_repair::wrap::WrapReport;
pub use tetdb_schema::catalog::{QualityRow, StoreState};
pub use tetdb_schema::code::Code;
pub use tetdb_schema::field::FieldRange;
pub use tetdb_schema::labels::LabelSet;
pub use tetdb_schema::source::BOUNDARY_OF as BOUNDARY_PREFIX;
pub use tetdb_schema::word::Word;
pub use tetdb_store::audit::{Population, Qualities};
pub use tetdb_store::transfer::TransferMethod;
pub use transfer::TransferredField;
pub use verify::{Verification, VerifyLevel};
pub use versions::{SubdomainDiff, Version, VersionDiff};
pub use viewer::{DrawnTriangles, PickedTet, Viewer};
