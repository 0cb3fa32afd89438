//! Numbers of threads as typed on the command line.

use super::failure::Failure;
use tetdb_engine::api::Code;

/// The requested number of threads. Errors: zero.
pub(super) fn requested(option: Option<usize>) -> Result<Option<usize>, Failure> {
    if option == Some(0) {
        let message = "--threads 0 is no thread to work with";
        return Err(Failure::new(Code::Usage, message).help("give 1 or more"));
    }
    Ok(option)
}
