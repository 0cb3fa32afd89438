//! The version of the recipe with which a store was begun.

use tetdb_schema::blob::Blob;
use tetdb_store::store::{Catalog, Step, StoreError};

/// Version of the recipe. It rises with every change that alters the digest of any mesh, or its ids. A store of one version cannot be
/// continued by another.
pub const RECIPE: u32 = 27;

/// Records this version in `step`, together with the job.
pub fn record_recipe(step: &mut Step) {
    step.set_blob(Blob::Recipe, &RECIPE.to_le_bytes());
}

/// Returns the version with which a store was begun; a store without a recorded version has version 1.
///
/// Errors: a damaged catalog.
pub fn recipe_of(catalog: &mut Catalog) -> Result<u32, StoreError> {
    let bytes = catalog.blob(Blob::Recipe)?;
    Ok(bytes.and_then(|bytes| bytes.try_into().ok()).map_or(1, u32::from_le_bytes))
}
