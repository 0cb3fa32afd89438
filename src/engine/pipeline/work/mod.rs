//! Units of work: a cut or a sub-domain, performed by any process with access to the store's files.
//!
//! A [`Worker`] turns a [`WorkOrder`](tetdb_schema::work::WorkOrder) into a [`Receipt`](tetdb_schema::work::Receipt). It needs
//! the order, the files named in the order and the size field, and never opens the catalog. The process that holds the store's
//! lock creates orders and commits receipts, in any order. Orders and receipts travel between threads, as files of a batch
//! scheduler's tasks, or as messages between processes; their bytes are the same in all three ([`tetdb_schema::work`]).

pub(super) mod coarse_snapshot;
pub(super) mod common;
mod cut;
mod cut_journal;
mod remote;
mod saturate;
pub(super) mod soundness;
pub(super) mod stages;
pub(super) mod subdomain;
pub(super) mod traffic;
mod worker;

pub use remote::{RemoteWorkers, WorkerPool};
pub use saturate::FineReport;
pub use stages::stage_faces;
pub(super) use worker::{Worker, Workplace};
