//! Failures of work in another process.

use tetdb_schema::code::Code;

/// Why another process did not do its share of the work.
#[derive(Clone, Debug)]
pub struct RemoteFailure {
    /// The error code.
    pub code: Code,
    /// What happened, and where.
    pub message: String,
}
