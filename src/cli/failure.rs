//! Errors as the user sees them: code, exit code, message, place, help.

use tetdb_engine::api::error::{Error, Remedy};
use tetdb_engine::api::{Code, SizeWarning};

/// An error to be printed.
#[derive(Debug)]
pub struct Failure {
    pub code: Code,
    pub message: String,
    pub place: Option<String>,
    pub help: Option<String>,
}

impl Failure {
    pub fn new(code: Code, message: impl ToString) -> Self {
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

    /// Adds to the help that `--force` overwrites `out`, if it is a file.
    pub fn or_force(mut self, out: &std::path::Path) -> Self {
        if let Some(help) = self.help.as_mut().filter(|_| out.is_file()) {
            help.push_str(", or overwrite it with --force");
        }
        self
    }

    /// Writes the names of the command's store and surface into the commands of the help.
    pub fn filled(mut self, names: &[(&str, String)]) -> Self {
        if let Some(help) = &mut self.help {
            let parts = help.split('`').enumerate().map(|(k, part)| match k % 2 {
                0 => part.to_owned(),
                _ => {
                    let words = part.split(' ').map(|word| {
                        names.iter().find(|(key, _)| *key == word).map_or(word, |(_, name)| name)
                    });
                    words.collect::<Vec<_>>().join(" ")
                }
            });
            *help = parts.collect::<Vec<_>>().join("`");
        }
        self
    }

    /// The exit code.
    pub fn exit(&self) -> u8 {
        match self.code {
            Code::Stopped => super::signals::exit_code(),
            code => code.exit(),
        }
    }
}

impl From<Error> for Failure {
    /// Converts an error, with help in terms of the command line.
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
            message: match e.option() {
                Some(option) => flag(option) + &e.message()[option.len()..],
                None => e.message().to_owned(),
            },
            place: e.place().map(str::to_owned),
            help,
        }
    }
}

/// The command-line flag of an option in a file of options.
fn flag(option: &str) -> String {
    format!("--{}", option.replace('_', "-"))
}

/// A warning in terms of command-line flags.
pub fn in_flags(warning: &SizeWarning) -> String {
    let help = match warning.needs_finer_surface() {
        true => "; refine it first with `tetdb refine-surface SURFACE FINE --hsiz H`",
        false => "",
    };
    format!("{} {}{help}", flag(warning.option()), warning.detail())
}

fn help_of(code: Code) -> &'static str {
    match code {
        Code::Busy => "wait for the other process, or stop it",
        Code::DiskFull if super::signals::has_store() => {
            "free some space, then `tetdb resume STORE`"
        }
        Code::DiskFull => "free some space, then run it again",
        Code::Damaged => {
            "`tetdb verify STORE` lists what is damaged; `tetdb resaturate STORE --repair` meshes damaged sub-domains again, `--forget` drops a damaged previous version, `tetdb version STORE drop NAME` one with a name"
        }
        Code::Memory => "give more with --memory, ask for longer edges, or take a coarser surface",
        Code::Stopped if super::signals::has_store() => {
            "`tetdb resume STORE` continues from the last finished step"
        }
        Code::Stopped => "nothing was begun; run it again",
        Code::NoSuchPart => "`tetdb info STORE` lists what there is",
        Code::NoSuchStore => "check the path; `tetdb mesh SURFACE -o STORE` creates a store",
        Code::NotAStore => {
            "a store is a directory that this program wrote; a surface is looked at by `tetdb check SURFACE`, and a new store takes another path"
        }
        Code::StoreExists => "choose another path, or replace it with --force",
        Code::NoCoarseLeaf => {
            "mesh the surface again without --drop-coarse; import an imported mesh again"
        }
        Code::StoreUnfinished => "`tetdb resume STORE` continues it",
        Code::StoreFormat => "use the version of this program that wrote the store, or mesh again",
        Code::StoreRecipe => {
            "go on with the version of this program that began it, or mesh again with --force"
        }
        Code::DegenerateTriangle | Code::DuplicateTriangle => {
            "`tetdb check SURFACE` lists all such triangles; `tetdb check SURFACE --repair --write OUT` drops them"
        }
        Code::OpenSurface => {
            "`tetdb check SURFACE` lists the holes and says which repair closes them; `--repair auto` takes the cheapest. If the open part is meant as a sheet inside, give it with --embed, or use --allow-open"
        }
        Code::SelfIntersection => {
            "`tetdb check SURFACE` lists the places, and says whether --repair resolve, which divides crossing triangles, leaves a surface that can be meshed"
        }
        Code::EmptySurface => "choose a file that holds triangles",
        Code::BadField => {
            "--no-fields imports the mesh without arrays of values; or write this one with numbers of type float64"
        }
        Code::CoordinateRange => "scale the surface to ordinary units, for example metres",
        Code::SurfaceTooLarge => "split the surface into parts and mesh them one by one",
        Code::IndexOutOfRange => {
            "write the file again from the program it comes from; vertex numbers must name vertices of the file"
        }
        Code::ContradictingOrientation => {
            "`--regions all` fills every volume whatever the orientation; or give each shared wall from both sides, once in each file"
        }
        Code::NothingFilled => {
            "try --regions all, and look at the surface with `tetdb check SURFACE`"
        }
        Code::SheetOutside => {
            "cut sheets off where they leave the filled regions, or fill the region they lie in (--regions)"
        }
        Code::WireOutside => {
            "--embed-outside skip leaves it out; --snap-embedded DIST moves onto the surface what is only just outside; or fill the region it lies in (--regions)"
        }
        Code::DegenerateEdge | Code::DuplicateWire => {
            "give each edge and each point once, edges between different vertices"
        }
        Code::WireContact => {
            "edges and points meet triangles, and edges each other, in common vertices alone; `--refine-surface` puts in what lies on one, and `--snap-embedded DIST` what lies near one"
        }
        Code::WireTooNear => {
            "join what is meant to meet, or move it apart; --snap-embedded DIST moves points and ends that are nearer to a triangle onto it"
        }
        Code::NothingToUndo => {
            "only the last `tetdb resaturate` or `tetdb version STORE restore` can be undone, once, and not after --forget; `tetdb version STORE list` lists what has a name"
        }
        Code::CountMismatch => {
            "`tetdb export STORE part.npy --subdomain N` writes the arrays of a sub-domain in that order"
        }
        Code::UnrecoveredTriangles => {
            "look at these triangles with `tetdb check SURFACE`; a finer or better shaped surface there helps"
        }
        Code::BadSample => {
            "for example sample:balls,count=100 or sample:box,h=0.1; see `tetdb sample --help`"
        }
        Code::SurfaceChanged => {
            "put the old file back, or mesh the new one with `tetdb mesh SURFACE -o STORE --force`; `tetdb verify` also takes the surface with --against"
        }
        Code::SizeFieldChanged => "put the old files back, or mesh again with --force",
        Code::Usage => "write it to a file first: `tetdb sample balls,count=10 -o balls.stl`",
        Code::NoRoom => {
            "`tetdb estimate SURFACE` tells what a mesh takes; ask for longer edges (--hsiz), give more --memory, or put the store on another disk with -o"
        }
        Code::InvalidMesh => {
            "`tetdb verify STORE --full --json` lists the places; with --against, also name sheets with --embed; after a change `tetdb resaturate STORE --undo` brings back the mesh before it"
        }
        Code::StoreChanged => "run the command again: the answer is then of the store as it is now",
        Code::NoTasks => {
            "`tetdb info STORE` says how far it is; `tetdb plan STORE --tasks N` plans an unfinished store, and `tetdb gather STORE` opens the next stage"
        }
        Code::TaskFile => "`tetdb gather STORE` writes the orders again; then do the task again",
        _ => "check the path and its permissions",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_has_the_names_of_the_command() {
        let names =
            [("STORE", "'my part.tetdb'".to_owned()), ("SURFACE", "a.stl b.stl".to_owned())];
        for (help, filled) in [
            ("`tetdb resume STORE` goes on", "`tetdb resume 'my part.tetdb'` goes on"),
            ("`tetdb check SURFACE --repair`", "`tetdb check a.stl b.stl --repair`"),
            ("a STORE, `tetdb info STORES`", "a STORE, `tetdb info STORES`"),
        ] {
            let failure = Failure::new(Code::Usage, "no").help(help).filled(&names);
            assert_eq!(failure.help.as_deref(), Some(filled));
        }
    }
}
