//! What the user typed, what it means, one file per command.

mod args;
mod check;
mod digest;
mod export;
mod failure;
mod info;
mod input;
mod memory;
mod mesh;
mod sample;
mod signals;
mod store;
mod talk;
mod verify;

use std::process::ExitCode;

use clap::Parser;

use args::{Args, Command};
use failure::Failure;
use talk::Talk;

pub use failure::{CODES, CodeRow};

/// Runs the command line of this process and returns its exit code.
pub fn run() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            // Help and version go to stdout and are no errors.
            let exit = if error.use_stderr() { 2 } else { 0 };
            let _ = error.print();
            return ExitCode::from(exit);
        }
    };
    let talk = Talk::new(args.command.is_json());
    // redb may panic on a damaged tree, which is caught and told as damage; its own message would only confuse.
    std::panic::set_hook(Box::new(failure::remember_panic));
    let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        dispatch(&args.command, &talk)
    }));
    let exit = match done {
        Ok(Ok(exit)) => exit,
        Ok(Err(failure)) => talk.fail(&failure),
        Err(_) => talk.fail(&Failure::internal(failure::last_panic())),
    };
    ExitCode::from(exit)
}

fn dispatch(command: &Command, talk: &Talk) -> Result<u8, Failure> {
    match command {
        Command::Mesh(args) => mesh::run(args, talk),
        Command::Resume(args) => mesh::resume(args, talk),
        Command::Check(args) => check::run(args, talk),
        Command::Info(args) => info::run(args, talk),
        Command::Verify(args) => verify::run(args, talk),
        Command::Digest(args) => digest::run(args, talk),
        Command::Export(args) => export::run(args, talk),
        Command::Sample(args) => sample::run(args, talk),
    }
}
