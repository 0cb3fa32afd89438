//! Arguments of `tetdb field`.

use std::path::PathBuf;

use super::run::{AtArgs, ReadArgs};
use super::words::word_of;
use tetdb_engine::api::{FieldNumber, FieldPlace};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb field part.tetdb add temperature --at vertices --from '300 + 20*x'\n  \
    tetdb field part.tetdb add u --at vertices --from u.npy\n  \
    tetdb field part.tetdb add stress --at tets --from stress.csv --ids stable --type f32\n  \
    tetdb field part.tetdb list\n  tetdb query part.tetdb --where 'temperature > 310 and u.x < 0'\n  tetdb field part.tetdb drop u"
)]
pub struct FieldArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    #[command(subcommand)]
    pub action: FieldAction,
}

#[derive(Debug, clap::Subcommand)]
pub enum FieldAction {
    /// Add a field: values at vertices or tetrahedra, from an expression or a file
    ///
    /// Ctrl-C leaves the store as it was.
    Add(AddFieldArgs),
    /// List the fields with type, bytes and range
    List(ListFieldsArgs),
    /// Drop a field with all its values
    Drop(DropFieldArgs),
}

#[derive(Debug, clap::Args)]
pub struct AddFieldArgs {
    /// Its name: letters, digits and _
    #[arg(value_name = "NAME")]
    pub name: String,
    /// Where its values are: vertices or tets
    #[arg(long, value_name = "PLACE", value_parser = word_of::<FieldPlace>(&[]))]
    pub at: FieldPlace,
    /// A .npy array with a row for each value, a .csv table with a line for each; or an expression of x, y, z, and at tetrahedra also of
    /// quality, volume, region and the other columns of `tetdb query`; several expressions with commas between them for several components
    #[arg(long, value_name = "FILE|EXPRESSION", allow_hyphen_values = true)]
    pub from: String,
    /// Type of the numbers: f32, f64, i32 or i64 [default: that of the array, or f64]
    #[arg(long = "type", value_name = "TYPE", value_parser = word_of::<FieldNumber>(&[]))]
    pub number: Option<FieldNumber>,
    /// Numbers of a value, which the file or expression must have: 1, 3, 6 or 9
    #[arg(long, value_name = "N")]
    pub components: Option<u32>,
    /// Ids of the values: `stable`, the first column has ids of `tetdb query` (also without a column named id); `export`, numbers of an
    /// export; or a .npy file of ids. Without ids, values are in the order of an export
    #[arg(long, value_name = "stable|export|FILE")]
    pub ids: Option<String>,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, clap::Args)]
pub struct ListFieldsArgs {
    #[command(flatten)]
    pub at: AtArgs,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, clap::Args)]
pub struct DropFieldArgs {
    /// Its name
    #[arg(value_name = "NAME")]
    pub name: String,
    #[command(flatten)]
    pub read: ReadArgs,
}

impl FieldArgs {
    /// Whether output is for programs.
    pub fn is_json(&self) -> bool {
        match &self.action {
            FieldAction::Add(args) => args.read.json,
            FieldAction::List(args) => args.read.json,
            FieldAction::Drop(args) => args.read.json,
        }
    }
}
