//! A new store from a surface.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use tetdb_schema::code::Code;

use super::field_arrays::FieldArrays;
use super::prediction::Prediction;
use super::preflight::{self, preflight, scratch_beside, with_free_space};
use super::store::say_how_locked;
use super::{
    Bytes, Error, Event, Optimize, Regions, Seal, Settings, Sizes, Store, Subdomains, Surface,
    Verification, guarded, job, replace, verify,
};
use crate::pipeline::{self, MeshOptions, Options, PipelineError, Prepared, RECIPE};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Budget, CancelToken, attempt, n_threads};
use tetdb_base::surface::{self, Seed, SeedKind};
use tetdb_schema::catalog::StoreState;
use tetdb_store::audit::Level;
use tetdb_store::store::{Catalog, StoreError, WriterLock};

/// A surface that takes more than this part of the cap is not kept while the mesh is refined.
const SURFACE_KEPT: u64 = 8;

/// What to do with a store that is already at the path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// The finished mesh of the same job is returned as it is; anything else is refused.
    #[default]
    Keep,
    /// It is replaced, once the new store is finished.
    Replace,
}

/// Meshes a surface into a new store: validated, refused before anything is written, on record, resumable, verified.
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// use tetdb::{Length, Mesher, Sizes, Surface};
///
/// let store = Mesher::new(Surface::sample("box,h=0.5")?)
///     .sizes(Sizes::interior(Length::share_of_diagonal(0.2)))
///     .create(&path)?;
/// assert!(store.summary().n_tets > 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mesher {
    surface: Surface,
    sizes: Sizes,
    options: Options,
    settings: Settings,
    existing: Existing,
    preflight: bool,
    verify: bool,
}

/// What a run left at its path.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Created {
    /// Path of the store.
    pub path: PathBuf,
    /// Whether the finished mesh of this job was there already.
    pub was_there: bool,
    /// Pages that the run moved; `None` where nothing was meshed.
    pub traffic: Option<PageTraffic>,
}

/// Pages of the working mesh that a run moved between memory and disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PageTraffic {
    /// Pages read.
    pub pages_read: u64,
    /// Pages written.
    pub pages_written: u64,
    /// Most pages held in memory at once.
    pub frames_used: usize,
}

impl From<&pipeline::Summary> for PageTraffic {
    fn from(summary: &pipeline::Summary) -> Self {
        Self {
            pages_read: summary.pages.pages_read,
            pages_written: summary.pages.pages_written,
            frames_used: summary.frames_used,
        }
    }
}

impl Mesher {
    /// With the sizes of the surface's own edges and all other defaults.
    pub fn new(surface: Surface) -> Self {
        Self::with_options(surface, MeshOptions::default())
    }

    /// With these options, and default settings.
    pub fn with_options(surface: Surface, mesh: MeshOptions) -> Self {
        Self {
            surface,
            sizes: (mesh.sizes.clone(), mesh.size_field.clone()).into(),
            options: mesh.into(),
            settings: Settings::new(),
            existing: Existing::default(),
            preflight: true,
            verify: true,
        }
    }

    /// Wanted edge lengths.
    pub fn sizes(mut self, sizes: Sizes) -> Self {
        self.sizes = sizes;
        self
    }

    /// Which regions are filled.
    pub fn regions(mut self, regions: Regions) -> Self {
        self.options.mesh.regions.policy = regions;
        self
    }

    /// The region around `point` is called `name`, and filled under [`Regions::Seeds`]; may be repeated.
    ///
    /// A name is good wherever a region is asked for: sizes, questions, exports. Seeds outside, on a triangle, in a region that stays
    /// empty, or of two names in one region are refused when the mesh is begun (`bad-seed`).
    pub fn region_seed(mut self, point: [f64; 3], name: Option<&str>) -> Self {
        let kind = SeedKind::Region(name.map(str::to_owned));
        let point = Point::from_array(point);
        self.options.mesh.regions.seeds.push(Seed { point, kind });
        self
    }

    /// The region around `point` stays empty, whatever the rule; may be repeated.
    pub fn hole(mut self, point: [f64; 3]) -> Self {
        let (point, kind) = (Point::from_array(point), SeedKind::Hole);
        self.options.mesh.regions.seeds.push(Seed { point, kind });
        self
    }

    /// Into how many sub-domains the mesh is divided.
    pub fn subdomains(mut self, n: Subdomains) -> Self {
        self.options.mesh.subdomains = n;
        self
    }

    /// How far tetrahedra are improved.
    pub fn optimize(mut self, optimize: Optimize) -> Self {
        self.options.mesh.optimize = optimize;
        self
    }

    /// How finished sub-domains are kept.
    pub fn seal(mut self, seal: Seal) -> Self {
        self.options.mesh.seal = seal;
        self
    }

    /// Whether what sub-domains are meshed from is kept, so that they can be meshed again. Default: it is.
    pub fn keep_coarse(mut self, keep: bool) -> Self {
        self.options.mesh.drop_coarse = !keep;
        self
    }

    /// Whether meshes on the way (before each cut, with its zone refined) are kept to be looked at. Default: they are not.
    pub fn keep_stages(mut self, keep: bool) -> Self {
        self.options.mesh.keep_stages = keep;
        self
    }

    /// Whether the surface's triangles are divided first until their edges are as short as the wanted lengths. Default: they are not, and
    /// its edges bound how short those of the mesh can be near it.
    ///
    /// No point of the surface moves. The store keeps a copy of the divided surface, and the mesh is verified against that.
    pub fn refine_surface(mut self, refine: bool) -> Self {
        self.options.mesh.refine_surface = refine;
        self
    }

    /// Whether the run ends with the coarse mesh, and leaves the rest to [`Tasks`](super::Tasks) or [`Store::resume`]. Default: it does not.
    pub fn coarse_only(mut self, coarse_only: bool) -> Self {
        self.options.run.coarse_only = coarse_only;
        self
    }

    /// How the run works, all at once.
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// Caps what the run holds; see [`Settings::memory`].
    pub fn memory(mut self, cap: Bytes) -> Self {
        self.settings = self.settings.memory(cap);
        self
    }

    /// Threads of the run; see [`Settings::threads`].
    pub fn threads(mut self, n: usize) -> Self {
        self.settings = self.settings.threads(n);
        self
    }

    /// The run ends soon after this token is cancelled.
    pub fn cancel(mut self, token: &CancelToken) -> Self {
        self.settings = self.settings.cancel(token);
        self
    }

    /// Is called with each [`Event`]; see [`Settings::progress`].
    pub fn progress(mut self, listener: impl Fn(&Event) + Send + Sync + 'static) -> Self {
        self.settings = self.settings.progress(listener);
        self
    }

    /// What becomes of a store that is already there.
    pub fn existing(mut self, existing: Existing) -> Self {
        self.existing = existing;
        self
    }

    /// Whether the finished mesh is verified against the surface. Default: it is.
    pub fn verify(mut self, verify: bool) -> Self {
        self.verify = verify;
        self
    }

    /// Whether a mesh that memory or disk are not expected to hold is refused. Default: it is.
    #[doc(hidden)]
    pub fn preflight(mut self, preflight: bool) -> Self {
        self.preflight = preflight;
        self
    }

    /// The options as they go on record: with sizes checked and the seeds of the surface's files. Errors: values without a meaning.
    fn complete_options(&self) -> Result<Options, Error> {
        let mut options = self.options.clone();
        let mesh = &mut options.mesh;
        mesh.sizes = self.sizes.options()?;
        mesh.size_field.clone_from(&self.sizes.file);
        if mesh.subdomains == Subdomains::Exactly(0) {
            let value = "0".to_owned();
            return Err(PipelineError::Option { option: "subdomains", value }.into());
        }
        if let Some(seed) = mesh.regions.seeds.iter().find(|seed| !seed.point.is_finite()) {
            let option = if seed.kind == SeedKind::Hole { "hole" } else { "region_seed" };
            return Err(PipelineError::BadSeed { option, found: seed.to_string() }.into());
        }
        job::identify_sizes(mesh)?;
        job::take_seeds(mesh, &self.surface.inner.seeds);
        Ok(options)
    }

    /// Predicts the mesh and what it takes; nothing is written. Errors: sizes that make no sense, a surface with defects.
    pub fn predict(&self) -> Result<Prediction, Error> {
        self.predict_at(".")
    }

    /// The same for a store at `store`, whose disk is looked at.
    pub fn predict_at(&self, store: impl AsRef<Path>) -> Result<Prediction, Error> {
        guarded(&self.settings, || {
            let (cap, store) = (self.settings.cap()?, store.as_ref());
            let options = self.complete_options()?;
            let field = self.sizes.field.as_deref();
            let mut surface = Cow::Borrowed(&self.surface);
            let scratch = scratch_beside(&surface.inner, cap, store)?;
            attempt(|| surface::validate_with(&surface.inner, &scratch))?.accept()?;
            if options.mesh.refine_surface {
                divide(surface.to_mut(), &options, field, cap, store, &self.settings)?;
            }
            let prepared = predict_with(&surface.inner, &options, field, cap, store)?;
            Ok(Prediction::new(prepared, cap, n_threads(), store))
        })
    }

    /// Meshes into a new store at `path` and opens it.
    ///
    /// Errors: a surface with defects, options that make no sense, too little memory or disk are refused before anything is written. A
    /// run that is cancelled, killed or ends at a full disk leaves a store that [`Store::resume`] goes on with.
    pub fn create(self, path: impl AsRef<Path>) -> Result<Store, Error> {
        let settings = self.settings.clone();
        let created = self.create_reported(path.as_ref())?;
        Store::open_with(created.path, settings)
    }

    /// The same where the store may stay unfinished, see [`Mesher::coarse_only`]. Errors: as [`Mesher::create`].
    pub fn create_unfinished(self, path: impl AsRef<Path>) -> Result<(), Error> {
        self.create_reported(path.as_ref()).map(|_| ())
    }

    /// [`Mesher::create`], and what the run did.
    pub fn create_reported(mut self, path: &Path) -> Result<Created, Error> {
        let settings = self.settings.clone();
        guarded(&settings, || self.run(path, &settings))
    }

    fn run(&mut self, path: &Path, settings: &Settings) -> Result<Created, Error> {
        self.options = self.complete_options()?;
        if self.options.run.coarse_only && self.existing == Existing::Replace {
            let message = "a store is not replaced by one that stays unfinished";
            return Err(Error::new(Code::Usage, message).with_help("choose another path"));
        }
        self.options.run.hands = settings.hands.clone();
        let cap = settings.cap()?;
        replace::settle(path, settings)?;
        if self.options.mesh.refine_surface {
            self.divide_surface(path, cap, settings)?;
        }
        if self.is_there(path)? {
            return Ok(Created { path: path.to_owned(), was_there: true, traffic: None });
        }
        if self.preflight {
            preflight::surface_fits(&self.surface.inner, cap)?;
        }
        let prepared = self.prepare(path, cap, settings)?;
        let (summary, lock) = match self.mesh(path, cap, prepared, settings) {
            // Another run was faster: what it left decides.
            Err(error) if error.code() == Code::StoreExists && self.is_there(path)? => {
                return Ok(Created { path: path.to_owned(), was_there: true, traffic: None });
            }
            other => other?,
        };
        report(&summary, settings);
        if self.verify && !self.options.run.coarse_only {
            let surface = match self.surface.n_triangles() {
                0 => None,
                _ => Some(&self.surface.inner),
            };
            verify_new(path, surface, cap, settings, lock)?;
        }
        Ok(Created { path: path.to_owned(), was_there: false, traffic: Some((&summary).into()) })
    }

    /// Refuses early what is no store or an unfinished one, before a surface is read for it.
    #[doc(hidden)]
    pub fn check_path(path: &Path, existing: Existing) -> Result<(), Error> {
        if !path.exists() || existing == Existing::Replace {
            return Ok(());
        }
        match Catalog::open(path) {
            Err(StoreError::NotOurs { .. }) if Catalog::is_vacant(path) => Ok(()),
            Err(error) => Err(error.into()),
            Ok(mut catalog) => match catalog.state()?.is_finished() {
                true => Ok(()),
                false => {
                    let path = path.to_owned();
                    Err(StoreError::Unfinished { path }.into())
                }
            },
        }
    }

    /// Whether the finished mesh of this job is at `path` already. Errors: something is in the way.
    fn is_there(&self, path: &Path) -> Result<bool, Error> {
        if !path.exists() {
            return Ok(false);
        }
        let mut catalog = match Catalog::open(path) {
            Ok(catalog) => catalog,
            Err(StoreError::NotOurs { .. }) if Catalog::is_vacant(path) => return Ok(false),
            Err(error) => return Err(error.into()),
        };
        let (state, job) = (catalog.state()?, catalog.job()?);
        drop(catalog);
        let path = path.to_owned();
        match self.existing {
            Existing::Replace => Ok(false),
            _ if !state.is_finished() => Err(StoreError::Unfinished { path }.into()),
            _ if job::is_same(&job, &self.options.mesh, &self.surface.sources) => Ok(true),
            _ => Err(StoreError::Finished { path }.into()),
        }
    }

    /// Divides the triangles of the surface, once it is known to have no defects.
    fn divide_surface(&mut self, path: &Path, cap: u64, settings: &Settings) -> Result<(), Error> {
        let scratch = scratch_beside(&self.surface.inner, cap, path)?;
        attempt(|| surface::validate_with(&self.surface.inner, &scratch))?.accept()?;
        let field = self.sizes.field.as_deref();
        divide(&mut self.surface, &self.options, field, cap, path, settings)
    }

    /// Validates, builds the size field and looks whether everything fits; inserts vertices meanwhile.
    fn prepare(
        &self,
        path: &Path,
        cap: u64,
        settings: &Settings,
    ) -> Result<(Prepared, Option<pipeline::HeadStart>), Error> {
        let (clock, surface) = (Instant::now(), &self.surface.inner);
        let watch = settings.watcher();
        pipeline::ahead(surface, &self.options, cap, &watch, |taken| {
            let left = cap - taken;
            let scratch = scratch_beside(surface, left, path)?;
            attempt(|| surface::validate_with(surface, &scratch))?.accept()?;
            settings.note(format!(
                "{} triangles{} and {} vertices, closed and free of defects ({:.1} s)",
                surface.n_input_triangles(),
                match surface.n_sheet_triangles() {
                    0 => String::new(),
                    n => format!(", {n} of them in sheets,"),
                },
                surface.n_input_vertices(),
                clock.elapsed().as_secs_f64()
            ));
            settings.note(format!("memory: {}", settings.cap_in_words()));
            let field = self.sizes.field.as_deref();
            let prepared = predict_with(surface, &self.options, field, left, path)?;
            for note in &prepared.notes {
                settings.note(format!("note: {note}"));
            }
            if self.preflight {
                preflight(&prepared.estimate, cap, path, settings)?;
            }
            Ok::<_, Error>(prepared)
        })
    }

    /// Everything from the first commit to the last. Returns the lock as well: nobody changes the store before it is verified.
    fn mesh(
        &mut self,
        path: &Path,
        cap: u64,
        prepared: (Prepared, Option<pipeline::HeadStart>),
        settings: &Settings,
    ) -> Result<(pipeline::Summary, Arc<WriterLock>), Error> {
        // The old store is only replaced once the new one is sealed.
        let replaces =
            self.existing == Existing::Replace && path.exists() && !Catalog::is_vacant(path);
        let place = match replaces {
            true => replace::new_of(path),
            false => path.to_owned(),
        };
        let needed = prepared.0.estimate.disk_peak_bytes(cap, n_threads());
        let mut catalog = self.begin(path, &place, replaces, settings)?;
        let lock = catalog.lock().expect("it is open for writing");
        say_how_locked(&catalog, settings);
        settings.say(&Event::StoreBegun(place.clone()));
        let budget = Budget::new(cap);
        let watch = settings.watcher();
        let (options, surface) = (&self.options, lent_or_given(&mut self.surface.inner, cap));
        let made = if catalog.state()? < StoreState::Coarse {
            pipeline::mesh_prepared(&mut catalog, surface, options, prepared, &budget, &watch)
        } else {
            drop(prepared);
            pipeline::mesh(&mut catalog, &surface, options, &budget, &watch)
        };
        let summary = match made.map_err(Error::from) {
            // A refused surface or option leaves nothing to resume.
            Err(error) if matches!(error.exit_code(), 2 | 3) => {
                drop(catalog);
                replace::remove(&place)?;
                return Err(error);
            }
            other => other.map_err(|e| with_free_space(e, &place, Some(needed)))?,
        };
        catalog.close()?;
        if replaces {
            replace::exchange(path, &lock)?;
        }
        Ok((summary, lock))
    }

    /// The catalog of the new store, or of the same replacement that was begun before.
    fn begin(
        &self,
        path: &Path,
        place: &Path,
        replaces: bool,
        settings: &Settings,
    ) -> Result<Catalog, Error> {
        let job = job::job(&self.options.mesh, &self.surface.sources);
        let is_same = |begun: &mut Catalog| {
            begun.job().is_ok_and(|begun| begun == job)
                && pipeline::recipe_of(begun).is_ok_and(|recipe| recipe == RECIPE)
        };
        if replaces && let Some(catalog) = replace::take_up(path, is_same)? {
            settings.note(format!("going on with {}", place.display()));
            return Ok(catalog);
        }
        let catalog = Catalog::create_with(place, &job, pipeline::record_recipe)?;
        self.surface.keep_in(place)?;
        if let Some(field) = &self.sizes.field {
            field.keep_in(place)?;
        }
        Ok(catalog)
    }
}

/// What is worth knowing of a run.
pub(super) fn report(summary: &pipeline::Summary, settings: &Settings) {
    if let Some(asked) = summary.subdomains_asked {
        settings.note(format!(
            "note: {asked} sub-domains were asked for, the mesh has {}: one of fewer than 25,000 tetrahedra would be all refined zone",
            summary.subdomains
        ));
    }
    if let Some(sizes) = &summary.sizes {
        settings.note(sizes.to_string());
        for warning in &sizes.warnings {
            settings.say(&Event::SizeWarning(warning.clone()));
        }
    }
}

/// Divides the triangles of a surface without defects to the lengths that `options` want.
#[doc(hidden)]
pub fn divide(
    surface: &mut Surface,
    options: &Options,
    field: Option<&FieldArrays>,
    cap: u64,
    store: &Path,
    settings: &Settings,
) -> Result<(), Error> {
    let before = surface.n_triangles();
    let diagonal = surface.inner.bounds().diagonal();
    let wanted = options.mesh.sizes.hsiz;
    let wanted = wanted.map_or(f64::INFINITY, |length| length.resolve(diagonal));
    let sizes = predict_with(&surface.inner, options, field, cap, store)?.field;
    let scratch = scratch_beside(&surface.inner, cap, store)?;
    surface.divide(&|p| sizes.h(p).min(wanted), cap, &scratch)?;
    settings.note(format!(
        "the surface was divided into {} triangles, from {before}",
        surface.n_triangles()
    ));
    Ok(())
}

/// The size field of a surface and what it predicts, within `cap`; what was given as arrays is read from `store`.
#[doc(hidden)]
pub fn predict(
    surface: &surface::Surface,
    options: &Options,
    cap: u64,
    store: &Path,
) -> Result<Prepared, Error> {
    predict_with(surface, options, None, cap, store)
}

/// The same, with what was given as arrays and is in no store yet.
fn predict_with(
    surface: &surface::Surface,
    options: &Options,
    field: Option<&FieldArrays>,
    cap: u64,
    store: &Path,
) -> Result<Prepared, Error> {
    let background = match field {
        Some(field) => Some(field.background(cap)?),
        None => job::read_background(&options.mesh, store, cap)?,
    };
    let scratch = scratch_beside(surface, cap, store)?;
    Ok(pipeline::prepare(surface, options, background.as_ref(), &scratch)?)
}

/// The surface for the pipeline: given away when it is large against the cap, to be read again for verification.
pub(super) fn lent_or_given(surface: &mut surface::Surface, cap: u64) -> Cow<'_, surface::Surface> {
    match surface.bytes() as u64 > cap / SURFACE_KEPT {
        true => Cow::Owned(std::mem::take(surface)),
        false => Cow::Borrowed(surface),
    }
}

/// Verifies a mesh against its surface, which is read again where it is not at hand, and puts on record that it was.
pub(super) fn verify_new(
    path: &Path,
    surface: Option<&surface::Surface>,
    cap: u64,
    settings: &Settings,
    lock: Arc<WriterLock>,
) -> Result<Verification, Error> {
    let mut catalog = Catalog::open(path)?;
    let again;
    let surface = match surface {
        Some(surface) => surface,
        None => {
            let sources = catalog.job()?.surfaces;
            let scratch = scratch_beside(&surface::Surface::default(), cap, path)?;
            again = Surface::of_record(&sources, path, &scratch)?;
            &again.inner
        }
    };
    let report = verify::check(&mut catalog, settings, Some(surface), cap, Level::Delaunay)?;
    drop(catalog);
    if !report.valid {
        return Err(verify::invalid(&report, path));
    }
    settings.note(verify::sentence(&report));
    verify::record(path, lock)?;
    Ok(Verification { report })
}
