//! Files of a finished store put in the place of others, and pages scribbled over.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Item, Model};
use crate::sim::Rng;

/// Bytes of a page in a file.
const PAGE: u64 = 65_536;
/// Exit codes of a program that says what is wrong.
const DAMAGED: i32 = 4;
const INVALID: i32 = 7;

/// Two finished stores of one mesh, of chunks and of working pages, each with a previous version of a sub-domain.
pub struct Swaps {
    program: PathBuf,
    dir: tempfile::TempDir,
    answer: String,
}

const STORES: [(&str, &str); 2] = [("chunks", "zstd"), ("pages", "none")];
const QUESTION: &str = "--where quality>1.5 --json";

impl Swaps {
    pub fn new(program: &Path, model: &Model) -> Self {
        let program = program.canonicalize().expect("the program to be asked");
        let mut swaps = Self {
            program,
            dir: tempfile::tempdir().expect("a folder for stores"),
            answer: String::new(),
        };
        for (name, seal) in STORES {
            let seal = match seal {
                "none" => "--seal none",
                _ => "",
            };
            for line in [
                format!("mesh {} -o {name} --subdomains 2 {seal}", model.large),
                format!("resaturate {name} --subdomain 1 --refine-by 0.9"),
                format!("resaturate {name} --undo"),
                format!("resaturate {name} --subdomain 1 --refine-by 0.8"),
            ] {
                assert_eq!(swaps.ask(&line).0, Some(0), "{line}");
            }
        }
        swaps.answer = swaps.ask(&format!("query chunks {QUESTION}")).1;
        swaps
    }

    fn ask(&self, line: &str) -> (Option<i32>, String) {
        let mut command = Command::new(&self.program);
        let words = line.split_whitespace();
        let done = command.args(words).current_dir(self.dir.path()).output();
        let done = done.expect("the program starts");
        let text = String::from_utf8_lossy(&done.stdout).into_owned();
        (done.status.code(), text)
    }

    pub fn item(&mut self, seed: u64, item: u64) -> Item {
        let mut rng = Rng(seed ^ item.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let mut done = Item::default();
        let (store, _) = STORES[item as usize % 2];
        let result = self.one(&mut rng, store, item / 2 % 3, &mut done);
        done.note(store, result);
        done
    }

    /// The files of a sub-domain, oldest first.
    fn files(&self, store: &str, rank: u32) -> Vec<PathBuf> {
        let start = format!("subdomain-{rank:05}-g");
        let entries = std::fs::read_dir(self.dir.path().join(store)).expect("a store");
        let mut files: Vec<(u32, PathBuf)> = entries
            .filter_map(|entry| {
                let path = entry.ok()?.path();
                let name = path.file_name()?.to_str()?.strip_prefix(&start)?;
                Some((name.strip_suffix(".redb")?.parse().ok()?, path))
            })
            .collect();
        files.sort();
        files.into_iter().map(|(_, path)| path).collect()
    }

    fn one(&self, rng: &mut Rng, store: &str, kind: u64, done: &mut Item) -> Result<(), String> {
        let io = |e: std::io::Error| e.to_string();
        let files = self.files(store, 1);
        let file = files.last().ok_or("no file")?;
        let sound = std::fs::read(file).map_err(io)?;
        let mut bytes = sound.clone();
        match kind {
            0 => bytes = std::fs::read(&files[0]).map_err(io)?,
            1 => {
                let n = 1 + rng.below(PAGE) as usize;
                let at = rng.below((bytes.len() - n.min(bytes.len() - 1)) as u64) as usize;
                let end = (at + n).min(bytes.len());
                bytes[at..end].fill_with(|| rng.word() as u8);
            }
            _ => {
                // One page over another: both match their own checksums.
                let n = bytes.len() as u64 / PAGE;
                let [from, to] = [rng.below(n), rng.below(n)].map(|page| (page * PAGE) as usize);
                bytes.copy_within(from..from + PAGE as usize, to);
            }
        }
        done.count(["older generation", "scribbled over", "page over page"][kind as usize]);
        std::fs::write(file, &bytes).map_err(io)?;
        let verified = self.ask(&format!("verify {store} --full"));
        let asked = self.ask(&format!("query {store} {QUESTION}"));
        std::fs::write(file, &sound).map_err(io)?;
        let is_told = matches!(verified.0, Some(DAMAGED | INVALID));
        done.count(if is_told { "told" } else { "no harm" });
        match (verified.0, asked.0) {
            (Some(0), _) if kind == 0 => Err("an older generation passes".to_owned()),
            (Some(0 | DAMAGED | INVALID), Some(DAMAGED)) => Ok(()),
            (Some(0 | DAMAGED | INVALID), Some(0)) if asked.1 == self.answer => Ok(()),
            (verified, asked) => Err(format!("verify {verified:?}, query {asked:?}")),
        }
    }
}
