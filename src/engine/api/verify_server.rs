//! Verification of single sub-domains for another process, which adds up the reports (see `verify_shared`).
//!
//! The server reads the order, the sub-domain's file and the surface. It never opens the catalog.

use std::path::Path;
use tetdb_schema::code::Code;

use tetdb_schema::catalog::SubdomainRow;

use super::preflight::scratch_beside;
use super::verify_shared::{Job, fingerprint, options};
use super::{Error, Settings};
use crate::api;
use crate::pipeline::{WorkKind, from_bytes, to_bytes};
use tetdb_base::geom::Point;
use tetdb_base::storage::{DiskPath, attempt};
use tetdb_base::surface::Surface;
use tetdb_store::audit::{self, VerifyOptions};
use tetdb_store::sealed::Subdomain;
use tetdb_store::store::{Catalog, StoreError};

/// Verifies single sub-domains for another process.
pub struct Server {
    job: Job,
    surface: Option<Surface>,
    options: VerifyOptions,
}

impl Server {
    /// Starts a verification. Returns `None` if `job` is no verification.
    ///
    /// Effects: reads the surface. Errors: the surface differs from the one to compare with.
    pub fn begin(job: &[u8], settings: &Settings) -> Option<Result<Self, Error>> {
        let job: Job = from_bytes(WorkKind::Verification, job).ok()?;
        Some(Self::with(job, settings))
    }

    fn with(job: Job, settings: &Settings) -> Result<Self, Error> {
        let cap = settings.cap()?;
        let surface = match &job.surface {
            None => None,
            Some((sources, print)) => {
                let scratch = settings.scratch_dir().join("verify");
                let space = scratch_beside(&Surface::default(), cap, &scratch)?;
                let read = api::Surface::of_record(sources, Path::new(&job.store), &space)?.inner;
                if fingerprint(&read) != *print {
                    let message = "the surface that was read is not the one to compare with";
                    return Err(Error::new(Code::SurfaceChanged, message));
                }
                Some(read)
            }
        };
        Ok(Self {
            options: options((cap, settings.scratch_dir()), surface.as_ref(), job.level),
            surface,
            job,
        })
    }

    /// Verifies one sub-domain. Errors: damage; the disk; an unreadable order.
    pub fn perform(&self, order: &[u8]) -> Result<Vec<u8>, Error> {
        let row: SubdomainRow = from_bytes(WorkKind::PartOrder, order).map_err(Error::internal)?;
        let found = attempt(|| {
            let name = Catalog::file_name(row.rank, row.generation);
            let path = DiskPath::from(Path::new(&self.job.store)).join(name);
            let mut part = Subdomain::open(&path, row, self.options.memory_bytes / 4)?;
            let apex = self.job.apex.map(Point::from_array);
            audit::verify_part(&mut part, apex, self.surface.as_ref(), &self.options)
        });
        let found = found.map_err(StoreError::from).flatten()?;
        Ok(to_bytes(WorkKind::PartReport, &found))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::api::{Bytes, Mesher, Subdomains, guarded};
    use crate::pipeline::{RemoteWorkers, WorkerPool};
    use tetdb_base::storage::RemoteFailure;
    use tetdb_store::audit::{Level, Report};

    /// Remote workers simulated by this process.
    #[derive(Default)]
    struct Threads {
        slots: usize,
        /// A worker that always fails.
        broken: Option<usize>,
        server: Mutex<Option<Arc<Server>>>,
        done: AtomicUsize,
    }

    fn failure(error: Error) -> RemoteFailure {
        RemoteFailure { code: error.code().to_owned(), message: error.message().to_owned() }
    }

    impl WorkerPool for Threads {
        fn begin(&self, job: &[u8]) -> Result<usize, RemoteFailure> {
            let server = Server::begin(job, &small()).expect("a verification");
            *self.server.lock().expect("no panics") = Some(Arc::new(server.map_err(failure)?));
            Ok(self.slots)
        }

        fn perform(&self, slot: usize, order: Vec<u8>) -> Result<Vec<u8>, RemoteFailure> {
            let server = self.server.lock().expect("no panics").clone();
            if self.broken == Some(slot) {
                return Err(failure(Error::internal("its disk is gone".to_owned())));
            }
            self.done.fetch_add(1, Ordering::Relaxed);
            (server.expect("it has begun").perform(&order)).map_err(failure)
        }
    }

    fn small() -> Settings {
        Settings::new().memory(Bytes(64 << 20)).threads(1)
    }

    fn made(dir: &Path) -> (std::path::PathBuf, Surface) {
        let path = dir.join("wells.tetdb");
        let surface = api::Surface::sample("wells,count=9,points=9,cells=28").expect("a sample");
        let mesher = Mesher::new(surface.clone()).subdomains(Subdomains::Exactly(3));
        (mesher.verify(false).settings(small()).create(&path)).expect("a mesh");
        (path, surface.inner)
    }

    /// The report or the error of a verification with these workers, and the number of orders that they performed.
    fn found(
        path: &Path,
        surface: Option<&Surface>,
        threads: Threads,
    ) -> (Result<Report, String>, usize) {
        let threads = Arc::new(threads);
        let mut settings = small();
        settings.remote = RemoteWorkers(Some(threads.clone()));
        let report = guarded(&settings, || {
            let mut store = Catalog::open(path)?;
            crate::api::verify::check(&mut store, &settings, surface, 64 << 20, Level::Delaunay)
        });
        (report.map_err(|e| e.message().to_owned()), threads.done.load(Ordering::Relaxed))
    }

    #[test]
    fn whoever_looks_at_sub_domains_the_report_is_the_same() {
        let dir = tempfile::tempdir().expect("a folder");
        let (path, surface) = made(dir.path());
        let mut store = Catalog::open(&path).expect("a store");
        let space = (64 << 20, std::env::temp_dir());
        let options = options(space, Some(&surface), Level::Delaunay);
        let one = audit::verify(&mut store, Some(&surface), &options).expect("sound");
        assert!(one.valid && one.subdomains > 1, "{one:?}");
        assert!(one.edges_present > 0 && one.points_present > 0 && one.interface_faces > 0);
        for slots in [0, 1, 4] {
            let threads = Threads { slots, ..Threads::default() };
            let (report, n) = found(&path, Some(&surface), threads);
            assert_eq!(report.as_ref(), Ok(&one), "{slots} workers");
            assert_eq!(n > 0, slots > 0);
        }
        let broken = Threads { slots: 2, broken: Some(1), ..Threads::default() };
        assert_eq!(found(&path, Some(&surface), broken).0, Ok(one.clone()));
        // A larger cap leaves memory for several threads in this process.
        for n in [1, 2, 5] {
            let settings = Settings::new().memory(Bytes(2 << 30)).threads(n);
            let report = guarded(&settings, || {
                let mut store = Catalog::open(&path)?;
                let (surface, cap) = (Some(&surface), 2 << 30);
                crate::api::verify::check(&mut store, &settings, surface, cap, Level::Delaunay)
            });
            assert_eq!(report.ok(), Some(one.clone()), "{n} threads");
        }
        // The workers would read a different surface, so this process verifies everything itself.
        let mut moved = surface;
        moved.points[0].x += 0.5;
        let threads = Threads { slots: 2, ..Threads::default() };
        let (report, n) = found(&path, Some(&moved), threads);
        assert!(!report.expect("an answer").valid);
        assert_eq!(n, 0);
    }

    #[test]
    fn damage_is_the_same_error_whoever_finds_it() {
        let dir = tempfile::tempdir().expect("a folder");
        let (path, surface) = made(dir.path());
        let mut store = Catalog::open(&path).expect("a store");
        let row = store.subdomains().expect("rows").swap_remove(1);
        let file = store.file_path(row.rank, row.generation);
        let mut bytes = std::fs::read(file.path()).expect("its file");
        // A quarter of the file, because some parts of a file hold no data.
        let n = bytes.len();
        bytes[3 * n / 8..5 * n / 8].fill(0xa5);
        std::fs::write(file.path(), bytes).expect("its file");
        let of = |slots| {
            let threads = Threads { slots, ..Threads::default() };
            found(&path, Some(&surface), threads).0
        };
        let one = of(0).expect_err("damage");
        for slots in [1, 3] {
            assert_eq!(of(slots).expect_err("damage"), one, "{slots} workers");
        }
    }
}
