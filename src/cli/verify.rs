//! `verify`: is it a valid mesh of its surface?

use serde_json::json;
use tetdb_schema::code::Code;

use super::args::VerifyArgs;
use super::console::Console;
use super::failure::Failure;
use super::input::{self, Space};
use super::{memory, threads};
use tetdb_base::surface;
use tetdb_engine::api::preflight::scratch_beside;
use tetdb_engine::api::store::open_finished;
use tetdb_engine::api::verify::{check, invalid, sentence};
use tetdb_engine::api::{Settings, Surface, guarded};
use tetdb_store::audit::Level;

/// A run of its own, with the threads that are asked for.
pub fn run(args: &VerifyArgs, console: &Console) -> Result<u8, Failure> {
    let settings = settings(args, console)?;
    guarded(&settings, || Ok(verify(args, &settings, console)))?
}

fn verify(args: &VerifyArgs, settings: &Settings, console: &Console) -> Result<u8, Failure> {
    let embeds = args.sheets.files().next().is_some() || args.sheets.allow_open;
    if embeds && args.against.is_empty() {
        let message =
            "what was embedded is named beside the surface alone, and --against names none";
        return Err(Failure::new(Code::Usage, message)
            .help("name all files with --against and --embed…, or none: the store knows them"));
    }
    let cap = settings.cap()?;
    let mut open = open_finished(&args.store)?;
    // The store may be one that can only be read.
    let scratch = std::env::temp_dir().join("verify");
    let space = Space { cap, beside: &scratch };
    let surface = match args.against.is_empty() {
        true => {
            let sources = open.job()?.surfaces;
            let left = scratch_beside(&surface::Surface::default(), cap, &scratch)?;
            Surface::of_record(&sources, &args.store, &left).map_err(Failure::from)
        }
        false => input::load_with(&args.against, (&args.sheets, false), space, console),
    };
    let surface = match surface {
        Ok(surface) => Some(surface.inner),
        Err(failure) if args.against.is_empty() && failure.code == "unreadable-file" => {
            console.note("note: the surface is not where it was; the mesh is verified without it (give it with --against)");
            None
        }
        Err(failure) => return Err(failure),
    };
    let level = if args.full { Level::Delaunay } else { Level::Geometry };
    let report = check(&mut open, settings, surface.as_ref(), cap, level)?;
    if console.is_json() {
        let mut answer = serde_json::to_value(&report).unwrap_or_default();
        answer["schema"] = json!(1);
        console.answer(&answer);
        return Ok(if report.valid { 0 } else { 7 });
    }
    if !report.valid {
        return Err(invalid(&report, &args.store).into());
    }
    console.line(&sentence(&report));
    Ok(0)
}

/// The cap, and who helps.
pub(super) fn settings(args: &VerifyArgs, console: &Console) -> Result<Settings, Failure> {
    let cap = memory::cap(args.read.memory.as_deref())?;
    #[cfg_attr(not(feature = "mpi"), allow(unused_mut))]
    let mut settings = console.settings(Some(cap), threads::asked(args.threads)?);
    #[cfg(feature = "mpi")]
    {
        settings = super::ranks::share_work(settings);
    }
    Ok(settings)
}
