//! A folder for running the program, and small surfaces for its input.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// A closed surface of four triangles.
pub const TETRA: &str =
    "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
/// The same surface with all triangles reversed.
pub const TETRA_INWARD: &str =
    "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 3 1\n3 1 3 2\n3 0 2 3\n";

/// The tested program: the one built with the tests, or the one that `TETDB_PROGRAM` names. With the program of an older commit, tests
/// of later fixes must fail.
pub fn program() -> PathBuf {
    std::env::var_os("TETDB_PROGRAM").map_or(env!("CARGO_BIN_EXE_tetdb").into(), PathBuf::from)
}

/// A folder for one test, removed afterwards.
pub struct Place {
    dir: TempDir,
}

impl Place {
    pub fn new() -> Self {
        Self { dir: tempfile::tempdir().expect("a temporary folder") }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).expect("the temporary folder takes files");
    }

    /// Names of the files in the folder and in its direct subfolders.
    pub fn names(&self) -> BTreeSet<String> {
        let mut names = BTreeSet::new();
        for entry in fs::read_dir(self.dir.path()).expect("the folder is readable") {
            let entry = entry.expect("an entry is readable");
            let name = entry.file_name().to_string_lossy().into_owned();
            for inner in fs::read_dir(entry.path()).into_iter().flatten() {
                let inner = inner.expect("an entry is readable").file_name();
                names.insert(format!("{name}/{}", inner.to_string_lossy()));
            }
            names.insert(name);
        }
        names
    }

    /// A command that runs the program with these arguments in the folder.
    pub fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(program());
        command.args(words).current_dir(self.dir.path()).stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    pub fn run(&self, words: &[&str]) -> Done {
        let output = self.command(words).output().expect("the program starts");
        Done { words: words.join(" "), output }
    }

    /// Runs a line, split at spaces like a shell line without special characters.
    pub fn run_line(&self, line: &str) -> Done {
        self.run(&line.split_whitespace().collect::<Vec<_>>())
    }

    /// Checks `four.tetdb`, which is `sample` in four sub-domains. It must be the mesh of one thread with little memory, and valid after
    /// one of its sub-domains is meshed again.
    pub fn check_four(&self, sample: &str) {
        let again =
            format!("mesh {sample} -o again.tetdb --subdomains 4 --threads 1 --memory 128MiB");
        self.run_line(&again).succeeds();
        assert_eq!(self.digest("four.tetdb"), self.digest("again.tetdb"));
        self.run_line("resaturate four.tetdb --subdomain 1 --hgrad 1.2").succeeds();
        self.run_line("verify four.tetdb --full").succeeds();
    }

    /// The digest of a store in the folder.
    /// Sum of the volumes that are filled.
    pub fn volume(&self, store: &str) -> f64 {
        let info = self.run(&["info", store, "--json"]).succeeds().json();
        let regions = info["regions"].as_array().expect("regions");
        let filled = regions.iter().filter(|r| r["filled"] == true);
        filled.map(|r| r["volume"].as_f64().expect("a number")).sum()
    }

    pub fn digest(&self, store: &str) -> String {
        self.run(&["digest", store]).succeeds().stdout().trim().to_owned()
    }
}

/// A finished run.
pub struct Done {
    words: String,
    output: Output,
}

impl Done {
    pub fn exit(&self) -> Option<i32> {
        self.output.status.code()
    }

    pub fn stdout(&self) -> String {
        String::from_utf8_lossy(&self.output.stdout).into_owned()
    }

    pub fn stdout_bytes(&self) -> Vec<u8> {
        self.output.stdout.clone()
    }

    pub fn stderr(&self) -> String {
        String::from_utf8_lossy(&self.output.stderr).into_owned()
    }

    /// Panics with all output unless the exit code is 0.
    pub fn succeeds(self) -> Self {
        assert_eq!(self.exit(), Some(0), "tetdb {}\n{}", self.words, self.stderr());
        self
    }

    /// Parses stdout as one JSON object.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout()).unwrap_or_else(|e| {
            panic!("tetdb {}: {e} in {}\n{}", self.words, self.stdout(), self.stderr())
        })
    }

    /// The error object of a run with `--json`.
    pub fn error(&self) -> Value {
        let stderr = self.stderr();
        let mut objects =
            stderr.lines().rev().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        // Only the last line of a failed run is the error.
        let error = objects.next().and_then(|mut object| object.get_mut("error").map(Value::take));
        error.unwrap_or_else(|| panic!("tetdb {}: no error object in {stderr:?}", self.words))
    }
}
