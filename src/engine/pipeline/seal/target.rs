//! Where a sealed sub-domain goes, and with what means.

use std::collections::BTreeMap;

use tetdb_schema::ids::SubdomainId;

use tetdb_base::geom::Aabb;
use tetdb_base::storage::DiskPath;
use tetdb_schema::topology::FacesAcross;
use tetdb_store::sealed::Form;

/// Where and how to seal.
pub struct SealTarget<'a> {
    pub path: &'a DiskPath,
    pub form: Form,
    pub scratch: &'a DiskPath,
    pub subdomain: SubdomainId,
    pub generation: u32,
    /// Bytes for sort runs and for the writer together.
    pub memory: u64,
    pub bounds: Aabb,
    /// Owners of the other side of its interface faces, by cut; without owners, interface faces are left out.
    pub owners: Option<&'a BTreeMap<u32, FacesAcross>>,
}
