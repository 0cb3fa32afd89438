//! A mesh by tasks that a batch scheduler starts: any machine, any order, as often as it likes.
//!
//! Beside the mesh the store has a folder `work` with everything that tasks and the process with the store's lock say to each other:
//!
//! | file | by | what |
//! |---|---|---|
//! | `plan` | [`plan`] | how many tasks, and what is the same for all |
//! | `size-field` | [`plan`] | the size field |
//! | `stage` | [`gather`] | the number of the first stage that is not committed, in digits |
//! | `task-00017.orders` | [`gather`] | what task 17 is to do |
//! | `task-00017.mark` | the task | who is at it, renewed while it lives; what went wrong |
//! | `files-ATTEMPT/` | the task | the files it wrote, under the names they will have |
//! | `task-00017.receipts` | the task | what it did, after its files |
//!
//! A task writes names that no other attempt at the same task writes, and only [`gather`] gives files their place in the store, one commit a
//! receipt. So a task that is done twice, or killed anywhere, changes nothing. Files are written under other names, synced and renamed.

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
pub use status::{Planned, TaskState, is_being_worked, status};
