//! What went wrong, in a form that any caller can act on.

use std::fmt;

use tetdb_base::storage::StorageError;
use tetdb_schema::code::Code;

/// Why a call did not do what was asked: a word, a message, a place and, where one is known, a way out.
///
/// The words are those of [`Code`], the same as the program's. Nothing of a failed call is left behind but a store that can be
/// resumed. Messages name no option of any caller: which argument helps is the caller's knowledge.
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

/// What would help, for a caller that has words of its own for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[doc(hidden)]
pub enum Remedy {
    /// What [`Error::help`] says, if anything.
    #[default]
    AsSaid,
    /// The same, but any error with this code has it.
    General,
    /// So many bytes of memory at least.
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

    /// `option` is the first word of the message.
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

    /// The word for it, one of [`Code::ALL`].
    pub fn code(&self) -> Code {
        self.code
    }

    /// What happened.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Where: a file with its line or byte, ids, coordinates.
    pub fn place(&self) -> Option<&str> {
        self.place.as_deref()
    }

    /// The error of a run that was cancelled.
    pub fn stopped() -> Self {
        StorageError::Cancelled.into()
    }

    /// The option or argument that has no meaning, by its key in a file of options. The message begins with it.
    pub fn option(&self) -> Option<&'static str> {
        self.option
    }

    /// What to do about it.
    pub fn help(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// The exit code the program has for it.
    pub fn exit_code(&self) -> u8 {
        self.code.exit()
    }

    /// Whether the run was cancelled; what it had finished is kept.
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
