//! Settings of a run: memory, threads, cancelling, progress, the version to read. None of them changes the mesh.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use tetdb_schema::code::Code;

use super::memory::{Bytes, default_cap};
use super::{Error, error::Remedy};
use crate::pipeline::{self, MEMORY_MIN, RemoteWorkers, Watcher};
use tetdb_base::storage::{Budget, CancelToken, ScratchSpace};
use tetdb_kernel::sizing::SizeWarning;

/// An event that a run reports to its listener.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// Progress of the work; sent often.
    Progress {
        /// One or two words, constant for the same work.
        stage: &'static str,
        /// Work done so far, in `unit`.
        done: u64,
        /// Total work, if known.
        total: Option<u64>,
        /// Unit of `done` and `total`.
        unit: &'static str,
    },
    /// Information for the user.
    Note(String),
    /// A result that may differ from the intended one.
    Warning(String),
    /// A wanted size that the mesh will not have; see [`SizeWarning`].
    SizeWarning(SizeWarning),
    /// The surface of a store cannot be read. The mesh is verified without it.
    SurfaceMissing,
    /// The store at this path exists from now on and can be resumed.
    StoreBegun(PathBuf),
}

type Listener = Arc<dyn Fn(&Event) + Send + Sync>;

/// Settings of a run: memory, threads, cancelling, progress, the version to read.
///
/// None of them changes the mesh. Clones share the token and the listener.
#[derive(Clone, Default)]
pub struct Settings {
    memory: Option<Bytes>,
    threads: Option<usize>,
    pub(super) cancel: CancelToken,
    progress: Option<Listener>,
    scratch: Option<PathBuf>,
    pub(super) version: Option<String>,
    /// Other processes that do part of the work.
    pub(super) remote: RemoteWorkers,
}

impl fmt::Debug for Settings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Settings({:?}, {:?} threads)", self.memory, self.threads)
    }
}

impl Settings {
    /// Default settings: a cap of 60 % of the memory that is free when a run begins, one thread per core, no listener.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the memory cap of the run; at least 64 MiB.
    pub fn memory(mut self, cap: Bytes) -> Self {
        self.memory = Some(cap);
        self
    }

    /// Sets the number of threads, up to [`Settings::threads_max`]. The threads end with the run.
    pub fn threads(mut self, n: usize) -> Self {
        self.threads = Some(n);
        self
    }

    /// Ends the run soon after this token is cancelled.
    pub fn cancel(mut self, token: &CancelToken) -> Self {
        self.cancel = token.clone();
        self
    }

    /// Calls `listener` with each [`Event`], on any thread. The listener must return quickly.
    pub fn progress(mut self, listener: impl Fn(&Event) + Send + Sync + 'static) -> Self {
        self.progress = Some(Arc::new(listener));
        self
    }

    /// Sets the folder for temporary files of calls that only read. Default: the system's. A run that creates a mesh keeps its temporary
    /// files next to the store.
    pub fn scratch(mut self, folder: impl Into<PathBuf>) -> Self {
        self.scratch = Some(folder.into());
        self
    }

    /// Reads stores as they were in the version of this name. Calls that change a store refuse it.
    pub fn at_version(mut self, name: impl Into<String>) -> Self {
        self.version = Some(name.into());
        self
    }

    /// Memory and temporary files for a call that only reads. `held`: bytes already in use.
    #[doc(hidden)]
    pub fn scratch_space(&self, held: u64) -> Result<ScratchSpace, Error> {
        Ok(ScratchSpace::new(self.cap()?.saturating_sub(held), self.scratch_dir()))
    }

    /// Folder for temporary files of calls that only read.
    #[doc(hidden)]
    pub fn scratch_dir(&self) -> PathBuf {
        self.scratch.clone().unwrap_or_else(std::env::temp_dir)
    }

    /// The most threads that a run may have on this machine: 64, or eight for each core if that is more. More only take memory and time.
    pub fn threads_max() -> usize {
        (8 * n_cores()).max(64)
    }

    /// Number of threads of the run.
    pub fn n_threads(&self) -> usize {
        self.threads.unwrap_or_else(n_cores)
    }

    /// Errors: `usage` if the number of threads is zero or above [`Settings::threads_max`].
    pub(super) fn check_threads(&self) -> Result<(), Error> {
        let most = Self::threads_max();
        let message = match self.threads {
            Some(0) => "no thread is left to work".to_owned(),
            Some(n) if n > most => format!("{n} threads are more than {most}"),
            _ => return Ok(()),
        };
        let help = format!("allow from 1 to {most} threads; there are {} cores here", n_cores());
        Err(Error::new(Code::Usage, message).with_help(help))
    }

    /// The cap and its origin, in words.
    pub(super) fn cap_in_words(&self) -> String {
        match self.memory {
            Some(cap) => format!("{cap} (as asked for)"),
            None => {
                let (bytes, whence) = default_cap();
                format!("{} ({whence})", Bytes(bytes))
            }
        }
    }

    /// The cap in bytes.
    ///
    /// Errors: `memory` if the cap is below the minimum of any run; `usage` if no run may have so many threads.
    pub fn cap(&self) -> Result<u64, Error> {
        self.check_threads()?;
        match self.memory {
            None => Ok(default_cap().0),
            Some(Bytes(bytes)) if bytes < MEMORY_MIN => {
                let least = MEMORY_MIN >> 20;
                let message =
                    format!("{} are less than the {least} MiB any run needs", Bytes(bytes));
                Err(Error::new(Code::Memory, message).with_remedy(Remedy::Memory(MEMORY_MIN)))
            }
            Some(Bytes(bytes)) => Ok(bytes),
        }
    }

    /// The same for stores as they are.
    pub(super) fn at_now(&self) -> Self {
        Self { version: None, ..self.clone() }
    }

    pub(super) fn budget(&self) -> Result<Budget, Error> {
        Ok(Budget::new(self.cap()?))
    }

    pub(super) fn say(&self, event: &Event) {
        if let Some(listener) = &self.progress {
            listener(event);
        }
    }

    pub(super) fn note(&self, text: impl Into<String>) {
        self.say(&Event::Note(text.into()));
    }

    pub(super) fn warn(&self, text: impl Into<String>) {
        self.say(&Event::Warning(text.into()));
    }

    /// A listener for the pipeline's events, which passes them on as [`Event`]s.
    pub(super) fn watcher(&self) -> Box<Watcher<'_>> {
        Box::new(|event: pipeline::Event| {
            self.say(&Event::Progress {
                stage: event.stage,
                done: event.done,
                total: event.total,
                unit: event.unit,
            });
        })
    }

    /// Reports progress of counted work.
    pub(super) fn count(&self, stage: &'static str, done: u64, total: u64, unit: &'static str) {
        let total = Some(total);
        self.say(&Event::Progress { stage, done, total, unit });
    }
}

/// Cores that this process may use.
fn n_cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}
