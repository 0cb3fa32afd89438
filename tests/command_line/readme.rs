//! README says what is true.
//!
//! Why: a newcomer's first commands must work, and scripts are written from its tables.
//! How: the lines after `$ ` in its `console` blocks are run in order in one folder; the first command's sample is made smaller
//! here and run in full by `.ci/run`. The table of errors must equal the program's own.

use super::place::Place;
use tetdb::cli::CODES;

const README: &str = include_str!("../../README.md");
/// What stands before a command in a checkout.
const CARGO_RUN: &str = "cargo run --release -- ";
/// The command that runs this very test.
const CARGO_TEST: &str = "cargo test --release --workspace";
/// Replaced so that the test stays fast.
const SMALLER: (&str, &str) = ("count=100", "count=3");

/// Command lines of the console blocks, in order.
fn commands() -> Vec<&'static str> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in README.lines() {
        match line.trim() {
            "```console" => inside = true,
            fence if fence.starts_with("```") => inside = false,
            text if inside => found.extend(text.strip_prefix("$ ")),
            _ => {}
        }
    }
    found
}

/// Words of a line; double quotes keep one together.
fn words(line: &str) -> Vec<&str> {
    let parts = line.split('"').enumerate();
    let words = parts.flat_map(|(i, part)| match i % 2 {
        0 => part.split_whitespace().collect(),
        _ => vec![part],
    });
    words.collect()
}

#[test]
fn its_commands_run() {
    let place = Place::new();
    let commands = commands();
    assert!(commands.len() >= 8, "{commands:?}");
    assert_eq!(commands[1], CARGO_TEST, "the second command runs the tests");
    for command in commands {
        if command == CARGO_TEST {
            continue;
        }
        let line = command
            .strip_prefix(CARGO_RUN)
            .or_else(|| command.strip_prefix("tetdb "));
        let line = line.unwrap_or_else(|| panic!("{command:?} is neither cargo's nor tetdb's"));
        let line = line.replace(SMALLER.0, SMALLER.1);
        place.run(&words(&line)).succeeds();
    }
}

#[test]
fn its_table_of_errors_is_the_programs() {
    let rows: Vec<(String, u8, String)> = README
        .lines()
        .filter_map(|line| {
            let mut cells = line.strip_prefix("| `")?.strip_suffix(" |")?.split(" | ");
            let (word, exit, meaning) = (
                cells.next()?.strip_suffix('`')?,
                cells.next()?,
                cells.next()?,
            );
            Some((
                word.to_owned(),
                exit.split('/').next()?.parse().ok()?,
                meaning.to_owned(),
            ))
        })
        .collect();
    let own: Vec<(String, u8, String)> = CODES
        .iter()
        .map(|row| (row.code.to_owned(), row.exit, row.meaning.to_owned()))
        .collect();
    assert_eq!(rows, own);
}

#[test]
fn it_names_every_command() {
    let place = Place::new();
    let help = place.run(&["--help"]).succeeds().stdout();
    let commands = help
        .lines()
        .skip_while(|l| *l != "Commands:")
        .skip(1)
        .take_while(|l| !l.is_empty());
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
