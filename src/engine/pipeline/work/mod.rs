//! Units of work that any process can do which sees the store's files: a cut, a sub-domain.
//!
//! A [`Worker`] turns a [`WorkOrder`](tetdb_schema::work::WorkOrder) into a [`Receipt`](tetdb_schema::work::Receipt). It needs the order, the
//! files that the order names and the size field, and never opens the catalog. The holder of the store's lock draws up orders and
//! commits receipts, in any order. Threads of this process, files of a batch scheduler's tasks or messages between processes carry
//! them; their bytes are the same in all three ([`tetdb_schema::work`]).

pub(super) mod coarse_snapshot;
pub(super) mod common;
mod cut;
mod cut_journal;
mod helpers;
mod saturate;
pub(super) mod soundness;
pub(super) mod stages;
pub(super) mod subdomain;
pub(super) mod traffic;
mod worker;

pub use helpers::{Hands, Helpers};
pub use saturate::FineReport;
pub use stages::stage_faces;
pub(super) use worker::{Worker, Workplace};
