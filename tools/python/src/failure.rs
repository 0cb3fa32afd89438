//! Why something was not done, on its way to an exception.

use pyo3::prelude::*;
use tetdb::Code;
use tetdb::data::SealedError;

/// What an exception says: the library's error, or the end of a thread.
pub struct Failure {
    code: String,
    message: String,
    place: Option<String>,
    help: Option<String>,
}

impl Failure {
    pub fn internal(message: &str) -> Self {
        Self {
            code: "internal".to_owned(),
            message: message.to_owned(),
            place: None,
            help: Some("this is a bug; please report the call and this message".to_owned()),
        }
    }

    /// A question to a store while a callable gives the values of a new field of it.
    pub fn busy() -> Self {
        Self {
            code: Code::Busy.to_string(),
            message: "a callable gives the values of a new field of this store".to_owned(),
            place: None,
            help: Some("ask when the field is added, or ask another store".to_owned()),
        }
    }

    /// A read that was cancelled: the exception that cancelled it is raised instead.
    pub fn cancelled() -> Self {
        Self {
            code: "stopped".to_owned(),
            message: "it was cancelled".to_owned(),
            place: None,
            help: None,
        }
    }

    /// The exception of the Python half for this code.
    pub fn raised(self, py: Python<'_>) -> PyErr {
        let exception = || {
            let module = py.import("tetdb._errors")?;
            let words = (self.code, self.message, self.place, self.help);
            module.getattr("of_code")?.call1(words)
        };
        match exception() {
            Ok(exception) => PyErr::from_value(exception),
            Err(error) => error,
        }
    }
}

impl From<tetdb::Error> for Failure {
    fn from(error: tetdb::Error) -> Self {
        Self {
            code: error.code().to_string(),
            message: error.message().to_owned(),
            place: error.place().map(str::to_owned),
            help: error.help().map(str::to_owned),
        }
    }
}

impl From<SealedError> for Failure {
    fn from(error: SealedError) -> Self {
        tetdb::Error::from(error).into()
    }
}
