//! Failures of work that another process did.

/// Why another process did not do its share of the work.
#[derive(Clone, Debug)]
pub struct RemoteFailure {
    /// The error code.
    pub code: String,
    /// What happened, and where.
    pub message: String,
}
