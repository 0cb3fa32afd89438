//! The previous version of sub-domains that were meshed again: brought back or dropped.

use std::collections::BTreeMap;
use std::time::Instant;

use super::summary::{Remade, ResaturateSummary};
use crate::pipeline::error::PipelineError;
use crate::pipeline::seal::totals::{journal, sum_totals, totals_of};
use crate::pipeline::tree::{self, blob};
use tetdb_base::storage::PagerStats;
use tetdb_schema::catalog::{StoreState, SubdomainRow};
use tetdb_store::store::{Catalog, Step, StoreError};

/// Brings back what the sub-domains of the last change were before it, in one step.
///
/// Errors: [`PipelineError::NothingToUndo`].
pub fn undo(catalog: &mut Catalog) -> Result<ResaturateSummary, PipelineError> {
    let clock = Instant::now();
    let before = catalog.previous()?;
    if before.is_empty() {
        return Err(PipelineError::NothingToUndo { path: catalog.dir().to_owned() });
    }
    let n = tree::n_subdomains(catalog)?;
    let (mut parts, mut totals, mut blobs) = (Vec::new(), BTreeMap::new(), Vec::new());
    for row in before {
        let rank = row.rank;
        totals.insert(rank, totals_of(catalog, blob::SEALED_BEFORE, rank)?);
        for (now, then) in VERSIONED {
            let old = catalog.blob(then + rank)?;
            let new = catalog.blob(now + rank)?;
            blobs.push(([now + rank, then + rank], old, new));
        }
        parts.push(Remade { before: catalog.subdomain(rank)?, after: row, fine: None });
    }
    let regions = sum_totals(catalog, n, &totals)?.regions;
    catalog.commit(|step| {
        for ([now, then], old, new) in &blobs {
            let length = |blob: &Option<Vec<u8>>| blob.as_ref().map_or(0, Vec::len);
            step.remove_blob(*now, length(new));
            step.remove_blob(*then, length(old));
            if let Some(bytes) = old {
                step.set_blob(*now, bytes);
            }
        }
        for part in &parts {
            step.remove_previous(part.after.rank);
            step.set_subdomain(&part.after);
            step.unlist_file(part.after.rank, part.before.generation);
        }
        step.set_regions(&regions);
        step.set_state(StoreState::Sealed);
        step.append_journal(&journal(StoreState::Sealed, "undo", clock, &[]));
        Ok(())
    })?;
    Ok(ResaturateSummary { parts, pages: PagerStats::default(), frames_used: 0 })
}

/// Drops the previous version; returns of how many sub-domains there was one. Errors: the disk.
pub fn forget(catalog: &mut Catalog) -> Result<usize, PipelineError> {
    let before = Previous::of(catalog)?;
    let n = before.rows.len();
    if n > 0 {
        catalog.commit(|step| {
            before.drop(step);
            Ok(())
        })?;
    }
    Ok(n)
}

/// Blobs of which there is a previous version: where they are, where those are.
pub const VERSIONED: [(u32, u32); 3] = [
    (blob::SEALED, blob::SEALED_BEFORE),
    (blob::FIELD, blob::FIELD_BEFORE),
    (blob::ASKED, blob::ASKED_BEFORE),
];

/// The previous version, and the lengths of its blobs.
pub struct Previous {
    pub rows: Vec<SubdomainRow>,
    blobs: Vec<(u32, usize)>,
}

impl Previous {
    /// As the catalog has it. Errors: a damaged catalog.
    pub fn of(catalog: &mut Catalog) -> Result<Self, StoreError> {
        let rows = catalog.previous()?;
        let mut blobs = Vec::new();
        for row in &rows {
            for (_, then) in VERSIONED {
                if let Some(bytes) = catalog.blob(then + row.rank)? {
                    blobs.push((then + row.rank, bytes.len()));
                }
            }
        }
        Ok(Self { rows, blobs })
    }

    /// Forgets it in `step`.
    pub fn drop(&self, step: &mut Step) {
        for row in &self.rows {
            step.remove_previous(row.rank);
            step.unlist_file(row.rank, row.generation);
        }
        for &(number, length) in &self.blobs {
            step.remove_blob(number, length);
        }
    }
}
