//! Which sub-domains to mesh again, and how.

use std::collections::BTreeSet;

use super::sizes::NewSizes;

/// What to make again.
#[derive(Clone, Debug)]
pub struct Resaturation {
    /// Ranks of the sub-domains.
    pub ranks: BTreeSet<u32>,
    /// `None`: with the sizes that are recorded.
    pub sizes: Option<NewSizes>,
    /// The file of each is damaged: it must become what the catalog says it was, and is no previous version.
    pub repair: bool,
}
