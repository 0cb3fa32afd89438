//! The previous version of remeshed sub-domains: restore it or drop it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use super::summary::{ResaturateSummary, Resaturated};
use crate::pipeline::error::PipelineError;
use crate::pipeline::seal::totals::{journal, sum_totals};
use crate::pipeline::tree::{self, read_blob};
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::{StoreState, SubdomainRow};
use tetdb_schema::field::FieldPart;
use tetdb_store::store::{Catalog, Step, StoreError};

/// Restores the sub-domains of the last remeshing to their version before it, in one step.
///
/// Errors: [`PipelineError::NothingToUndo`]; a damaged catalog; the disk.
pub fn undo(catalog: &mut Catalog) -> Result<ResaturateSummary, PipelineError> {
    let clock = Instant::now();
    let before = catalog.previous()?;
    if before.is_empty() {
        return Err(PipelineError::NothingToUndo { path: catalog.dir().to_owned() });
    }
    let values = previous_values(catalog, &before)?;
    let n = tree::recorded_n_subdomains(catalog)?;
    let (mut parts, mut totals, mut blobs) = (Vec::new(), BTreeMap::new(), Vec::new());
    for row in before {
        let rank = row.rank;
        totals.insert(rank, read_blob(catalog, Blob::PreviousTotals(rank))?);
        for [now, previous] in Blob::versioned(rank) {
            blobs.push(([now, previous], catalog.blob(previous)?, catalog.blob(now)?));
        }
        parts.push(Resaturated { before: catalog.subdomain(rank)?, after: row, fine: None });
    }
    let regions = sum_totals(catalog, n, &totals)?.regions;
    catalog.commit(|step| {
        for ([now, previous], old, new) in &blobs {
            let length = |bytes: &Option<Vec<u8>>| bytes.as_ref().map_or(0, Vec::len);
            step.remove_blob(*now, length(new));
            step.remove_blob(*previous, length(old));
            if let Some(bytes) = old {
                step.set_blob(*now, bytes);
            }
        }
        for [now, previous] in &values {
            step.set_field_part(previous);
            step.remove_previous_field_part(previous, false);
            step.unlist_field_file(now);
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
    Ok(ResaturateSummary { parts, ..ResaturateSummary::default() })
}

/// Values in changed sub-domains, now and before. Errors: [`PipelineError::LaterFields`]; a damaged catalog.
fn previous_values(
    catalog: &mut Catalog,
    rows: &[SubdomainRow],
) -> Result<Vec<[FieldPart; 2]>, PipelineError> {
    let (fields, previous) = (catalog.fields()?, catalog.previous_field_parts()?);
    let (mut values, mut later) = (Vec::new(), BTreeSet::new());
    for now in catalog.field_parts()? {
        if !rows.iter().any(|row| row.rank == now.rank) {
            continue;
        }
        let is_same = |part: &&FieldPart| (part.field, part.rank) == (now.field, now.rank);
        match previous.iter().find(is_same) {
            Some(part) => values.push([now, part.clone()]),
            None => drop(later.insert(now.field)),
        }
    }
    let names = fields.into_iter().filter(|field| later.contains(&field.id));
    match later.is_empty() {
        true => Ok(values),
        false => Err(PipelineError::LaterFields { names: names.map(|f| f.name).collect() }),
    }
}

/// Drops the previous version; returns its number of sub-domains. Errors: the disk.
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

/// The rows of the previous version, its values of fields, and the lengths of its blobs.
pub struct Previous {
    pub rows: Vec<SubdomainRow>,
    values: Vec<FieldPart>,
    blobs: Vec<(Blob, usize)>,
}

impl Previous {
    /// Reads the previous version from the catalog. Errors: a damaged catalog.
    pub fn of(catalog: &mut Catalog) -> Result<Self, StoreError> {
        let rows = catalog.previous()?;
        let mut blobs = Vec::new();
        for row in &rows {
            for [_, previous] in Blob::versioned(row.rank) {
                if let Some(bytes) = catalog.blob(previous)? {
                    blobs.push((previous, bytes.len()));
                }
            }
        }
        Ok(Self { rows, values: catalog.previous_field_parts()?, blobs })
    }

    /// Drops the previous version in `step`.
    pub fn drop(&self, step: &mut Step) {
        for row in &self.rows {
            step.remove_previous(row.rank);
            step.unlist_file(row.rank, row.generation);
        }
        self.values.iter().for_each(|part| step.remove_previous_field_part(part, true));
        for &(blob, length) in &self.blobs {
            step.remove_blob(blob, length);
        }
    }
}
