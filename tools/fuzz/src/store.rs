//! A whole store of which something was changed: bytes of a file, or a value in it that is then sealed again.
//!
//! Opened, summed up, verified and asked; one in four is also written to files, drawn, compared, and one in eight is then written to. Any
//! answer will do, also that nothing is wrong where nothing was; a bug of ours (`internal`) will not. Stores are of a dozen to two
//! thousand tetrahedra and in memory: an input takes a few milliseconds.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};
use tetdb::Code;

use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition};
use tetdb::{
    Bytes, CancelToken, ColorBy, Event, ExportOptions, MeshFormat, Mesher, Seal, Settings,
    Snapshot, Store, Surface, VerifyLevel,
};
use tetdb_base::storage::Budget;
use tetdb_engine::pipeline::{self, MeshOptions, Options, RunOptions, Subdomains, Trial};
use tetdb_schema::catalog::{Job, StoreState};
use tetdb_store::store::Catalog;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Of every file of a store: values by key.
const TABLE: TableDefinition<u64, &[u8]> = TableDefinition::new("pages");
/// All values begin with the sum of what follows; in a chunk this comes next, in the catalog the key is the sum's seed.
const CHUNK: &[u8] = b"TETC";
const MEMORY: u64 = 64 << 20;
/// A change of a store is not let go on for longer.
const LONG: Duration = Duration::from_millis(500);

struct Sound {
    dir: tempfile::TempDir,
    path: PathBuf,
    files: Vec<(PathBuf, Vec<u8>)>,
}

/// What stores there are.
#[derive(Clone, Copy)]
enum Made {
    /// One sub-domain, of which there is a previous version.
    Whole(Seal),
    /// Four sub-domains, two of them with a previous version.
    Divided,
    /// Ended behind the coarse mesh.
    Begun,
}

const MADE: [Made; 4] =
    [Made::Whole(Seal::Packed), Made::Whole(Seal::Pages), Made::Divided, Made::Begun];

fn settings() -> Settings {
    Settings::default().threads(1).memory(Bytes(MEMORY))
}

/// As these, but what takes long is cancelled: changed lengths may ask for a billion tetrahedra.
fn limited() -> Settings {
    let (token, clock) = (CancelToken::new(), Instant::now());
    let cancelled = token.clone();
    settings().cancel(&token).progress(move |_| {
        if clock.elapsed() > LONG {
            cancelled.cancel();
        }
    })
}

/// A store in memory, where the system has files there.
fn sound(made: Made) -> Sound {
    let shared = Path::new("/dev/shm");
    let dir = match shared.is_dir() {
        true => tempfile::tempdir_in(shared),
        false => tempfile::tempdir(),
    };
    let dir = dir.expect("a folder");
    let path = dir.path().join("a.tetdb");
    match made {
        Made::Whole(seal) => {
            let surface = Surface::sample("box,h=0.9").expect("a box");
            let mesher = Mesher::new(surface).settings(settings()).seal(seal);
            let change = mesher.create(&path).expect("a mesh").remesh();
            let change = change.subdomains(&[0]).scaled(0.6);
            drop(change.run().expect("a finer mesh"));
        }
        Made::Divided => {
            divided(&path);
            let store = Store::open_with(&path, settings()).expect("a finished store");
            let change = store.remesh().subdomains(&[1, 2]).scaled(0.8);
            // The job names no surface, which a verification would miss.
            let change = change.verify(false);
            drop(change.run().expect("a finer mesh"));
        }
        Made::Begun => {
            let token = CancelToken::new();
            let cancelled = token.clone();
            let ending = settings().cancel(&token).progress(move |event| {
                if let Event::Progress { stage: "divide and smooth", .. } = event {
                    cancelled.cancel();
                }
            });
            let surface = Surface::sample("box,h=0.4").expect("a box");
            let ended = Mesher::new(surface).settings(ending).create(&path);
            assert_eq!(ended.err().map(|e| e.code()), Some(Code::Stopped));
        }
    }
    let mut files = entries(&path);
    files.retain(|path| path.extension().is_some_and(|e| e == "redb"));
    let read = |path: PathBuf| (path.clone(), std::fs::read(path).expect("readable"));
    Sound { path, files: files.into_iter().map(read).collect(), dir }
}

/// Meshes a box into sub-domains far smaller than those of the front door.
fn divided(path: &Path) {
    let surface =
        tetdb_kernel::samples::SampleSpec::parse("box,h=0.2").and_then(|spec| spec.make());
    let trial = Trial { subdomains_small: true, ..Trial::default() };
    let options = Options {
        mesh: MeshOptions { subdomains: Subdomains::Exactly(4), ..MeshOptions::default() },
        run: RunOptions { trial, ..RunOptions::default() },
    };
    let job = Job { options: "{}".to_owned(), ..Job::default() };
    let mut catalog = Catalog::create(path, &job).expect("a new store");
    let surface = surface.expect("a box").into();
    let budget = Budget::new(MEMORY);
    let made = pipeline::mesh(&mut catalog, &surface, &options, &budget, &pipeline::silent);
    made.expect("a mesh");
    let verified = catalog.commit(|step| {
        step.set_state(StoreState::Verified);
        Ok(())
    });
    verified.expect("room");
    assert_eq!(catalog.subdomains().expect("rows").len(), 4);
    catalog.close().expect("room");
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a store is a folder");
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("readable").path()).collect();
    paths.sort();
    paths
}

impl Sound {
    /// As it was; nothing beside it.
    fn restore(&self) {
        for path in entries(&self.path) {
            if !self.files.iter().any(|(file, _)| *file == path) {
                let _ = match path.is_dir() {
                    true => std::fs::remove_dir_all(path),
                    false => std::fs::remove_file(path),
                };
            }
        }
        for (path, content) in &self.files {
            std::fs::write(path, content).expect("writable");
        }
    }
}

/// Each eight bytes are a change: file, whether of a value, where (four bytes), what, and how.
pub fn changed(bytes: &[u8]) {
    static SOUND: OnceLock<[Mutex<Sound>; MADE.len()]> = OnceLock::new();
    let sound = SOUND.get_or_init(|| MADE.map(|made| Mutex::new(sound(made))));
    let choice = xxh3_64_with_seed(bytes, 0);
    // One in seven is a store that is not finished.
    let sound = &sound[choice as usize % 7 * MADE.len() / 8];
    let choice = choice / 7;
    let sound = sound.lock().unwrap_or_else(|e| e.into_inner());
    let changes = || bytes.chunks_exact(8).take(8);
    let file = |change: &[u8]| &sound.files[usize::from(change[0]) % sound.files.len()];
    let place =
        |change: &[u8]| u32::from_le_bytes([change[2], change[3], change[4], change[5]]) as usize;
    let is_of_bytes = |change: &&[u8]| change[1].is_multiple_of(4);
    // Values before bytes: redb may panic where it writes to a file that was changed, and again in a destructor, which ends the process.
    for change in changes().filter(|change| !is_of_bytes(change)) {
        let _ = change_value(&file(change).0, place(change), change);
    }
    for change in changes().filter(is_of_bytes) {
        let (path, content) = file(change);
        let mut content = std::fs::read(path).unwrap_or_else(|_| content.clone());
        put(&mut content, place(change), change);
        std::fs::write(path, content).expect("writable");
    }
    ask(&sound.path);
    if choice.is_multiple_of(4) {
        show(&sound.path, sound.dir.path(), choice / 4 % 18);
    }
    if (choice / 128).is_multiple_of(8) {
        write(&sound.path, choice / 1024 % 5);
    }
    sound.restore();
}

/// Another byte, or the same bits turned, or the end cut off.
fn put(content: &mut Vec<u8>, at: usize, change: &[u8]) {
    if content.is_empty() {
        return;
    }
    let at = at % content.len();
    match change[7] % 8 {
        0..=2 => content[at] ^= 1 << (change[6] % 8),
        3..=5 => content[at] = change[6],
        6 => content[at..].iter_mut().take(8).for_each(|b| *b = change[6]),
        _ => content.truncate(at),
    }
}

/// A value changed as it would be by one who knows the format: redb's sums are right, and those of a chunk.
fn change_value(path: &Path, at: usize, change: &[u8]) -> Option<()> {
    let unwound = std::panic::AssertUnwindSafe(|| {
        let file = Database::open(path).ok()?;
        let mut keys = Vec::new();
        {
            let read = file.begin_read().ok()?;
            let table = read.open_table(TABLE).ok()?;
            for row in table.iter().ok()? {
                let (key, value) = row.ok()?;
                keys.push((key.value(), value.value().to_vec()));
            }
        }
        let (key, mut value) = keys.get(at % keys.len().max(1))?.clone();
        put(&mut value, at / keys.len(), change);
        if let Some((sum, rest)) = value.split_first_chunk_mut::<8>() {
            let seed = if rest.starts_with(CHUNK) { 0 } else { key };
            *sum = xxh3_64_with_seed(rest, seed).to_le_bytes();
        }
        let write = file.begin_write().ok()?;
        write.open_table(TABLE).ok()?.insert(key, &value[..]).ok()?;
        write.commit().ok()
    });
    std::panic::catch_unwind(unwound).ok()?
}

fn answered<T>(result: Result<T, tetdb::Error>) {
    if let Err(error) = result {
        assert_ne!(error.code(), "internal", "{error}");
    }
}

fn ask(path: &Path) {
    let mut store = match Store::open_with(path, settings()) {
        Ok(store) => store,
        error => return answered(error),
    };
    answered(store.verify(VerifyLevel::Delaunay));
    answered(store.locate(&[[0.3, 0.4, 0.5], [2.0, 0.0, 0.0]]));
    let asked = store.query().where_("quality > 1.2");
    answered(asked.and_then(|q| q.collect()));
}

/// Formats by number, then pictures, then the page.
fn show(path: &Path, folder: &Path, way: u64) {
    let store = match Store::open_with(path, settings()) {
        Ok(store) => store,
        error => return answered(error),
    };
    let out = folder.join("out");
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir(&out).expect("room");
    let export = |name: &str, options: &ExportOptions| {
        answered(store.export(out.join(name), options));
    };
    let whole = ExportOptions::new();
    match way {
        0 => export("a.vtu", &whole),
        1 => export("a.vtkhdf", &whole),
        2 => export("a.mesh", &whole),
        3 => export("a.meshb", &whole.second_order()),
        4 => export("a.msh", &whole.ghosts()),
        5 => export("a.msh", &whole.format(MeshFormat::Gmsh22)),
        6 => export("a.foam", &whole.pieces()),
        7 => export("a.mfem", &whole),
        8 => export("a.ele", &whole.split_sheets()),
        9 => export("a.inp", &whole),
        10 => export("a.npy", &whole),
        11 => export("a.pvtu", &whole),
        12 => export("a.json", &whole),
        13 => export("a.vtu", &whole.boundary()),
        14 => export("a.mesh", &whole.interfaces()),
        15 => answered(store.report(out.join("a.html"))),
        16 => {
            let cut = Snapshot::cut().plane([0.5; 3], [1.0, 2.0, 3.0]);
            let cut = cut.color(ColorBy::Quality).pixels(64, 48);
            answered(store.snapshot(out.join("a.svg"), &cut));
        }
        _ => {
            let surface = Snapshot::surface().color(ColorBy::Label).pixels(64, 48);
            answered(store.snapshot(out.join("a.png"), &surface));
        }
    }
}

/// One of the ways to change a store.
fn write(path: &Path, way: u64) {
    if way == 0 {
        return answered(Store::resume(path, limited()));
    }
    let mut store = match Store::open_with(path, limited()) {
        Ok(store) => store,
        // One that is not finished.
        Err(error) if error.code() == "store-unfinished" => {
            return answered(Store::resume(path, limited()));
        }
        error => return answered(error),
    };
    match way {
        1 => answered(store.undo()),
        2 => answered(store.forget_previous()),
        3 => answered(store.remesh().repair().run()),
        _ => answered(store.remesh().subdomains(&[0]).scaled(1.2).run()),
    }
}
