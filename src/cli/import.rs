//! The command `import`.

use std::path::{Path, PathBuf};

use super::args::ImportArgs;
use super::console::Console;
use super::failure::Failure;
use super::mesh;
use tetdb_engine::api::{Existing, Import, Subdomains};

pub fn run(args: &ImportArgs, console: &Console) -> Result<u8, Failure> {
    let path = output(args);
    let settings = mesh::begin(&args.run, std::slice::from_ref(&args.mesh), console)?;
    let mut import = Import::new(&args.mesh)
        .subdomains(args.subdomains.map_or(Subdomains::Auto, Subdomains::Exactly))
        .settings(settings.clone())
        .verify(!args.run.no_verify)
        .fields(!args.no_fields)
        .existing(if args.force { Existing::Replace } else { Existing::Keep });
    if let Some(name) = &args.part_field {
        import = import.part_field(name);
    }
    if let Some(name) = &args.region_field {
        import = import.region_field(name);
    }
    import.create_reported(&path)?;
    console.done();
    mesh::finish(&path, &args.run, &settings, None, console)
}

/// The store that is written.
pub(super) fn output(args: &ImportArgs) -> PathBuf {
    // `part.1.ele` is not `part.2.ele`: only one ending goes.
    let name = || {
        let mut name = Path::new(&args.mesh).file_stem().unwrap_or("mesh".as_ref()).to_owned();
        name.push(".tetdb");
        PathBuf::from(name)
    };
    args.output.clone().unwrap_or_else(name)
}
