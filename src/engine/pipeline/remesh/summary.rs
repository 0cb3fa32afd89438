//! Report of a remeshing run.

use crate::pipeline::work::FineReport;
use tetdb_base::storage::PagerStats;
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::field::FieldRow;
use tetdb_store::transfer::{TransferMethod, Transferred};

/// Number of tetrahedra of a sub-domain, now and predicted for after its remeshing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Rank of the sub-domain.
    pub rank: u32,
    /// Number of tetrahedra now.
    pub tets: u64,
    /// Predicted number of tetrahedra.
    pub predicted: f64,
}

/// Rows of a sub-domain before and after remeshing.
#[derive(Clone, Debug)]
pub struct Resaturated {
    /// Its row in the catalog before the run.
    pub before: SubdomainRow,
    /// Its row in the catalog after the run.
    pub after: SubdomainRow,
    /// Report of the fine step; `None` if an older version was restored.
    pub fine: Option<FineReport>,
}

/// A field that was evaluated on the new mesh.
#[derive(Clone, Debug)]
pub struct FieldChange {
    /// The field.
    pub field: FieldRow,
    /// How its values were evaluated.
    pub method: TransferMethod,
    /// Its values in the changed sub-domains.
    pub values: Transferred,
}

/// Report of a remeshing run.
#[derive(Clone, Debug, Default)]
pub struct ResaturateSummary {
    /// The changed sub-domains, by rank.
    pub parts: Vec<Resaturated>,
    /// Fields of the store, evaluated on the changed sub-domains.
    pub fields: Vec<FieldChange>,
    /// Pages read and written.
    pub pages: PagerStats,
    /// Largest number of pages held in memory at once.
    pub frames_used: usize,
}
