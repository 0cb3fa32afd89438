//! Units of work that any process can do which sees the store's files: a cut, a sub-domain.
//!
//! [`Order`] says what to do, [`Receipt`] what was done; [`Worker`] comes from the one to the other. It needs the order, the files that the
//! order names and the size field, and never opens the catalog: whoever has that draws up orders and commits receipts, in whatever order
//! they come. Who carries them is another matter: the pool of threads of this process, files that a batch scheduler's tasks read and
//! write, messages between processes. Both have a form in bytes with a version and a checksum, the same for every carrier.

mod bytes;
pub(super) mod coarse_snapshot;
pub(super) mod common;
mod cut;
mod cut_journal;
mod helpers;
mod order;
mod receipt;
mod saturate;
pub(super) mod soundness;
pub(super) mod stages;
pub(super) mod subdomain;
mod worker;

pub use bytes::{Kind, from_bytes, to_bytes};
pub(super) use bytes::{body, head};
pub use helpers::{Hands, Helpers};
pub(super) use order::{CutOrder, Order, SubdomainOrder};
pub(super) use receipt::{CutReceipt, InheritedFace, Receipt, SubdomainReceipt, Traffic};
pub use saturate::FineReport;
pub use stages::stage_faces;
pub(super) use worker::{Worker, Workplace};
