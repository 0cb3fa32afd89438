//! The error type of all calls.

use std::fmt;

use tetdb_base::storage::StorageError;
use tetdb_schema::code::Code;

/// The reason why a call failed: a code, a message, a place and, if known, a remedy.
///
/// Codes are those of [`Code`], the same as the program's. A failed call leaves nothing behind, except a store that can be resumed.
/// Messages name no option of any caller, because only the caller can tell which of its arguments helps.
#[derive(Clone, Debug, PartialEq)]
pub struct Error {
    code: Code,
    message: String,
    place: Option<String>,
    help: Option<String>,
    option: Option<&'static str>,
    #[doc(hidden)]
    pub remedy: Remedy,
}

/// A remedy that a caller can put in its own words.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[doc(hidden)]
pub enum Remedy {
    /// The text of [`Error::help`], if any.
    #[default]
    AsSaid,
    /// The text of [`Error::help`], which is the same for all errors with this code.
    General,
    /// A larger memory cap, of at least this many bytes.
    Memory(u64),
}

impl Error {
    #[doc(hidden)]
    pub fn new(code: Code, message: impl ToString) -> Self {
        let (message, remedy) = (message.to_string(), Remedy::AsSaid);
        Self { code, message, place: None, help: None, option: None, remedy }
    }

    #[doc(hidden)]
    pub fn at(mut self, place: impl ToString) -> Self {
        self.place = Some(place.to_string());
        self
    }

    #[doc(hidden)]
    pub fn with_help(mut self, help: impl ToString) -> Self {
        self.help = Some(help.to_string());
        self
    }

    #[doc(hidden)]
    pub fn with_remedy(mut self, remedy: Remedy) -> Self {
        self.remedy = remedy;
        self
    }

    /// Sets the option, if the message begins with `option`.
    pub(super) fn with_option(mut self, option: Option<&'static str>) -> Self {
        self.option = option.filter(|option| self.message.starts_with(option));
        self
    }

    #[doc(hidden)]
    pub fn add(&mut self, text: &str) {
        self.message += text;
    }

    #[doc(hidden)]
    pub fn internal(message: String) -> Self {
        Self::new(Code::Internal, message)
            .with_help("this is a bug; please report the call and this message")
    }

    /// The code, one of [`Code::ALL`].
    pub fn code(&self) -> Code {
        self.code
    }

    /// The message.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The place of the failure: a file with its line or byte, ids, coordinates.
    pub fn place(&self) -> Option<&str> {
        self.place.as_deref()
    }

    /// The error of a run that was cancelled.
    pub fn stopped() -> Self {
        StorageError::Cancelled.into()
    }

    /// The option or argument with a value that makes no sense, by its key in a file of options. The message begins with this key.
    pub fn option(&self) -> Option<&'static str> {
        self.option
    }

    /// Help: a way out, if one is known.
    pub fn help(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Exit code of the program for this error.
    pub fn exit_code(&self) -> u8 {
        self.code.exit()
    }

    /// Returns whether the run was cancelled. Steps finished before that are kept.
    pub fn is_cancelled(&self) -> bool {
        self.code == "stopped"
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.code, self.message)?;
        if let Some(place) = &self.place {
            write!(f, " (at {place})")?;
        }
        match &self.help {
            Some(help) => write!(f, "; {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Error {}
