//! Arguments of `tetdb transfer`.

use std::path::PathBuf;

use super::run::{AtArgs, ReadArgs};
use super::words::word_of;
use tetdb_engine::api::TransferMethod;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  tetdb transfer coarse.tetdb fine.tetdb\n  \
    tetdb transfer old.tetdb new.tetdb --field temperature --field u --threads 4 --memory 1GiB\n  \
    tetdb transfer old.tetdb new.tetdb --field mark --method nearest")]
pub struct TransferArgs {
    /// The store that has the fields; --at-version names its version
    #[arg(value_name = "FROM")]
    pub from: PathBuf,
    /// The store on whose mesh they are evaluated, and that they are added to
    #[arg(value_name = "TO")]
    pub to: PathBuf,
    /// A field of FROM; may be repeated [default: all]
    #[arg(long, value_name = "NAME")]
    pub field: Vec<String>,
    /// How values are evaluated: at vertices `linear` in the old tetrahedra, at tetrahedra the mean by `overlap`; or `nearest`, the value of
    /// the nearest corner of the old tetrahedron that holds a vertex, or of the one that holds a centroid [default: linear and overlap]
    #[arg(long, value_name = "METHOD", value_parser = word_of::<TransferMethod>(&[]))]
    pub method: Option<TransferMethod>,
    /// Threads to use [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub at: AtArgs,
    #[command(flatten)]
    pub read: ReadArgs,
}
