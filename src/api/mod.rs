//! The front door: whoever calls it gets validation, refusal before anything is written, the job on record, verification and resume.
//!
//! Reading order: `surface`, `sizes` and `options` (what is asked for), `settings` (memory, threads, cancelling, progress), `mesher`
//! (a new store), `store` (a finished one), `ask` (questions), `remesh` (sub-domains again), `tasks` (many
//! machines), `show` (files, pictures, the page),
//! `error`. Private: `job` (what is put on record), `preflight` (what is refused before it begins), `replace` (one store in the place of
//! another), `guard` (nothing unwinds into the caller).

mod ask;
mod codes;
mod defects;
pub(crate) mod error;
pub(crate) mod field_arrays;
mod from_errors;
pub(crate) mod guard;
pub(crate) mod job;
mod located;
mod memory;
mod mesher;
mod options;
pub(crate) mod page;
pub(crate) mod picture;
pub(crate) mod preflight;
pub(crate) mod remesh;
pub(crate) mod replace;
mod resume;
mod settings;
pub(crate) mod show;
mod sizes;
pub(crate) mod store;
pub(crate) mod surface;
mod surface_arrays;
mod surface_wires;
pub(crate) mod targets;
pub(crate) mod tasks;
pub(crate) mod verify;
#[cfg(any(test, feature = "mpi"))]
pub(crate) mod verify_server;
mod verify_shared;

pub use crate::io::write::MeshFormat;
pub use crate::storage::CancelToken;
pub use ask::{Answers, Order, Query};
pub use codes::{CODES, CodeRow};
pub use defects::DefectPlace;
pub use error::Error;
pub(crate) use guard::guarded;
pub use memory::Bytes;
#[cfg(feature = "cli")]
pub(crate) use memory::default_cap;
#[cfg(any(test, feature = "cli", feature = "internals"))]
pub use memory::peak_bytes;
pub(crate) use memory::show_bytes;
pub use mesher::{Existing, Mesher, Prediction};
#[cfg(feature = "cli")]
pub(crate) use mesher::{divide, predict};
pub use options::{Optimize, Regions, Seal, Subdomains};
pub use picture::{ColorBy, Snapped, Snapshot};
pub use remesh::{Remesh, Remeshed};
#[cfg(feature = "cli")]
pub(crate) use resume::resume_reported;
pub use settings::{Event, Settings};
pub use show::{ExportOptions, Exported};
pub use sizes::{Length, Sizes};
pub use store::{Store, Summary};
pub use surface::{CheckReport, Surface};
pub use tasks::Tasks;
pub use verify::{Verification, VerifyLevel};
