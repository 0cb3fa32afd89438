//! One verification by several processes: each looks at sub-domains by itself, this one adds up what they found.
//!
//! Helpers need the order, the file it names and the surface, and never open the catalog. What a helper cannot do or fails at is done here: the
//! report and the error are those of one process.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use rkyv::{Archive, Deserialize, Serialize};
use tetdb_schema::catalog::{SubdomainRow, SurfaceSource};
use xxhash_rust::xxh3::Xxh3;

use super::preflight::scratch_beside;
use super::{Error, Settings};
use crate::api;
use crate::audit::{self, Level, PartReport, Report, VerifyOptions};
use crate::geom::Point;
use crate::pipeline::{
    Hand, Helpers, Kind, PipelineError, Watcher, from_bytes, to_bytes, work_off,
};
use crate::sealed::Subdomain;
use crate::storage::{DiskPath, attempt};
use crate::store::{Catalog, StoreError};
use crate::surface::Surface;

/// What is the same for all sub-domains.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
struct Job {
    store: String,
    level: Level,
    apex: Option<[f64; 3]>,
    /// What the mesh is compared with, if with anything: where it can be read, and its fingerprint.
    surface: Option<(Vec<SurfaceSource>, u64)>,
}

/// Verifies within `cap`, less what the surface holds.
pub(super) fn options(cap: u64, surface: Option<&Surface>, level: Level) -> VerifyOptions {
    let held = surface.map_or(0, |s| s.bytes() as u64 + audit::wire_bytes(s));
    let memory = cap.saturating_sub(held).min(1 << 30) / 2;
    VerifyOptions {
        level,
        memory_bytes: memory as usize,
        temp_dir: std::env::temp_dir(),
    }
}

/// Verifies, with the other processes of `settings` if there are any. Errors: as [`audit::verify`].
pub(super) fn verify(
    store: &mut Catalog,
    settings: &Settings,
    surface: Option<&Surface>,
    options: &VerifyOptions,
) -> Result<Report, StoreError> {
    let Some(helpers) = settings.hands.0.clone() else {
        return audit::verify(store, surface, options);
    };
    if store.subdomains()?.len() < 2 {
        return audit::verify(store, surface, options);
    }
    let dir = std::path::absolute(store.dir()).unwrap_or_else(|_| store.dir().to_owned());
    let sources = store.job()?.surfaces;
    let own = Mutex::new(store.share());
    audit::verify_shared(store, surface, options, &mut |rows, apex, add| {
        let job = Job {
            store: dir.to_string_lossy().into_owned(),
            level: options.level,
            apex: apex.map(|p| p.to_array()),
            surface: surface.map(|s| (sources.clone(), fingerprint(s))),
        };
        let slots = match helpers.begin(&to_bytes(Kind::Verification, &job)) {
            Ok(slots) => slots,
            Err(failure) => {
                settings.note(format!(
                    "note: verified by one process: {}",
                    failure.message
                ));
                0
            }
        };
        let here = |row: &SubdomainRow| {
            let own = own.lock().unwrap_or_else(PoisonError::into_inner);
            let done = attempt(|| {
                let mut part = own.open_row(row.clone(), options.memory_bytes / 4)?;
                audit::verify_part(&mut part, apex, surface, options)
            });
            done.map_err(StoreError::from).flatten()
        };
        let each = |slot, row: &SubdomainRow| match ask(&*helpers, slot, row) {
            Ok(part) => Ok(part),
            Err(_) => here(row),
        };
        share(rows, slots, &here, &each, add)
    })
}

/// What is found of a sub-domain.
type Found = Result<PartReport, StoreError>;

/// Has each of `rows` looked at, here or by one of `slots` elsewhere; `add` takes what was found in their order.
fn share(
    rows: &[SubdomainRow],
    slots: usize,
    here: &(dyn Fn(&SubdomainRow) -> Found + Sync),
    elsewhere: &(dyn Fn(usize, &SubdomainRow) -> Found + Sync),
    add: &mut dyn FnMut(PartReport) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let own = |at: usize, _: &Watcher| Ok((at, here(&rows[at])));
    let others: Vec<_> = (0..slots)
        .map(|slot| move |at: usize, _: &Watcher| Ok((at, elsewhere(slot, &rows[at]))))
        .collect();
    let mut hands: Vec<Hand<usize, (usize, Found)>> = vec![&own];
    hands.extend(others.iter().map(|hand| hand as Hand<_, _>));
    let mut waiting = BTreeMap::new();
    let mut next = 0;
    let mut commit = |(at, found): (usize, Found)| {
        waiting.insert(at, found);
        while let Some(found) = waiting.remove(&next) {
            next += 1;
            add(found?)?;
        }
        Ok(Vec::new())
    };
    // The last of the list is taken first.
    let jobs = (0..rows.len()).rev().collect();
    let done = work_off(jobs, &hands, &|_| (), &mut commit);
    done.map_err(|error| match error {
        PipelineError::Store(error) => error,
        other => unreachable!("{other}: only what is added fails"),
    })
}

/// Has a sub-domain looked at by a helper. Errors: in words.
fn ask(helpers: &dyn Helpers, slot: usize, row: &SubdomainRow) -> Result<PartReport, String> {
    let answer = helpers.perform(slot, to_bytes(Kind::PartOrder, row));
    from_bytes(Kind::PartReport, &answer.map_err(|e| e.message)?)
}

/// Of all that a mesh is compared with.
fn fingerprint(surface: &Surface) -> u64 {
    let mut sum = Xxh3::new();
    let mut put = |words: &mut dyn Iterator<Item = u32>| {
        let mut n = 0u64;
        for word in words {
            sum.update(&word.to_le_bytes());
            n += 1;
        }
        sum.update(&n.to_le_bytes());
    };
    let bits = |p: &Point| p.to_array().map(f64::to_bits);
    let halves = |x: u64| [x as u32, (x >> 32) as u32];
    put(&mut surface.points.iter().flat_map(bits).flat_map(halves));
    put(&mut surface.triangles.iter().flatten().copied());
    put(&mut surface.sheets.iter().map(|&is_sheet| is_sheet.into()));
    put(&mut surface.wires.edges.iter().flatten().copied());
    put(&mut surface.wires.points.iter().flatten().copied());
    put(&mut surface.wires.fins.iter().flatten().copied());
    sum.digest()
}

/// The other side: looks at sub-domains for a process that adds up.
pub(crate) struct Server {
    job: Job,
    surface: Option<Surface>,
    options: VerifyOptions,
}

impl Server {
    /// `None` where `job` is no verification. Effects: the surface is read. Errors: it is not the one that is compared with.
    pub fn begin(job: &[u8], settings: &Settings) -> Option<Result<Self, Error>> {
        let job: Job = from_bytes(Kind::Verification, job).ok()?;
        Some(Self::with(job, settings))
    }

    fn with(job: Job, settings: &Settings) -> Result<Self, Error> {
        let cap = settings.cap()?;
        let surface = match &job.surface {
            None => None,
            Some((sources, print)) => {
                let scratch = std::env::temp_dir().join("verify");
                let space = scratch_beside(&Surface::default(), cap, &scratch)?;
                let read = api::Surface::of_record(sources, Path::new(&job.store), &space)?.inner;
                if fingerprint(&read) != *print {
                    let message = "the surface that was read is not the one to compare with";
                    return Err(Error::new("surface-changed", message));
                }
                Some(read)
            }
        };
        Ok(Self {
            options: options(cap, surface.as_ref(), job.level),
            surface,
            job,
        })
    }

    /// Looks at one sub-domain. Errors: damage; the disk; an order that cannot be read.
    pub fn perform(&self, order: &[u8]) -> Result<Vec<u8>, Error> {
        let row: SubdomainRow = from_bytes(Kind::PartOrder, order).map_err(Error::internal)?;
        let found = attempt(|| {
            let name = Catalog::file_name(row.rank, row.generation);
            let path = DiskPath::from(Path::new(&self.job.store)).join(name);
            let mut part = Subdomain::open(&path, row, self.options.memory_bytes / 4)?;
            let apex = self.job.apex.map(Point::from_array);
            audit::verify_part(&mut part, apex, self.surface.as_ref(), &self.options)
        });
        let found = found.map_err(StoreError::from).flatten()?;
        Ok(to_bytes(Kind::PartReport, &found))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::api::{Bytes, Mesher, Subdomains, guarded};
    use crate::pipeline::{Hands, HelperFailure};

    /// Helpers that are threads of this process.
    #[derive(Default)]
    struct Threads {
        slots: usize,
        /// A helper of which nothing works.
        broken: Option<usize>,
        server: Mutex<Option<Arc<Server>>>,
        done: AtomicUsize,
    }

    fn failure(error: Error) -> HelperFailure {
        HelperFailure {
            code: error.code().to_owned(),
            message: error.message().to_owned(),
        }
    }

    impl Helpers for Threads {
        fn begin(&self, job: &[u8]) -> Result<usize, HelperFailure> {
            let server = Server::begin(job, &small()).expect("a verification");
            *self.server.lock().expect("no panics") = Some(Arc::new(server.map_err(failure)?));
            Ok(self.slots)
        }

        fn perform(&self, slot: usize, order: Vec<u8>) -> Result<Vec<u8>, HelperFailure> {
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

    /// The report, or the error, with so many helpers; and how many orders they did.
    fn found(
        path: &Path,
        surface: Option<&Surface>,
        threads: Threads,
    ) -> (Result<Report, String>, usize) {
        let threads = Arc::new(threads);
        let mut settings = small();
        settings.hands = Hands(Some(threads.clone()));
        let report = guarded(&settings, || {
            let mut store = Catalog::open(path)?;
            super::super::verify::check(&mut store, &settings, surface, 64 << 20, Level::Delaunay)
        });
        (
            report.map_err(|e| e.message().to_owned()),
            threads.done.load(Ordering::Relaxed),
        )
    }

    #[test]
    fn whoever_looks_at_sub_domains_the_report_is_the_same() {
        let dir = tempfile::tempdir().expect("a folder");
        let (path, surface) = made(dir.path());
        let mut store = Catalog::open(&path).expect("a store");
        let options = options(64 << 20, Some(&surface), Level::Delaunay);
        let one = audit::verify(&mut store, Some(&surface), &options).expect("sound");
        assert!(one.valid && one.subdomains > 1, "{one:?}");
        assert!(one.edges_present > 0 && one.points_present > 0 && one.interface_faces > 0);
        for slots in [0, 1, 4] {
            let threads = Threads {
                slots,
                ..Threads::default()
            };
            let (report, n) = found(&path, Some(&surface), threads);
            assert_eq!(report.as_ref(), Ok(&one), "{slots} helpers");
            assert_eq!(n > 0, slots > 0);
        }
        let broken = Threads {
            slots: 2,
            broken: Some(1),
            ..Threads::default()
        };
        assert_eq!(found(&path, Some(&surface), broken).0, Ok(one));
        // What helpers would read is another surface: this process does it all.
        let mut moved = surface;
        moved.points[0].x += 0.5;
        let threads = Threads {
            slots: 2,
            ..Threads::default()
        };
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
        let middle = bytes.len() / 2;
        bytes[middle..middle + 64].fill(0xa5);
        std::fs::write(file.path(), bytes).expect("its file");
        let of = |slots| {
            let threads = Threads {
                slots,
                ..Threads::default()
            };
            found(&path, Some(&surface), threads).0
        };
        let one = of(0).expect_err("damage");
        for slots in [1, 3] {
            assert_eq!(of(slots).expect_err("damage"), one, "{slots} helpers");
        }
    }
}
