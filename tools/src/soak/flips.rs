//! Single bits of a finished store turned around, and the program asked about it.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tetdb_base::storage::StoreFile;

use super::{Item, Model};
use crate::sim::Rng;

/// What is asked; answers must be right, or the damage be told.
const QUESTIONS: [&[&str]; 3] = [
    &["verify", "a.tetdb", "--full", "--json"],
    &["info", "a.tetdb", "--json"],
    &["digest", "a.tetdb", "--json"],
];
/// A panic of the program that it did not make an error of.
const PANIC: i32 = 101;

/// A finished store and the right answers.
pub struct Flips {
    program: PathBuf,
    dir: tempfile::TempDir,
    files: Vec<File>,
    questions: Vec<Vec<&'static str>>,
    answers: Vec<String>,
}

struct File {
    path: PathBuf,
    bytes: Vec<u8>,
    /// Where values are that are found nowhere else in the file, with their keys.
    values: Vec<(Range<usize>, u64)>,
}

impl Flips {
    /// Two sub-domains of several chunks.
    pub fn large(program: &Path, model: &Model) -> Self {
        Self::new(program, model, (model.large, "1"))
    }

    /// One of few chunks, which is asked four times as soon.
    pub fn small(program: &Path, model: &Model) -> Self {
        Self::new(program, model, (model.small, "0"))
    }

    fn new(program: &Path, model: &Model, (surface, changed): (&str, &str)) -> Self {
        let asked = ["query", "a.tetdb", "--json"].into_iter();
        let asked = asked.chain(model.question.split(' ')).collect();
        let questions = QUESTIONS.map(<[_]>::to_vec).into_iter();
        let program = program.canonicalize().expect("the program to be asked");
        let shared = Path::new("/dev/shm");
        let dir = match shared.is_dir() {
            true => tempfile::tempdir_in(shared),
            false => tempfile::tempdir(),
        };
        let mut flips = Self {
            program,
            dir: dir.expect("a folder for a store"),
            files: Vec::new(),
            questions: questions.chain([asked]).collect(),
            answers: Vec::new(),
        };
        let mesh = ["mesh", surface, "-o", "a.tetdb", "--subdomains", "2"];
        assert_eq!(flips.ask(&mesh).0, Some(0), "a store is made");
        // Files of the previous version are kept beside those that count, and the coarse leaves.
        let words = "resaturate a.tetdb --refine-by 0.9 --subdomain";
        let change: Vec<&str> = words.split(' ').chain([changed]).collect();
        assert_eq!(flips.ask(&change).0, Some(0), "a sub-domain is made again");
        let store = flips.dir.path().join("a.tetdb");
        for entry in std::fs::read_dir(store).expect("a store is a folder") {
            let path = entry.expect("a readable folder").path();
            let bytes = std::fs::read(&path).expect("a readable file");
            let values = values(&path, &bytes);
            flips.files.push(File { path, bytes, values });
        }
        flips.files.sort_by(|a, b| a.path.cmp(&b.path));
        flips.answers = flips.questions.iter().map(|q| flips.ask(q).1).collect();
        flips
    }

    /// Exit code, standard output, standard error.
    fn ask(&self, words: &[&str]) -> (Option<i32>, String, String) {
        let mut command = Command::new(&self.program);
        let done = command.args(words).current_dir(self.dir.path()).output();
        let done = done.expect("the program starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (done.status.code(), text(&done.stdout), text(&done.stderr))
    }

    pub fn item(&mut self, seed: u64, item: u64) -> Item {
        let mut rng = Rng(seed ^ item.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let mut done = Item::default();
        let total: u64 = self.files.iter().map(|f| f.bytes.len() as u64).sum();
        // Any byte of any file; half of the flips are brought where there are no values but something else, or these would be rare.
        let (file, offset) = loop {
            let mut at = rng.below(total);
            let file = self.files.iter().find(|f| {
                let len = f.bytes.len() as u64;
                let here = at < len;
                at -= if here { 0 } else { len };
                here
            });
            let file = file.expect("within all files");
            let at = at as usize;
            let is_used = file.bytes[at & !7..].iter().take(8).any(|&b| b != 0);
            if item.is_multiple_of(2) || is_used && file.value_at(at).is_none() {
                break (file, at);
            }
        };
        let bit = rng.below(8) as u8;
        let mut bad = file.bytes.clone();
        bad[offset] ^= 1 << bit;
        std::fs::write(&file.path, &bad).expect("a writable file");
        self.look(file, offset, bit, &mut done);
        std::fs::write(&file.path, &file.bytes).expect("a writable file");
        done
    }

    fn look(&self, file: &File, offset: usize, bit: u8, done: &mut Item) {
        let name = file.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let value = file.value_at(offset);
        let (mut found, mut named, mut silent) = (false, true, false);
        for (question, answer) in self.questions.iter().zip(&self.answers) {
            let (exit, stdout, stderr) = self.ask(question);
            let context = format!("{name} byte {offset} bit {bit}: {}", question[0]);
            match exit {
                Some(0) if stdout == *answer => {}
                Some(4) => {
                    found = true;
                    let error = stderr.lines().filter_map(error_of).next_back();
                    let text = error.map(|e| e.to_string()).unwrap_or_default();
                    named &= text.contains(&name);
                    let place = place_of(&name, value);
                    if place.iter().any(|p| !text.contains(p.as_str())) {
                        done.wrong.push(format!("{context}: not told where: {text}"));
                    }
                }
                Some(0) => {
                    silent = true;
                    done.wrong.push(format!("{context}: a wrong answer"));
                }
                Some(PANIC) | None => done.wrong.push(format!("{context}: panic {stderr}")),
                Some(exit) => done.wrong.push(format!("{context}: exit {exit}: {stderr}")),
            }
        }
        let is_catalog = name.starts_with("catalog");
        done.count(match (value, found, silent) {
            (Some(_), true, _) if is_catalog => "catalog rows, found",
            (Some(_), true, _) => "payload, found",
            (Some(_), false, _) => "payload, not found",
            (None, true, _) => "tree, found",
            (None, false, true) => "tree, silent",
            (None, false, false) => "no change",
        });
        if found && !named {
            done.count("file not named");
        }
        if value.is_some() && !found {
            done.wrong.push(format!("{name} byte {offset} bit {bit}: not found"));
        }
    }
}

impl File {
    /// Key of the value at a place in the file.
    fn value_at(&self, offset: usize) -> Option<u64> {
        let found = self.values.iter().find(|(range, _)| range.contains(&offset));
        found.map(|&(_, key)| key)
    }
}

/// What an error about a value must say besides the file: the chunk.
fn place_of(name: &str, value: Option<u64>) -> Vec<String> {
    let Some(key) = value else {
        return Vec::new();
    };
    match name.starts_with("subdomain-") || name.starts_with("coarse-") {
        true => vec![format!("chunk {}:", key as u32)],
        false => Vec::new(),
    }
}

fn error_of(line: &str) -> Option<Value> {
    let value: Value = serde_json::from_str(line).ok()?;
    value.get("error").cloned()
}

/// Where each value of a file is, when it is there once.
fn values(path: &Path, bytes: &[u8]) -> Vec<(Range<usize>, u64)> {
    let mut all = Vec::new();
    let mut file = StoreFile::open(path, 4 << 20, false).expect("a sound file");
    let scanned = file.scan(0..u64::MAX, |key, value| {
        all.push((key, value.to_vec()));
        true
    });
    scanned.expect("a sound file");
    let mut found = Vec::new();
    for (key, value) in all.iter().filter(|(_, v)| v.len() >= 16) {
        let head = &value[..16];
        let mut places = (0..bytes.len() - value.len())
            .filter(|&i| bytes[i] == head[0] && bytes[i..].starts_with(head))
            .filter(|&i| bytes[i..].starts_with(value));
        if let (Some(at), None) = (places.next(), places.next()) {
            found.push((at..at + value.len(), *key));
        }
    }
    found
}
