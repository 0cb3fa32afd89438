//! Remeshing of sub-domains from their coarse snapshots, each alone; the mesh around them stays as it is.
//!
//! Workers write new files next to the old ones. When all are done, one commit lists the new files and keeps the old as the
//! previous version. A killed run leaves either the old mesh or the new one.
//!
//! An imported store has no coarse snapshots: those that are needed are made before, from the shells of the sub-domains.

use std::collections::BTreeSet;

use super::coarse::add_snapshots;
use super::request::Resaturation;
use super::run::RemeshRun;
use super::sizes::{NewSizes, Recorded, recorded_field, room};
use super::summary::{Forecast, ResaturateSummary};
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Options;
use crate::pipeline::progress::Watcher;
use tetdb_base::storage::{Budget, attempt};
use tetdb_schema::blob::Blob;
use tetdb_store::store::{Catalog, StoreError};

/// Remeshes sub-domains of a finished store, in one step.
///
/// The result depends on the store and the sizes alone. Interfaces and all other sub-domains stay as they are. Effects: one
/// commit. The replaced files become the previous version, and the earlier previous version is dropped. Errors: a sub-domain does
/// not exist or has no coarse snapshot; sizes make no sense. The store is then unchanged.
pub fn resaturate(
    catalog: &mut Catalog,
    options: &Options,
    what: &Resaturation,
    budget: &Budget,
    watch: &Watcher,
) -> Result<ResaturateSummary, PipelineError> {
    // A damaged file has no shell from which its sub-domain could be meshed.
    if !what.repair {
        add_snapshots(catalog, options, &what.ranks, budget, watch)?;
    }
    let mut again = RemeshRun::open(catalog, options, what, budget)?;
    attempt(|| {
        let fields = again.fields(budget)?;
        again.run(fields, budget, watch)
    })?
}

/// Predicts the number of tetrahedra that [`resaturate`] would give each sub-domain, without remeshing. Errors: as there.
pub fn forecast(
    catalog: &mut Catalog,
    options: &Options,
    what: &Resaturation,
    budget: &Budget,
) -> Result<Vec<Forecast>, PipelineError> {
    let mut again = RemeshRun::open(catalog, options, what, budget)?;
    attempt(|| {
        let fields = again.fields(budget)?;
        again.forecast(&fields, budget)
    })?
}

/// Returns the sub-domains that `sizes` would change. Errors: damage; sizes that make no sense.
pub fn changed(
    catalog: &mut Catalog,
    options: &Options,
    sizes: &NewSizes,
    budget: &Budget,
) -> Result<BTreeSet<u32>, PipelineError> {
    let room = room(catalog, budget)?;
    let field = recorded_field(catalog, options, &room)?;
    let recorded = Recorded { whole: &field, room: &room };
    let mut ranks = BTreeSet::new();
    for row in catalog.subdomains()? {
        let memory = budget.available() / 4;
        if attempt(|| recorded.differs(catalog, row.rank, sizes, memory))?? {
            ranks.insert(row.rank);
        }
    }
    Ok(ranks)
}

/// Returns the recorded request of the last remeshing of a sub-domain with new sizes; `None` if the sub-domain has the sizes of
/// the whole.
///
/// Errors: a damaged catalog.
pub fn recorded_request(catalog: &mut Catalog, rank: u32) -> Result<Option<String>, StoreError> {
    let bytes = catalog.blob(Blob::Request(rank))?;
    Ok(bytes.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
}
