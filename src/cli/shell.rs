//! The commands `completions` and `man`: shell completions and manual pages.

use std::path::Path;
use tetdb_engine::api::Code;

use clap::{Command, CommandFactory};

use super::args::{Args, CompletionsArgs, ManArgs};
use super::console::Console;
use super::failure::Failure;

pub fn completions(args: &CompletionsArgs, console: &Console) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "tetdb", &mut script);
    console.write(&script);
    Ok(0)
}

pub fn man(args: &ManArgs, console: &Console) -> Result<u8, Failure> {
    let mut root = Args::command();
    root.build();
    if let Some(dir) = &args.dir {
        for command in std::iter::once(&root).chain(pages(&root)) {
            let path = dir.join(format!("{}.1", name(command)));
            std::fs::write(&path, page(command)?).map_err(|e| unwritable(&path, &e))?;
            console.note(&format!("wrote {}", path.display()));
        }
        return Ok(0);
    }
    let command = match &args.command {
        None => &root,
        Some(word) => pages(&root).find(|c| c.get_name() == word.as_str()).ok_or_else(|| {
            Failure::new(Code::Usage, format!("there is no command {word}")).help("`tetdb --help`")
        })?,
    };
    console.write(&page(command)?);
    Ok(0)
}

/// The commands that have manual pages of their own.
fn pages(root: &Command) -> impl Iterator<Item = &Command> {
    root.get_subcommands().filter(|c| c.get_name() != "help" && !c.is_hide_set())
}

/// Name of a page: `tetdb` or `tetdb-mesh`.
fn name(command: &Command) -> String {
    let full = command.get_bin_name().unwrap_or(command.get_name());
    full.replace(' ', "-")
}

fn page(command: &Command) -> Result<Vec<u8>, Failure> {
    let after = command.get_after_help().map(ToString::to_string);
    let (examples, rest) = examples(after.as_deref().unwrap_or_default());
    let mut text = Vec::new();
    let rendered = clap_mangen::Man::new(command.clone().after_help(rest))
        .title(name(command))
        .render(&mut text);
    rendered.map_err(|e| Failure::new(Code::Internal, e))?;
    if !examples.is_empty() {
        text.extend_from_slice(b".SH EXAMPLES\n.nf\n");
        for line in examples {
            text.extend_from_slice(line.replace('\\', "\\e").replace('-', "\\-").as_bytes());
            text.push(b'\n');
        }
        text.extend_from_slice(b".fi\n");
    }
    Ok(text)
}

/// Splits the text below the options into the lines of examples and the rest.
fn examples(after: &str) -> (Vec<&str>, String) {
    let is_head = |line: &str| matches!(line, "Example:" | "Examples:");
    let (mut examples, mut rest) = (Vec::new(), Vec::new());
    let mut inside = false;
    for line in after.lines() {
        inside = is_head(line) || inside && line.starts_with("  ");
        match inside {
            true if is_head(line) => {}
            true => examples.push(line.trim()),
            false => rest.push(line),
        }
    }
    (examples, rest.join("\n").trim().to_owned())
}

fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(Code::Io, error).at(path.display()).help("give a folder that exists with --dir")
}
