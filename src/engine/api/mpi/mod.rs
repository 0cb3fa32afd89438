//! Meshing by the ranks of an MPI program. Rank 0 runs like a single process; the other ranks perform orders that it sends.
//!
//! Reading order: `mailbox` (messages between ranks), `rank_workers` (the other ranks as workers of rank 0), `shared_file` (a file that
//! all ranks write), `ranks`.

mod mailbox;
mod rank_workers;
mod ranks;
mod shared_file;

pub use ranks::Ranks;
