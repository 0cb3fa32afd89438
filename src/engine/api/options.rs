//! Options of a mesh other than its sizes.

pub use crate::pipeline::{EmbedOutside, Subdomains};
pub use tetdb_kernel::boundary::RegionPolicy as Regions;
pub use tetdb_kernel::optimize::Mode as Optimize;
pub use tetdb_kernel::sizing::Length;
pub use tetdb_store::sealed::Form as Seal;

use super::{Error, job};
use crate::pipeline::{MeshOptions, OptionsText};

/// Parses options given as text, and reads the size file to record its hash.
///
/// # Errors
/// An option whose value makes no sense, with the value; `unreadable-file`.
pub fn typed(text: OptionsText) -> Result<MeshOptions, Error> {
    let mut options = MeshOptions::try_from(text)?;
    job::identify_sizes(&mut options)?;
    Ok(options)
}
