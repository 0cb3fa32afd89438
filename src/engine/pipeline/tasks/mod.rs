//! Meshing by tasks that a batch scheduler starts, on any machine, in any order and any number of times.
//!
//! The folder `work` of the store has all files that tasks exchange with the process that holds the store's lock:
//!
//! | file | written by | content |
//! |---|---|---|
//! | `plan` | [`plan`] | number of tasks, and parameters common to all |
//! | `size-field` | [`plan`] | the size field |
//! | `stage` | [`gather`] | the number of the first stage that is not committed, in digits |
//! | `committed` | [`gather`] | numbers of the committed tasks of that stage, in digits |
//! | `task-00017.orders` | [`gather`] | orders of task 17 |
//! | `task-00017.mark` | the task | host and process of the task, renewed while it lives; its error |
//! | `files-ATTEMPT/` | the task | the files it wrote, under their final names |
//! | `task-00017.receipts` | the task | its receipts, written after its files |
//!
//! Each attempt at a task writes its files to a folder of its own. Only [`gather`] links or copies files to their place in the store.
//! It commits all cuts of a task at once, and each sub-domain by itself. So a task that runs twice, or is killed at any point, changes
//! nothing. Files are written under temporary names, synced and renamed.

mod folder;
mod gather;
mod perform;
mod schedule;
mod serve;
mod status;

pub use gather::{Gathered, end_plan, gather, plan};
pub use perform::{Performed, TaskSettings, perform};
pub use schedule::{Stage, StageKind, TASKS_MAX};
pub use serve::serve;
pub(super) use serve::{ask, begin, wrong_receipt};
pub use status::{Planned, TaskState, is_being_worked, is_planned, status};
