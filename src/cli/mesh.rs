//! The commands `mesh` and `resume`.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::{MeshArgs, ResumeArgs, RunArgs};
use super::console::Console;
use super::failure::Failure;
use super::input;
use super::words::quoted;
use super::{config, export, info, memory, threads};
use tetdb_engine::api::targets::{check_target, inputs_of};
use tetdb_engine::api::{
    BOUNDARY_PREFIX, Code, Existing, Mesher, PageTraffic, SAMPLE_PREFIX, Settings, resume_reported,
};

pub fn run(args: &MeshArgs, console: &Console) -> Result<u8, Failure> {
    if let Some(file) = args.output.as_deref().filter(|out| export::check_format(out).is_ok()) {
        let message = format!("-o {0} names a mesh file; -o names the store", file.display());
        let help = format!("`--export {}` writes that file as well", file.display());
        return Err(Failure::new(Code::Usage, message).help(help));
    }
    let options = config::options(&args.shape)?;
    let files =
        (args.surfaces.iter()).chain(&args.shape.sizes.size_field).chain(args.sheets.files());
    let inputs: Vec<PathBuf> = files.map(PathBuf::from).collect();
    let settings = begin(&args.run, if args.force { &[] } else { &inputs }, console)?;
    let path = output(args);
    let existing = match args.force {
        true => Existing::Replace,
        false => Existing::Keep,
    };
    Mesher::check_path(&path, existing)?;
    let beside = input::scratch_beside(settings.clone(), &path);
    let surface = input::load_with(
        &args.surfaces,
        |surface| {
            let how = (&args.repair, &args.remesh);
            input::prepared(surface, how, &options, &beside, console)
        },
        &args.sheets,
        &options,
        &beside,
        console,
    )?;
    let mesher = Mesher::with_options(surface, options);
    let created = (args.periodic.pairs().fold(mesher, Mesher::periodic))
        .settings(settings.clone())
        .existing(existing)
        .preflight(!args.no_preflight)
        .coarse_only(args.coarse_only)
        .verify(!args.run.no_verify)
        .create_reported(&path)
        .map_err(|e| input::in_prepared(e.into(), (&args.repair, &args.remesh)))?;
    console.done();
    if created.was_there {
        console.note(&format!(
            "{} already holds the finished mesh of this surface with these options",
            path.display()
        ));
        return finish(&path, &args.run, &settings, None, console);
    }
    if args.coarse_only {
        return begun(&path, &settings, console);
    }
    finish(&path, &args.run, &settings, created.traffic, console)
}

/// Prints how to continue with a coarse mesh.
fn begun(path: &Path, settings: &Settings, console: &Console) -> Result<u8, Failure> {
    if console.is_json() {
        let mut answer = info::object(path)?;
        answer["memory_cap_bytes"] = json!(settings.cap()?);
        answer["peak_bytes"] = json!(memory::peak());
        console.answer(&answer);
    } else if !console.is_quiet() {
        let store = quoted(path);
        console.line(&format!("{}: the coarse mesh is there", path.display()));
        console.note(&format!(
            "next: `tetdb plan {store} --tasks N` makes tasks of the rest, `tetdb resume {store}` does it here"
        ));
    }
    Ok(0)
}

pub fn resume(args: &ResumeArgs, console: &Console) -> Result<u8, Failure> {
    let settings = begin(&args.run, &inputs_of(&args.store), console)?;
    let created = resume_reported(&args.store, &settings, !args.run.no_verify)?;
    console.done();
    finish(&args.store, &args.run, &settings, created.traffic, console)
}

/// Sets up threads, signals and the cap. Refuses outputs that are among `inputs`.
pub(super) fn begin(
    args: &RunArgs,
    inputs: &[PathBuf],
    console: &Console,
) -> Result<Settings, Failure> {
    let threads = threads::requested(args.threads)?;
    for out in &args.export {
        export::check_format(out)?;
        check_target(out, inputs)?;
    }
    let cap = memory::requested(args.memory.as_deref())?;
    #[cfg_attr(not(feature = "mpi"), allow(unused_mut))]
    let mut settings = console.settings(cap, threads);
    #[cfg(feature = "mpi")]
    {
        settings = super::ranks::share_work(settings);
    }
    Ok(settings)
}

/// The store that is written.
pub(super) fn output(args: &MeshArgs) -> PathBuf {
    args.output.clone().unwrap_or_else(|| {
        let first = args.surfaces.first().map_or("mesh", String::as_str);
        let first = first.strip_prefix(BOUNDARY_PREFIX).unwrap_or(first);
        let stem = match first.strip_prefix(SAMPLE_PREFIX) {
            Some(sample) => sample.split(',').next().map(Into::into),
            None => Path::new(first).file_stem().map(PathBuf::from),
        };
        stem.unwrap_or_else(|| PathBuf::from("mesh")).with_extension("tetdb")
    })
}

/// Exports the mesh and prints a summary.
pub(super) fn finish(
    path: &Path,
    args: &RunArgs,
    settings: &Settings,
    traffic: Option<PageTraffic>,
    console: &Console,
) -> Result<u8, Failure> {
    write_exports(path, args, settings, console)?;
    let cap = settings.cap()?;
    if console.is_json() {
        let mut answer = info::object(path)?;
        answer["memory_cap_bytes"] = json!(cap);
        answer["peak_bytes"] = json!(memory::peak());
        if let Some(traffic) = traffic {
            answer["pages_read"] = json!(traffic.pages_read);
            answer["pages_written"] = json!(traffic.pages_written);
            answer["frames_used"] = json!(traffic.frames_used);
        }
        console.answer(&answer);
    } else if !console.is_quiet() {
        info::print(path, console)?;
        if let Some(peak) = memory::peak().filter(|_| traffic.is_some()) {
            console.line(&format!("peak memory {} of {}", memory::show(peak), memory::show(cap)));
        }
        let [page, cut] = ["html", "png"].map(|ending| quoted(path.with_extension(ending)));
        let store = quoted(path);
        console.note(&format!(
            "next: `tetdb report {store} {page}` shows it in a browser, `tetdb snapshot {store} {cut}` draws a cut, `tetdb export {store} FILE.vtu` writes it for other programs"
        ));
    }
    Ok(0)
}

pub(super) fn write_exports(
    path: &Path,
    args: &RunArgs,
    settings: &Settings,
    console: &Console,
) -> Result<(), Failure> {
    for out in &args.export {
        export::write(path, out, settings, console)?;
    }
    Ok(())
}
