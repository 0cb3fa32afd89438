//! What many commands take: how to read a store, how to run.

use std::path::PathBuf;

use tetdb_engine::api::Settings;

/// How to read a store; none of this changes the answer.
#[derive(Debug, clap::Args)]
pub struct ReadArgs {
    /// Most memory to hold
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

/// The version to read.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct AtArgs {
    /// Read the store as it was in this version; see `tetdb version --help`
    #[arg(long, value_name = "NAME")]
    pub at_version: Option<String>,
}

impl AtArgs {
    /// Settings to read it.
    pub fn of(&self, settings: Settings) -> Settings {
        match &self.at_version {
            Some(name) => settings.at_version(name),
            None => settings,
        }
    }
}

/// How to run; none of this changes the mesh.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Run")]
pub struct RunArgs {
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Threads to use, at most eight for each core or 64 [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Skip the verification at the end
    #[arg(long)]
    pub no_verify: bool,
    /// Also write this mesh file, its format by its ending as `tetdb export --help` lists them; may be repeated
    #[arg(long, value_name = "FILE")]
    pub export: Vec<PathBuf>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}
