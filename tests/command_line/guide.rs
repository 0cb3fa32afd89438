//! Every command of the README and of the guide runs, and prints the output shown on the page.
//!
//! Why: a page whose commands fail teaches nothing.
//! How: the lines after `$ ` in each page's `console` blocks run one after the other, each by `bash -euo pipefail`. Each page has a
//! fresh folder, and the built program's folder is first in PATH. A command ending in `# exits N` must end with that code, any other
//! with 0. The lines below a command must occur in its output, in this order; `...` in them stands for any text.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use tetdb::Code;

const README: &str = include_str!("../../README.md");
const ERRORS: &str = include_str!("../../src/guide/errors.md");

/// Prefix of a command in a checkout.
const CARGO_RUN: &str = "cargo run --release -- ";
/// The command that runs this very test, and commands that only build.
const NOT_HERE: [&str; 2] = ["cargo test --profile quick --workspace", "cargo install --path ."];
/// The README's first sample is smaller here; `.ci/run` runs it in full.
const SMALLER: (&str, &str) = ("count=100", "count=3");

/// A command of a page and the output shown below it.
struct Step {
    command: String,
    exit: i32,
    shown: Vec<String>,
}

/// The commands of the `console` blocks, in order. A line that ends in `\` continues in the next line.
fn steps(page: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let (mut inside, mut goes_on) = (false, false);
    for line in page.lines() {
        match line {
            "```console" => (inside, goes_on) = (true, false),
            fence if fence.starts_with("```") => inside = false,
            _ if !inside => {}
            _ if goes_on => {
                let command = &mut steps.last_mut().expect("a line went on").command;
                command.truncate(command.len() - 1);
                command.push_str(line.trim_start());
                goes_on = line.ends_with('\\');
            }
            _ => match line.strip_prefix("$ ") {
                Some(command) => {
                    let command = command.to_owned();
                    goes_on = command.ends_with('\\');
                    let shown = Vec::new();
                    steps.push(Step { command, exit: 0, shown });
                }
                None => {
                    let step = steps.last_mut().expect("a command stands before answers");
                    step.shown.push(line.to_owned());
                }
            },
        }
    }
    for step in &mut steps {
        if let Some((command, exit)) = step.command.split_once("# exits ") {
            step.exit = exit.trim().parse().expect("an exit code is a number");
            step.command = command.trim_end().to_owned();
        }
    }
    steps
}

impl Step {
    fn run(&self, folder: &Path) {
        let command = match self.command.strip_prefix(CARGO_RUN) {
            Some(words) => format!("tetdb {words}").replace(SMALLER.0, SMALLER.1),
            None => self.command.clone(),
        };
        let log = folder.join(".log");
        let file = File::create(&log).expect("the folder takes files");
        let both = file.try_clone().expect("a file has two handles");
        let status = Command::new("bash")
            .args(["-euo", "pipefail", "-c", &command])
            .env("PATH", path_with_program())
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(file)
            .stderr(both)
            .status()
            .expect("bash starts");
        let answer = fs::read_to_string(&log).unwrap_or_default();
        assert_eq!(status.code(), Some(self.exit), "$ {command}\n{answer}");
        let finds_nothing =
            |line: &str| line.starts_with("0 found") || line.contains("\"found\":0}");
        assert!(!answer.lines().any(finds_nothing), "$ {command}\nfinds nothing");
        let mut lines: VecDeque<&str> = answer.lines().collect();
        for shown in &self.shown {
            let found = lines.iter().position(|line| is_like(line, shown));
            let Some(found) = found else {
                panic!("$ {command}\nthe page shows\n{shown}\nbut the answer is\n{answer}");
            };
            lines.drain(..=found);
        }
    }
}

/// Returns whether `line` matches `shown`, in which `...` stands for any text.
fn is_like(line: &str, shown: &str) -> bool {
    let mut rest = line;
    let parts: Vec<&str> = shown.split("...").collect();
    for (i, part) in parts.iter().enumerate() {
        let at = match (i, parts.len()) {
            (0, _) => rest.starts_with(part).then_some(0),
            (i, n) if i + 1 == n => {
                rest.ends_with(part).then(|| rest.len().saturating_sub(part.len()))
            }
            _ => rest.find(part),
        };
        match at {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    parts.len() > 1 || rest.is_empty()
}

fn path_with_program() -> String {
    let program = super::place::program();
    let folder = program.parent().expect("a program lies in a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    format!("{}:{path}", folder.display())
}

fn runs(page: &str, n_least: usize) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let steps = steps(page);
    assert!(steps.len() >= n_least, "only {} commands", steps.len());
    for step in steps {
        if !NOT_HERE.contains(&step.command.as_str()) {
            step.run(folder.path());
        }
    }
}

/// A test for each chapter.
macro_rules! chapters {
    ($($chapter:ident: $n_least:literal,)*) => {
        const CHAPTERS: &[(&str, &str)] = &[$((
            stringify!($chapter),
            include_str!(concat!("../../src/guide/", stringify!($chapter), ".md")),
        )),*];
        $(
            #[test]
            fn $chapter() {
                runs(include_str!(concat!("../../src/guide/", stringify!($chapter), ".md")), $n_least);
            }
        )*
    };
}

chapters! {
    start: 10,
    sizes: 8,
    repair: 6,
    regions: 3,
    subdomains: 5,
    import: 5,
    cluster: 8,
    questions: 8,
    fields: 8,
    resaturation: 5,
    pictures: 10,
    exports: 8,
    scripting: 5,
    library: 0,
    python: 0,
    stability: 0,
    errors: 2,
}

#[test]
fn the_readme() {
    runs(README, 2);
    assert_eq!(steps(README)[1].command, NOT_HERE[0], "the second command runs the tests");
}

/// The README has at most two screens.
#[test]
fn the_readme_is_short() {
    assert!(README.lines().count() <= 100);
    assert!(README.lines().all(|line| line.chars().count() <= 200));
}

/// Lines are short enough for a terminal. Tables and text to be copied may be longer.
#[test]
fn lines_are_short() {
    for (name, page) in CHAPTERS {
        let mut in_block = false;
        for line in page.lines() {
            in_block ^= line.starts_with("```");
            let is_free = in_block || line.starts_with('|') || line.contains("](");
            assert!(is_free || line.chars().count() <= 110, "{name}: {line}");
        }
    }
}

#[test]
fn every_chapter_is_a_module_and_in_the_list() {
    let modules = include_str!("../../src/guide/mod.rs");
    let files = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/guide"));
    for file in files.expect("the guide is a folder") {
        let path = file.expect("an entry is readable").path();
        if path.extension().is_some_and(|ending| ending == "md") {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            assert!(CHAPTERS.iter().any(|(chapter, _)| *chapter == name));
            assert!(modules.contains(&format!("include_str!(\"{name}.md\")")));
        }
    }
}

#[test]
fn the_table_of_errors_is_the_programs() {
    let rows: Vec<(String, u8, String)> = ERRORS
        .lines()
        .filter_map(|line| {
            let mut cells = line.strip_prefix("| `")?.strip_suffix(" |")?.split(" | ");
            let (word, exit, meaning) =
                (cells.next()?.strip_suffix('`')?, cells.next()?, cells.next()?);
            Some((word.to_owned(), exit.split('/').next()?.parse().ok()?, meaning.to_owned()))
        })
        .collect();
    let own: Vec<(String, u8, String)> = Code::ALL
        .iter()
        .map(|c| (c.as_str().to_owned(), c.exit(), c.meaning().to_owned()))
        .collect();
    assert_eq!(rows, own);
}

#[test]
fn the_readme_names_every_command() {
    let help = super::place::Place::new().run(&["--help"]).succeeds().stdout();
    let commands =
        help.lines().skip_while(|l| *l != "Commands:").skip(1).take_while(|l| !l.is_empty());
    let mut n = 0;
    for line in commands {
        let name = line.split_whitespace().next().unwrap_or_default();
        n += 1;
        assert!(
            name == "help" || README.contains(&format!("`tetdb {name}")),
            "README does not name `tetdb {name}`"
        );
    }
    assert!(n >= 8, "{help}");
}
