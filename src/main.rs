//! The command line program; see [`tetdb::cli`].
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    tetdb::cli::run()
}
