//! Pages, cache, budget, transactions. This room knows bytes and records, not geometry.

mod error;
mod file;

pub use error::StoreError;
pub use file::StoreFile;
