//! One task on any machine: reads orders, writes files and receipts.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::folder::{
    Patience, TaskFolder, attempt_name, copy, damaged, read_record, scratch_in, write_record,
};
use super::schedule::stages;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::{MeshOptions, Options, Plan};
use crate::pipeline::progress::Watcher;
use crate::pipeline::work::common::Common;
use crate::pipeline::work::{Worker, Workplace};
use crate::pipeline::workers::{WorkerFn, run_jobs};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Budget, DiskPath, ScratchSpace, StorageError, attempt, host_name};
use tetdb_kernel::sizing::SizeField;
use tetdb_schema::tree::CutPlane;
use tetdb_schema::work::{
    PlanRecord, Receipt, TaskMark, TaskOrders, TaskReceipts, WorkKind, WorkOrder,
};
use tetdb_store::store::Catalog;

/// Interval between two renewals of a task's mark.
const RENEWED_EVERY: Duration = Duration::from_secs(5);

/// Settings of a task; the mesh does not depend on them.
#[derive(Clone, Debug)]
pub struct TaskSettings {
    /// Local folder for files being written; `None` for folders of the store.
    pub scratch: Option<PathBuf>,
    /// How long a file may be late.
    pub wait: Duration,
}

/// Outcome of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Performed {
    /// Number of cuts or sub-domains done.
    Done(usize),
    /// An earlier attempt had completed the task.
    Already,
}

/// Performs task `task` of the store at `store`, without opening its catalog.
///
/// Effects: new files in the store's folder of tasks. Errors: no plan; a stage that has not begun; those of the mesher. A task
/// that is killed or fails can be performed once more.
pub fn perform(
    store: &Path,
    task: u32,
    settings: &TaskSettings,
    budget: &Budget,
    watch: &Watcher,
) -> Result<Performed, PipelineError> {
    attempt(|| {
        let patience = Patience::of(settings.wait);
        let folder = TaskFolder::of(Catalog::work_dir_at(store));
        let plan = folder.plan(patience)?;
        let stages = stages(plan.n, plan.tasks);
        let Some(stage) = stages.iter().position(|s| s.tasks().contains(&task)) else {
            return Err(PipelineError::Option { option: "task", value: task.to_string() });
        };
        let is_committed = folder.stage()? > stage || folder.committed()?.contains(&task);
        if is_committed || is_done(&folder, &plan, task)? {
            return Ok(Performed::Already);
        }
        let orders = orders_of(&folder, &plan, task, patience)?;
        let is_alive =
            TaskMark { host: host_name(), process: std::process::id(), renewed: 0, error: None };
        let done = marked(&folder, task, &is_alive, || {
            Attempt::new(&folder, &plan, orders, settings).run(patience, budget, watch)
        });
        match &done {
            Ok(_) => folder.mark_path(task).remove_file()?,
            Err(error) => {
                let error = Some(error.to_string());
                // A failed write of the mark must not hide the error itself.
                let _ = folder.set_mark(task, &TaskMark { error, ..is_alive });
            }
        }
        done.map(Performed::Done)
    })?
}

/// True if the task has receipts of this plan, and their files exist.
fn is_done(folder: &TaskFolder, plan: &PlanRecord, task: u32) -> Result<bool, StorageError> {
    let found = read_record::<TaskReceipts>(&folder.receipts_path(task), WorkKind::Receipts)?;
    Ok(found.is_some_and(|found| {
        found.is_ok_and(|receipts| {
            let dir = folder.files_dir(&receipts.attempt);
            let is_there =
                |(name, bytes): &(String, u64)| dir.join(name).bytes().is_ok_and(|b| b == *bytes);
            receipts.run == plan.run && receipts.files.iter().all(is_there)
        })
    }))
}

fn orders_of(
    folder: &TaskFolder,
    plan: &PlanRecord,
    task: u32,
    patience: Patience,
) -> Result<TaskOrders, PipelineError> {
    let path = folder.orders_path(task);
    let found = patience.until(|| {
        let found = read_record::<TaskOrders>(&path, WorkKind::Orders)?;
        // Orders of an earlier plan do not count.
        Ok(found.filter(|found| found.as_ref().map_or(true, |orders| orders.run == plan.run)))
    })?;
    let orders = found.ok_or_else(|| PipelineError::NoPlan {
        path: folder.dir.folder().path().to_owned(),
        reason: format!("task {task} has no orders yet: the stage before it has not been gathered"),
    })?;
    let orders = orders.map_err(|e| damaged(&path, &e))?;
    match orders.task == task {
        true => Ok(orders),
        false => Err(damaged(&path, "it is of another task")),
    }
}

/// Runs `work`, and meanwhile renews the mark that shows that the task is alive.
fn marked<T>(folder: &TaskFolder, task: u32, mark: &TaskMark, work: impl FnOnce() -> T) -> T {
    std::thread::scope(|scope| {
        let (stop, stopped) = channel::<()>();
        scope.spawn(move || {
            loop {
                let now = SystemTime::now().duration_since(UNIX_EPOCH);
                let renewed = now.unwrap_or_default().as_secs();
                // The mark only informs other processes, so the work continues if a write fails.
                let _ = folder.set_mark(task, &TaskMark { renewed, ..mark.clone() });
                if stopped.recv_timeout(RENEWED_EVERY) != Err(RecvTimeoutError::Timeout) {
                    return;
                }
            }
        });
        let _stop = stop;
        work()
    })
}

/// The receipt of an order, and the zones above the order if the task also performs the cuts below it.
type Below = (Option<Vec<CutPlane>>, Receipt);

/// One attempt at a task.
struct Attempt<'a> {
    name: String,
    folder: &'a TaskFolder,
    plan: &'a PlanRecord,
    orders: TaskOrders,
    /// Final folder of the attempt's files.
    files: DiskPath,
    /// Local folder for all files until the end, if there is one.
    local: Option<DiskPath>,
}

impl<'a> Attempt<'a> {
    fn new(
        folder: &'a TaskFolder,
        plan: &'a PlanRecord,
        orders: TaskOrders,
        settings: &TaskSettings,
    ) -> Self {
        let name = attempt_name();
        let local = settings.scratch.as_deref();
        Self {
            files: folder.files_dir(&name),
            local: local.map(|dir| scratch_in(dir, &name)),
            name,
            folder,
            plan,
            orders,
        }
    }

    fn run(
        self,
        patience: Patience,
        budget: &Budget,
        watch: &Watcher,
    ) -> Result<usize, PipelineError> {
        let clock = Instant::now();
        let output = self.local.as_ref().unwrap_or(&self.files);
        let scratch = output.join("scratch");
        let done = (|| {
            scratch.create_dir_all()?;
            self.files.create_dir_all()?;
            let receipts = self.receipts(output, &scratch, patience, budget, watch)?;
            // The scratch folder is empty by now, or nothing in it is of use.
            scratch.remove_dir_all()?;
            let n = receipts.len();
            let record = TaskReceipts {
                run: self.plan.run,
                task: self.orders.task,
                attempt: self.name.clone(),
                files: self.deliver(output, &receipts)?,
                receipts,
                seconds: clock.elapsed().as_secs_f64(),
            };
            write_record(&self.folder.receipts_path(record.task), WorkKind::Receipts, &record)?;
            Ok(n)
        })();
        if let Some(local) = &self.local {
            let _ = local.remove_dir_all();
        }
        if done.is_err() {
            let _ = self.files.remove_dir_all();
        }
        done
    }

    /// Performs all orders.
    fn receipts(
        &self,
        output: &DiskPath,
        scratch: &DiskPath,
        patience: Patience,
        budget: &Budget,
        watch: &Watcher,
    ) -> Result<Vec<Receipt>, PipelineError> {
        let options: MeshOptions = serde_json::from_str(&self.plan.options)
            .map_err(|e| damaged(&self.folder.plan_path(), &e.to_string()))?;
        let options = Options::from(options);
        let bounds = Aabb::around(self.plan.bounds.map(Point::from_array));
        let space = ScratchSpace::new(budget.cap() / 2, scratch);
        let field = SizeField::from_bytes_in(&self.folder.field(patience)?, &space)?
            .with_sources(&options.mesh.sizes, bounds.diagonal())?;
        let _field = budget.lease(field.bytes() as u64, "the size field")?;
        let share = Plan::new(budget.cap(), field.bytes() as u64)?;
        let leased = share.frames + share.redb + share.redb / 2 + share.buffers;
        let _working = budget.lease(leased, "the working mesh")?;
        let worker = Worker {
            place: Workplace {
                store: self.folder.dir.folder(),
                output: output.clone(),
                scratch: scratch.clone(),
            },
            common: Common::new(&options, &field, bounds),
        };
        self.wait_for_inputs(patience)?;
        let orders = &self.orders.orders;
        let at_once = |n: usize| share.shared_by(share.workers().min(n).max(1) as u64);
        // A single subtree gets all the memory: its children are cut only after it is done.
        let (first, later) = (at_once(orders.len()), at_once(usize::MAX));
        let jobs = orders.iter().rev().map(|order| (order.clone(), first));
        let mut receipts = Vec::new();
        let run = &|(order, share): (WorkOrder, Plan), watch: &Watcher| {
            let zones = match &order {
                WorkOrder::Cut(cut) if self.orders.below => Some(cut.zones.clone()),
                _ => None,
            };
            Ok((zones, worker.perform(order, share, watch)?))
        };
        run_jobs(
            jobs.collect(),
            &vec![run as WorkerFn<(WorkOrder, Plan), Below>; share.workers()],
            watch,
            &mut |(zones, receipt)| {
                let mut next = Vec::new();
                if let (Some(zones), Receipt::Cut(cut)) = (zones, &receipt) {
                    // Files of the store stay. A file that this attempt wrote and has cut since is no longer needed.
                    let parent = Catalog::file_name(cut.parent.ranks.first, cut.parent.generation);
                    output.join(parent).remove_file()?;
                    next.extend(cut.below(&zones).map(|order| (WorkOrder::Cut(order), later)));
                    next.reverse();
                }
                receipts.push(receipt);
                Ok(next)
            },
        )?;
        receipts.sort_by_key(|receipt| match receipt {
            Receipt::Cut(cut) => (cut.parent.ranks.first, Reverse(cut.parent.ranks.count)),
            Receipt::Subdomain(sub) => (sub.row.rank, Reverse(1)),
        });
        Ok(receipts)
    }

    /// Waits for input files of the orders that this machine does not see yet.
    fn wait_for_inputs(&self, patience: Patience) -> Result<(), PipelineError> {
        let store = self.folder.dir.folder();
        for order in &self.orders.orders {
            let path = store.join(order.input());
            let found = patience.until(|| Ok(path.is_file().then_some(())))?;
            found.ok_or_else(|| {
                damaged(&path, "it is missing, unless the task has been done meanwhile")
            })?;
        }
        Ok(())
    }

    /// Writes all files durably to the store's folder of tasks; returns their names and lengths.
    fn deliver(
        &self,
        output: &DiskPath,
        receipts: &[Receipt],
    ) -> Result<Vec<(String, u64)>, StorageError> {
        let mut names: BTreeSet<String> = receipts.iter().flat_map(Receipt::files).collect();
        for receipt in receipts {
            if let Receipt::Cut(cut) = receipt {
                names.remove(&Catalog::file_name(cut.parent.ranks.first, cut.parent.generation));
            }
        }
        let mut files = Vec::with_capacity(names.len());
        for name in names {
            let path = self.files.join(&name);
            match &self.local {
                Some(_) => copy(&output.join(&name), &path)?,
                None => path.sync_file()?,
            }
            let bytes = path.bytes()?;
            files.push((name, bytes));
        }
        self.files.sync_dir()?;
        self.folder.dir.sync_dir()?;
        Ok(files)
    }
}
