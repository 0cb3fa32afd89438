//! The command `verify`: checks that a mesh is a valid mesh of its surface.

use serde_json::json;

use super::args::VerifyArgs;
use super::console::Console;
use super::failure::Failure;
use super::input;
use super::words::quoted;
use super::{memory, threads};
use tetdb_engine::api::{Code, MeshOptions, Settings, Store, VerifyLevel};

pub fn run(args: &VerifyArgs, console: &Console) -> Result<u8, Failure> {
    let embeds = args.sheets.files().next().is_some()
        || args.sheets.allow_open
        || args.repair.repair.is_some();
    if embeds && args.against.is_empty() {
        let message = "--repair, --embed… and --allow-open describe the surface of --against, which is missing";
        return Err(Failure::new(Code::Usage, message)
            .help("name all files with --against and --embed…, or none: the store knows them"));
    }
    let settings = settings(args, console)?;
    let store = Store::open_with(&args.store, settings.clone())?;
    let level = if args.full { VerifyLevel::Delaunay } else { VerifyLevel::Geometry };
    let found = match args.against.is_empty() {
        true => store.verify(level)?,
        false => {
            let options = MeshOptions::default();
            let surface = input::load_with(
                &args.against,
                |surface| {
                    let is_repaired = args.repair.repair.is_some();
                    let surface = input::repaired(surface, &args.repair, &settings, console)?;
                    Ok(store.repaired_alike(surface, is_repaired)?)
                },
                &args.sheets,
                &options,
                &settings,
                console,
            )?;
            store.verify_against(&surface, level)?
        }
    };
    if console.is_json() {
        let mut answer = json!(found);
        answer["schema"] = json!(1);
        console.answer(&answer);
        return Ok(if found.is_valid() { 0 } else { 7 });
    }
    found.accept(&args.store)?;
    console.line(&found.sentence());
    if !store.summary().is_verified && args.at.at_version.is_none() {
        console.note(&format!(
            "the record of the store is left as it is; `tetdb resume {}` verifies and records it",
            quoted(&args.store)
        ));
    }
    Ok(0)
}

/// Settings of a verification: the cap, and the other ranks if any.
pub(super) fn settings(args: &VerifyArgs, console: &Console) -> Result<Settings, Failure> {
    let cap = memory::cap(args.read.memory.as_deref())?;
    #[cfg_attr(not(feature = "mpi"), allow(unused_mut))]
    let mut settings = console.settings(Some(cap), threads::requested(args.threads)?);
    #[cfg(feature = "mpi")]
    {
        settings = super::ranks::share_work(settings);
    }
    Ok(args.at.of(settings))
}
