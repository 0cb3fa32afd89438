//! Sub-domains of a finished store meshed again; what lies around them stays as it is.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use tetdb_schema::code::Code;

use serde_json::{Value, json};

use super::mesher::predict;
use super::preflight::scratch_beside;
use super::store::{open_finished, open_to_change};
use super::{Error, Settings, Sizes, Store, Surface, guarded, job, verify};
use crate::pipeline::{
    self, MeshOptions, NewSizes, Options, OptionsText, RECIPE, ResaturateSummary, Resaturation,
    SizeFile, Values,
};
use tetdb_kernel::sizing::{SizeField, SizeOptions};
use tetdb_schema::catalog::SubdomainRow;
use tetdb_store::audit::Level;
use tetdb_store::store::{Catalog, StoreError, WriterLock};

/// What is to be meshed again, and how; begun by [`Store::remesh`].
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
    ranks: BTreeSet<u32>,
    sizes: Option<Sizes>,
    lengths: Option<Values>,
    factor: f64,
    prepared: Option<NewSizes>,
    repair: bool,
    verify: bool,
    /// `None`: it is taken when the run begins.
    lock: Option<Arc<WriterLock>>,
}

/// What was meshed again.
pub struct Remeshed {
    /// The store as it is now.
    pub store: Store,
    /// Each sub-domain before and after, by rank.
    pub subdomains: Vec<[SubdomainRow; 2]>,
}

impl Store {
    /// Sub-domains of it again, with other sizes or because they are damaged.
    pub fn remesh(self) -> Remesh {
        let (path, settings) = self.into_parts();
        Remesh::new(path, settings)
    }

    /// Brings back what the last [`Store::remesh`] replaced. Errors: `nothing-to-undo`.
    pub fn undo(self) -> Result<Self, Error> {
        let (path, settings) = self.into_parts();
        guarded(&settings, || {
            let mut catalog = open_to_change(&path, &settings)?;
            pipeline::undo(&mut catalog)?;
            Ok(catalog.close()?)
        })?;
        Self::open_with(path, settings)
    }

    /// Drops what the last [`Store::remesh`] replaced, which cannot be undone then. Returns the number of sub-domains.
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
    #[doc(hidden)]
    pub fn new(path: PathBuf, settings: Settings) -> Self {
        Self {
            path,
            settings,
            ranks: BTreeSet::new(),
            sizes: None,
            lengths: None,
            factor: 1.0,
            prepared: None,
            repair: false,
            verify: true,
            lock: None,
        }
    }

    /// Which sub-domains, by rank.
    pub fn subdomains(mut self, ranks: &[u32]) -> Self {
        self.ranks = ranks.iter().copied().collect();
        self
    }

    /// With these sizes beside those on record: single lengths replace them, shapes and regions are added.
    pub fn sizes(mut self, sizes: Sizes) -> Self {
        self.sizes = Some(sizes);
        self
    }

    /// With one length for each tetrahedron of the sub-domains, by rank, in the order in which they are read.
    pub fn lengths_of_tets(mut self, lengths: Vec<f64>) -> Self {
        self.lengths = Some(Values::Tets(lengths));
        self
    }

    /// With one length for each vertex of the only sub-domain, in the order in which they are read.
    pub fn lengths_of_vertices(mut self, lengths: Vec<f64>) -> Self {
        self.lengths = Some(Values::Vertices(lengths));
        self
    }

    /// All lengths times `factor`: 0.5 gives edges half as long.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.factor = factor;
        self
    }

    /// The files are damaged: the sub-domains must become what the catalog says they were. Without a list, all that are damaged.
    pub fn repair(mut self) -> Self {
        self.repair = true;
        self
    }

    /// Whether the changed mesh is verified. Default: it is.
    pub fn verify(mut self, verify: bool) -> Self {
        self.verify = verify;
        self
    }

    /// By a caller in this crate who has the lock of the store.
    #[doc(hidden)]
    pub fn locked(mut self, lock: Option<Arc<WriterLock>>) -> Self {
        self.lock = lock;
        self
    }

    /// With sizes that a caller in this crate has prepared.
    #[doc(hidden)]
    pub fn prepared_sizes(mut self, sizes: Option<NewSizes>) -> Self {
        self.prepared = sizes;
        self
    }

    /// Meshes them again in one step, verifies, and opens the store. The result depends on store and sizes alone.
    ///
    /// Errors: `no-such-part`, `no-coarse-leaf`; sizes that make no sense; `store-recipe` where a repair is to give what another recipe
    /// gave. The store is then as it was.
    pub fn run(self) -> Result<Remeshed, Error> {
        let (path, settings) = (self.path.clone(), self.settings.clone());
        let parts = self.run_reported()?.parts.into_iter();
        Ok(Remeshed {
            store: Store::open_with(path, settings)?,
            subdomains: parts.map(|part| [part.before, part.after]).collect(),
        })
    }

    /// [`Remesh::run`], and what it did.
    #[doc(hidden)]
    pub fn run_reported(self) -> Result<ResaturateSummary, Error> {
        let settings = self.settings.clone();
        guarded(&settings, || {
            let (summary, lock) = self.change()?;
            if self.verify {
                verify_changed(&self.path, &self.settings, lock)?;
            }
            Ok(summary)
        })
    }

    fn change(&self) -> Result<(ResaturateSummary, Arc<WriterLock>), Error> {
        let mut open = match &self.lock {
            Some(lock) => Catalog::open_locked(&self.path, lock.clone())?,
            None => open_to_change(&self.path, &self.settings)?,
        };
        let lock = open.lock().expect("it is open for writing");
        let options = Options::from(job::options_of(&open.job()?, &self.path)?);
        let ranks = match self.repair && self.ranks.is_empty() {
            true => damaged(&mut open)?,
            false => self.ranks.clone(),
        };
        check_recipe(&mut open, self.repair, &self.settings)?;
        let sizes = match &self.prepared {
            Some(sizes) => Some(sizes.clone()),
            None => self.new_sizes(&mut open, &options)?,
        };
        let what = Resaturation { ranks, sizes, repair: self.repair };
        let (budget, watch) = (self.settings.budget()?, self.settings.watcher());
        let summary = pipeline::resaturate(&mut open, &options, &what, &budget, &watch)?;
        open.close()?;
        Ok((summary, lock))
    }

    fn new_sizes(&self, open: &mut Catalog, options: &Options) -> Result<Option<NewSizes>, Error> {
        if self.sizes.is_none() && self.lengths.is_none() && self.factor == 1.0 {
            return Ok(None);
        }
        if !(self.factor.is_normal() && self.factor > 0.0) {
            let message =
                format!("a factor of {} scales nothing, expected one above zero", self.factor);
            return Err(Error::new(Code::BadSize, message));
        }
        let given = self.sizes.clone();
        if given.as_ref().is_some_and(|given| given.field.is_some()) {
            let message = "a background mesh of arrays is for a new mesh";
            return Err(Error::new(Code::Usage, message)
                .with_help("give a length for each tetrahedron or vertex instead"));
        }
        let sizes = given.map(|given| Ok::<_, Error>((given.options()?, given.file)));
        let asked = AskedSizes {
            sizes: sizes.transpose()?,
            values: self.lengths.clone(),
            file: None,
            factor: self.factor,
            limits: [0.0, f64::INFINITY],
            refine_by: json!(self.factor),
        };
        Ok(Some(asked.new_sizes(open, options, &self.settings)?))
    }
}

/// What is asked for in place of the sizes on record.
#[doc(hidden)]
pub struct AskedSizes {
    /// Sizes beside those on record.
    pub sizes: Option<(SizeOptions, Option<SizeFile>)>,
    /// Lengths one by one: of the options only the gradation counts beside them.
    pub values: Option<Values>,
    /// Where those were read from.
    pub file: Option<String>,
    /// Times this.
    pub factor: f64,
    /// No length of `values` is taken below or above these.
    pub limits: [f64; 2],
    /// The factor as it was given, to be recorded.
    pub refine_by: Value,
}

impl AskedSizes {
    /// Errors: sizes without a meaning; a surface that is not what it was, where its edges are needed.
    pub fn new_sizes(
        self,
        open: &mut Catalog,
        options: &Options,
        settings: &Settings,
    ) -> Result<NewSizes, Error> {
        let (sizes, file) = self.sizes.clone().unwrap_or_default();
        let beta = match sizes.hgrad {
            Some(_) => sizes.beta(),
            None => options.mesh.sizes.beta(),
        };
        let mut asked = MeshOptions { sizes, size_field: file, ..MeshOptions::default() };
        let field = match (&self.sizes, &self.values) {
            (Some(_), None) => {
                job::identify_sizes(&mut asked)?;
                let mut all = options.clone();
                all.mesh.sizes.add(&asked.sizes);
                if asked.size_field.is_some() {
                    all.mesh.size_field.clone_from(&asked.size_field);
                }
                Some(field_of_surface(open, &all, settings)?)
            }
            _ => None,
        };
        let mut asked = OptionsText::from_sizes(&asked.sizes, asked.size_field.as_ref());
        asked.size_field = self.file.or(asked.size_field);
        let asked = serde_json::to_value(&asked).unwrap_or_default();
        Ok(NewSizes {
            field,
            values: self.values,
            factor: self.factor,
            limits: self.limits,
            beta,
            asked: json!({ "options": asked, "refine_by": self.refine_by }).to_string(),
        })
    }
}

/// The field of the surface a store was made from, with these options. Errors: a surface that is not what it was.
fn field_of_surface(
    open: &mut Catalog,
    all: &Options,
    settings: &Settings,
) -> Result<SizeField, Error> {
    let (dir, cap) = (open.dir().to_owned(), settings.cap()?);
    let scratch = scratch_beside(&tetdb_base::surface::Surface::default(), cap, &dir)?;
    let surface = Surface::of_record(&open.job()?.surfaces, &dir, &scratch)?;
    drop(scratch);
    let prepared = predict(&surface.inner, all, cap, &dir)?;
    settings.note(prepared.sizes.to_string());
    Ok(prepared.field)
}

/// A repair must give what the recipe of then gave; any other change only says that the recipe is another.
#[doc(hidden)]
pub fn check_recipe(open: &mut Catalog, is_repair: bool, settings: &Settings) -> Result<(), Error> {
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

/// The sub-domains of which something cannot be read.
#[doc(hidden)]
pub fn damaged(open: &mut Catalog) -> Result<BTreeSet<u32>, Error> {
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
    /// For chunks and what redb holds of the file.
    const MEMORY_BYTES: usize = 8 << 20;
    let mut part = catalog.open_subdomain(rank, MEMORY_BYTES)?;
    part.vertex_chunks().try_for_each(|c| c.map(drop))?;
    part.tet_chunks().try_for_each(|c| c.map(drop))?;
    part.facet_chunks().try_for_each(|c| c.map(drop))?;
    part.interface_chunks().try_for_each(|c| c.map(drop))?;
    Ok(part.check()?)
}

/// Verifies a changed store, against its surface if that is still there, and puts it on record; `lock` was held since.
#[doc(hidden)]
pub fn verify_changed(
    path: &std::path::Path,
    settings: &Settings,
    lock: Arc<WriterLock>,
) -> Result<(), Error> {
    let report = {
        let mut open = open_finished(path)?;
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
