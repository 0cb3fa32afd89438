//! The bisections of a run: orders from the catalog, receipts into it.

use super::owners::{NewCut, TopologyChange};
use super::run::Run;
use super::stages;
use crate::bisect::CutReport;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Plan;
use crate::pipeline::tree::{self, PartMesh, blob};
use crate::pipeline::work::{CutOrder, CutReceipt, Worker, Workplace};
use crate::pipeline::workers::work_off;
use tetdb_schema::catalog::StoreState;

impl Run<'_> {
    /// Bisects until no part has more than one sub-domain, as many parts at once as there are threads and memory for.
    pub(crate) fn divide_all(&mut self) -> Result<Vec<CutReport>, PipelineError> {
        let mut parts = tree::parts(self.catalog, self.n)?;
        parts.retain(|p| p.part.count > 1);
        let workers = self.plan.workers();
        // One part alone has all the memory: its children come when it is done.
        let share = self.plan.shared_by(parts.len().min(workers).max(1) as u64);
        let mut orders = Vec::with_capacity(parts.len());
        for part in parts.into_iter().rev() {
            orders.push((self.cut_order(part)?, share));
        }
        let worker = Worker {
            place: Workplace::in_store(self.catalog)?,
            common: self.common()?,
        };
        let watch = self.watch;
        let mut reports = Vec::new();
        let share = self.plan.shared_by(workers as u64);
        work_off(
            orders,
            workers,
            watch,
            &|(order, share): (CutOrder, Plan), watch| {
                let (receipt, report) = worker.cut(&order, share, watch)?;
                Ok((order, receipt, report))
            },
            &mut |(order, receipt, report)| {
                reports.push(report);
                self.commit_cuts(std::slice::from_ref(&receipt))?;
                let mut orders: Vec<_> = receipt.below(&order.zones).map(|o| (o, share)).collect();
                orders.reverse();
                Ok(orders)
            },
        )?;
        Ok(reports)
    }

    /// What bisects a part.
    pub(crate) fn cut_order(&mut self, parent: PartMesh) -> Result<CutOrder, PipelineError> {
        let zones = tree::zones_above(self.catalog, parent.part, self.n)?;
        Ok(CutOrder { parent, zones })
    }

    /// Commits bisections, each after those above it, in one step: of the files between only the last children's are there.
    pub(crate) fn commit_cuts(&mut self, cuts: &[CutReceipt]) -> Result<(), PipelineError> {
        let mut topology = TopologyChange::none(self.catalog)?;
        for cut in cuts {
            let [low, high] = cut.children.map(|child| child.part.first);
            let new = NewCut {
                cut: cut.zone.cut,
                faces: cut.faces,
                low,
                high,
                inherited: &cut.inherited,
            };
            topology.add(self.catalog, &new)?;
        }
        self.catalog.commit(|step| {
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
        for cut in cuts {
            self.count(cut.traffic);
        }
        Ok(())
    }
}
