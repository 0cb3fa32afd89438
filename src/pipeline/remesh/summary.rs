//! What a run did, by rank.

use crate::pipeline::mesh::FineReport;
use crate::storage::PagerStats;
use tetdb_schema::catalog::SubdomainRow;

/// A sub-domain before and after.
#[derive(Clone, Debug)]
pub struct Remade {
    pub before: SubdomainRow,
    pub after: SubdomainRow,
    /// `None` where an older version came back.
    pub fine: Option<FineReport>,
}

/// What a run did, by rank.
#[derive(Clone, Debug)]
pub struct ResaturateSummary {
    pub parts: Vec<Remade>,
    pub pages: PagerStats,
    pub frames_used: usize,
}
