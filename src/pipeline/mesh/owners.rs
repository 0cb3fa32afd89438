//! Who has the faces of a cut, as the catalog keeps it.

use crate::pipeline::tree::blob;
use crate::sealed::SealedError;
use crate::store::{Catalog, StoreError};
use crate::topology::Owners;

/// The owners of a cut's faces.
pub(in crate::pipeline) fn read_owners(
    catalog: &mut Catalog,
    cut: u32,
) -> Result<Owners, StoreError> {
    let bytes = catalog.blob(blob::OWNERS + cut)?.unwrap_or_default();
    Owners::from_bytes(&bytes).ok_or_else(|| {
        StoreError::Sealed(SealedError::Content {
            path: catalog.dir().to_owned(),
            subdomain: cut,
            what: format!("the table of owners of cut {cut} is damaged"),
        })
    })
}
