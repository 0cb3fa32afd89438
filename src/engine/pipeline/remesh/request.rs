//! Request to remesh sub-domains.

use std::collections::BTreeSet;

use super::sizes::NewSizes;

/// Sub-domains to remesh, and their sizes.
#[derive(Clone, Debug)]
pub struct Resaturation {
    /// Ranks of the sub-domains.
    pub ranks: BTreeSet<u32>,
    /// New sizes; `None` for the recorded ones.
    pub sizes: Option<NewSizes>,
    /// True if the file of each sub-domain is damaged. The new mesh must then equal the one recorded in the catalog, and the
    /// damaged file does not become a previous version.
    pub repair: bool,
    /// True to drop all fields of the store. Otherwise their values are evaluated on the new mesh.
    pub drop_fields: bool,
}
