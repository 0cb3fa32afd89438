//! `mesh` and `resume`.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::args::{MeshArgs, ResumeArgs, RunArgs};
use super::console::Console;
use super::failure::Failure;
use super::input::{self, Input, Space};
use super::{background, config, estimate, export, info, memory, replace, signals, store, verify};
use crate::io::write::Selection;
use crate::pipeline::{self, Options, Prepared, Summary};
use crate::storage::Budget;
use crate::store::{Catalog, StoreError};
use crate::surface::Surface;
use tetdb_schema::catalog::{Job, StoreState};

/// A surface that takes more than this part of the cap is not kept while the mesh is refined.
const SURFACE_KEPT: u64 = 8;

pub fn run(args: &MeshArgs, console: &Console) -> Result<u8, Failure> {
    let options = config::options(&args.shape)?;
    // Sizes are checked before anything is read.
    options.sizes()?;
    let (cap, whence) = begin(&args.run, console)?;
    let path = output(args);
    replace::settle(&path, console)?;
    if let Some(exit) = already_there(&path, args, &options, console)? {
        return Ok(exit);
    }
    let clock = Instant::now();
    let space = Space::Capped(cap, &path);
    let mut input = input::load(&args.surfaces, space, console)?;
    if !args.no_preflight {
        estimate::surface_fits(&input.surface, cap)?;
    }
    let watch = |event| console.progress(event);
    let prepared = pipeline::ahead(&input.surface, &options, cap, &watch, |taken| {
        let space = Space::Capped(cap - taken, &path);
        input::validated(&input.surface, space)?;
        console.note(&format!(
            "{} triangles and {} vertices, closed and free of defects ({:.1} s)",
            input.surface.n_triangles(),
            input.surface.n_vertices(),
            clock.elapsed().as_secs_f64()
        ));
        console.note(&format!("memory: {} ({whence})", memory::show(cap)));
        let prepared = prepared(&input.surface, &options, cap, space)?;
        if !args.no_preflight {
            estimate::preflight(&prepared.estimate, cap, &path, console)?;
        }
        Ok::<_, Failure>(prepared)
    })?;
    // With --force the old store is only replaced once the new one is sealed.
    let replaces = path.exists() && !Catalog::is_vacant(&path);
    let place = match replaces {
        true => replace::new_of(&path),
        false => path.clone(),
    };
    let job = Job {
        options: serde_json::to_string(&options).unwrap_or_default(),
        surfaces: input.sources.clone(),
        tool_version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let needed = (prepared.0.estimate).disk_peak_bytes(cap, rayon::current_num_threads());
    let is_same = |begun: &mut Catalog| begun.job().is_ok_and(|begun| begun == job);
    let begun = match replaces {
        true => replace::take_up(&path, is_same)?,
        false => None,
    };
    signals::store_begins();
    let mut catalog = match begun {
        Some(catalog) => {
            console.note(&format!("going on with {}", place.display()));
            catalog
        }
        None => Catalog::create(&place, &job)?,
    };
    let budget = Budget::new(cap);
    let surface = lent_or_given(&mut input, cap);
    let made = if catalog.state()? < StoreState::Coarse {
        pipeline::mesh_prepared(&mut catalog, surface, &options, prepared, &budget, &watch)
    } else {
        drop(prepared);
        pipeline::mesh(&mut catalog, &surface, &options, &budget, &watch)
    };
    let summary = match made.map_err(Failure::from) {
        // A refused surface or option leaves nothing to resume.
        Err(failure) if matches!(failure.exit(), 2 | 3) => {
            drop(catalog);
            replace::remove(&place)?;
            return Err(failure);
        }
        other => other.map_err(|e| estimate::with_room(e, &place, Some(needed)))?,
    };
    tell(&summary, console);
    catalog.close()?;
    if replaces {
        replace::exchange(&path)?;
    }
    finish(&path, &input, &args.run, cap, Some(&summary), console)
}

pub fn resume(args: &ResumeArgs, console: &Console) -> Result<u8, Failure> {
    let (cap, _) = begin(&args.run, console)?;
    replace::settle(&args.store, console)?;
    // A run with --force was interrupted: what it replaces is finished.
    let replaces = replace::is_begun(&args.store);
    let place = match replaces {
        true => replace::new_of(&args.store),
        false => args.store.clone(),
    };
    let mut reader = Catalog::open(&place)?;
    let state = reader.state()?;
    let space = Space::Capped(cap, &args.store);
    let mut input = store::surface_of(&mut reader, &[], space, console)?;
    let job = reader.job()?;
    drop(reader);
    if state.is_finished() {
        if replaces {
            replace::exchange(&args.store)?;
        }
        console.note(&format!("{} is already finished", args.store.display()));
        return finish(&args.store, &input, &args.run, cap, None, console);
    }
    let options: Options = serde_json::from_str(&job.options).map_err(|e| {
        Failure::new("damaged", format!("the job's options cannot be read: {e}"))
            .at(place.display())
    })?;
    let mut catalog = Catalog::open_writable(&place)?;
    let watch = |event| console.progress(event);
    let budget = Budget::new(cap);
    let made = if state < StoreState::Coarse {
        let prepared = pipeline::ahead(&input.surface, &options, cap, &watch, |taken| {
            let space = Space::Capped(cap - taken, &args.store);
            prepared(&input.surface, &options, cap, space)
        })?;
        signals::store_begins();
        let surface = lent_or_given(&mut input, cap);
        pipeline::mesh_prepared(&mut catalog, surface, &options, prepared, &budget, &watch)
    } else {
        signals::store_begins();
        pipeline::mesh(&mut catalog, &input.surface, &options, &budget, &watch)
    };
    let summary = made.map_err(|e| estimate::with_room(e.into(), &place, None))?;
    tell(&summary, console);
    catalog.close()?;
    if replaces {
        replace::exchange(&args.store)?;
    }
    finish(&args.store, &input, &args.run, cap, Some(&summary), console)
}

/// What sizes make of a surface, in the memory of `space`.
fn prepared(
    surface: &Surface,
    options: &Options,
    cap: u64,
    space: Space,
) -> Result<Prepared, Failure> {
    let background = background::read(options, cap)?;
    let room = space.room(surface)?;
    let prepared = pipeline::prepare(surface, options, background.as_ref(), &room)?;
    Ok(prepared)
}

/// The surface for the pipeline: given away when it is large against the cap, to be read again for verification.
fn lent_or_given(input: &mut Input, cap: u64) -> Cow<'_, Surface> {
    match input.surface.bytes() as u64 > cap / SURFACE_KEPT {
        true => Cow::Owned(std::mem::take(&mut input.surface)),
        false => Cow::Borrowed(&input.surface),
    }
}

/// Threads, signals, and the cap.
pub(super) fn begin(args: &RunArgs, console: &Console) -> Result<(u64, String), Failure> {
    if let Some(threads) = args.threads {
        if threads == 0 {
            return Err(
                Failure::new("usage", "--threads 0 leaves nobody to work").help("give 1 or more")
            );
        }
        let built = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global();
        if built.is_err() {
            console.note("note: the thread pool was already running");
        }
    }
    for out in &args.export {
        export::check_format(out)?;
    }
    signals::listen(console.is_json());
    memory::cap(args.memory.as_deref())
}

fn output(args: &MeshArgs) -> PathBuf {
    args.output.clone().unwrap_or_else(|| {
        let first = args.surfaces.first().map_or("mesh", String::as_str);
        let stem = match first.strip_prefix(crate::samples::PREFIX) {
            Some(sample) => sample.split(',').next().map(Into::into),
            None => Path::new(first).file_stem().map(PathBuf::from),
        };
        stem.unwrap_or_else(|| PathBuf::from("mesh"))
            .with_extension("tetdb")
    })
}

/// What is at the place of the new store: nothing, the same mesh already, or something in the way.
fn already_there(
    path: &Path,
    args: &MeshArgs,
    options: &Options,
    console: &Console,
) -> Result<Option<u8>, Failure> {
    if !path.exists() {
        return Ok(None);
    }
    let mut store = match Catalog::open(path) {
        Ok(store) => store,
        Err(StoreError::NotOurs { .. }) if Catalog::is_vacant(path) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let catalog = &mut store;
    let (state, job) = (catalog.state()?, catalog.job()?);
    drop(store);
    if args.force {
        return Ok(None);
    }
    if !state.is_finished() {
        return Err(StoreError::Unfinished {
            path: path.to_owned(),
        }
        .into());
    }
    let same_options = serde_json::from_str::<Options>(&job.options).is_ok_and(|mut o| {
        // A store that kept more or less than asked for holds the same mesh.
        o.drop_coarse = options.drop_coarse;
        o.seal.clone_from(&options.seal);
        o == *options
    });
    let cap = memory::cap(args.run.memory.as_deref())?.0;
    let input = input::load(&args.surfaces, Space::Capped(cap, path), console)?;
    if !same_options || job.surfaces != input.sources {
        return Err(StoreError::Finished {
            path: path.to_owned(),
        }
        .into());
    }
    console.note(&format!(
        "{} already holds the finished mesh of this surface with these options",
        path.display()
    ));
    write_exports(path, &args.run, cap, console)?;
    info::print(path, console)?;
    Ok(Some(0))
}

fn tell(summary: &Summary, console: &Console) {
    console.done();
    if let Some(asked) = summary.subdomains_asked {
        console.note(&format!(
            "note: {asked} sub-domains were asked for; the mesh is made in {}, for one of fewer than 25,000 tetrahedra would be all refined zone",
            summary.subdomains
        ));
    }
    if let Some(sizes) = &summary.sizes {
        console.note(&sizes.to_string());
        for warning in &sizes.warnings {
            console.warn(&warning.to_string());
        }
    }
}

/// Verify, export, tell.
fn finish(
    path: &Path,
    input: &Input,
    args: &RunArgs,
    cap: u64,
    summary: Option<&Summary>,
    console: &Console,
) -> Result<u8, Failure> {
    if !args.no_verify {
        let report = {
            let mut store = store::open_finished(path)?;
            let again;
            let surface = match input.surface.n_triangles() {
                0 => {
                    let space = Space::Capped(cap, path);
                    again = store::surface_of(&mut store, &[], space, console)?;
                    &again.surface
                }
                _ => &input.surface,
            };
            verify::check(
                &mut store,
                console,
                Some(surface),
                cap,
                crate::audit::Level::Delaunay,
            )?
        };
        if !report.valid {
            return Err(verify::invalid(&report, path));
        }
        console.note(&verify::sentence(&report));
        let mut catalog = Catalog::open_writable(path)?;
        if catalog.state()? < StoreState::Verified {
            catalog.commit(|step| {
                step.set_state(StoreState::Verified);
                Ok(())
            })?;
        }
        catalog.close()?;
    }
    write_exports(path, args, cap, console)?;
    if console.is_json() {
        let mut answer = info::object(path)?;
        answer["memory_cap_bytes"] = json!(cap);
        answer["peak_bytes"] = json!(memory::peak());
        if let Some(s) = summary {
            answer["pages_read"] = json!(s.pages.pages_read);
            answer["pages_written"] = json!(s.pages.pages_written);
            answer["frames_used"] = json!(s.frames_used);
        }
        console.answer(&answer);
    } else {
        info::print(path, console)?;
        if let Some(peak) = memory::peak() {
            console.line(&format!(
                "peak memory {} of {}",
                memory::show(peak),
                memory::show(cap)
            ));
        }
    }
    Ok(0)
}

pub(super) fn write_exports(
    path: &Path,
    args: &RunArgs,
    cap: u64,
    console: &Console,
) -> Result<(), Failure> {
    for out in &args.export {
        export::write(path, out, &Selection::default(), cap, console)?;
    }
    Ok(())
}
