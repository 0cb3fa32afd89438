//! Two runs of the program onto one path, at random delays.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::Item;
use crate::sim::Rng;

/// Edge lengths of the two boxes, which are told apart by their digests.
const LENGTHS: [&str; 2] = ["0.1", "0.12"];
const STORE: &str = "x.tetdb";

/// A folder to race in, and what either run gives undisturbed.
pub struct Races {
    program: PathBuf,
    dir: tempfile::TempDir,
    digests: [String; 2],
    duration: Duration,
}

impl Races {
    pub fn new(program: &Path) -> Self {
        let program = program.canonicalize().expect("the program that races");
        let mut races = Self {
            program,
            dir: tempfile::tempdir().expect("a folder for stores"),
            digests: Default::default(),
            duration: Duration::ZERO,
        };
        let clock = Instant::now();
        races.digests = LENGTHS.map(|length| {
            let mut child = races.start(length, false).expect("the program starts");
            assert!(child.wait().is_ok_and(|status| status.success()));
            let digest = races.digest().expect("a finished store");
            races.clear();
            digest
        });
        races.duration = clock.elapsed() / 2;
        races
    }

    fn clear(&self) {
        let _ = std::fs::remove_dir_all(self.dir.path().join(STORE));
    }

    fn start(&self, length: &str, force: bool) -> Result<Child, String> {
        let surface = format!("sample:box,h={length}");
        let mut command = Command::new(&self.program);
        command.args(["mesh", &surface, "-o", STORE]);
        command.args(force.then_some("--force"));
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let child = command.current_dir(self.dir.path()).spawn();
        child.map_err(|e| e.to_string())
    }

    fn digest(&self) -> Result<String, String> {
        for words in [["verify", STORE], ["digest", STORE]] {
            let mut command = Command::new(&self.program);
            let done = command.args(words).current_dir(self.dir.path()).output();
            let done = done.map_err(|e| e.to_string())?;
            if !done.status.success() {
                return Err(format!("{words:?}: {}", String::from_utf8_lossy(&done.stderr)));
            }
            if words[0] == "digest" {
                return Ok(String::from_utf8_lossy(&done.stdout).into_owned());
            }
        }
        unreachable!("the last of the words is digest")
    }

    /// Every second race is for the place of a store that is there.
    pub fn item(&mut self, seed: u64, item: u64) -> Item {
        let mut rng = Rng(seed ^ item.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let mut done = Item::default();
        let forced = item % 2 == 1;
        let result = self.race(&mut rng, forced, &mut done);
        done.note(if forced { "replacing" } else { "creating" }, result);
        self.clear();
        done
    }

    fn race(&self, rng: &mut Rng, forced: bool, done: &mut Item) -> Result<(), String> {
        if forced {
            let status = self.start(LENGTHS[0], false)?.wait();
            status.map_err(|e| e.to_string())?;
        }
        let delay = self.duration.mul_f64(rng.below(1200) as f64 / 1000.0);
        let mut one = self.start(LENGTHS[0], forced)?;
        std::thread::sleep(delay);
        let mut two = self.start(LENGTHS[1], forced)?;
        let mut codes = [None; 2];
        for (code, child) in codes.iter_mut().zip([&mut one, &mut two]) {
            *code = child.wait().map_err(|e| e.to_string())?.code();
        }
        let winner = match codes {
            [Some(0), Some(5)] => 0,
            [Some(0), Some(8)] if !forced => 0,
            [Some(5), Some(0)] => 1,
            [Some(8), Some(0)] if !forced => 1,
            // One after the other: the second has replaced the first.
            [Some(0), Some(0)] if forced => 1,
            other => return Err(format!("{delay:?} apart: exit codes {other:?}")),
        };
        done.count(match codes {
            [Some(0), Some(0)] => "one after the other",
            [Some(5), _] | [_, Some(5)] => "one busy",
            _ => "one too late",
        });
        let names = std::fs::read_dir(self.dir.path()).map_err(|e| e.to_string())?;
        let n_left = names.count();
        if n_left != 1 {
            return Err(format!("{delay:?} apart: {n_left} folders are left"));
        }
        let digest = self.digest()?;
        match digest == self.digests[winner] {
            true => Ok(()),
            // Both may have ended in the other order.
            false if codes == [Some(0); 2] && self.digests.contains(&digest) => Ok(()),
            false => Err(format!("{delay:?} apart: the store is not the winner's")),
        }
    }
}
