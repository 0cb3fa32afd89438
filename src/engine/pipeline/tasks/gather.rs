//! Tasks, on the side that holds the store's lock: writes orders and commits receipts.

use std::collections::BTreeSet;
use std::hash::{BuildHasher, RandomState};
use std::ops::Range;
use std::time::Duration;

use super::folder::{Patience, TaskFolder, copy, damaged, read_record, write_record};
use super::schedule::{Stage, StageKind, stages};
use super::status::is_being_worked;
use crate::pipeline::error::PipelineError;
use crate::pipeline::mesh::commit::{
    close, commit_cuts, commit_subdomain, cut_order, subdomain_order,
};
use crate::pipeline::plan::RECIPE;
use crate::pipeline::tree;
use tetdb_base::storage::{DiskPath, StorageError, attempt};
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::StoreState;
use tetdb_schema::tree::{RankRange, SubtreeMesh};
use tetdb_schema::work::{
    CutReceipt, PlanRecord, Receipt, TaskOrders, TaskReceipts, WorkKind, WorkOrder,
};
use tetdb_store::store::{Catalog, StoreError};

/// Result of a call of [`gather`].
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// Tasks whose receipts were committed.
    pub committed: Vec<u32>,
    /// Tasks of the stage without anything to commit, and the reason.
    pub left: Vec<(u32, String)>,
    /// True if the tasks of the stage have just received their orders, because the previous stage is complete.
    pub is_new_stage: bool,
    /// Number of the stage, from 0, and number of stages.
    pub stage: [usize; 2],
    /// Tasks of the stage.
    pub tasks: Range<u32>,
    /// True if all tasks are done and the store is sealed.
    pub is_finished: bool,
}

impl Gathered {
    /// True if the tasks of the stage had orders before this call: each remaining one has failed or is not done yet.
    pub fn is_begun(&self) -> bool {
        !self.is_new_stage
    }
}

/// Plans the remaining work of an unfinished store with a coarse mesh, for about `tasks` tasks at once. Repeating a plan changes
/// nothing.
///
/// `options` are the job's options as JSON. Errors: no coarse mesh; nothing left to do; a running task of another plan; the disk.
pub fn plan(catalog: &mut Catalog, tasks: u32, options: &str) -> Result<(), PipelineError> {
    attempt(|| {
        let folder = TaskFolder::of(catalog.work_dir());
        let state = catalog.state()?;
        let no_plan = |reason: &str| PipelineError::NoPlan {
            path: folder.dir.folder().path().to_owned(),
            reason: reason.to_owned(),
        };
        if state.is_finished() {
            return Err(no_plan("it is finished"));
        }
        if state < StoreState::Coarse {
            return Err(no_plan("it has no coarse mesh yet, which one process makes"));
        }
        let bounds = tree::bounds(catalog)?;
        let mut plan = PlanRecord {
            run: RandomState::new().hash_one(std::process::id()),
            recipe: RECIPE,
            n: tree::recorded_n_subdomains(catalog)?,
            tasks,
            bounds: [bounds.low, bounds.high].map(|p| p.to_array()),
            options: options.to_owned(),
        };
        if let Ok(old) = folder.plan(Patience::of(Duration::ZERO)) {
            plan.run = old.run;
            if plan == old {
                return Ok(());
            }
            if let Some((task, host)) = is_being_worked(folder.dir.folder().path())? {
                let path = folder.dir.folder().path().to_owned();
                let writer = format!("task {task} on {host}");
                return Err(StoreError::Busy { path, writer }.into());
            }
            // Finished tasks of the old plan are committed; results of its other tasks no longer count.
            gather(catalog, Duration::ZERO)?;
            plan.run = RandomState::new().hash_one(old.run);
        }
        if folder.dir.exists() {
            folder.dir.remove_dir_all()?;
        }
        folder.dir.create_dir_all()?;
        let field = catalog.blob(Blob::SizeField)?.unwrap_or_default();
        folder.set_field(&field)?;
        write_record(&folder.plan_path(), WorkKind::Plan, &plan)?;
        Ok(())
    })?
}

/// Commits the results of tasks and writes orders for the next ones; seals the store when nothing is left.
///
/// `wait` is how long to look for missing files. Errors: no plan; the disk. Commits before the error stay.
pub fn gather(catalog: &mut Catalog, wait: Duration) -> Result<Gathered, PipelineError> {
    attempt(|| {
        let folder = TaskFolder::of(catalog.work_dir());
        let patience = Patience::of(wait);
        if catalog.state()?.is_finished() {
            return Ok(Gathered { is_finished: true, ..Gathered::default() });
        }
        let plan = folder.plan(patience)?;
        let run = GatherRun { catalog, folder: &folder, plan: &plan, patience };
        run.all()
    })?
}

struct GatherRun<'a> {
    catalog: &'a mut Catalog,
    folder: &'a TaskFolder,
    plan: &'a PlanRecord,
    patience: Patience,
}

impl GatherRun<'_> {
    fn all(mut self) -> Result<Gathered, PipelineError> {
        let n = self.plan.n;
        let stages = stages(n, self.plan.tasks);
        let mut gathered = Gathered::default();
        for (number, stage) in stages.iter().enumerate() {
            gathered.stage = [number, stages.len()];
            gathered.tasks = stage.tasks();
            let open = self.open_tasks(stage)?;
            gathered.is_new_stage = open.iter().all(|&t| !self.folder.orders_path(t).exists());
            for task in open {
                // A task without orders cannot have late receipts.
                let has_orders = self.folder.orders_path(task).exists();
                match self.receipts(task, has_orders)? {
                    Ok(receipts) => {
                        self.commit(receipts)?;
                        gathered.committed.push(task);
                    }
                    Err(why) => gathered.left.push((task, why)),
                }
            }
            if !gathered.left.is_empty() {
                for (task, _) in &gathered.left {
                    self.give_orders(stage, *task)?;
                }
                let is_left = |task| gathered.left.iter().any(|(left, _)| *left == task);
                let committed: Vec<u32> = stage.tasks().filter(|&task| !is_left(task)).collect();
                self.folder.set_stage(number, &committed)?;
                return Ok(gathered);
            }
        }
        close(self.catalog, n)?;
        gathered.is_finished = true;
        Ok(gathered)
    }

    /// Returns the tasks of a stage that are not committed.
    fn open_tasks(&mut self, stage: &Stage) -> Result<Vec<u32>, PipelineError> {
        let parts = tree::subtrees(self.catalog, self.plan.n)?;
        let sealed: BTreeSet<u32> = self.catalog.subdomains()?.iter().map(|r| r.rank).collect();
        let is_open = |part: RankRange| match stage.kind {
            StageKind::Cuts => parts.iter().any(|p| p.ranks == part),
            StageKind::Subtrees => wide_within(&parts, part).next().is_some(),
            StageKind::Subdomains => part.ranks().any(|r| !sealed.contains(&r)),
        };
        let tasks = stage.tasks().zip(&stage.parts);
        Ok(tasks.filter(|(_, part)| is_open(**part)).map(|(task, _)| task).collect())
    }

    /// Returns the receipts of a task if all its files are present; otherwise the reason why nothing can be committed.
    fn receipts(
        &self,
        task: u32,
        may_be_late: bool,
    ) -> Result<Result<TaskReceipts, String>, PipelineError> {
        let path = self.folder.receipts_path(task);
        let patience = match may_be_late {
            true => self.patience,
            false => Patience::of(Duration::ZERO),
        };
        let look = || {
            let found = read_record::<TaskReceipts>(&path, WorkKind::Receipts)?;
            Ok(found.filter(|found| found.as_ref().map_or(true, |r| r.run == self.plan.run)))
        };
        let receipts = match patience.until(look)? {
            None => return Ok(Err("it has no receipt".to_owned())),
            Some(Err(e)) => return Ok(Err(format!("its receipt cannot be used: {e}"))),
            Some(Ok(receipts)) => receipts,
        };
        let dir = self.folder.files_dir(&receipts.attempt);
        for (name, bytes) in &receipts.files {
            let file = dir.join(name);
            let is_there = || Ok(file.bytes().is_ok_and(|found| found == *bytes).then_some(()));
            if patience.until(is_there)?.is_none() {
                return Ok(Err(format!("its file {name} is missing or not complete")));
            }
        }
        Ok(Ok(receipts))
    }

    /// Links or copies the files of a task to their place in the store, and commits its receipts.
    fn commit(&mut self, done: TaskReceipts) -> Result<(), PipelineError> {
        let from = self.folder.files_dir(&done.attempt);
        let store = self.folder.dir.folder();
        let files = self.catalog.files()?;
        let files = files.iter().map(|f| Catalog::file_name(f.subdomain, f.generation));
        let coarse = self.catalog.coarse_snapshots()?;
        let coarse = coarse.iter().map(|c| Catalog::coarse_name(c.rank, c.generation));
        let listed: BTreeSet<String> = files.chain(coarse).collect();
        for (name, _) in &done.files {
            // A listed file is not touched: an earlier commit included this part of the task.
            if !listed.contains(name) {
                place(&from.join(name), &store.join(name))?;
            }
        }
        let (mut cuts, mut subdomains) = (Vec::new(), Vec::new());
        for receipt in done.receipts {
            match receipt {
                Receipt::Cut(cut) => cuts.push(cut),
                Receipt::Subdomain(sub) => subdomains.push(sub),
            }
        }
        self.commit_new_cuts(cuts, done.task)?;
        let sealed: BTreeSet<u32> = self.catalog.subdomains()?.iter().map(|r| r.rank).collect();
        for sub in subdomains.iter().filter(|sub| !sealed.contains(&sub.row.rank)) {
            commit_subdomain(self.catalog, sub)?;
        }
        // The folder only has second names of files that are now in the store.
        from.remove_dir_all()?;
        self.folder.receipts_path(done.task).remove_file()?;
        self.folder.mark_path(done.task).remove_file()?;
        Ok(())
    }

    /// Commits cuts. Errors: the store lacks the subtree that they cut.
    fn commit_new_cuts(&mut self, cuts: Vec<CutReceipt>, task: u32) -> Result<(), PipelineError> {
        let Some(top) = cuts.first() else {
            return Ok(());
        };
        let parts = tree::subtrees(self.catalog, self.plan.n)?;
        match parts.contains(&top.parent) {
            true => commit_cuts(self.catalog, &cuts),
            false => Err(damaged(
                &self.folder.receipts_path(task),
                "it cuts a part that the store has not",
            )),
        }
    }

    fn give_orders(&mut self, stage: &Stage, task: u32) -> Result<(), PipelineError> {
        let part = stage.part(task).expect("a task of the stage");
        let n = self.plan.n;
        let parts = tree::subtrees(self.catalog, n)?;
        let mut orders = Vec::new();
        if stage.kind == StageKind::Subdomains {
            let sealed: BTreeSet<u32> = self.catalog.subdomains()?.iter().map(|r| r.rank).collect();
            let within = part.ranks();
            for part in parts.iter().filter(|p| within.contains(&p.ranks.first)) {
                if !sealed.contains(&part.ranks.first) {
                    orders.push(WorkOrder::Subdomain(subdomain_order(self.catalog, n, *part)?));
                }
            }
        } else {
            for part in wide_within(&parts, part) {
                orders.push(WorkOrder::Cut(cut_order(self.catalog, n, *part)?));
            }
        }
        let record = TaskOrders {
            run: self.plan.run,
            task,
            orders,
            below: stage.kind == StageKind::Subtrees,
        };
        Ok(write_record(&self.folder.orders_path(task), WorkKind::Orders, &record)?)
    }
}

/// Returns the subtrees within `part` that are still to be cut.
fn wide_within(parts: &[SubtreeMesh], part: RankRange) -> impl Iterator<Item = &SubtreeMesh> {
    let within = part.ranks();
    (parts.iter()).filter(move |p| p.ranks.count > 1 && within.contains(&p.ranks.first))
}

/// Gives a file a second name, so that it is not lost if the commit does not follow. The file is copied where the disk has no
/// hard links.
fn place(from: &DiskPath, to: &DiskPath) -> Result<(), StorageError> {
    to.remove_file()?;
    match from.link(to) {
        Ok(()) => to.folder().sync_dir(),
        Err(_) => copy(from, to),
    }
}

/// Commits the finished tasks and drops the plan, for a run that continues without tasks. Returns true if there was a plan.
///
/// Errors: the disk.
pub fn end_plan(catalog: &mut Catalog) -> Result<bool, PipelineError> {
    let folder = TaskFolder::of(catalog.work_dir());
    if !folder.dir.exists() {
        return Ok(false);
    }
    let had_plan = folder.plan_path().exists();
    match gather(catalog, Duration::ZERO) {
        Ok(_) | Err(PipelineError::NoPlan { .. } | PipelineError::TaskFile { .. }) => {}
        Err(error) => return Err(error),
    }
    if folder.dir.exists() {
        folder.dir.remove_dir_all()?;
    }
    Ok(had_plan)
}
