//! What shapes a mesh, besides its sizes.

pub use crate::pipeline::Subdomains;
pub use tetdb_kernel::boundary::RegionPolicy as Regions;
pub use tetdb_kernel::optimize::Mode as Optimize;
pub use tetdb_kernel::sizing::Length;
pub use tetdb_store::sealed::Form as Seal;

use super::{Error, job};
use crate::pipeline::{MeshOptions, OptionsText};

/// Parses options that were given as text, and looks at the file of sizes.
///
/// # Errors
/// The option and the value that have no meaning; `unreadable-file`.
pub fn typed(text: OptionsText) -> Result<MeshOptions, Error> {
    let mut options = MeshOptions::try_from(text)?;
    job::identify_sizes(&mut options)?;
    Ok(options)
}
