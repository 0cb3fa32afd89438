//! The catalog's side of the work: orders are drawn up from it, receipts committed to it, each in one step.

use std::collections::BTreeMap;

use super::owners::{NewCut, TopologyChange, read_owners};
use crate::pipeline::error::PipelineError;
use crate::pipeline::seal::totals::{Totals, sum_totals};
use crate::pipeline::tree::{self, PartMesh, blob};
use crate::pipeline::work::stages;
use crate::pipeline::work::{CutOrder, CutReceipt, SubdomainOrder, SubdomainReceipt};
use tetdb_schema::catalog::StoreState;
use tetdb_store::store::{Catalog, StoreError};

/// What bisects a part of a mesh of `n` sub-domains. Errors: a damaged catalog.
pub fn cut_order(catalog: &mut Catalog, n: u32, parent: PartMesh) -> Result<CutOrder, StoreError> {
    let zones = tree::zones_above(catalog, parent.part, n)?;
    Ok(CutOrder { parent, zones })
}

/// What makes a sub-domain, once all cuts are made. Errors: a damaged catalog.
pub fn subdomain_order(
    catalog: &mut Catalog,
    n: u32,
    part: PartMesh,
) -> Result<SubdomainOrder, StoreError> {
    let mut owners = BTreeMap::new();
    for cut in part.part.cuts_above(n) {
        let table = read_owners(catalog, cut)?;
        owners.insert(cut, table.across(part.part.first));
    }
    let zones = tree::zones_above(catalog, part.part, n)?;
    Ok(SubdomainOrder { part, zones, owners })
}

/// Commits bisections, each after those above it, in one step: of the files between them only the last children's are there.
pub fn commit_cuts(catalog: &mut Catalog, cuts: &[CutReceipt]) -> Result<(), PipelineError> {
    let mut topology = TopologyChange::none(catalog)?;
    for cut in cuts {
        let [low, high] = cut.children.map(|child| child.part.first);
        let new =
            NewCut { cut: cut.zone.cut, faces: cut.faces, low, high, inherited: &cut.inherited };
        topology.add(catalog, &new)?;
    }
    catalog.commit(|step| {
        for cut in cuts {
            for child in cut.children {
                step.list_file(child.part.first, child.generation);
                step.set_blob(blob::PART + child.part.first, &child.to_bytes());
            }
            step.unlist_file(cut.parent.part.first, cut.parent.generation);
            stages::list(&cut.stages, &cut.stage_faces, step);
            step.set_blob(blob::CUT + cut.zone.cut, &tree::plane_bytes(cut.zone));
            step.append_journal(&cut.journal);
        }
        topology.commit(step);
        step.set_state(StoreState::Bisected);
        Ok(())
    })?;
    Ok(())
}

/// Commits a finished sub-domain.
pub fn commit_subdomain(
    catalog: &mut Catalog,
    leaf: &SubdomainReceipt,
) -> Result<(), PipelineError> {
    let mut journal = leaf.journal.clone();
    // A finished sub-domain leaves the state of the whole as it is until the last one.
    journal.state = catalog.state()?;
    catalog.commit(|step| {
        let rank = leaf.row.rank;
        step.set_subdomain(&leaf.row);
        step.set_blob(blob::SEALED + rank, &leaf.totals);
        step.list_file(rank, leaf.row.generation);
        step.unlist_file(rank, leaf.coarse);
        if let Some(kept) = &leaf.kept {
            step.list_coarse(kept);
        }
        step.append_journal(&journal);
        Ok(())
    })?;
    Ok(())
}

/// Everything is sealed: regions and interfaces of the whole.
pub fn close(catalog: &mut Catalog, n: u32) -> Result<(), PipelineError> {
    let Totals { regions, interfaces } = sum_totals(catalog, n, &BTreeMap::new())?;
    let scratch = catalog.scratch_dir()?;
    catalog.commit(|step| {
        step.set_regions(&regions);
        for (&cut, rows) in &interfaces {
            step.set_interfaces(cut, rows);
        }
        step.set_state(StoreState::Sealed);
        Ok(())
    })?;
    // Nothing in it counts; what cannot be removed now goes when the store is next opened for writing.
    let _ = scratch.remove_dir_all();
    let work = catalog.work_dir();
    if work.exists() {
        let _ = work.remove_dir_all();
    }
    Ok(())
}
