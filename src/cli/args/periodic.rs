//! Arguments of `tetdb periodic`, and the pairs that `tetdb mesh` records.

use std::path::PathBuf;

use super::run::ReadArgs;
use tetdb_engine::api::PeriodicLabels;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb periodic part.tetdb left=right bottom=top\n  tetdb periodic part.tetdb 0=1:rotate --periodic-tolerance 1e-5\n  \
    tetdb periodic part.tetdb\n  tetdb periodic part.tetdb left=right --drop"
)]
pub struct PeriodicArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Pairs of labels, by name or number: the triangles of A, moved, are those of B; none lists the pairs of the store. A=B:translate and
    /// A=B:rotate choose the motion where both would do
    #[arg(value_name = "A=B")]
    pub pairs: Vec<PeriodicLabels>,
    /// How far a moved vertex may be from its partner [default: a millionth of the diagonal around both labels]
    #[arg(long, value_name = "LENGTH", requires = "pairs")]
    pub periodic_tolerance: Option<f64>,
    /// Remove these pairs from the record
    #[arg(long, requires = "pairs", conflicts_with = "periodic_tolerance")]
    pub drop: bool,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// Periodic pairs of a surface to mesh.
#[derive(Debug, Default, clap::Args)]
#[command(next_help_heading = "Periodic pairs")]
pub struct PeriodicPairArgs {
    /// Check that the triangles of label A, moved, are those of label B, and keep their pairs with the mesh; may be repeated. A=B:rotate
    /// and A=B:translate choose the motion where both would do
    #[arg(long, value_name = "A=B")]
    pub periodic: Vec<PeriodicLabels>,
    /// How far a moved vertex may be from its partner [default: a millionth of the diagonal around both labels]
    #[arg(long, value_name = "LENGTH", requires = "periodic")]
    pub periodic_tolerance: Option<f64>,
}

impl PeriodicPairArgs {
    /// The pairs, with their tolerance.
    pub fn pairs(&self) -> impl Iterator<Item = PeriodicLabels> {
        with_tolerance(&self.periodic, self.periodic_tolerance)
    }
}

impl PeriodicArgs {
    /// The pairs, with their tolerance.
    pub fn pairs(&self) -> impl Iterator<Item = PeriodicLabels> {
        with_tolerance(&self.pairs, self.periodic_tolerance)
    }
}

fn with_tolerance(
    pairs: &[PeriodicLabels],
    tolerance: Option<f64>,
) -> impl Iterator<Item = PeriodicLabels> {
    pairs.iter().cloned().map(move |pair| match tolerance {
        Some(tolerance) => pair.tolerance(tolerance),
        None => pair,
    })
}
