//! Versions of a store brought back: a named one, or that before the last change.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use super::summary::{ResaturateSummary, Resaturated};
use crate::pipeline::error::PipelineError;
use crate::pipeline::seal::totals::{journal, sum_totals};
use crate::pipeline::tree;
use tetdb_schema::catalog::{FileRow, StoreState, SubdomainRow, VersionRow};
use tetdb_store::store::{BEFORE, Catalog, StoreError};

/// Makes a version the store as it is, in one step. What was before becomes version [`BEFORE`], unless that is the one restored: it goes.
///
/// Errors: [`PipelineError::NothingToUndo`] without such a version; [`PipelineError::LaterFields`]; a damaged catalog; the disk.
pub fn restore(catalog: &mut Catalog, number: u32) -> Result<ResaturateSummary, PipelineError> {
    let clock = Instant::now();
    let versions = catalog.versions()?;
    let Some(version) = versions.get(&number) else {
        return Err(PipelineError::NothingToUndo { path: catalog.dir().to_owned() });
    };
    let (mut then, difference) = (catalog.at(version), catalog.difference(version)?);
    let before = match number {
        BEFORE => {
            check_later_fields(catalog, &mut then, &versions)?;
            None
        }
        _ if difference.is_empty() => return Ok(ResaturateSummary::default()),
        _ => Some(catalog.version_now(VersionRow::default())?),
    };
    let rows = catalog.subdomains()?.into_iter().zip(then.subdomains()?);
    let parts = rows.filter(|(before, after)| before != after);
    let parts = parts.map(|(before, after)| Resaturated { before, after, fine: None }).collect();
    let n = tree::recorded_n_subdomains(catalog)?;
    let regions = sum_totals(&mut then, n, &BTreeMap::new())?.regions;
    let step_name = if number == BEFORE { "undo" } else { "restore" };
    catalog.commit(|step| {
        step.restore(&difference);
        step.set_regions(&regions);
        step.set_state(StoreState::Sealed);
        match &before {
            Some(before) => step.set_version(BEFORE, before),
            None => step.remove_version(BEFORE),
        }
        step.append_journal(&journal(StoreState::Sealed, step_name, clock, &[]));
        Ok(())
    })?;
    Ok(ResaturateSummary { parts, ..ResaturateSummary::default() })
}

/// Refuses to lose fields that were added after the last change and are in no version with a name.
fn check_later_fields(
    catalog: &mut Catalog,
    then: &mut Catalog,
    versions: &BTreeMap<u32, VersionRow>,
) -> Result<(), PipelineError> {
    let (known, parts) = (then.fields()?, catalog.field_parts()?);
    let named = versions.iter().filter(|(number, _)| **number != BEFORE);
    let kept: BTreeSet<FileRow> = named.flat_map(|(_, row)| row.fields.iter().copied()).collect();
    let mut later = catalog.fields()?;
    later.retain(|field| {
        let mut own = parts.iter().filter(|part| part.field == field.id);
        !known.contains(field) && own.any(|part| !kept.contains(&part.file()))
    });
    match later.is_empty() {
        true => Ok(()),
        false => Err(PipelineError::LaterFields {
            names: later.into_iter().map(|field| field.name).collect(),
        }),
    }
}

/// Rows of sub-domains as they were before the last change, where it changed them.
pub fn previous(catalog: &mut Catalog) -> Result<Vec<SubdomainRow>, StoreError> {
    let Some(before) = catalog.versions()?.remove(&BEFORE) else { return Ok(Vec::new()) };
    let (now, mut rows) = (catalog.subdomains()?, catalog.at(&before).subdomains()?);
    rows.retain(|row| !now.contains(row));
    Ok(rows)
}

/// Drops the version before the last change; returns the number of its sub-domains that differ from those of now. Errors: the disk.
pub fn forget(catalog: &mut Catalog) -> Result<usize, PipelineError> {
    let n = previous(catalog)?.len();
    if catalog.versions()?.contains_key(&BEFORE) {
        catalog.commit(|step| {
            step.remove_version(BEFORE);
            Ok(())
        })?;
    }
    Ok(n)
}
