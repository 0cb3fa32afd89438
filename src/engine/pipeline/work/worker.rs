//! The worker: performs orders, independent of how they reach it.

use std::collections::BTreeMap;

use super::common::Common;
use super::cut::CutJob;
use super::subdomain::SubdomainJob;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Plan;
use crate::pipeline::progress::Watcher;
use crate::pipeline::tree::DONE;
use tetdb_base::storage::DiskPath;
use tetdb_kernel::bisect::CutReport;
use tetdb_schema::work::{CutOrder, CutReceipt, Receipt, SubdomainOrder, WorkOrder};
use tetdb_store::store::{Catalog, StoreError};

/// Folders of a worker.
#[derive(Clone, Debug)]
pub struct Workplace {
    /// The folder of the store.
    pub store: DiskPath,
    /// Folder of new files; input files are looked for here first.
    pub output: DiskPath,
    /// Folder of pages and sort runs that leave memory.
    pub scratch: DiskPath,
}

/// Performs orders.
pub struct Worker<'a> {
    pub place: Workplace,
    pub common: Common<'a>,
}

impl Workplace {
    /// Folders inside the store, for the process that holds its lock.
    pub fn in_store(catalog: &Catalog) -> Result<Self, StoreError> {
        let store = catalog.disk_path().clone();
        Ok(Self { output: store.clone(), store, scratch: catalog.scratch_dir()? })
    }

    fn input(&self, name: String) -> DiskPath {
        let own = self.output.join(&name);
        match own.is_file() {
            true => own,
            false => self.store.join(&name),
        }
    }

    /// Creates a scratch folder for one order.
    fn scratch(&self, name: String) -> Result<DiskPath, StoreError> {
        let path = self.scratch.join(name);
        path.create_dir_all()?;
        Ok(path)
    }
}

impl Worker<'_> {
    /// Performs one order with the memory of `share`.
    pub fn perform(
        &self,
        order: WorkOrder,
        share: Plan,
        watch: &Watcher,
    ) -> Result<Receipt, PipelineError> {
        match order {
            WorkOrder::Cut(order) => Ok(Receipt::Cut(self.cut(&order, share, watch)?.0)),
            WorkOrder::Subdomain(order) => {
                let job = self.subdomain_job(order, share)?;
                let finished = job.run(self.common, watch)?;
                Ok(Receipt::Subdomain(finished.receipt()))
            }
        }
    }

    /// Bisects a subtree. A failed page access ends here as an error.
    pub fn cut(
        &self,
        order: &CutOrder,
        share: Plan,
        watch: &Watcher,
    ) -> Result<(CutReceipt, CutReport), PipelineError> {
        let (parent, cut) = (order.parent, order.parent.ranks.cut());
        let written = (parent.ranks.children()).map(|part| {
            let name = Catalog::file_name(part.first, parent.generation + DONE);
            self.place.output.join(name)
        });
        let base = Catalog::file_name(parent.ranks.first, parent.generation);
        let job = CutJob {
            order,
            base: self.place.input(base),
            written,
            output: &self.place.output,
            scratch: self.place.scratch(format!("cut-{cut}"))?,
            zones: order.zones.iter().map(|&zone| zone.into()).collect(),
            common: self.common,
            share,
        };
        job.run(watch)
    }

    /// Returns the job that meshes a sub-domain.
    pub fn subdomain_job(
        &self,
        order: SubdomainOrder,
        share: Plan,
    ) -> Result<SubdomainJob, PipelineError> {
        let SubdomainOrder { mesh, zones, owners } = order;
        let (rank, coarse) = (mesh.ranks.first, mesh.generation);
        let output = |name: String| self.place.output.join(name);
        let kept = Catalog::coarse_name(rank, coarse);
        Ok(SubdomainJob {
            mesh,
            base: self.place.input(Catalog::file_name(rank, coarse)),
            sealed: output(Catalog::file_name(rank, coarse + DONE)),
            generation: coarse + DONE,
            form: self.common.form,
            field: None,
            kept: self.common.keeps_coarse.then(|| output(kept)),
            scratch: self.place.scratch(format!("leaf-{rank}"))?,
            zones: zones.into_iter().map(Into::into).collect(),
            owners: BTreeMap::from_iter(owners),
            share: share.without_file(),
        })
    }
}
