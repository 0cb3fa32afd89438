//! Meshing sub-domains of a finished store again. All other sub-domains stay unchanged.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::preflight::scratch_beside;
use super::remesh_sizes::{Lengths, RemeshSizes};
use super::store::{open_finished, open_to_change};
use super::{Error, Settings, Sizes, Store, Surface, TransferredField, guarded, job, verify};
use crate::pipeline::{self, Options, RECIPE, ResaturateSummary, Resaturation, Values};
use tetdb_schema::catalog::SubdomainRow;
use tetdb_store::audit::{self, Level};
use tetdb_store::store::{BEFORE, Catalog, StoreError, WriterLock};

/// A request to mesh sub-domains again; see [`Store::remesh`].
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// # let store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.25")?).create(&path)?;
/// let before = store.summary().n_tets;
/// let remeshed = store.remesh().subdomains(&[0]).scaled(0.5).run()?;
/// assert!(remeshed.store.summary().n_tets > before);
/// let store = remeshed.store.undo()?;
/// assert_eq!(store.summary().n_tets, before);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Remesh {
    path: PathBuf,
    settings: Settings,
    ranks: RemeshRanks,
    sizes: RemeshSizes,
    repair: bool,
    verify: bool,
    drop_fields: bool,
}

/// The sub-domains to mesh again.
#[derive(Clone, Debug)]
enum RemeshRanks {
    Listed(BTreeSet<u32>),
    /// The sub-domains whose lengths would change.
    Changed,
}

/// Result of meshing sub-domains again, or of bringing back an older version.
#[non_exhaustive]
pub struct Remeshed {
    /// The store after the change.
    pub store: Store,
    /// Each changed sub-domain before and after, by rank.
    pub subdomains: Vec<[SubdomainRow; 2]>,
    /// Number of vertices inserted into each sub-domain; `None` for a restored older version. Shape: parallel to `subdomains`.
    pub inserted_vertices: Vec<Option<u64>>,
    /// Fields of the store, evaluated on the changed sub-domains.
    pub fields: Vec<TransferredField>,
    /// Pages read from scratch files.
    pub pages_read: u64,
    /// Pages written to scratch files.
    pub pages_written: u64,
    /// Largest number of pages in memory at once.
    pub frames_used: usize,
}

/// A sub-domain that [`Remesh::run`] would mesh again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RemeshForecast {
    /// Rank of the sub-domain.
    pub id: u32,
    /// Number of its tetrahedra now.
    pub tets: u64,
    /// Predicted number of its tetrahedra afterwards.
    pub predicted_tets: f64,
}

impl Store {
    /// Starts a request to mesh sub-domains again, with other sizes or because they are damaged.
    pub fn remesh(self) -> Remesh {
        let (path, settings) = self.into_parts();
        Remesh::new(path, settings)
    }

    /// Restores mesh and fields as they were before the last [`Store::remesh`] or [`Store::restore_version`]. Errors: `nothing-to-undo`;
    /// `bad-field` for a field that was added since and is in no version.
    pub fn undo(self) -> Result<Self, Error> {
        Ok(self.undo_reported(false)?.store)
    }

    /// Like [`Store::undo`], with a report. Also verifies the mesh if `verify` is true. Errors: as [`Store::undo`]; `invalid-mesh`.
    pub fn undo_reported(self, verify: bool) -> Result<Remeshed, Error> {
        self.restored(|_| Ok(BEFORE), verify)
    }

    /// Restores the version whose number `which` finds.
    pub(super) fn restored(
        self,
        which: impl FnOnce(&mut Catalog) -> Result<u32, Error>,
        verify: bool,
    ) -> Result<Remeshed, Error> {
        let (path, settings) = self.into_parts();
        let summary = guarded(&settings, || {
            let mut catalog = open_to_change(&path, &settings)?;
            let (lock, number) = (catalog.lock(), which(&mut catalog)?);
            // An undo deletes the present mesh, so the previous one must be sound.
            if let Some(damage) = audit::damage_of_version(&mut catalog, number)?.into_iter().next()
            {
                let mut error = Error::from(damage);
                error.add("; it would come back, so nothing was changed");
                return Err(error);
            }
            let summary = pipeline::restore(&mut catalog, number)?;
            catalog.close()?;
            if let (true, Some(lock)) = (verify, lock) {
                verify_changed(&path, &settings, lock)?;
            }
            Ok(summary)
        })?;
        Remeshed::new(Self::open_with(path, settings)?, summary)
    }

    /// Deletes the previous versions that the last [`Store::remesh`] kept, so that it cannot be undone. Returns the number of
    /// sub-domains.
    pub fn forget_previous(&mut self) -> Result<usize, Error> {
        self.close_session();
        guarded(self.settings(), || {
            let mut catalog = open_to_change(self.path(), self.settings())?;
            let n = pipeline::forget(&mut catalog)?;
            catalog.close()?;
            Ok(n)
        })
    }
}

impl Remesh {
    /// A request for the store at `path`. The store is opened when the run begins.
    pub fn new(path: impl AsRef<Path>, settings: Settings) -> Self {
        Self {
            path: path.as_ref().to_owned(),
            settings,
            ranks: RemeshRanks::Listed(BTreeSet::new()),
            sizes: RemeshSizes::default(),
            repair: false,
            verify: true,
            drop_fields: false,
        }
    }

    /// Selects the sub-domains to mesh again, by rank.
    pub fn subdomains(mut self, ranks: &[u32]) -> Self {
        self.ranks = RemeshRanks::Listed(ranks.iter().copied().collect());
        self
    }

    /// Selects the sub-domains whose lengths would change by 5 % somewhere.
    pub fn changed(mut self) -> Self {
        self.ranks = RemeshRanks::Changed;
        self
    }

    /// Adds these sizes to those on record. Single lengths replace the recorded ones; shapes and regions are added.
    ///
    /// If lengths are given one by one, these sizes provide only their limits and the gradation.
    pub fn sizes(mut self, sizes: Sizes) -> Self {
        self.sizes.sizes = Some(sizes);
        self
    }

    /// Sets one length for each tetrahedron of the sub-domains, by rank, in the order in which the tetrahedra are read.
    pub fn lengths_of_tets(mut self, lengths: Vec<f64>) -> Self {
        self.sizes.lengths = Some(Lengths::Given(Values::Tets(lengths)));
        self
    }

    /// Sets one length for each vertex, in the order in which the vertices are read. Only one sub-domain may be selected.
    pub fn lengths_of_vertices(mut self, lengths: Vec<f64>) -> Self {
        self.sizes.lengths = Some(Lengths::Given(Values::Vertices(lengths)));
        self
    }

    /// Reads the lengths from a `.npy` file. Their number decides whether they belong to tetrahedra or to vertices.
    pub fn lengths_from(mut self, file: impl AsRef<Path>) -> Self {
        self.sizes.lengths = Some(Lengths::File(file.as_ref().to_owned()));
        self
    }

    /// Multiplies all lengths by `factor`; 0.5 gives edges half as long.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.sizes.factor = Some(factor);
        self
    }

    /// Repairs damaged files: the result must match the digests in the catalog. Without a list, all damaged sub-domains are repaired.
    pub fn repair(mut self) -> Self {
        self.repair = true;
        self
    }

    /// Drops all fields of the store together with the old mesh. Otherwise their values are evaluated on the new mesh.
    pub fn drop_fields(mut self) -> Self {
        self.drop_fields = true;
        self
    }

    /// Sets whether the changed mesh is verified. Default: true.
    pub fn verify(mut self, verify: bool) -> Self {
        self.verify = verify;
        self
    }

    /// Meshes the selected sub-domains in one step, verifies the mesh and opens the store.
    ///
    /// The result depends only on the store and the sizes. If no sub-domain is selected, the store stays unchanged.
    ///
    /// Errors: `no-such-part`, `no-coarse-leaf`; sizes that make no sense; `store-recipe` for a repair of a store that another recipe
    /// began. After these errors the store is unchanged.
    pub fn run(self) -> Result<Remeshed, Error> {
        let summary = guarded(&self.settings, || {
            let Some((summary, lock)) = self.change()? else {
                return Ok(None);
            };
            if self.verify {
                verify_changed(&self.path, &self.settings, lock)?;
            }
            Ok(Some(summary))
        })?;
        let store = Store::open_with(self.path, self.settings)?;
        Remeshed::new(store, summary.unwrap_or_default())
    }

    /// Lists the sub-domains that [`Remesh::run`] would mesh again. Nothing is changed. Errors: as [`Remesh::run`].
    pub fn forecast(&self) -> Result<Vec<RemeshForecast>, Error> {
        guarded(&self.settings, || {
            let mut open = open_finished(&self.path, &self.settings)?;
            let (options, request) = self.request(&mut open)?;
            if request.ranks.is_empty() {
                return Ok(Vec::new());
            }
            let budget = self.settings.budget()?;
            let list = pipeline::forecast(&mut open, &options, &request, &budget)?.into_iter();
            Ok(list
                .map(|f| RemeshForecast {
                    id: f.rank,
                    tets: f.tets,
                    predicted_tets: f.predicted.round(),
                })
                .collect())
        })
    }

    fn change(&self) -> Result<Option<(ResaturateSummary, Arc<WriterLock>)>, Error> {
        let mut open = open_to_change(&self.path, &self.settings)?;
        let lock = open.lock().expect("it is open for writing");
        let (options, request) = self.request(&mut open)?;
        if request.ranks.is_empty() {
            return Ok(None);
        }
        check_recipe(&mut open, self.repair, &self.settings)?;
        let (budget, watch) = (self.settings.budget()?, self.settings.watcher());
        let summary = pipeline::resaturate(&mut open, &options, &request, &budget, &watch)?;
        open.close()?;
        Ok(Some((summary, lock)))
    }

    /// The options of the store, and the request for the pipeline.
    fn request(&self, open: &mut Catalog) -> Result<(Options, Resaturation), Error> {
        let options = recorded_options(open, &self.path)?;
        let listed = match &self.ranks {
            RemeshRanks::Listed(ranks) => ranks.clone(),
            RemeshRanks::Changed => BTreeSet::new(),
        };
        let sizes = self.sizes.prepare(&listed, (open, &options), &self.settings)?;
        let ranks = match (&self.ranks, &sizes) {
            (RemeshRanks::Changed, Some(sizes)) => {
                pipeline::changed(open, &options, sizes, &self.settings.budget()?)?
            }
            (RemeshRanks::Listed(ranks), _) if self.repair && ranks.is_empty() => damaged(open)?,
            _ => listed,
        };
        let (repair, drop_fields) = (self.repair, self.drop_fields);
        Ok((options, Resaturation { ranks, sizes, repair, drop_fields }))
    }
}

/// The recorded options of a store. Errors: damage.
pub(super) fn recorded_options(open: &mut Catalog, path: &Path) -> Result<Options, Error> {
    Ok(Options::from(job::options_of(&open.job()?, path)?))
}

impl Remeshed {
    pub(super) fn new(store: Store, summary: ResaturateSummary) -> Result<Self, Error> {
        let fields = store.transferred(summary.fields)?;
        let inserted = summary.parts.iter().map(|part| part.fine.as_ref());
        Ok(Self {
            store,
            fields,
            inserted_vertices: inserted.map(|fine| fine.map(|f| f.refine.inserted)).collect(),
            pages_read: summary.pages.pages_read,
            pages_written: summary.pages.pages_written,
            frames_used: summary.frames_used,
            subdomains: summary.parts.into_iter().map(|part| [part.before, part.after]).collect(),
        })
    }
}

/// A repair must follow the recipe that began the store. Any other change only reports that the recipe differs.
pub(super) fn check_recipe(
    open: &mut Catalog,
    is_repair: bool,
    settings: &Settings,
) -> Result<(), Error> {
    if is_repair {
        return job::check_recipe(open);
    }
    let found = pipeline::recipe_of(open)?;
    if found != RECIPE {
        settings.note(format!(
            "note: the store was begun by version {found} of the recipe; what is meshed now follows version {RECIPE}"
        ));
    }
    Ok(())
}

/// Lists the sub-domains with unreadable data.
fn damaged(open: &mut Catalog) -> Result<BTreeSet<u32>, Error> {
    let mut ranks = BTreeSet::new();
    for row in open.subdomains()? {
        match read_all(open, row.rank) {
            Err(error) if error.is_damage() => drop(ranks.insert(row.rank)),
            other => other?,
        }
    }
    Ok(ranks)
}

fn read_all(catalog: &mut Catalog, rank: u32) -> Result<(), StoreError> {
    /// Memory for chunks and for redb's view of the file.
    const MEMORY_BYTES: usize = 8 << 20;
    let mut part = catalog.open_subdomain(rank, MEMORY_BYTES)?;
    part.vertex_chunks().try_for_each(|c| c.map(drop))?;
    part.tet_chunks().try_for_each(|c| c.map(drop))?;
    part.facet_chunks().try_for_each(|c| c.map(drop))?;
    part.interface_chunks().try_for_each(|c| c.map(drop))?;
    Ok(part.check()?)
}

/// Verifies a changed store, against its surface if that can be read, and records it. `lock` was held since the change.
pub(super) fn verify_changed(
    path: &Path,
    settings: &Settings,
    lock: Arc<WriterLock>,
) -> Result<(), Error> {
    let report = {
        let mut open = open_finished(path, settings)?;
        let sources = open.job()?.surfaces;
        let cap = settings.cap()?;
        let scratch = scratch_beside(&tetdb_base::surface::Surface::default(), cap, path)?;
        let surface = Surface::of_record(&sources, path, &scratch);
        if let Err(error) = &surface {
            let why = error.message();
            settings.note(format!(
                "note: the mesh is verified without its surface, which cannot be read: {why}"
            ));
        }
        let surface = surface.as_ref().ok().map(|surface| &surface.inner);
        verify::check(&mut open, settings, surface, cap, Level::Delaunay)?
    };
    if !report.valid {
        return Err(verify::invalid(&report, path).with_help("undo brings back what was before"));
    }
    settings.note(verify::sentence(&report));
    verify::record(path, lock)
}
