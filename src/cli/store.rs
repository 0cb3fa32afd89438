//! Stores as arguments.

use std::path::Path;

use super::console::Console;
use super::failure::Failure;
use super::input::{self, Input, Space};
use crate::store::Catalog;

/// Opens a store that is finished. Errors: `store-unfinished` says how to go on.
pub fn open_finished(path: &Path) -> Result<Catalog, Failure> {
    let mut store = Catalog::open(path)?;
    let state = store.state()?;
    if !state.is_finished() {
        return Err(Failure::new(
            "store-unfinished",
            format!("{} is not finished", path.display()),
        )
        .help(format!("`tetdb resume {}` goes on with it", path.display())));
    }
    Ok(store)
}

/// Reads the surface a store was made from again, or another one when it is given.
///
/// Errors: `surface-changed` when a file is not what it was.
pub fn surface_of(
    store: &mut Catalog,
    given: &[String],
    space: Space,
    console: &Console,
) -> Result<Input, Failure> {
    let job = store.job()?;
    let arguments: Vec<String> = if given.is_empty() {
        job.surfaces.iter().map(|s| s.path.clone()).collect()
    } else {
        given.to_vec()
    };
    let input = input::load(&arguments, space, console)?;
    if given.is_empty() {
        for (then, now) in job.surfaces.iter().zip(&input.sources) {
            if (then.bytes, then.hash) != (now.bytes, now.hash) {
                return Err(Failure::new(
                    "surface-changed",
                    "the surface is not the one the store was begun with",
                )
                .at(&now.path)
                .help("put the old file back, or give the surface with --against"));
            }
        }
    }
    Ok(input)
}
