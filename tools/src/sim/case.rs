//! The fault case: a mesh of 30,000 tetrahedra in eight sub-domains, with so little memory that pages leave it and sorts spill.

use std::sync::Arc;

use tetdb_base::storage::{Budget, DiskPath, StoreFile};
use tetdb_base::surface::Surface;
use tetdb_engine::pipeline::{
    self, MeshOptions, NewSizes, Options, PipelineError, Plan, Resaturation, RunOptions,
    Subdomains, Trial, silent,
};
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::samples::SampleSpec;
use tetdb_schema::catalog::{Job, StoreState};
use tetdb_schema::digest::Digest;
use tetdb_schema::page::STORED_BYTES;
use tetdb_store::audit;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::{Catalog, StoreError};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use super::SimDisk;

const STORE: &str = "/case.tetdb";

/// Surface and options.
pub struct Case {
    surface: Surface,
    options: Options,
    budget: u64,
}

/// The digests of tetrahedra and of interface faces.
pub type Digests = [String; 2];

/// How a run ended, when it did not end well.
pub type Ended = Result<(), PipelineError>;

impl Case {
    /// `words` name a sample, such as `box,h=0.1`.
    pub fn new(words: &str, subdomains: u32) -> Self {
        let surface = SampleSpec::parse(words).and_then(|spec| spec.make());
        let trial = Trial {
            subdomains_small: true,
            plan: Some(Plan { frames: 1 << 20, redb: 512 << 10, buffers: 128 << 10 }),
        };
        let subdomains = Subdomains::Exactly(subdomains);
        let options = Options {
            mesh: MeshOptions { subdomains, ..MeshOptions::default() },
            run: RunOptions { trial, ..RunOptions::default() },
        };
        Self { surface: surface.expect("a sample").into(), options, budget: 128 << 20 }
    }

    /// The one all campaigns use.
    pub fn small() -> Self {
        Self::new("box,h=0.08", 8)
    }

    /// A smaller one, not optimized, for what is done to every single call: the disk is asked for much the same. With a quarter of
    /// the tetrahedra that eight sub-domains of edges of 0.12 have, a run takes half the time for as many calls.
    pub fn tiny() -> Self {
        let mut case = Self::new("box,h=0.2", 8);
        case.options.mesh.optimize = Mode::None;
        case
    }

    pub fn store(&self, disk: &Arc<SimDisk>) -> DiskPath {
        disk.path(STORE)
    }

    /// Begins the store, or goes on with it, until it is verified; as the program does.
    pub fn run(&self, disk: &Arc<SimDisk>) -> Ended {
        let store = self.store(disk);
        let mut catalog = match store.exists() && !Catalog::is_vacant(&store) {
            true => Catalog::open_writable(&store)?,
            false => Catalog::create(&store, &Job::default())?,
        };
        if !catalog.state()?.is_finished() {
            let budget = Budget::new(self.budget);
            pipeline::mesh(&mut catalog, &self.surface, &self.options, &budget, &silent)?;
        }
        catalog.close()?;
        let mut catalog = Catalog::open_writable(&store)?;
        if catalog.state()? < StoreState::Verified {
            catalog.commit(|step| {
                step.set_state(StoreState::Verified);
                Ok(())
            })?;
        }
        Ok(catalog.close()?)
    }

    /// Makes two sub-domains of the finished store again, in finer tetrahedra: one step.
    pub fn change(&self, disk: &Arc<SimDisk>) -> Ended {
        let sizes = NewSizes {
            field: None,
            base: None,
            values: None,
            factor: 0.8,
            limits: [0.0, f64::INFINITY],
            beta: self.options.mesh.sizes.beta(),
            requested: "{}".to_owned(),
        };
        let what = Resaturation {
            ranks: [2, 5].into(),
            sizes: Some(sizes),
            repair: false,
            drop_fields: false,
        };
        let mut catalog = Catalog::open_writable(self.store(disk))?;
        let budget = Budget::new(self.budget);
        pipeline::resaturate(&mut catalog, &self.options, &what, &budget, &silent)?;
        Ok(catalog.close()?)
    }

    /// The digests of a finished store, once from the catalog and once from all records.
    pub fn digests(&self, disk: &Arc<SimDisk>) -> Result<Digests, StoreError> {
        let mut store = Catalog::open(self.store(disk))?;
        let told = store.digest()?.map(|d| d.to_string());
        let found = audit::digest(&mut store, 16 << 20)?.map(|d| d.to_string());
        assert_eq!(told, found, "the catalog and the records disagree");
        Ok(told)
    }

    /// Opens a store in whatever state, for writing, and reads every row and every value of the files it lists.
    pub fn check(&self, disk: &Arc<SimDisk>) -> Result<StoreState, StoreError> {
        let path = self.store(disk);
        let mut catalog = Catalog::open_writable(&path)?;
        let state = catalog.state()?;
        catalog.job()?;
        catalog.labels()?;
        catalog.regions()?;
        catalog.interfaces()?;
        catalog.topology()?;
        catalog.journal()?;
        let parts = catalog.files()?.into_iter().map(|file| {
            let place = catalog.file_path(file.subdomain, file.generation);
            (file.subdomain, place)
        });
        let mut files: Vec<(u32, DiskPath)> = parts.collect();
        for leaf in catalog.coarse_snapshots()? {
            let place = catalog.coarse_path(leaf.rank, leaf.generation);
            files.push((leaf.rank, place));
        }
        for (subdomain, place) in files {
            let mut values = 0u64;
            let mut torn = None;
            let mut opened = StoreFile::open_repaired(&place, 1 << 20, false)?;
            opened.scan(0..u64::MAX, |key, value| {
                values += 1;
                if !is_sound(value) {
                    torn = Some(key);
                }
                torn.is_none()
            })?;
            if let Some(key) = torn {
                return Err(content(&path, subdomain, format!("value {key:x} is torn")));
            }
            if values == 0 {
                return Err(content(&path, subdomain, "its file is empty".into()));
            }
        }
        let rows = catalog.subdomains()?;
        drop(catalog);
        let mut store = Catalog::open(&path)?;
        let found = audit::digest(&mut store, 4 << 20)?;
        let mut told = [Digest::default(); 2];
        for row in rows {
            told[0].merge(&Digest { lanes: row.digest });
            told[1].merge(&Digest { lanes: row.interface_digest });
        }
        if found.map(|d| d.to_string()) != told.map(|d| d.to_string()) {
            return Err(content(&path, 0, "a sealed sub-domain has another digest".into()));
        }
        Ok(state)
    }
}

fn content(path: &DiskPath, subdomain: u32, what: String) -> StoreError {
    StoreError::Sealed(SealedError::Content { path: path.path().to_owned(), subdomain, what })
}

/// Whether a page or chunk matches its checksum.
fn is_sound(value: &[u8]) -> bool {
    /// Bytes of the records of a page; its checksum follows.
    const RECORDS: usize = 2046 * 32;
    let word = |at: usize| value[at..].first_chunk().map(|&b| u64::from_le_bytes(b));
    match value.get(8..12) {
        Some(b"TETC") => word(0) == Some(xxh3_64(&value[8..])),
        _ if value.len() == STORED_BYTES => {
            let mut hash = Xxh3::new();
            hash.update(&value[..RECORDS]);
            hash.update(&value[RECORDS + 8..]);
            word(RECORDS) == Some(hash.digest())
        }
        _ => false,
    }
}
