//! Meshing a surface into a new store.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tetdb_schema::code::Code;

use super::field_arrays::FieldArrays;
use super::periodic::SurfacePairs;
use super::prediction::Prediction;
use super::preflight::{self, preflight, scratch_beside, with_free_space};
use super::store::say_how_locked;
use super::{
    Bytes, EmbedOutside, Error, Event, Optimize, PeriodicLabels, Regions, Seal, Settings, Sizes,
    Store, Subdomains, Surface, SurfaceRemesh, Verification, guarded, job, replace, verify,
};
use crate::pipeline::{self, MeshOptions, Options, PipelineError, Prepared, RECIPE};
use tetdb_base::geom::{Point, count};
use tetdb_base::storage::{Budget, CancelToken, ScratchSpace, StepClock, attempt, n_threads};
use tetdb_base::surface::{self, Seed, SeedKind};
use tetdb_schema::catalog::StoreState;
use tetdb_store::audit::Level;
use tetdb_store::store::{Catalog, StoreError, WriterLock};

/// A surface larger than the cap divided by this number is freed while the mesh is refined.
const SURFACE_KEPT: u64 = 8;

/// Treatment of a store that already exists at the path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// Returns the finished mesh of the same job unchanged; refuses anything else.
    #[default]
    Keep,
    /// Replaces the old store once the new one is finished.
    Replace,
}

/// Meshes a surface into a new store.
///
/// The surface and the options are validated, and a mesh that does not fit is refused, before anything is written. The store records the
/// job. An interrupted run can be resumed, and the finished mesh is verified.
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
    periodic: Vec<PeriodicLabels>,
    preflight: bool,
    verify: bool,
}

/// Result of a run.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Created {
    /// Path of the store.
    pub path: PathBuf,
    /// True if the finished mesh of this job was at the path already.
    pub was_there: bool,
    /// Pages that the run moved; `None` if nothing was meshed.
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
    /// Largest number of pages in memory at once.
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
    /// Meshes `surface` with the sizes of its own edges and all other options at their defaults.
    pub fn new(surface: Surface) -> Self {
        Self::with_options(surface, MeshOptions::default())
    }

    /// Meshes `surface` with these options, and default settings.
    pub fn with_options(surface: Surface, mesh: MeshOptions) -> Self {
        Self {
            surface,
            sizes: (mesh.sizes.clone(), mesh.size_field.clone()).into(),
            options: mesh.into(),
            settings: Settings::new(),
            existing: Existing::default(),
            periodic: Vec::new(),
            preflight: true,
            verify: true,
        }
    }

    /// Sets the wanted edge lengths.
    pub fn sizes(mut self, sizes: Sizes) -> Self {
        self.sizes = sizes;
        self
    }

    /// Sets which regions are filled.
    pub fn regions(mut self, regions: Regions) -> Self {
        self.options.mesh.regions.policy = regions;
        self.options.mesh.regions.is_given = true;
        self
    }

    /// Names the region around `point`, and fills it under [`Regions::Seeds`]. May be repeated.
    ///
    /// The name is valid wherever a region is expected: in sizes, questions and exports. A seed is refused when meshing starts
    /// (`bad-seed`) if it lies outside, on a triangle or in a region that stays empty. Two names for one region are refused too.
    pub fn region_seed(mut self, point: [f64; 3], name: Option<&str>) -> Self {
        let kind = SeedKind::Region(name.map(str::to_owned));
        let point = Point::from_array(point);
        self.options.mesh.regions.seeds.push(Seed { point, kind });
        self
    }

    /// Keeps the region around `point` empty, under any rule. May be repeated.
    pub fn hole(mut self, point: [f64; 3]) -> Self {
        let (point, kind) = (Point::from_array(point), SeedKind::Hole);
        self.options.mesh.regions.seeds.push(Seed { point, kind });
        self
    }

    /// Sets the number of sub-domains.
    pub fn subdomains(mut self, n: Subdomains) -> Self {
        self.options.mesh.subdomains = n;
        self
    }

    /// Sets how far the quality of tetrahedra is improved.
    pub fn optimize(mut self, optimize: Optimize) -> Self {
        self.options.mesh.optimize = optimize;
        self
    }

    /// Sets how finished sub-domains are stored.
    pub fn seal(mut self, seal: Seal) -> Self {
        self.options.mesh.seal = seal;
        self
    }

    /// Sets whether the coarse snapshots of the sub-domains are kept. Meshing a sub-domain again needs its snapshot. Default: true.
    pub fn keep_coarse(mut self, keep: bool) -> Self {
        self.options.mesh.drop_coarse = !keep;
        self
    }

    /// Sets whether intermediate meshes are kept for inspection: before each cut, and with its zone refined. Default: false.
    pub fn keep_stages(mut self, keep: bool) -> Self {
        self.options.mesh.keep_stages = keep;
        self
    }

    /// Sets whether the surface's triangles are first divided until their edges are as short as the wanted lengths. Default: false; the
    /// surface's edges then bound how short edges near it can be.
    ///
    /// No point of the surface moves. The store keeps a copy of the divided surface, and the mesh is verified against this copy.
    pub fn refine_surface(mut self, refine: bool) -> Self {
        self.options.mesh.refine_surface = refine;
        self
    }

    /// Remeshes the surface within a tolerance, with the sizes and settings set so far; see [`Surface::remeshed`]. The store has it on record.
    ///
    /// Errors: those of [`Surface::remeshed`].
    pub fn remesh_surface(mut self, how: SurfaceRemesh) -> Result<Self, Error> {
        let how = how.with_sizes(&self.sizes)?;
        (self.surface, _) = self.surface.remeshed_with(&how, &self.settings)?;
        Ok(self)
    }

    /// Sets the treatment of embedded edges and points outside all filled regions. Default: an error.
    ///
    /// If they are left out, the store keeps a copy of the surface without them.
    pub fn embed_outside(mut self, outside: EmbedOutside) -> Self {
        self.options.mesh.embed_outside = outside;
        self
    }

    /// Records a periodic pair of labels with the store; see [`Store::add_periodic`]. May be repeated. The surface is refused if its triangles
    /// are no such pair (`not-periodic`).
    pub fn periodic(mut self, labels: PeriodicLabels) -> Self {
        self.periodic.push(labels);
        self
    }

    /// Sets whether the run ends with the coarse mesh. [`Tasks`](super::Tasks) or [`Store::resume`] then do the rest. Default: false.
    pub fn coarse_only(mut self, coarse_only: bool) -> Self {
        self.options.run.coarse_only = coarse_only;
        self
    }

    /// Replaces all settings of the run.
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// Limits the memory of the run; see [`Settings::memory`].
    pub fn memory(mut self, cap: Bytes) -> Self {
        self.settings = self.settings.memory(cap);
        self
    }

    /// Sets the number of threads; see [`Settings::threads`].
    pub fn threads(mut self, n: usize) -> Self {
        self.settings = self.settings.threads(n);
        self
    }

    /// Ends the run soon after this token is cancelled.
    pub fn cancel(mut self, token: &CancelToken) -> Self {
        self.settings = self.settings.cancel(token);
        self
    }

    /// Calls `listener` with each [`Event`]; see [`Settings::progress`].
    pub fn progress(mut self, listener: impl Fn(&Event) + Send + Sync + 'static) -> Self {
        self.settings = self.settings.progress(listener);
        self
    }

    /// Sets the treatment of a store that already exists at the path.
    pub fn existing(mut self, existing: Existing) -> Self {
        self.existing = existing;
        self
    }

    /// Sets whether the finished mesh is verified against the surface. Default: true.
    pub fn verify(mut self, verify: bool) -> Self {
        self.verify = verify;
        self
    }

    /// Sets whether a mesh is refused if memory or disk are not expected to hold it. Default: true.
    #[doc(hidden)]
    pub fn preflight(mut self, preflight: bool) -> Self {
        self.preflight = preflight;
        self
    }

    /// Completes the options for the record: checks sizes and adds the seeds of the surface's files. Errors: values that make no sense.
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
        if let Some(note) = job::take_seeds(mesh, &self.surface.inner) {
            self.settings.note(format!("note: {note}"));
        }
        Ok(options)
    }

    /// Predicts the mesh, and the memory, disk and time needed. Nothing is written.
    ///
    /// Errors: sizes that make no sense; a surface with defects.
    pub fn predict(&self) -> Result<Prediction, Error> {
        self.predict_at(".")
    }

    /// Like [`Mesher::predict`], for a store at `store`; the free space of its disk is reported.
    pub fn predict_at(&self, store: impl AsRef<Path>) -> Result<Prediction, Error> {
        guarded(&self.settings, || {
            let (cap, store) = (self.settings.cap()?, store.as_ref());
            let options = self.complete_options()?;
            let field = self.sizes.field.as_deref();
            let mut surface = Cow::Borrowed(&self.surface);
            let scratch = scratch_beside(&surface.inner, cap, store)?;
            attempt(|| surface::validate_with(&surface.inner, &scratch))?.accept()?;
            if skips_outer(&surface, &options) {
                leave_out(surface.to_mut(), &options, &scratch, &self.settings)?;
            }
            if options.mesh.refine_surface {
                divide(surface.to_mut(), &options, field, cap, store, &self.settings)?;
            }
            let prepared = predict_with(&surface.inner, &options, field, cap, store)?;
            Ok(Prediction::new(prepared, cap, n_threads(), store))
        })
    }

    /// Meshes into a new store at `path` and opens it.
    ///
    /// A run that is cancelled, killed or ended by a full disk leaves a store that [`Store::resume`] can continue.
    ///
    /// Errors: a surface with defects, options that make no sense, too little memory or disk. All of these are refused before anything
    /// is written.
    pub fn create(self, path: impl AsRef<Path>) -> Result<Store, Error> {
        let settings = self.settings.clone();
        let created = self.create_reported(path.as_ref())?;
        Store::open_with(created.path, settings)
    }

    /// Like [`Mesher::create`], for a store that may stay unfinished; see [`Mesher::coarse_only`]. Errors: as [`Mesher::create`].
    pub fn create_unfinished(self, path: impl AsRef<Path>) -> Result<(), Error> {
        self.create_reported(path.as_ref()).map(|_| ())
    }

    /// Like [`Mesher::create`], but returns a report of the run and does not open the store.
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
        self.options.run.remote = settings.remote.clone();
        let cap = settings.cap()?;
        replace::settle(path, settings)?;
        if skips_outer(&self.surface, &self.options) {
            let scratch = scratch_beside(&self.surface.inner, cap, path)?;
            attempt(|| surface::validate_with(&self.surface.inner, &scratch))?.accept()?;
            leave_out(&mut self.surface, &self.options, &scratch, settings)?;
        }
        if self.options.mesh.refine_surface {
            self.divide_surface(path, cap, settings)?;
        }
        if self.is_there(path)? {
            return self.found(path, settings);
        }
        if self.preflight {
            preflight::surface_fits(&self.surface.inner, cap)?;
        }
        let pairs = SurfacePairs::find(&self.surface.inner, &self.periodic, cap / 2)?;
        let prepared = self.prepare(path, cap, settings)?;
        let (summary, lock) = match self.mesh(path, cap, prepared, &pairs, settings) {
            // Another run was faster, so the store that it left decides.
            Err(error) if error.code() == Code::StoreExists && self.is_there(path)? => {
                return self.found(path, settings);
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

    /// Refuses a path with an unfinished store, or with files that are no store, before a surface is read for it.
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

    /// Returns whether the finished mesh of this job is at `path` already. Errors: the path holds something else.
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

    /// Records the periodic pairs in the finished store of this job that is there.
    fn found(&self, path: &Path, settings: &Settings) -> Result<Created, Error> {
        if !self.periodic.is_empty() {
            let mut store = Store::open_with(path, settings.clone())?;
            for pair in &self.periodic {
                if !store.has_periodic(pair)? {
                    store.add_periodic(pair)?;
                }
            }
        }
        Ok(Created { path: path.to_owned(), was_there: true, traffic: None })
    }

    /// Validates the surface, then divides its triangles.
    fn divide_surface(&mut self, path: &Path, cap: u64, settings: &Settings) -> Result<(), Error> {
        let scratch = scratch_beside(&self.surface.inner, cap, path)?;
        attempt(|| surface::validate_with(&self.surface.inner, &scratch))?.accept()?;
        let field = self.sizes.field.as_deref();
        divide(&mut self.surface, &self.options, field, cap, path, settings)
    }

    /// Validates the surface, builds the size field and checks that the mesh fits. Vertices are inserted at the same time.
    fn prepare(
        &self,
        path: &Path,
        cap: u64,
        settings: &Settings,
    ) -> Result<(Prepared, Option<pipeline::HeadStart>), Error> {
        let (clock, surface) = (StepClock::start(), &self.surface.inner);
        let watch = settings.watcher();
        pipeline::head_start(surface, &self.options, cap, &watch, |taken| {
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
                clock.seconds()
            ));
            settings.note(format!("memory: {}", settings.cap_in_words()));
            let field = self.sizes.field.as_deref();
            let mut prepared = predict_with(surface, &self.options, field, left, path)?;
            for note in &prepared.notes {
                settings.note(format!("note: {note}"));
            }
            if self.preflight {
                preflight(&prepared.estimate, cap, path, settings)?;
            }
            prepared.journal = Some(pipeline::prepared_row(&clock));
            Ok::<_, Error>(prepared)
        })
    }

    /// Runs all steps from the first commit to the last. Returns the writer lock too, so that nobody changes the store before it is
    /// verified.
    fn mesh(
        &mut self,
        path: &Path,
        cap: u64,
        prepared: (Prepared, Option<pipeline::HeadStart>),
        pairs: &SurfacePairs,
        settings: &Settings,
    ) -> Result<(pipeline::Summary, Arc<WriterLock>), Error> {
        // The old store is replaced only once the new one is sealed.
        let replaces =
            self.existing == Existing::Replace && path.exists() && !Catalog::is_vacant(path);
        let place = match replaces {
            true => replace::new_of(path),
            false => path.to_owned(),
        };
        let needed = prepared.0.estimate.disk_peak_bytes(cap, n_threads());
        let mut catalog = self.begin(path, &place, replaces, (pairs, settings))?;
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
            // After a refused surface or option there is nothing to resume.
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

    /// Creates the catalog of the new store, or opens that of a begun replacement with the same job.
    fn begin(
        &self,
        path: &Path,
        place: &Path,
        replaces: bool,
        (pairs, settings): (&SurfacePairs, &Settings),
    ) -> Result<Catalog, Error> {
        let job = job::job(&self.options.mesh, &self.surface.sources);
        let is_same = |begun: &mut Catalog| {
            begun.job().is_ok_and(|begun| begun == job)
                && pairs.are_in(begun).is_ok_and(|are_there| are_there)
                && pipeline::recipe_of(begun).is_ok_and(|recipe| recipe == RECIPE)
        };
        if replaces && let Some(catalog) = replace::take_up(path, is_same)? {
            settings.note(format!("going on with {}", place.display()));
            return Ok(catalog);
        }
        let catalog = Catalog::create_with(place, &job, |step| {
            pipeline::record_recipe(step);
            pairs.record(step);
        })?;
        self.surface.keep_in(place)?;
        if let Some(field) = &self.sizes.field {
            field.keep_in(place)?;
        }
        Ok(catalog)
    }
}

/// Reports notes and size warnings of a run to the listener.
pub(super) fn report(summary: &pipeline::Summary, settings: &Settings) {
    if let Some(requested) = summary.subdomains_requested {
        settings.note(format!(
            "note: {requested} sub-domains were asked for, the mesh has {}: a smaller one, of fewer than 25,000 tetrahedra, would lie wholly in the bands beside interfaces that are refined before the cut",
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

/// Returns whether embedded edges and points outside the filled regions are to be left out.
fn skips_outer(surface: &Surface, options: &Options) -> bool {
    options.mesh.embed_outside == EmbedOutside::Skip && surface.inner.has_embedded()
}

/// Leaves out embedded edges and points of a surface without defects that are outside the filled regions.
pub(super) fn leave_out(
    surface: &mut Surface,
    options: &Options,
    scratch: &ScratchSpace,
    settings: &Settings,
) -> Result<(), Error> {
    let outer = attempt(|| pipeline::outer_embedded(&surface.inner, options, scratch))??;
    if outer.is_empty() {
        return Ok(());
    }
    settings.note(format!(
        "note: {} and {} outside the filled regions were left out",
        count(outer.edges.len() as u64, "edge"),
        count(outer.points.len() as u64, "point")
    ));
    surface.without_wires(&outer.edges, &outer.points, scratch)
}

/// Divides the triangles of a surface without defects to the lengths that `options` require.
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
    let h = |p| sizes.h(p).min(wanted);
    let predicted = surface::predict_split(&surface.inner, &h);
    if predicted > 2.0 * before as f64 {
        settings.note(format!("the surface will have about {predicted:.3e} triangles"));
    }
    surface.divide(&h, cap, &scratch)?;
    settings.note(format!(
        "the surface was divided into {} triangles, from {before}",
        surface.n_triangles()
    ));
    Ok(())
}

/// Computes the size field of a surface and predicts the mesh, within `cap`. Sizes that were given as arrays are read from `store`.
#[doc(hidden)]
pub fn predict(
    surface: &surface::Surface,
    options: &Options,
    cap: u64,
    store: &Path,
) -> Result<Prepared, Error> {
    predict_with(surface, options, None, cap, store)
}

/// Like [`predict`], with sizes given as arrays that are in no store yet.
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

/// Passes the surface to the pipeline. A surface that is large against the cap is moved, and read again for verification.
pub(super) fn lent_or_given(surface: &mut surface::Surface, cap: u64) -> Cow<'_, surface::Surface> {
    match surface.bytes() as u64 > cap / SURFACE_KEPT {
        true => Cow::Owned(std::mem::take(surface)),
        false => Cow::Borrowed(surface),
    }
}

/// Verifies a mesh against its surface and records the verification. Without `surface`, the surface is read again.
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
    Ok(Verification { report, is_refined: false })
}
