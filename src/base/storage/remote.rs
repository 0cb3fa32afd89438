//! Failures of work in another process.

/// The failure of work in another process.
#[derive(Clone, Debug)]
pub struct RemoteFailure {
    /// The error code.
    pub code: String,
    /// The failure and its place.
    pub message: String,
}
