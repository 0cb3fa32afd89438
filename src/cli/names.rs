//! Names of the store and the surface of a command, for help that can be copied.

use super::args::{Command, SheetArgs};
use super::words::quoted;
use super::{import, mesh};

/// The names that stand for STORE and SURFACE in help, as a shell reads them.
pub fn names(command: &Command) -> Vec<(&'static str, String)> {
    let (store, surfaces) = match command {
        Command::Mesh(a) => (Some(mesh::output(a)), plain(&a.surfaces, &a.sheets)),
        Command::Import(a) => (Some(import::output(a)), None),
        Command::Estimate(a) => (None, plain(&a.surfaces, &a.sheets)),
        Command::Check(a) => (None, plain(&a.surfaces, &a.sheets)),
        Command::RefineSurface(a) => {
            (None, plain(std::slice::from_ref(&a.surface), &SheetArgs::default()))
        }
        Command::RemeshSurface(a) => {
            (None, plain(std::slice::from_ref(&a.surface), &SheetArgs::default()))
        }
        Command::Wrap(a) => (None, plain(&a.surfaces, &SheetArgs::default())),
        Command::Resume(a) => (Some(a.store.clone()), None),
        Command::Plan(a) => (Some(a.store.clone()), None),
        Command::Work(a) => (Some(a.store.clone()), None),
        Command::Gather(a) => (Some(a.store.clone()), None),
        Command::Resaturate(a) => (Some(a.store.clone()), None),
        Command::Adapt(a) => (Some(a.store.clone()), None),
        Command::Info(a) => (Some(a.of.store.clone()), None),
        Command::Digest(a) => (Some(a.store.clone()), None),
        Command::Query(a) => (Some(a.store.clone()), None),
        Command::Field(a) => (Some(a.store.clone()), None),
        Command::Transfer(a) => (Some(a.to.clone()), None),
        Command::Periodic(a) => (Some(a.store.clone()), None),
        Command::Version(a) => (Some(a.store.clone()), None),
        Command::Verify(a) => (Some(a.store.clone()), None),
        Command::Export(a) => (Some(a.store.clone()), None),
        Command::Snapshot(a) => (Some(a.store.clone()), None),
        Command::Report(a) => (Some(a.store.clone()), None),
        Command::View(a) => (Some(a.store.clone()), None),
        Command::Compare(_) | Command::Sample(_) | Command::Completions(_) | Command::Man(_) => {
            (None, None)
        }
    };
    let store = store.map(|path| ("STORE", quoted(&path)));
    store.into_iter().chain(surfaces.map(|names| ("SURFACE", names))).collect()
}

/// The surfaces of a command as a shell reads them; `None` where they are not all of it, or are read from a pipe.
fn plain(surfaces: &[String], sheets: &SheetArgs) -> Option<String> {
    let is_all = sheets.files().next().is_none() && !surfaces.iter().any(|file| file == "-");
    let quoted: Vec<String> = surfaces.iter().map(quoted).collect();
    is_all.then(|| quoted.join(" "))
}
