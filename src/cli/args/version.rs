//! Arguments of `tetdb version`.

use std::path::PathBuf;

use super::run::ReadArgs;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb version part.tetdb save coarse --note 'before the fillets'\n  \
    tetdb version part.tetdb list\n  tetdb query part.tetdb --at-version coarse --where 'quality > 2'\n  \
    tetdb version part.tetdb diff coarse now\n  tetdb version part.tetdb restore coarse\n  tetdb resaturate part.tetdb --undo\n  \
    tetdb version part.tetdb drop coarse"
)]
pub struct VersionArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    #[command(subcommand)]
    pub action: VersionAction,
}

#[derive(Debug, clap::Subcommand)]
pub enum VersionAction {
    /// Save mesh and fields as they are under a name; no file is copied
    Save(SaveArgs),
    /// List the versions, the oldest first, with the bytes that dropping each frees
    List(ReadArgs),
    /// Say what one version has
    Show(NamedArgs),
    /// Compare two versions by sub-domain; `now` is the store as it is
    ///
    /// Exit code 0: the same; 7: they differ.
    Diff(DiffArgs),
    /// Make mesh and fields those of a version; `tetdb resaturate --undo` brings back what was before
    Restore(RestoreArgs),
    /// Drop a version, and files that nothing else needs
    Drop(NamedArgs),
}

#[derive(Debug, clap::Args)]
pub struct SaveArgs {
    /// Its name: letters, digits, `_`, `-` and `.`, which does not come first
    #[arg(value_name = "NAME")]
    pub name: String,
    /// A note to list with it
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    pub note: String,
    /// Drop the oldest versions until N are left
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub keep: Option<u32>,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, clap::Args)]
pub struct NamedArgs {
    /// Its name
    #[arg(value_name = "NAME")]
    pub name: String,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, clap::Args)]
pub struct DiffArgs {
    /// The name of a version, or `now`
    #[arg(value_name = "A")]
    pub first: String,
    /// The other one
    #[arg(value_name = "B")]
    pub second: String,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, clap::Args)]
pub struct RestoreArgs {
    #[command(flatten)]
    pub of: NamedArgs,
    /// Skip the verification at the end
    #[arg(long)]
    pub no_verify: bool,
}

impl VersionArgs {
    /// How to read the store.
    pub fn read(&self) -> &ReadArgs {
        match &self.action {
            VersionAction::Save(args) => &args.read,
            VersionAction::List(read) => read,
            VersionAction::Show(args) | VersionAction::Drop(args) => &args.read,
            VersionAction::Diff(args) => &args.read,
            VersionAction::Restore(args) => &args.of.read,
        }
    }
}
