//! Errors as the user sees them: a word, an exit code, what happened, where, what to do.

use std::sync::Mutex;

use crate::boundary::BoundaryError;
use crate::io::read::ReadError;
use crate::io::write::WriteError;
use crate::pipeline::PipelineError;
use crate::query::QueryError;
use crate::sealed::SealedError;
use crate::sizing::SizingError;
use crate::storage::StorageError;
use crate::store::StoreError;
use crate::surface::SurfaceError;

/// One row of the table of errors.
pub struct CodeRow {
    pub code: &'static str,
    pub exit: u8,
    pub meaning: &'static str,
}

const fn row(code: &'static str, exit: u8, meaning: &'static str) -> CodeRow {
    CodeRow {
        code,
        exit,
        meaning,
    }
}

/// Every error word, its exit code, and what it means; README carries the same table.
pub const CODES: &[CodeRow] = &[
    row(
        "internal",
        1,
        "a bug: please report it with the command and the message",
    ),
    row("usage", 2, "the command line makes no sense"),
    row(
        "bad-size",
        2,
        "a size option has no meaning, or contradicts another",
    ),
    row(
        "bad-config",
        2,
        "a configuration file has a fault, or a key or word that is not known",
    ),
    row(
        "bad-query",
        2,
        "a place, list, id or column of a query has no meaning",
    ),
    row("bad-expression", 2, "an expression cannot be read"),
    row("bad-memory", 2, "a memory size has no unit or no meaning"),
    row(
        "bad-sample",
        2,
        "there is no such sample, or a key of it is wrong",
    ),
    row(
        "unreadable-file",
        3,
        "an input file is missing or may not be read",
    ),
    row(
        "unknown-format",
        3,
        "the format of a file cannot be told from its name",
    ),
    row("truncated-file", 3, "an input file ends too early"),
    row(
        "unexpected-text",
        3,
        "an input file has something else than its format asks for",
    ),
    row("not-a-number", 3, "a coordinate is not a finite number"),
    row(
        "index-out-of-range",
        3,
        "a triangle names a vertex that is not there",
    ),
    row("count-mismatch", 3, "a declared count cannot be right"),
    row(
        "coordinate-range",
        3,
        "a coordinate, or the whole surface, is too large or too small to compute with exactly",
    ),
    row(
        "unsupported-content",
        3,
        "a file has elements that do not make a triangle surface",
    ),
    row(
        "surface-too-large",
        3,
        "more triangles or vertices than 32-bit numbers can name",
    ),
    row(
        "lossy-format",
        3,
        "the chosen format would round coordinates",
    ),
    row(
        "format-limit",
        3,
        "the mesh is larger than the chosen format can number",
    ),
    row("empty-surface", 3, "there are no triangles"),
    row("degenerate-triangle", 3, "a triangle has no area"),
    row("duplicate-triangle", 3, "a triangle occurs twice"),
    row("open-surface", 3, "an edge has only one triangle"),
    row(
        "self-intersection",
        3,
        "triangles meet where they should not",
    ),
    row(
        "unrecovered-triangles",
        3,
        "input triangles that could not be made faces of the mesh",
    ),
    row(
        "nothing-filled",
        3,
        "the surface encloses no region to fill",
    ),
    row("no-such-store", 3, "there is no store at this path"),
    row(
        "no-such-part",
        3,
        "the store has no such tetrahedron, vertex, label, sub-domain, interface or stage",
    ),
    row("damaged", 4, "the store is not what was written"),
    row("busy", 5, "another process writes the store"),
    row("memory", 6, "the memory cap is too small for this work"),
    row(
        "no-room",
        6,
        "the disk has less room than the mesh is expected to need",
    ),
    row("disk-full", 6, "the disk is full"),
    row("io", 6, "the system refused to read or write a file"),
    row("invalid-mesh", 7, "verification found the mesh invalid"),
    row("store-exists", 8, "a finished store is already there"),
    row("store-unfinished", 8, "the store is not finished"),
    row(
        "no-coarse-leaf",
        8,
        "what the sub-domain was made from was not kept",
    ),
    row(
        "nothing-to-undo",
        8,
        "no previous version of a sub-domain is kept",
    ),
    row("not-a-store", 8, "what is there is not a store"),
    row("store-format", 8, "the store has another format version"),
    row(
        "surface-changed",
        8,
        "the surface is not the one the store was begun with",
    ),
    row(
        "size-field-changed",
        8,
        "the sizes of --size-field are not those the store was begun with",
    ),
    row(
        "stopped",
        130,
        "stopped by a signal; `tetdb resume` goes on",
    ),
];

/// An error on its way to the user.
#[derive(Debug)]
pub struct Failure {
    pub code: &'static str,
    pub message: String,
    pub place: Option<String>,
    pub help: Option<String>,
}

impl Failure {
    pub fn new(code: &'static str, message: impl ToString) -> Self {
        Self {
            code,
            message: message.to_string(),
            place: None,
            help: None,
        }
    }

    pub fn at(mut self, place: impl ToString) -> Self {
        self.place = Some(place.to_string());
        self
    }

    pub fn help(mut self, help: impl ToString) -> Self {
        self.help = Some(help.to_string());
        self
    }

    pub fn internal(message: String) -> Self {
        Self::new("internal", message)
            .help("this is a bug; please report the command and this message")
    }

    /// The exit code of its word.
    pub fn exit(&self) -> u8 {
        if self.code == "stopped" {
            return super::signals::exit_code();
        }
        let row = CODES.iter().find(|row| row.code == self.code);
        row.map_or(1, |row| row.exit)
    }
}

static PANIC: Mutex<Panic> = Mutex::new(Panic {
    message: String::new(),
    is_in_redb: false,
});

struct Panic {
    message: String,
    /// redb asserts what it reads; a damaged tree ends there.
    is_in_redb: bool,
}

/// Keeps what is known of a panic for [`last_panic`].
pub fn remember_panic(info: &std::panic::PanicHookInfo) {
    let file = info.location().map_or("", std::panic::Location::file);
    if let Ok(mut panic) = PANIC.lock() {
        panic.message = info.to_string();
        panic.is_in_redb = std::path::Path::new(file)
            .iter()
            .any(|part| part.to_string_lossy().starts_with("redb-"));
    }
}

/// The last panic: damage when it came from redb, otherwise a bug of ours.
pub fn last_panic() -> Failure {
    let Ok(panic) = PANIC.lock() else {
        return Failure::internal(String::new());
    };
    if panic.is_in_redb {
        return Failure::new("damaged", "a database file of the store cannot be followed")
            .at(panic.message.replace('\n', " "))
            .help(help_of("damaged"));
    }
    Failure::internal(panic.message.clone())
}

impl From<ReadError> for Failure {
    fn from(e: ReadError) -> Self {
        Self::new(e.code(), &e).at(e.place()).help(e.help())
    }
}

impl From<WriteError> for Failure {
    fn from(e: WriteError) -> Self {
        let failure = Self::new(e.code(), &e).help(e.help());
        match e.place() {
            Some(path) => failure.at(path.display()),
            None => failure,
        }
    }
}

impl From<SurfaceError> for Failure {
    fn from(e: SurfaceError) -> Self {
        let failure = Self::new(e.code(), &e).help(e.help());
        match &e {
            SurfaceError::Invalid { defect, n_defects } => {
                let more = match n_defects.saturating_sub(1) {
                    0 => String::new(),
                    n => format!(" (and {n} more defects)"),
                };
                failure.at(defect.place() + &more)
            }
            _ => failure,
        }
    }
}

impl From<StorageError> for Failure {
    fn from(e: StorageError) -> Self {
        let code = match &e {
            StorageError::Busy { .. } => "busy",
            StorageError::Full { .. } => "disk-full",
            StorageError::Damaged { .. }
            | StorageError::Page { .. }
            | StorageError::Missing { .. } => "damaged",
            StorageError::Budget { .. } | StorageError::TooMany { .. } => "memory",
            StorageError::Cancelled => "stopped",
            _ => "io",
        };
        Self::new(code, &e).help(help_of(code))
    }
}

impl From<StoreError> for Failure {
    fn from(e: StoreError) -> Self {
        let code = match e {
            StoreError::Storage(inner) => return inner.into(),
            StoreError::Sealed(SealedError::Storage(inner)) => return inner.into(),
            StoreError::Busy { .. } => "busy",
            StoreError::NotFound { .. } => "no-such-store",
            StoreError::NoSubdomain { .. } => "no-such-part",
            StoreError::NotOurs { .. } => "not-a-store",
            StoreError::Finished { .. } => "store-exists",
            StoreError::Unfinished { .. } | StoreError::Sealed(SealedError::NotSealed { .. }) => {
                "store-unfinished"
            }
            StoreError::NoCoarseSnapshot { .. } => "no-coarse-leaf",
            StoreError::Format { .. } => "store-format",
            StoreError::Row { .. }
            | StoreError::Sealed(SealedError::Chunk { .. })
            | StoreError::Sealed(SealedError::Content { .. }) => "damaged",
        };
        Self::new(code, &e).help(help_of(code))
    }
}

impl From<QueryError> for Failure {
    fn from(e: QueryError) -> Self {
        match e {
            QueryError::Store(e) => e.into(),
            other => Self::new("no-such-part", other).help(help_of("no-such-part")),
        }
    }
}

impl From<SizingError> for Failure {
    fn from(e: SizingError) -> Self {
        Self::new("bad-size", e).help("a size is a length in the surface's units, such as 0.5, or a share of its box diagonal, such as 1%")
    }
}

impl From<BoundaryError> for Failure {
    fn from(e: BoundaryError) -> Self {
        Self::new("unrecovered-triangles", &e)
            .help("look at these triangles with `tetdb check SURFACE`; a finer or better shaped surface there helps")
    }
}

impl From<PipelineError> for Failure {
    fn from(e: PipelineError) -> Self {
        match e {
            PipelineError::Surface(e) => e.into(),
            PipelineError::Boundary(e) => e.into(),
            PipelineError::Sizing(e) => e.into(),
            PipelineError::Store(e) => e.into(),
            PipelineError::Storage(e) => e.into(),
            PipelineError::NothingFilled { .. } => Self::new("nothing-filled", &e)
                .help("try --regions all, and look at the surface with `tetdb check SURFACE`"),
            PipelineError::NothingToUndo { .. } => {
                Self::new("nothing-to-undo", &e).help("only the last `tetdb resaturate` can be undone, once, and not after --forget")
            }
            PipelineError::SizeCount { .. } => Self::new("count-mismatch", &e)
                .help("`tetdb export STORE part.npy --subdomain N` writes the arrays of a sub-domain in that order"),
            other => Self::new("usage", other),
        }
    }
}

fn help_of(code: &str) -> &'static str {
    match code {
        "busy" => "wait for the other process, or stop it",
        "disk-full" => "free some space, then `tetdb resume STORE`",
        "damaged" => {
            "`tetdb verify STORE` lists what is damaged; `tetdb resaturate STORE --repair` makes damaged sub-domains again, `--forget` drops a damaged previous version"
        }
        "memory" => "give more with --memory, or mesh a coarser surface",
        "stopped" if super::signals::has_store() => {
            "`tetdb resume STORE` goes on from the last finished step"
        }
        "stopped" => "nothing was begun; run it again",
        "no-such-part" => "`tetdb info STORE` lists what there is",
        "no-such-store" => "check the path; `tetdb mesh SURFACE -o STORE` makes a store",
        "not-a-store" => "choose another path; what is there was not made by this program",
        "store-exists" => "choose another path, or replace it with --force",
        "no-coarse-leaf" => "mesh the surface again without --drop-coarse",
        "store-unfinished" => "`tetdb resume STORE` goes on with it",
        "store-format" => "use the version of this program that made the store, or mesh again",
        _ => "check the path and its permissions",
    }
}
