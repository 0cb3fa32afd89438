//! Numbers of threads as typed on the command line.

use super::failure::Failure;
use tetdb_engine::api::{Code, Settings};

/// The requested number of threads. Errors: zero, or more than any run may have here.
pub(super) fn requested(option: Option<usize>) -> Result<Option<usize>, Failure> {
    let most = Settings::threads_max();
    let message = match option {
        Some(0) => "--threads 0 is no thread to work with".to_owned(),
        Some(n) if n > most => format!("--threads {n} is more than {most}, the most here"),
        _ => return Ok(option),
    };
    let help = format!("give 1 to {most}; more than there are cores make no run faster");
    Err(Failure::new(Code::Usage, message).help(help))
}
