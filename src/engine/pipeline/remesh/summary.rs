//! What a run did, by rank.

use crate::pipeline::work::FineReport;
use tetdb_base::storage::PagerStats;
use tetdb_schema::catalog::SubdomainRow;

/// A sub-domain before and after.
#[derive(Clone, Debug)]
pub struct Remade {
    /// Its row in the catalog before the run.
    pub before: SubdomainRow,
    /// Its row in the catalog after the run.
    pub after: SubdomainRow,
    /// `None` where an older version came back.
    pub fine: Option<FineReport>,
}

/// What a run did, by rank.
#[derive(Clone, Debug, Default)]
pub struct ResaturateSummary {
    /// The sub-domains that were meshed again.
    pub parts: Vec<Remade>,
    /// Pages read and written.
    pub pages: PagerStats,
    /// Most pages held in memory at once.
    pub frames_used: usize,
}
