//! What shapes a mesh, besides its sizes.

pub use crate::pipeline::Subdomains;
pub use tetdb_kernel::boundary::RegionPolicy as Regions;
pub use tetdb_kernel::optimize::Mode as Optimize;
pub use tetdb_kernel::sizing::Length;
pub use tetdb_store::sealed::Form as Seal;
