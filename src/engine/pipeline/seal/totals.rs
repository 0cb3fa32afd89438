//! Regions and interfaces of the whole mesh, summed over its sub-domains; and rows of the journal.

use std::collections::BTreeMap;
use std::time::Instant;

use crate::pipeline::error::PipelineError;
use crate::pipeline::tree::read_blob;
use tetdb_base::storage::StepClock;
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::{InterfaceRow, JournalRow, Measure, RegionRow, StoreState};
use tetdb_schema::totals::SubdomainTotals;
use tetdb_store::sealed::Sealed;
use tetdb_store::store::Catalog;

/// Regions and interfaces of a sub-domain.
pub fn totals_of(sealed: &Sealed) -> SubdomainTotals {
    SubdomainTotals { regions: sealed.regions.clone(), interfaces: sealed.interfaces.clone() }
}

/// Regions and interfaces of the whole mesh.
pub struct Totals {
    pub regions: Vec<RegionRow>,
    /// By cut.
    pub interfaces: BTreeMap<u32, Vec<InterfaceRow>>,
}

/// Sums the totals of all `n` sub-domains; those in `changed` replace the recorded ones.
pub fn sum_totals(
    catalog: &mut Catalog,
    n: u32,
    changed: &BTreeMap<u32, SubdomainTotals>,
) -> Result<Totals, PipelineError> {
    let mut regions = catalog.regions()?;
    let mut row_of = BTreeMap::new();
    for (i, row) in (0..).zip(&mut regions).filter(|(_, r)| r.filled) {
        (row.tets, row.volume) = (0, 0.0);
        row_of.insert(row.region, i);
    }
    let mut interfaces: BTreeMap<u32, Vec<InterfaceRow>> = BTreeMap::new();
    for rank in 0..n {
        let totals = match changed.get(&rank) {
            Some(totals) => totals.clone(),
            None => read_blob(catalog, Blob::Totals(rank))?,
        };
        for (region, here) in &totals.regions {
            let Some(&i) = row_of.get(region) else {
                continue;
            };
            let row: &mut RegionRow = &mut regions[i];
            row.tets += here.tets;
            row.volume += here.volume;
        }
        // Only the side with the lower rank counts; verification compares it with the other.
        for side in totals.interfaces.iter().filter(|s| rank < s.other) {
            interfaces.entry(side.cut).or_default().push(InterfaceRow {
                cut: side.cut,
                low: rank,
                high: side.other,
                faces: side.faces,
                digest: side.digest.lanes,
            });
        }
    }
    Ok(Totals { regions, interfaces })
}

/// Measures of a step by how many threads can share its seconds, asked on the thread of the step.
pub fn by_threads(clock: &StepClock) -> [(&'static str, f64); 4] {
    let shared = clock.shared();
    [
        ("serial_s", clock.seconds() - shared.clock),
        ("parallel_s", shared.parallel),
        ("tasks_s", shared.tasks),
        ("chain_s", shared.chain),
    ]
}

/// Row of the journal for what comes before a store is begun.
pub fn prepared_row(clock: &StepClock) -> JournalRow {
    journal(StoreState::Imported, "check, sizes", clock.begun(), &by_threads(clock))
}

/// Row of the journal for a step that began at `clock`.
pub fn journal(
    state: StoreState,
    step: &str,
    clock: Instant,
    measures: &[(&str, f64)],
) -> JournalRow {
    JournalRow {
        state,
        subdomain: Some(0),
        step: step.to_owned(),
        seconds: clock.elapsed().as_secs_f64(),
        measures: measures
            .iter()
            .map(|&(name, value)| Measure { name: name.to_owned(), value })
            .collect(),
    }
}
