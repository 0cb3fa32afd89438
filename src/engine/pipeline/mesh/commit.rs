//! Catalog access for work units: creates orders from the catalog and commits receipts to it, each in one step.

use std::collections::BTreeMap;

use super::owners::{NewCut, TopologyChange};
use crate::pipeline::error::PipelineError;
use crate::pipeline::seal::totals::{Totals, sum_totals};
use crate::pipeline::tree::{self, read_blob};
use crate::pipeline::work::stages;
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::StoreState;
use tetdb_schema::topology::FaceOwners;
use tetdb_schema::tree::SubtreeMesh;
use tetdb_schema::work::{CutOrder, CutReceipt, SubdomainOrder, SubdomainReceipt};
use tetdb_store::store::{Catalog, StoreError};

/// Creates the order that bisects a subtree in a mesh of `n` sub-domains. Errors: a damaged catalog.
pub fn cut_order(
    catalog: &mut Catalog,
    n: u32,
    parent: SubtreeMesh,
) -> Result<CutOrder, StoreError> {
    let zones = tree::zones_above(catalog, parent.ranks, n)?;
    Ok(CutOrder { parent, zones })
}

/// Creates the order that meshes a sub-domain; all cuts above it must be committed. Errors: a damaged catalog.
pub fn subdomain_order(
    catalog: &mut Catalog,
    n: u32,
    mesh: SubtreeMesh,
) -> Result<SubdomainOrder, StoreError> {
    let mut owners = BTreeMap::new();
    for cut in mesh.ranks.cuts_above(n) {
        let table: FaceOwners = read_blob(catalog, Blob::FaceOwners(cut))?;
        owners.insert(cut, table.across(mesh.ranks.first));
    }
    let zones = tree::zones_above(catalog, mesh.ranks, n)?;
    Ok(SubdomainOrder { mesh, zones, owners })
}

/// Commits bisections in one step; `cuts` has each cut after those above it. Of the files written, only those of the last children stay
/// listed.
pub fn commit_cuts(catalog: &mut Catalog, cuts: &[CutReceipt]) -> Result<(), PipelineError> {
    let mut topology = TopologyChange::none(catalog)?;
    for cut in cuts {
        let [low, high] = cut.children.map(|child| child.ranks.first);
        let new =
            NewCut { cut: cut.zone.cut, faces: cut.faces, low, high, inherited: &cut.inherited };
        topology.add(catalog, &new)?;
    }
    catalog.commit(|step| {
        for cut in cuts {
            for child in cut.children {
                step.list_file(child.ranks.first, child.generation);
                step.set_blob(Blob::Subtree(child.ranks.first), &child.to_bytes());
            }
            step.unlist_file(cut.parent.ranks.first, cut.parent.generation);
            stages::list(&cut.stages, &cut.stage_faces, step);
            step.set_blob(Blob::CutPlane(cut.zone.cut), &cut.zone.to_bytes());
            step.append_journal(&cut.journal);
        }
        topology.commit(step);
        step.set_state(StoreState::Bisected);
        Ok(())
    })?;
    Ok(())
}

/// Commits a finished sub-domain in one step.
pub fn commit_subdomain(
    catalog: &mut Catalog,
    receipt: &SubdomainReceipt,
) -> Result<(), PipelineError> {
    let mut journal = receipt.journal.clone();
    // The state of the store changes only when the last sub-domain is sealed.
    journal.state = catalog.state()?;
    catalog.commit(|step| {
        let rank = receipt.row.rank;
        step.set_subdomain(&receipt.row);
        step.set_blob(Blob::Totals(rank), &receipt.totals);
        step.list_file(rank, receipt.row.generation);
        step.unlist_file(rank, receipt.coarse);
        if let Some(kept) = &receipt.kept {
            step.list_coarse(kept);
        }
        step.append_journal(&journal);
        Ok(())
    })?;
    Ok(())
}

/// Seals the store once all sub-domains are sealed: commits the regions and interfaces of the whole mesh.
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
    // The scratch folder has no data of the store. A folder that cannot be removed now is removed when the store is next opened for
    // writing.
    let _ = scratch.remove_dir_all();
    let work = catalog.work_dir();
    if work.exists() {
        let _ = work.remove_dir_all();
    }
    Ok(())
}
