//! Ranks of an MPI program share a mesh: rank 0 runs as one process does, the others perform orders that come as messages.
//!
//! Reading order: `mailbox` (messages between ranks), `rank_workers` (the other ranks as workers of rank 0), `shared_file` (a file that
//! all ranks write), `ranks`.

mod mailbox;
mod rank_workers;
mod ranks;
mod shared_file;

pub use ranks::Ranks;
