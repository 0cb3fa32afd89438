//! Arguments of `tetdb import`.

use std::path::PathBuf;

use super::run::RunArgs;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb import part.msh\n  tetdb import part.vtu -o part.tetdb --region-field material --memory 1GiB\n  \
    tetdb import part.mesh --subdomains 8 --export part.pvtu\n  tetdb import parts.vtu --part-field subdomain"
)]
pub struct ImportArgs {
    /// The mesh: MEDIT .mesh or .meshb, Gmsh .msh, VTK .vtu or .vtkhdf, TetGen .ele with its .node, Abaqus .inp, or NumPy .npy as `tetdb export` writes it
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// The store to write [default: the file's name with .tetdb, in the current folder]
    #[arg(short, long, value_name = "STORE")]
    pub output: Option<PathBuf>,
    /// Sub-domains, divided by planes [default: one for every 10 million tetrahedra]
    #[arg(long, alias = "domains", value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub subdomains: Option<u32>,
    /// Take the sub-domains from this array of the cells; for Gmsh any name, its partitions are taken; for .vtkhdf also `partition`
    #[arg(long, value_name = "NAME", conflicts_with = "subdomains")]
    pub part_field: Option<String>,
    /// Take the regions from this array of the cells [default: region, where there is one]
    #[arg(long, value_name = "NAME")]
    pub region_field: Option<String>,
    /// Do not make fields of arrays of values
    #[arg(long)]
    pub no_fields: bool,
    /// Replace the store if it is there
    #[arg(long, help_heading = "Store")]
    pub force: bool,
    #[command(flatten)]
    pub run: RunArgs,
}
