//! Readers of a store that the program changes again and again.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tetdb_store::audit;
use tetdb_store::store::{Catalog, StoreError};

use super::Item;
use crate::sim::Rng;

const READERS: u64 = 20;
/// A reader that is told so often in a row that the store was changed is refused.
const CHANGED_MAX: u64 = 3;
const MEMORY: usize = 4 << 20;
/// A reader asks, and asks again after at most so long: twenty that never pause leave the change next to no processor, so that it takes minutes.
const PAUSE_MAX_MS: u64 = 2000;

/// A finished store of two sub-domains.
pub struct Readers {
    program: PathBuf,
    dir: tempfile::TempDir,
}

/// What a reader met.
#[derive(Default)]
struct Seen {
    digests: Vec<String>,
    changed: u64,
    wrong: Vec<String>,
}

impl Readers {
    pub fn new(program: &Path) -> Self {
        let program = program.canonicalize().expect("the program that changes");
        let readers = Self { program, dir: tempfile::tempdir().expect("a folder for a store") };
        let mesh = "mesh sample:box,h=0.05 -o a.tetdb --subdomains 2";
        readers.run(mesh).expect("an undisturbed run");
        readers
    }

    fn run(&self, line: &str) -> Result<(), String> {
        let mut command = Command::new(&self.program);
        let done = command.args(line.split_whitespace()).current_dir(self.dir.path()).output();
        let done = done.map_err(|e| e.to_string())?;
        match done.status.success() {
            true => Ok(()),
            false => Err(format!("{line}: {}", String::from_utf8_lossy(&done.stderr))),
        }
    }

    fn store(&self) -> PathBuf {
        self.dir.path().join("a.tetdb")
    }

    fn digest(&self) -> Result<String, String> {
        read(&self.store()).map_err(|e| e.to_string())
    }

    /// One change while all read: a sub-domain is meshed again, or comes back.
    pub fn item(&mut self, item: u64) -> Item {
        let mut done = Item::default();
        let result = self.one(item, &mut done);
        done.note("read", result);
        done
    }

    fn one(&self, item: u64, done: &mut Item) -> Result<(), String> {
        // Four that come to nothing together: else the mesh would grow, or shrink, from one to the next.
        let line = match item % 4 {
            0 => "resaturate a.tetdb --subdomain 0 --refine-by 0.8",
            1 => "resaturate a.tetdb --subdomain 1 --refine-by 0.9",
            2 => "resaturate a.tetdb --undo",
            _ => "resaturate a.tetdb --subdomain 0 --refine-by 1.25",
        };
        let before = self.digest()?;
        let is_over = AtomicBool::new(false);
        let (changed, seen) = std::thread::scope(|scope| {
            let is_over = &is_over;
            let readers: Vec<_> = (0..READERS)
                .map(|k| scope.spawn(move || self.watch(is_over, Rng(READERS * item + k))))
                .collect();
            let changed = self.run(line);
            is_over.store(true, Ordering::Release);
            let seen = readers.into_iter().map(|reader| reader.join());
            (changed, seen.collect::<Vec<_>>())
        });
        changed?;
        let after = self.digest()?;
        for seen in seen {
            let seen = seen.map_err(|_| "a reader panicked")?;
            done.wrong.extend(seen.wrong);
            *done.counts.entry("told of a change").or_default() += seen.changed;
            for digest in seen.digests {
                done.count("answers");
                if digest != before && digest != after {
                    done.wrong.push(format!("an answer of neither mesh: {digest}"));
                }
            }
        }
        Ok(())
    }

    fn watch(&self, is_over: &AtomicBool, mut rng: Rng) -> Seen {
        let (mut seen, mut in_a_row) = (Seen::default(), 0);
        // At least one answer each, for the change may be quicker.
        while !is_over.load(Ordering::Acquire) || seen.digests.is_empty() {
            match read(&self.store()) {
                Ok(digest) => {
                    in_a_row = 0;
                    seen.digests.push(digest);
                }
                Err(StoreError::Changed { .. }) => {
                    (seen.changed, in_a_row) = (seen.changed + 1, in_a_row + 1);
                    if in_a_row > CHANGED_MAX {
                        seen.wrong.push("refused again and again".to_owned());
                        break;
                    }
                }
                Err(error) => {
                    seen.wrong.push(error.to_string());
                    break;
                }
            }
            let pause = Duration::from_millis(rng.below(PAUSE_MAX_MS));
            let clock = Instant::now();
            while clock.elapsed() < pause && !is_over.load(Ordering::Acquire) {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        seen
    }
}

/// Reads all records, which must be those of the catalog that was opened first.
fn read(store: &Path) -> Result<String, StoreError> {
    let mut catalog = Catalog::open(store)?;
    let [told, _] = catalog.digest()?;
    let [found, _] = audit::digest(&mut catalog, MEMORY)?;
    match told.to_string() == found.to_string() {
        true => Ok(found.to_string()),
        false => Ok(format!("{told} in the catalog, {found} in the records")),
    }
}
