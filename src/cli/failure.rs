//! Errors as the user sees them: a word, an exit code, what happened, where, what to do.

use clap::CommandFactory;

use super::args::Args;
use tetdb_base::storage::StorageError;
use tetdb_base::surface::SurfaceError;
use tetdb_engine::api::error::{Error, Remedy};
use tetdb_engine::pipeline::PipelineError;
use tetdb_io::read::ReadError;
use tetdb_io::write::WriteError;
use tetdb_kernel::boundary::BoundaryError;
use tetdb_kernel::sizing::SizingError;
use tetdb_store::query::QueryError;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::StoreError;

pub use tetdb_engine::api::{CODES, CodeRow};

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
        Self { code, message: message.to_string(), place: None, help: None }
    }

    pub fn at(mut self, place: impl ToString) -> Self {
        self.place = Some(place.to_string());
        self
    }

    pub fn help(mut self, help: impl ToString) -> Self {
        self.help = Some(help.to_string());
        self
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

impl From<Error> for Failure {
    /// What helps, in the words of the command line.
    fn from(e: Error) -> Self {
        let help = match e.remedy {
            Remedy::Memory(least) => {
                Some(format!("give at least --memory {}MiB", least.div_ceil(1 << 20)))
            }
            Remedy::General => Some(help_of(e.code()).to_owned()),
            Remedy::AsSaid => e.help().map(str::to_owned),
        };
        Self {
            code: e.code(),
            message: in_flags(e.message()),
            place: e.place().map(str::to_owned),
            help,
        }
    }
}

/// Errors of the modules below, by way of the front door's.
macro_rules! failures {
    ($($error:ty),*) => {$(
        impl From<$error> for Failure {
            fn from(e: $error) -> Self {
                Error::from(e).into()
            }
        }
    )*};
}

failures!(
    BoundaryError,
    PipelineError,
    QueryError,
    ReadError,
    SealedError,
    SizingError,
    StorageError,
    StoreError,
    SurfaceError,
    WriteError
);

/// A message that begins with an option's key, with the option as it is typed; and what makes a surface finer.
pub fn in_flags(text: &str) -> String {
    let text = text.replace(
        "refine the surface first",
        "refine it first with `tetdb refine-surface SURFACE FINE --hsiz H`",
    );
    let end = text.find([' ', ':']).unwrap_or(text.len());
    let (key, rest) = text.split_at(end);
    let root = Args::command();
    let mut options = (root.find_subcommand("mesh").into_iter()).flat_map(|m| m.get_arguments());
    match options.any(|option| option.get_id() == key && option.get_long().is_some()) {
        true => format!("--{}{rest}", key.replace('_', "-")),
        false => text,
    }
}

fn help_of(code: &str) -> &'static str {
    match code {
        "busy" => "wait for the other process, or stop it",
        "disk-full" => "free some space, then `tetdb resume STORE`",
        "damaged" => {
            "`tetdb verify STORE` lists what is damaged; `tetdb resaturate STORE --repair` meshes damaged sub-domains again, `--forget` drops a damaged previous version"
        }
        "memory" => "give more with --memory, or take a coarser surface",
        "stopped" if super::signals::has_store() => {
            "`tetdb resume STORE` goes on from the last finished step"
        }
        "stopped" => "nothing was begun; run it again",
        "no-such-part" => "`tetdb info STORE` lists what there is",
        "no-such-store" => "check the path; `tetdb mesh SURFACE -o STORE` creates a store",
        "not-a-store" => {
            "a store is a directory that this program wrote; a surface is looked at by `tetdb check SURFACE`, and a new store takes another path"
        }
        "store-exists" => "choose another path, or replace it with --force",
        "no-coarse-leaf" => "mesh the surface again without --drop-coarse",
        "store-unfinished" => "`tetdb resume STORE` goes on with it",
        "store-format" => "use the version of this program that wrote the store, or mesh again",
        "store-recipe" => {
            "go on with the version of this program that began it, or mesh again with --force"
        }
        "degenerate-triangle" | "duplicate-triangle" => {
            "`tetdb check SURFACE` lists all such triangles; `tetdb check SURFACE --repair --write OUT` drops them"
        }
        "open-surface" => {
            "`tetdb check SURFACE` lists the holes and says whether a repair closes them; otherwise close them where the surface was made; a sheet inside is none: give it with --embed FILE, or --allow-open"
        }
        "self-intersection" => {
            "`tetdb check SURFACE` lists the places; unite or separate the parts where the surface was made"
        }
        "empty-surface" => "choose a file that holds triangles",
        "coordinate-range" => "scale the surface to ordinary units, for example metres",
        "surface-too-large" => "split the surface into parts and mesh them one by one",
        "index-out-of-range" => {
            "write the file again from the program it comes from; vertex numbers must name vertices of the file"
        }
        "contradicting-orientation" => {
            "`--regions all` fills every volume whatever the orientation; or give each shared wall from both sides, once in each file"
        }
        "nothing-filled" => "try --regions all, and look at the surface with `tetdb check SURFACE`",
        "sheet-outside" => {
            "cut sheets off where they leave the filled regions, or fill the region they lie in (--regions)"
        }
        "wire-outside" => {
            "leave out what is outside the filled regions, or fill the region it lies in (--regions)"
        }
        "degenerate-edge" | "duplicate-wire" => {
            "give each edge and each point once, edges between different vertices"
        }
        "wire-contact" => {
            "edges and points meet triangles, and edges each other, in common vertices alone; `--refine-surface` puts in what lies exactly on one"
        }
        "wire-too-near" => {
            "join what is meant to meet, or move it apart: beside a triangle is not on it"
        }
        "nothing-to-undo" => {
            "only the last `tetdb resaturate` can be undone, once, and not after --forget"
        }
        "count-mismatch" => {
            "`tetdb export STORE part.npy --subdomain N` writes the arrays of a sub-domain in that order"
        }
        "unrecovered-triangles" => {
            "look at these triangles with `tetdb check SURFACE`; a finer or better shaped surface there helps"
        }
        "bad-sample" => {
            "for example sample:balls,count=100 or sample:box,h=0.1; see `tetdb sample --help`"
        }
        "surface-changed" => "put the old file back, or give the surface with --against",
        "size-field-changed" => "put the old files back, or mesh again with --force",
        "usage" => "write it to a file first: `tetdb sample balls,count=10 -o balls.stl`",
        "no-room" => {
            "`tetdb estimate SURFACE` tells what a mesh takes; ask for longer edges (--hsiz), give more --memory, or put the store on another disk with -o"
        }
        "invalid-mesh" => "`tetdb verify STORE --full --json` has examples; --embed names sheets",
        _ => "check the path and its permissions",
    }
}
