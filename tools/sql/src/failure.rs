//! DataFusion's errors as those of the library.

use datafusion::common::DataFusionError;
use tetdb::{Code, Error};

/// The error of the library within one of DataFusion's, or one that says what DataFusion does. `tables`: what there is to ask.
pub(crate) fn of_query(error: DataFusionError, tables: &str) -> Error {
    let mut inner: Option<&(dyn std::error::Error + 'static)> = Some(&error);
    while let Some(this) = inner {
        if let Some(own) = this.downcast_ref::<Error>() {
            return own.clone();
        }
        inner = this.source();
    }
    let message = error.strip_backtrace();
    match error.find_root() {
        DataFusionError::ResourcesExhausted(_) => Error::new(Code::Memory, message)
            .with_help("allow more memory, or ask for fewer rows or groups"),
        DataFusionError::IoError(_) => Error::new(Code::DiskFull, message)
            .with_help("a temporary file could not be written or read; free some space"),
        DataFusionError::Internal(_) => Error::new(Code::Internal, message)
            .with_help("this is a bug; please report the query and this message"),
        _ => Error::new(Code::BadQuery, message).with_help(format!("there are {tables}")),
    }
}
