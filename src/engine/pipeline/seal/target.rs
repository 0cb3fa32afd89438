//! Destination and resources of a sealed sub-domain.

use std::collections::BTreeMap;

use tetdb_schema::ids::SubdomainId;

use tetdb_base::geom::Aabb;
use tetdb_base::storage::DiskPath;
use tetdb_schema::topology::FacesAcross;
use tetdb_store::sealed::Form;

/// Destination and resources of a sealed sub-domain.
pub struct SealTarget<'a> {
    pub path: &'a DiskPath,
    pub form: Form,
    pub scratch: &'a DiskPath,
    pub subdomain: SubdomainId,
    pub generation: u32,
    /// Bytes for sort runs and the writer together.
    pub memory: u64,
    pub bounds: Aabb,
    /// Owners of the other side of the sub-domain's interface faces, by cut; `None` leaves interface faces out.
    pub owners: Option<&'a BTreeMap<u32, FacesAcross>>,
}
