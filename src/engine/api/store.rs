//! A finished store, open for reading.

use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use super::guard::guarded_in;
use super::{Error, Event, Settings, Surface, Verification, VerifyLevel, job, verify};
use tetdb_base::storage::RunContext;
use tetdb_schema::catalog::{InterfaceRow, RegionRow, StoreState, SubdomainRow};
use tetdb_schema::labels::LabelSet;
use tetdb_schema::source::{Origin, Source};
use tetdb_store::audit::Level;
use tetdb_store::query::QuerySession;
use tetdb_store::sealed::Subdomain;
use tetdb_store::store::{Catalog, StoreError};

/// Memory of one open sub-domain: half for the database, half for decoded vertices.
const SUBDOMAIN_BYTES: usize = 16 << 20;

/// A finished store, open for reading.
///
/// Other processes may read and change the store at the same time. Answers come from the state in which the store was opened. A call
/// fails with `store-changed` if files of that state are gone.
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// # tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.5")?).create(&path)?;
/// let mut store = tetdb::Store::open(&path)?;
/// println!("{} tetrahedra, digest {}", store.summary().n_tets, store.summary().digest);
///
/// let mut part = store.subdomain(0)?;
/// for chunk in part.tet_chunks() {
///     for tet in chunk?.records {
///         assert_eq!(tet.nodes.len(), 4);
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Store {
    path: PathBuf,
    settings: Settings,
    context: RunContext,
    /// The catalog in the state in which it was opened, whatever other processes change.
    catalog: Catalog,
    summary: Summary,
    session: Option<QuerySession>,
}

/// Bounds of what reads the sub-domains of a store chunk by chunk.
#[derive(Clone)]
pub struct Guard(RunContext);

impl Guard {
    /// Does `work` as a call of the store: the token of its settings cancels it, and a panic of the database, which damaged files can
    /// cause, is an error.
    pub fn run<T>(&self, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        guarded_in(&self.0, work)
    }
}

/// Counts, digests and labels of a store.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Summary {
    /// Number of tetrahedra.
    pub n_tets: u64,
    /// Number of vertices. A vertex shared by several sub-domains counts in each.
    pub n_vertices: u64,
    /// Bytes of the sub-domains' files.
    pub bytes: u64,
    /// Digest of the mesh as 32 hexadecimal digits. Equal meshes have equal digests.
    pub digest: String,
    /// Digest of the interface faces.
    pub interface_digest: String,
    /// True if a verification is on record.
    pub is_verified: bool,
    /// The greatest q = √6/12 · longest edge / inradius; 1 is regular.
    pub worst_quality: f64,
    /// Number of triangles of the input, where the store says. Facets with this number and above hold embedded edges and are not of the
    /// input.
    pub input_triangles: Option<u64>,
    /// Names of the labels. A label is a position in this list.
    pub labels: Vec<String>,
    /// Labels of triangles in several groups, and the labels of those; none where no triangle is in two.
    pub label_sets: Vec<LabelSet>,
    /// Regions by number, including empty ones.
    pub regions: Vec<RegionRow>,
    /// Names of regions 1, 2, …; empty for a region without a name. No elements if no region has a name.
    pub region_names: Vec<String>,
    /// Sub-domains, in order of rank.
    pub subdomains: Vec<SubdomainRow>,
    /// Pairs of sub-domains and the number of faces that they share, in order of cut.
    pub interfaces: Vec<InterfaceRow>,
}

impl Store {
    /// Opens a finished store. Errors: `no-such-store`, `not-a-store`, `store-unfinished`, `damaged`, `busy`.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::open_with(path, Settings::new())
    }

    /// Like [`Store::open`], with settings for all later calls.
    pub fn open_with(path: impl AsRef<Path>, settings: Settings) -> Result<Self, Error> {
        let path = path.as_ref().to_owned();
        let context = RunContext::new(settings.n_threads(), settings.cancel.clone());
        let (catalog, summary) = guarded_in(&context, || {
            let mut catalog = open_finished(&path, &settings)?;
            let summary = Summary::of(&mut catalog)?;
            Ok((catalog, summary))
        })?;
        Ok(Self { path, settings, context, catalog, summary, session: None })
    }

    /// Opens a finished store as it was in a version; see [`Store::save_version`]. Errors: as [`Store::open`]; `no-such-part`.
    pub fn open_version(path: impl AsRef<Path>, name: &str) -> Result<Self, Error> {
        Self::open_with(path, Settings::new().at_version(name))
    }

    /// Path of the store.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Splits the store into its path and its settings.
    pub(super) fn into_parts(self) -> (PathBuf, Settings) {
        (self.path, self.settings)
    }

    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Counts, digests and labels of the store.
    pub fn summary(&self) -> &Summary {
        &self.summary
    }

    /// Opens a sub-domain for reading chunk by chunk. Only one chunk at a time is copied.
    ///
    /// Errors: `no-such-part`; damage.
    pub fn subdomain(&self, rank: u32) -> Result<Subdomain, Error> {
        guarded_in(&self.context, || {
            Ok(self.catalog.share().open_subdomain(rank, SUBDOMAIN_BYTES)?)
        })
    }

    /// Cancels reads of this store's sub-domains, and turns panics of its database into errors.
    pub fn guard(&self) -> Guard {
        Guard(self.context.clone())
    }

    /// Finds the tetrahedron that contains each point; `None` outside the mesh. If several contain a point, the one with the lowest id
    /// is returned.
    ///
    /// Shape: the result runs parallel to `points`. Errors: damage; too little memory.
    pub fn locate(
        &mut self,
        points: &[[f64; 3]],
    ) -> Result<Vec<Option<tetdb_store::query::Hit>>, Error> {
        self.with_session(|session| {
            let points: Vec<_> =
                points.iter().map(|p| tetdb_base::geom::Point::from_array(*p)).collect();
            Ok(session.locate(&points)?.into_iter().map(|located| located.found).collect())
        })
    }

    /// Verifies the mesh with exact signs, against its surface if that can still be read.
    ///
    /// An invalid mesh is a result, not an error. Errors: damage; `surface-changed`.
    pub fn verify(&self, level: VerifyLevel) -> Result<Verification, Error> {
        guarded_in(&self.context, || {
            let sources = self.catalog.share().job()?.surfaces;
            let scratch = self.settings.scratch_space(0)?;
            let surface = match Surface::of_record(&sources, &self.path, &scratch) {
                Ok(surface) => Some(surface),
                Err(error) if error.code() == Code::UnreadableFile => {
                    self.settings.say(&Event::SurfaceMissing);
                    None
                }
                Err(error) => return Err(error),
            };
            drop(scratch);
            self.verify_with(surface.as_ref(), level)
        })
    }

    /// Repairs and remeshes a surface as that of the store was, if it was. One that is repaired already is remeshed alone.
    ///
    /// Errors: those of the repairs.
    pub fn repaired_alike(
        &self,
        mut surface: Surface,
        is_repaired: bool,
    ) -> Result<Surface, Error> {
        guarded_in(&self.context, || {
            let records = self.catalog.share().job()?.surfaces;
            let sources = records.iter().filter_map(Source::from_record);
            let scratch = self.settings.scratch_space(surface.inner.bytes() as u64)?;
            let is_left = |origin: &Origin| match origin {
                Origin::Remeshed(_) => true,
                origin => !is_repaired && origin.is_repair(),
            };
            for source in sources.filter(|s| is_left(&s.origin)) {
                surface = surface.with_inside(&source.origin, &self.path, &scratch)?;
            }
            Ok(surface)
        })
    }

    /// Like [`Store::verify`], against the given surface instead of the recorded files.
    pub fn verify_against(
        &self,
        surface: &Surface,
        level: VerifyLevel,
    ) -> Result<Verification, Error> {
        guarded_in(&self.context, || {
            let found = self.verify_with(Some(surface), level)?;
            let options = job::options_of(&self.catalog.share().job()?, &self.path)?;
            Ok(Verification { is_refined: options.refine_surface, ..found })
        })
    }

    fn verify_with(
        &self,
        surface: Option<&Surface>,
        level: VerifyLevel,
    ) -> Result<Verification, Error> {
        let cap = self.settings.cap()?;
        let level = match level {
            VerifyLevel::Geometry => Level::Geometry,
            VerifyLevel::Delaunay => Level::Delaunay,
        };
        let surface = surface.map(|surface| &surface.inner);
        let mut catalog = self.catalog.share();
        let report = verify::check(&mut catalog, &self.settings, surface, cap, level)?;
        Ok(Verification { report, is_refined: false })
    }

    /// Returns whether another store has the same mesh, bit for bit, in the same sub-domains.
    pub fn is_same_mesh(&self, other: &Self) -> bool {
        self.summary.digest == other.summary.digest
    }

    /// Another reader of the same state of the store.
    pub(super) fn catalog_shared(&self) -> Catalog {
        self.catalog.share()
    }

    /// Goes on with the store as it is now, after a change.
    pub(super) fn reopen(&mut self) -> Result<(), Error> {
        *self = Self::open_with(&self.path, self.settings.clone())?;
        Ok(())
    }

    /// Closes the query session. The next question opens it again.
    pub(super) fn close_session(&mut self) {
        self.session = None;
    }

    /// Runs `work` with the query session, and keeps the session open.
    pub(super) fn with_session<T>(
        &mut self,
        work: impl FnOnce(&mut QuerySession) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let Self { catalog, settings, context, session, .. } = self;
        guarded_in(context, || {
            if session.is_none() {
                *session = Some(QuerySession::open(catalog.share(), &settings.budget()?)?);
            }
            work(session.as_mut().expect("it was opened above"))
        })
    }

    pub(super) fn context_and_session(
        &mut self,
    ) -> Result<(&RunContext, &mut QuerySession), Error> {
        self.with_session(|_| Ok(()))?;
        Ok((&self.context, self.session.as_mut().expect("it was opened above")))
    }
}

impl Summary {
    fn of(catalog: &mut Catalog) -> Result<Self, Error> {
        let subdomains = catalog.subdomains()?;
        let worst = subdomains.iter().map(|r| r.quality.worst);
        let [digest, interface_digest] = catalog.digest()?;
        Ok(Self {
            n_tets: subdomains.iter().map(|r| r.tets).sum(),
            n_vertices: subdomains.iter().map(|r| r.vertices).sum(),
            bytes: subdomains.iter().map(|r| r.bytes).sum(),
            digest: digest.to_string(),
            interface_digest: interface_digest.to_string(),
            is_verified: catalog.state()? == StoreState::Verified,
            worst_quality: worst.fold(0.0, f64::max),
            input_triangles: catalog.n_input_triangles()?,
            labels: catalog.labels()?,
            label_sets: catalog.label_sets()?,
            regions: catalog.regions()?,
            region_names: catalog.region_names()?,
            interfaces: catalog.interfaces()?,
            subdomains,
        })
    }
}

/// Opens a finished store, at the version that the settings name. Errors: `store-unfinished`; `no-such-part`.
#[doc(hidden)]
pub fn open_finished(path: &Path, settings: &Settings) -> Result<Catalog, Error> {
    at_version(if_finished(Catalog::open(path)?, path)?, settings)
}

/// A store, at the version that the settings name. Errors: `no-such-part`.
pub(super) fn at_version(mut catalog: Catalog, settings: &Settings) -> Result<Catalog, Error> {
    Ok(match &settings.version {
        Some(name) => catalog.version_called(name).map(|(_, version)| catalog.at(&version))?,
        None => catalog,
    })
}

/// Opens a finished store to change it. Errors: `store-unfinished`; `busy` while another process changes it; `bad-version` for a version.
#[doc(hidden)]
pub fn open_to_change(path: &Path, settings: &Settings) -> Result<Catalog, Error> {
    if let Some(name) = &settings.version {
        let message = format!("version {name} cannot be changed");
        return Err(Error::new(Code::BadVersion, message).with_help("restore it, and change that"));
    }
    let catalog = Catalog::open_writable(path)?;
    say_how_locked(&catalog, settings);
    if_finished(catalog, path)
}

/// Reports a note if other writers are kept away only by a lock file.
#[doc(hidden)]
pub fn say_how_locked(catalog: &Catalog, settings: &Settings) {
    if catalog.lock().is_some_and(|lock| lock.is_by_name()) {
        settings.note(format!(
            "note: the file system of {} knows no locks; writer.lock in it keeps other writers of this host away, and has to be removed by hand when a writer of another host has died",
            catalog.dir().display()
        ));
    }
}

fn if_finished(mut catalog: Catalog, path: &Path) -> Result<Catalog, Error> {
    match catalog.state()?.is_finished() {
        true => Ok(catalog),
        false => Err(StoreError::Unfinished { path: path.to_owned() }.into()),
    }
}
