//! Sub-domains meshed again from their coarse snapshots, each alone; what lies around them stays as it is.
//!
//! Workers write new files beside the old ones; when all are done, one commit lists the new files and remembers the old as the previous
//! version. A run that is killed leaves the old mesh or the new one.

use std::collections::BTreeSet;

use super::request::Resaturation;
use super::run::{RemeshRun, recorded_field, room};
use super::sizes::{NewSizes, Recorded, predicted};
use super::summary::ResaturateSummary;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Options;
use crate::pipeline::progress::Watcher;
use tetdb_base::storage::{Budget, attempt};
use tetdb_schema::blob::Blob;
use tetdb_store::store::{Catalog, StoreError};

/// What would be meshed again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Rank of the sub-domain.
    pub rank: u32,
    /// Tetrahedra it has now.
    pub tets: u64,
    /// Tetrahedra to expect.
    pub predicted: f64,
}

/// Meshes sub-domains of a finished store again, in one step.
///
/// The result depends on the store and the sizes alone. Interfaces and all other sub-domains stay as they are. Effects: one commit; the
/// replaced files stay as the previous version, the one before goes. Errors: a sub-domain that is not there or whose coarse snapshot
/// was not kept; sizes that make no sense. The store is then as it was.
pub fn resaturate(
    catalog: &mut Catalog,
    options: &Options,
    what: &Resaturation,
    budget: &Budget,
    watch: &Watcher,
) -> Result<ResaturateSummary, PipelineError> {
    let mut again = RemeshRun::open(catalog, options, what, budget)?;
    attempt(|| {
        let fields = again.fields(budget)?;
        again.run(fields, budget, watch)
    })?
}

/// What [`resaturate`] would make, without making it. Errors: as there.
pub fn forecast(
    catalog: &mut Catalog,
    options: &Options,
    what: &Resaturation,
    budget: &Budget,
) -> Result<Vec<Forecast>, PipelineError> {
    let mut again = RemeshRun::open(catalog, options, what, budget)?;
    attempt(|| {
        let memory = budget.available() / 4;
        let mut list = Vec::new();
        for (rank, new) in again.fields(budget)? {
            let recorded = Recorded { whole: &again.field, room: &room(again.catalog, budget)? };
            let old = recorded.own(again.catalog, rank)?;
            let old = old.as_ref().unwrap_or(&again.field);
            let tets = again.catalog.subdomain(rank)?.tets;
            let predicted = match &new {
                Some(new) => predicted(again.catalog, rank, [old, new], memory)?,
                None => tets as f64,
            };
            list.push(Forecast { rank, tets, predicted });
        }
        Ok(list)
    })?
}

/// The sub-domains that `sizes` would make otherwise than they are. Errors: damage; sizes that make no sense.
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

/// What was asked for when a sub-domain was last meshed again with other sizes; `None` for one with those of the whole.
///
/// Errors: a damaged catalog.
pub fn asked(catalog: &mut Catalog, rank: u32) -> Result<Option<String>, StoreError> {
    let bytes = catalog.blob(Blob::Request(rank))?;
    Ok(bytes.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
}
