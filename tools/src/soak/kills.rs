//! The program killed at random times, again and again.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::{Item, Model};
use crate::sim::Rng;

/// The duration of a run is measured again after so many items, for the load of the machine changes.
const REMEASURED: u64 = 20;

/// A folder to mesh in, and what comes out of it undisturbed.
pub struct Kills {
    program: PathBuf,
    dir: tempfile::TempDir,
    mesh: [&'static str; 8],
    digest: String,
    duration: Duration,
}

impl Kills {
    pub fn new(program: &Path, model: &Model) -> Self {
        let program = program.canonicalize().expect("the program to be killed");
        let dir = tempfile::tempdir().expect("a folder for stores");
        let mut kills = Self {
            program,
            dir,
            mesh: ["mesh", model.large, "-o", "a.tetdb", "--subdomains", "2", "--memory", "64MiB"],
            digest: String::new(),
            duration: Duration::ZERO,
        };
        kills.measure().expect("an undisturbed run");
        kills.digest = kills.succeed(&["digest", "a.tetdb"]).expect("a finished store");
        kills
    }

    /// How long a run takes that nothing disturbs, at the load the machine has now.
    fn measure(&mut self) -> Result<(), String> {
        self.clear();
        let clock = Instant::now();
        self.succeed(&self.mesh)?;
        self.duration = clock.elapsed();
        Ok(())
    }

    fn clear(&self) {
        let _ = std::fs::remove_dir_all(self.dir.path().join("a.tetdb"));
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        command.args(words).current_dir(self.dir.path());
        command
    }

    /// What a run that must succeed says on its standard output.
    fn succeed(&self, words: &[&str]) -> Result<String, String> {
        let done = self.command(words).output().map_err(|e| e.to_string())?;
        match done.status.success() {
            true => Ok(String::from_utf8_lossy(&done.stdout).into_owned()),
            false => Err(format!(
                "{words:?}: {:?} {}",
                done.status.code(),
                String::from_utf8_lossy(&done.stderr)
            )),
        }
    }

    /// Starts a run and kills it after `delay`; how long it took when it had ended before that.
    fn kill(&self, words: &[&str], delay: Duration) -> Result<Option<Duration>, String> {
        let mut command = self.command(words);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().map_err(|e| e.to_string())?;
        let clock = Instant::now();
        while clock.elapsed() < delay {
            if let Ok(Some(status)) = child.try_wait() {
                return match status.success() {
                    true => Ok(Some(clock.elapsed())),
                    false => Err(format!("{words:?} ended with {status}")),
                };
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().map_err(|e| e.to_string())?;
        let status = child.wait().map_err(|e| e.to_string())?;
        // It may have ended between the last look and the signal.
        Ok(status.success().then(|| clock.elapsed()))
    }

    /// Every tenth run is killed a second time while it is resumed.
    pub fn item(&mut self, seed: u64, item: u64) -> Item {
        let mut rng = Rng(seed ^ item.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let mut done = Item::default();
        let result = self.one(&mut rng, item, &mut done);
        done.note("killed", result);
        self.clear();
        done
    }

    fn one(&mut self, rng: &mut Rng, item: u64, done: &mut Item) -> Result<(), String> {
        if item.is_multiple_of(REMEASURED) {
            self.measure()?;
        }
        let any = |rng: &mut Rng, of: Duration| of.mul_f64(rng.below(1000) as f64 / 1000.0);
        // Until the signal finds a run: a machine that has become faster ends it before.
        let first = loop {
            self.clear();
            let delay = any(rng, self.duration);
            match self.kill(&self.mesh, delay)? {
                None => break delay,
                Some(took) => self.duration = took,
            }
            done.count("finished first");
        };
        done.count("killed");
        let begun = self.dir.path().join("a.tetdb/catalog.redb").exists();
        if item.is_multiple_of(10) && begun {
            let second = any(rng, self.duration - first.min(self.duration));
            if self.kill(&["resume", "a.tetdb"], second)?.is_none() {
                done.count("killed again");
            }
        }
        match begun {
            true => self.succeed(&["resume", "a.tetdb"])?,
            false => {
                done.count("before the first commit");
                self.succeed(&self.mesh)?
            }
        };
        match self.succeed(&["digest", "a.tetdb"])? == self.digest {
            true => Ok(()),
            false => Err(format!("another digest after {first:?}")),
        }
    }
}
