//! One verification by several threads and processes. Each verifies whole sub-domains, and one process adds up the reports.
//!
//! Work that another process (`verify_server`) refuses or fails at is done by this process. Report and error are the same as with a
//! single process.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use rkyv::{Archive, Deserialize, Serialize};
use tetdb_schema::catalog::{SubdomainRow, SurfaceSource};
use xxhash_rust::xxh3::Xxh3;

use super::Settings;
use crate::pipeline::{
    PipelineError, Watcher, WorkKind, WorkerFn, WorkerPool, from_bytes, run_jobs, to_bytes,
};
use tetdb_base::geom::Point;
use tetdb_base::storage::{attempt, n_threads};
use tetdb_base::surface::Surface;
use tetdb_store::audit::{self, Level, PartReport, Report, VerifyOptions};
use tetdb_store::store::{Catalog, StoreError};

/// Parameters that are the same for all sub-domains.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub(super) struct Job {
    pub store: String,
    pub level: Level,
    pub apex: Option<[f64; 3]>,
    /// The surface to compare with, if any: the sources to read it from, and its fingerprint.
    pub surface: Option<(Vec<SurfaceSource>, u64)>,
}

/// Options for verifying within `cap`, less the memory of the surface.
pub(super) fn options(
    (cap, temp_dir): (u64, PathBuf),
    surface: Option<&Surface>,
    level: Level,
) -> VerifyOptions {
    let held = surface.map_or(0, |s| s.bytes() as u64 + audit::wire_bytes(s));
    let memory = cap.saturating_sub(held).min(1 << 30) / 2;
    VerifyOptions::new(level, memory as usize, temp_dir)
}

/// Memory for each thread that verifies sub-domains. A second thread took 24 to 66 MiB when memory was not short.
const THREAD_BYTES: u64 = 64 << 20;

/// Number of threads of this process that verify sub-domains at once.
fn threads(n_subdomains: usize, surface: Option<&Surface>, options: &VerifyOptions) -> usize {
    let each = THREAD_BYTES + surface.map_or(0, audit::wire_bytes);
    let room = options.memory_bytes as u64 / each;
    n_threads().min(n_subdomains).min(room as usize).max(1)
}

/// Verifies with several threads, and with the other processes of `settings` if any. Errors: as [`audit::verify`].
pub(super) fn verify(
    store: &mut Catalog,
    settings: &Settings,
    surface: Option<&Surface>,
    options: &VerifyOptions,
) -> Result<Report, StoreError> {
    let n_subdomains = store.subdomains()?.len();
    let n_threads = threads(n_subdomains, surface, options);
    let pool = settings.remote.0.clone();
    if n_subdomains < 2 || pool.is_none() && n_threads == 1 {
        return audit::verify(store, surface, options);
    }
    let dir = std::path::absolute(store.dir()).unwrap_or_else(|_| store.dir().to_owned());
    let sources = store.job()?.surfaces;
    let shares: Vec<_> = (0..n_threads).map(|_| Mutex::new(store.share())).collect();
    let own_options =
        VerifyOptions { memory_bytes: options.memory_bytes / n_threads, ..options.clone() };
    audit::verify_shared(store, surface, options, &mut |rows, apex, add| {
        let job = || Job {
            store: dir.to_string_lossy().into_owned(),
            level: options.level,
            apex: apex.map(|p| p.to_array()),
            surface: surface.map(|s| (sources.clone(), fingerprint(s))),
        };
        let slots = pool.as_ref().map_or(0, |pool| {
            let begun = pool.begin(&to_bytes(WorkKind::Verification, &job()));
            begun.unwrap_or_else(|failure| {
                settings.note(format!("note: verified by one process: {}", failure.message));
                0
            })
        });
        let here = |thread: usize, row: &SubdomainRow| {
            let share = &shares[thread];
            let own = share.lock().unwrap_or_else(PoisonError::into_inner);
            let done = attempt(|| {
                let mut part = own.open_row(row.clone(), own_options.memory_bytes / 4)?;
                audit::verify_part(&mut part, apex, surface, &own_options)
            });
            done.map_err(StoreError::from).flatten()
        };
        let each = |slot, row: &SubdomainRow| {
            let answer = pool.as_ref().and_then(|pool| ask(&**pool, slot, row).ok());
            let Some(answer) = answer else {
                return here(slot % n_threads, row);
            };
            if let Some(progress) = &own_options.progress {
                progress(row.tets);
            }
            Ok(answer)
        };
        share(rows, [n_threads, slots], &here, &each, add)
    })
}

/// Report on one sub-domain.
type PartResult = Result<PartReport, StoreError>;
/// A worker: verifies one sub-domain, on the thread or remote worker of this number.
type Look<'a> = &'a (dyn Fn(usize, &SubdomainRow) -> PartResult + Sync);

/// Distributes `rows` over `n_here` threads of this process and `n_elsewhere` remote workers. Calls `add` with the reports in the order
/// of `rows`.
fn share(
    rows: &[SubdomainRow],
    [n_here, n_elsewhere]: [usize; 2],
    here: Look,
    elsewhere: Look,
    add: &mut dyn FnMut(PartReport) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let all = (0..n_here).map(|k| (here, k)).chain((0..n_elsewhere).map(|k| (elsewhere, k)));
    let all: Vec<_> =
        all.map(|(look, k)| move |at: usize, _: &Watcher| Ok((at, look(k, &rows[at])))).collect();
    let workers: Vec<WorkerFn<usize, (usize, PartResult)>> =
        all.iter().map(|worker| worker as WorkerFn<_, _>).collect();
    let mut waiting = BTreeMap::new();
    let mut next = 0;
    let mut commit = |(at, found): (usize, PartResult)| {
        waiting.insert(at, found);
        while let Some(found) = waiting.remove(&next) {
            next += 1;
            add(found?)?;
        }
        Ok(Vec::new())
    };
    // Jobs are taken from the end of the list.
    let jobs = (0..rows.len()).rev().collect();
    let done = run_jobs(jobs, &workers, &|_| (), &mut commit);
    done.map_err(|error| match error {
        PipelineError::Store(error) => error,
        other => unreachable!("{other}: only what is added fails"),
    })
}

/// Lets a remote worker verify a sub-domain. Errors: a message.
fn ask(pool: &dyn WorkerPool, slot: usize, row: &SubdomainRow) -> Result<PartReport, String> {
    let answer = pool.perform(slot, to_bytes(WorkKind::PartOrder, row));
    from_bytes(WorkKind::PartReport, &answer.map_err(|e| e.message)?)
}

/// Hash of all parts of a surface that a mesh is compared with.
pub(super) fn fingerprint(surface: &Surface) -> u64 {
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
    put(&mut surface.embedded.edges.iter().flatten().copied());
    put(&mut surface.embedded.points.iter().flatten().copied());
    put(&mut surface.embedded.first_support.iter().flatten().copied());
    sum.digest()
}
