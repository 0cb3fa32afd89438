//! Failures of work in another process.

/// Why another process did not do its share of the work.
#[derive(Clone, Debug)]
pub struct RemoteFailure {
    /// The error code.
    pub code: String,
    /// The failure and its place.
    pub message: String,
}
