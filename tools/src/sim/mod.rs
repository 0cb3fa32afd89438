//! A disk in memory for tests: it counts what is asked of it, and there can be trouble.

mod campaign;
mod case;
mod content;
mod disk;
mod door;
mod image;
mod rng;
mod state;

pub use campaign::{Changed, End, Reference, exit_code, unclean};
pub use case::{Case, Digests, Ended};
pub use disk::SimDisk;
pub use image::Wreck;
pub use rng::Rng;
pub use state::Call;

/// What is wrong with a disk. Calls and boundaries are counted from when it is set.
#[derive(Clone, Debug, Default)]
pub struct Trouble {
    /// This call fails.
    pub fail_at: Option<u64>,
    /// All calls from there on fail.
    pub fails_on: bool,
    /// Syncs of this kind are said to be done and are not.
    pub lies: Option<Call>,
    /// Bytes files may take up.
    pub space: Option<u64>,
    /// From this boundary on nothing is done any more, as when the process is killed before it.
    pub die_at_boundary: Option<u64>,
    /// Moments of loss of power, and seeds of what is lost: calls descending.
    pub crash_at: Vec<(u64, u64)>,
}
