//! Arguments of `tetdb adapt`.

use std::path::PathBuf;

use super::run::RunArgs;
use super::words::word_of;
use tetdb_engine::api::ErrorEstimate;

const ESTIMATES: &[&str] = &[
    "From second derivatives: the error of values is least",
    "From jumps of the gradient at faces: the error of gradients is least",
];

#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("wanted").required(true).args(["tets", "factor"])))]
#[command(after_help = "Examples:\n  tetdb adapt part.tetdb --field u --factor 2 --dry-run\n  \
    tetdb adapt part.tetdb --field u --tets 5M --hmin 0.1% --hgrad 1.5\n  \
    tetdb adapt part.tetdb --field displacement.z --estimate jump --factor 4 --memory 4GiB\n  \
    tetdb resaturate part.tetdb --undo")]
pub struct AdaptArgs {
    /// The store, a directory that `tetdb mesh` wrote
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// A field at vertices, or a component such as u.x, of type f32 or f64
    #[arg(long, value_name = "NAME")]
    pub field: String,
    /// How the error of the field is estimated [default: hessian]
    #[arg(long, value_name = "HOW", value_parser = word_of::<ErrorEstimate>(ESTIMATES))]
    pub estimate: Option<ErrorEstimate>,
    /// Wanted number of tetrahedra, such as 800000, 500k, 5M or 1.2G
    #[arg(long, value_name = "N", value_parser = number_of)]
    pub tets: Option<u64>,
    /// Wanted number of tetrahedra as a multiple of those there are
    #[arg(long, value_name = "F", allow_hyphen_values = true)]
    pub factor: Option<f64>,
    /// Least edge length: a length, or 1% of the box diagonal
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hmin: Option<String>,
    /// Greatest edge length
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub hmax: Option<String>,
    /// Greatest ratio of neighboring edge lengths [default: as it was]
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub hgrad: Option<String>,
    /// Ratio of two lengths above which they differ: a sub-domain is meshed again when they do in more than a twentieth of it
    #[arg(long, value_name = "RATIO", default_value_t = 1.25, allow_hyphen_values = true)]
    pub change: f64,
    /// Only say what would be meshed again, with the predicted tetrahedra
    #[arg(long)]
    pub dry_run: bool,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Reads a number with k, M or G for thousands, millions and billions behind it.
fn number_of(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let (digits, unit) = match text.strip_suffix(['k', 'M', 'G']) {
        Some(digits) if text.ends_with('k') => (digits, 1e3),
        Some(digits) if text.ends_with('M') => (digits, 1e6),
        Some(digits) => (digits, 1e9),
        None => (text, 1.0),
    };
    match digits.parse::<f64>().map(|x| x * unit) {
        Ok(n) if (1.0..1e15).contains(&n) => Ok(n.round() as u64),
        _ => Err("expected a number above zero, such as 800000 or 5M".to_owned()),
    }
}
