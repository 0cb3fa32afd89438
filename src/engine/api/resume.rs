//! Resuming an interrupted run.

use std::path::Path;

use super::mesher::{Created, lent_or_given, predict, report, verify_new};
use super::preflight::{scratch_beside, with_free_space};
use super::store::say_how_locked;
use super::{Error, Event, Settings, Store, Surface, guarded, job, replace};
use crate::pipeline;
use tetdb_base::storage::Budget;
use tetdb_base::surface;
use tetdb_schema::catalog::StoreState;
use tetdb_schema::code::Code;
use tetdb_store::store::{Catalog, StoreError};

impl Store {
    /// Resumes an interrupted run, verifies the mesh and opens the store. A finished store is only verified.
    ///
    /// The mesh is the same as without the interruption.
    ///
    /// Errors: `surface-changed`; `store-recipe` if a version with another recipe began the store; as
    /// [`Mesher::create`](super::Mesher::create).
    pub fn resume(path: impl AsRef<Path>, settings: Settings) -> Result<Self, Error> {
        let created = resume_reported(path.as_ref(), &settings, true)?;
        Self::open_with(created.path, settings)
    }
}

/// Resumes the run of the store at `path`, and verifies the mesh if `verify` is true.
#[doc(hidden)]
pub fn resume_reported(path: &Path, settings: &Settings, verify: bool) -> Result<Created, Error> {
    guarded(settings, || run(path, settings, verify))
}

fn run(path: &Path, settings: &Settings, verify: bool) -> Result<Created, Error> {
    let cap = settings.cap()?;
    replace::settle(path, settings)?;
    // The interrupted run may have been replacing a store; the store at `path` is finished then.
    let replaces = replace::is_begun(path);
    let place = match replaces {
        true => replace::new_of(path),
        false => path.to_owned(),
    };
    let mut catalog = Catalog::open_writable(&place)?;
    say_how_locked(&catalog, settings);
    let lock = catalog.lock().expect("it is open for writing");
    let job = catalog.job()?;
    if !catalog.state()?.is_finished() {
        if job.is_imported() {
            let message = "an import was interrupted, and cannot be continued";
            return Err(Error::new(Code::StoreUnfinished, message)
                .at(place.display())
                .with_help("import the mesh again, which begins anew"));
        }
        job::check_recipe(&mut catalog)?;
        if let Some((task, host)) = pipeline::is_being_worked(&place)? {
            let (path, writer) = (place, format!("task {task} on {host}"));
            return Err(StoreError::Busy { path, writer }.into());
        }
        if pipeline::end_plan(&mut catalog)? {
            settings.note("what tasks had done is in the store; their plan is dropped");
        }
    }
    let state = catalog.state()?;
    drop(catalog);
    let scratch = scratch_beside(&surface::Surface::default(), cap, path)?;
    let mut surface = Surface::of_record(&job.surfaces, &place, &scratch)?;
    drop(scratch);
    surface.notes().into_iter().for_each(|note| settings.note(format!("note: {note}")));
    let summary = match state.is_finished() {
        true => {
            settings.note(format!("{} is already finished", path.display()));
            None
        }
        false => {
            let mut options = pipeline::Options::from(job::options_of(&job, &place)?);
            options.run.remote = settings.remote.clone();
            let catalog = Catalog::open_locked(&place, lock.clone())?;
            Some(go_on(catalog, &options, &mut surface, cap, settings)?)
        }
    };
    if replaces {
        replace::exchange(path, &lock)?;
    }
    if verify {
        let at_hand = Some(&surface.inner).filter(|s| s.n_triangles() > 0);
        verify_new(path, at_hand, cap, settings, lock)?;
    }
    let traffic = summary.as_ref().map(Into::into);
    Ok(Created { path: path.to_owned(), was_there: summary.is_none(), traffic })
}

fn go_on(
    mut catalog: Catalog,
    options: &pipeline::Options,
    surface: &mut Surface,
    cap: u64,
    settings: &Settings,
) -> Result<pipeline::Summary, Error> {
    let place = &catalog.dir().to_owned();
    let (watch, budget) = (settings.watcher(), Budget::new(cap));
    let made = if catalog.state()? < StoreState::Coarse {
        let inner = &surface.inner;
        let prepared = pipeline::head_start(inner, options, cap, &watch, |taken| {
            predict(inner, options, cap - taken, place)
        })?;
        settings.say(&Event::StoreBegun(place.to_owned()));
        let surface = lent_or_given(&mut surface.inner, cap);
        pipeline::mesh_prepared(&mut catalog, surface, options, prepared, &budget, &watch)
    } else {
        settings.say(&Event::StoreBegun(place.to_owned()));
        pipeline::mesh(&mut catalog, &surface.inner, options, &budget, &watch)
    };
    let summary = made.map_err(|e| with_free_space(e.into(), place, None))?;
    report(&summary, settings);
    catalog.close()?;
    Ok(summary)
}
