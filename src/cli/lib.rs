//! The command line: parsing, one file for each command, printing.

#![warn(missing_docs)]

mod adapt;
mod args;
mod check;
mod check_report;
mod compare;
mod config;
mod console;
mod digest;
mod estimate;
mod export;
mod failure;
mod field;
mod heap;
mod import;
mod info;
mod input;
mod memory;
mod mesh;
mod names;
mod periodic;
mod query;
mod query_ask;
mod query_rows;
#[cfg(feature = "mpi")]
mod ranks;
mod refine_surface;
mod remesh_surface;
mod report;
mod resaturate;
mod resaturate_sizes;
mod sample;
mod shell;
mod signals;
mod snapshot;
mod task_scripts;
mod tasks;
mod threads;
mod transfer;
mod verify;
mod version;
mod view;
mod view_answers;
mod view_http;
mod view_server;
mod words;
mod wrap;

use std::io::Write;
use std::process::ExitCode;
use tetdb_engine::api::{Code, Error};

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser};

use args::{Args, Command};
use console::Console;
use failure::Failure;

use tetdb_engine::api::guarded;
#[cfg(feature = "mpi")]
use tetdb_engine::api::mpi::Ranks;

/// Runs the command line of this process and returns its exit code.
pub fn run() -> ExitCode {
    heap::keep_little();
    heap::keep_sweeping();
    signals::end_without_memory();
    #[cfg(feature = "mpi")]
    let ranks = match ranks::begin() {
        Ok(ranks) => ranks,
        Err(failure) => return ExitCode::from(Console::new(false).fail(&failure)),
    };
    #[cfg(feature = "mpi")]
    if let Some(ranks) = ranks {
        let exit = run_rank(&ranks);
        ranks.end();
        return exit;
    }
    run_alone()
}

/// Runs one rank of an MPI program. Rank 0 runs as without MPI, and is the only one that reports errors of the command line.
#[cfg(feature = "mpi")]
fn run_rank(ranks: &Ranks) -> ExitCode {
    if ranks.is_first() {
        return run_alone();
    }
    let Ok(args) = Args::try_parse() else {
        return ExitCode::SUCCESS;
    };
    let console = Console::with(false, true, false);
    listen(&console);
    if let Command::Export(export) = &args.command {
        return match export::run(export, &console) {
            Ok(exit) => ExitCode::from(exit),
            Err(failure) => ExitCode::from(failure.exit()),
        };
    }
    ranks.serve(tasks::scratch_of_machine(), || {
        let settings = match &args.command {
            Command::Mesh(args) => mesh::begin(&args.run, &[], &console),
            Command::Resume(args) => mesh::begin(&args.run, &[], &console),
            Command::Verify(args) => verify::settings(args, &console),
            _ => Err(Failure::new(Code::Internal, "a rank was asked for what it cannot do")),
        };
        settings.map_err(|failure| (failure.code, failure.message))
    });
    ExitCode::SUCCESS
}

/// Lets signals end the run from now on.
fn listen(console: &Console) {
    let is_json = console.is_json();
    signals::listen(console.cancel(), move || Console::new(is_json).fail(&Error::stopped().into()));
}

fn run_alone() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => return unparsed(&error),
    };
    let console = Console::with(args.command.is_json(), args.quiet, args.verbose);
    let settings = console.settings(None, None);
    listen(&console);
    let done = guarded(&settings, || Ok(dispatch(&args.command, &console)));
    let done = done.map(|done| console.end_answer().and(done));
    let exit = match done {
        Ok(Ok(exit)) => exit,
        Ok(Err(failure)) => console.fail(&failure.filled(&names::names(&args.command))),
        Err(error) => console.fail(&Failure::from(error).filled(&names::names(&args.command))),
    };
    ExitCode::from(exit)
}

/// Reports an error of the command line. Help and version are no errors and go to stdout.
fn unparsed(error: &clap::Error) -> ExitCode {
    let is_help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if is_help || !error.use_stderr() {
        let printed = error.print().and_then(|()| std::io::stdout().flush());
        return ExitCode::from(match printed.or_else(|e| console::unwritten(&e, "")) {
            Ok(()) if error.use_stderr() => 2,
            Ok(()) => 0,
            Err(failure) => Console::new(false).fail(&failure),
        });
    }
    let is_json = std::env::args_os().any(|word| word == "--json");
    let text = error.render().to_string();
    let text = text.split("\n\nUsage:").next().unwrap_or(&text);
    let message = text.strip_prefix("error: ").unwrap_or(text).trim_end();
    let command = std::env::args().nth(1).filter(|c| is_command(c));
    if !is_apart(error)
        && let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidArg)
        && error.kind() == ErrorKind::UnknownArgument
        && word.starts_with('-')
        && word[1..].starts_with(|c: char| c.is_ascii_digit() || c == '.')
    {
        let help = format!(
            "the option before it takes no value of this kind; write values that begin with a minus behind a sign of equality, as in --option={word}"
        );
        let message = format!("{word} looks like a negative number, and no option here takes one");
        return ExitCode::from(
            Console::new(is_json).fail(&Failure::new(Code::Usage, message).help(help)),
        );
    }
    if is_apart(error) {
        let message = "numbers of one option stand apart";
        let help = "write them as one word with commas, as in --point 0.1,0.2,0.3";
        return ExitCode::from(
            Console::new(is_json).fail(&Failure::new(Code::Usage, message).help(help)),
        );
    }
    let help = format!("`tetdb {} --help`", command.unwrap_or_default()).replace("  ", " ");
    ExitCode::from(Console::new(is_json).fail(&Failure::new(Code::Usage, message).help(help)))
}

/// Returns whether the unexpected argument is a number that follows another one.
fn is_apart(error: &clap::Error) -> bool {
    let is_number = |word: &str| word.trim_end_matches(',').parse::<f64>().is_ok();
    let Some(ContextValue::String(found)) = error.get(ContextKind::InvalidArg) else {
        return false;
    };
    let words: Vec<String> =
        std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    // For a negative number, clap names only the sign and the first digit.
    (words.windows(2))
        .any(|two| is_number(&two[0]) && is_number(&two[1]) && two[1].starts_with(found.as_str()))
}

fn is_command(word: &str) -> bool {
    Args::command().find_subcommand(word).is_some()
}

fn dispatch(command: &Command, console: &Console) -> Result<u8, Failure> {
    if writes_files(command) {
        signals::end_in_order();
    }
    match command {
        Command::Mesh(args) => mesh::run(args, console),
        Command::Import(args) => import::run(args, console),
        Command::Estimate(args) => estimate::run(args, console),
        Command::Resume(args) => mesh::resume(args, console),
        Command::Plan(args) => tasks::plan(args, console),
        Command::Work(args) => tasks::work(args, console),
        Command::Gather(args) => tasks::gather(args, console),
        Command::Resaturate(args) => resaturate::run(args, console),
        Command::Adapt(args) => adapt::run(args, console),
        Command::Check(args) => check::run(args, console),
        Command::Info(args) => info::run(args, console),
        Command::Query(args) => query::run(args, console),
        Command::Field(args) => field::run(args, console),
        Command::Transfer(args) => transfer::run(args, console),
        Command::Periodic(args) => periodic::run(args, console),
        Command::Version(args) => version::run(args, console),
        Command::Verify(args) => verify::run(args, console),
        Command::Compare(args) => compare::run(args, console),
        Command::Digest(args) => digest::run(args, console),
        Command::Export(args) => export::run(args, console),
        Command::RefineSurface(args) => refine_surface::run(args, console),
        Command::RemeshSurface(args) => remesh_surface::run(args, console),
        Command::Wrap(args) => wrap::run(args, console),
        Command::Snapshot(args) => snapshot::run(args, console),
        Command::Report(args) => report::run(args, console),
        Command::View(args) => view::run(args, console),
        Command::Sample(args) => sample::run(args, console),
        Command::Completions(args) => shell::completions(args, console),
        Command::Man(args) => shell::man(args, console),
    }
}

/// Returns whether a command, if it ended at once, could leave a half-written file from the start.
fn writes_files(command: &Command) -> bool {
    matches!(
        command,
        Command::Resaturate(_)
            | Command::Adapt(_)
            | Command::Export(_)
            | Command::Snapshot(_)
            | Command::Report(_)
            | Command::Query(_)
            | Command::Field(_)
            | Command::Transfer(_)
            | Command::Periodic(_)
            | Command::Version(_)
    )
}
