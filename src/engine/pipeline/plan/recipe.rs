//! Which version of the recipe a store was begun with.

use tetdb_schema::blob::Blob;
use tetdb_store::store::{Catalog, Step, StoreError};

/// Raised whenever a change alters the digest of any mesh: what one version began no other can go on with.
pub const RECIPE: u32 = 15;

/// Puts this version on record, with the job.
pub fn record_recipe(step: &mut Step) {
    step.set_blob(Blob::Recipe, &RECIPE.to_le_bytes());
}

/// The version a store was begun with; stores that do not say are of the first.
///
/// Errors: a damaged catalog.
pub fn recipe_of(catalog: &mut Catalog) -> Result<u32, StoreError> {
    let bytes = catalog.blob(Blob::Recipe)?;
    Ok(bytes.and_then(|bytes| bytes.try_into().ok()).map_or(1, u32::from_le_bytes))
}
