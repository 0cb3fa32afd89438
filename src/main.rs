//! The command line program; see the crate `tetdb-cli`.
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    tetdb_cli::run()
}
