//! The bisections of a run, by threads of this process and remote workers.

use super::commit::{commit_cuts, cut_order};
use super::run::Run;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Plan;
use crate::pipeline::progress::{JobProgress, Watcher};
use crate::pipeline::tasks::{ask, wrong_receipt};
use crate::pipeline::tree;
use crate::pipeline::work::{Worker, Workplace};
use crate::pipeline::workers::{WorkerFn, run_jobs};
use tetdb_kernel::bisect::CutReport;
use tetdb_schema::tree::RankRange;
use tetdb_schema::work::{CutOrder, CutReceipt, Receipt, WorkOrder};

/// A finished cut: its order, its receipt, and the report if this process performed the cut.
type CutDone = (CutOrder, CutReceipt, Option<CutReport>);

/// Predicted work of the cut of a subtree, in no unit: it grows like the number of tetrahedra near the plane.
fn work(ranks: RankRange) -> f64 {
    f64::from(ranks.count).powf(2.0 / 3.0)
}

/// That of all cuts of a subtree.
fn work_below(ranks: RankRange) -> f64 {
    match ranks.count {
        0 | 1 => 0.0,
        _ => work(ranks) + ranks.children().map(work_below).iter().sum::<f64>(),
    }
}

impl Run<'_> {
    /// Bisects until every subtree is one sub-domain. As many subtrees are cut at once as threads and memory allow.
    pub fn divide_all(&mut self) -> Result<Vec<CutReport>, PipelineError> {
        let mut parts = tree::subtrees(self.catalog, self.n)?;
        parts.retain(|p| p.ranks.count > 1);
        if parts.is_empty() {
            return Ok(Vec::new());
        }
        let workers = self.plan.workers();
        // A single subtree gets all the memory: its children are cut only after it is done.
        let share = self.plan.shared_by(parts.len().min(workers).max(1) as u64);
        let all = work_below(RankRange::root(self.n));
        let left: f64 = parts.iter().map(|part| work_below(part.ranks)).sum();
        let per_cent = 100.0 / all;
        let done = [(all - left) * per_cent, 100.0];
        let progress = JobProgress::new("cut into sub-domains", "%", done);
        let job = |order: &CutOrder| {
            let ranks = order.parent.ranks;
            (ranks.cut(), work(ranks) * per_cent)
        };
        let mut orders = Vec::with_capacity(parts.len());
        for part in parts.into_iter().rev() {
            orders.push((cut_order(self.catalog, self.n, part)?, share));
        }
        let worker = Worker { place: Workplace::in_store(self.catalog)?, common: self.common() };
        let watch = self.watch;
        let mut reports = Vec::new();
        let share = self.plan.shared_by(workers as u64);
        let here = |(order, share): (CutOrder, Plan), watch: &Watcher| {
            let job = job(&order);
            let heard = |event| progress.heard(job, event, watch);
            let (receipt, report) = worker.cut(&order, share, &heard)?;
            progress.finished(job, watch);
            Ok((order, receipt, Some(report)))
        };
        let there = self.pool()?;
        let store = &worker.place.store;
        let elsewhere: Vec<_> = (there.iter())
            .map(|(pool, slot)| {
                let (job, progress) = (&job, &progress);
                move |(order, _): (CutOrder, Plan), watch: &Watcher| match ask(
                    &**pool,
                    *slot,
                    &WorkOrder::Cut(order.clone()),
                    store,
                )? {
                    Receipt::Cut(receipt) => {
                        progress.finished(job(&order), watch);
                        Ok((order, receipt, None))
                    }
                    Receipt::Subdomain(_) => Err(wrong_receipt()),
                }
            })
            .collect();
        let mut workers: Vec<WorkerFn<(CutOrder, Plan), CutDone>> = vec![&here; workers];
        workers.extend(elsewhere.iter().map(|worker| worker as WorkerFn<_, _>));
        run_jobs(orders, &workers, watch, &mut |(order, receipt, report)| {
            reports.extend(report);
            commit_cuts(self.catalog, std::slice::from_ref(&receipt))?;
            self.count(receipt.traffic);
            let mut orders: Vec<_> = receipt.below(&order.zones).map(|o| (o, share)).collect();
            orders.reverse();
            Ok(orders)
        })?;
        Ok(reports)
    }
}
