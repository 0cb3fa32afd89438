//! One task, on whatever machine: orders in, files and receipts out.

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
use crate::pipeline::workers::{Hand, work_off};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Budget, DiskPath, ScratchSpace, StorageError, attempt, host_name};
use tetdb_kernel::sizing::SizeField;
use tetdb_schema::tree::CutPlane;
use tetdb_schema::work::{
    PlanRecord, Receipt, TaskMark, TaskOrders, TaskReceipts, WorkKind, WorkOrder,
};
use tetdb_store::store::Catalog;

/// Between two marks that a task lives.
const RENEWED_EVERY: Duration = Duration::from_secs(5);

/// How a task works; none of it changes the mesh.
#[derive(Clone, Debug)]
pub struct TaskSettings {
    /// A folder of this machine for what is being written; `None`: beside the store.
    pub scratch: Option<PathBuf>,
    /// How long a file may be late.
    pub wait: Duration,
}

/// What became of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Performed {
    /// So many cuts or sub-domains are done.
    Done(usize),
    /// It had been done before.
    Already,
}

/// Does task `task` of the store at `store`, and never opens its catalog.
///
/// Effects: new files in the store's folder of tasks. Errors: no plan, or one whose stage has not come; those of the mesher. A task that is
/// killed or fails can be done again.
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
        if folder.stage()? > stage || is_done(&folder, &plan, task)? {
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
                // The error itself is what counts.
                let _ = folder.set_mark(task, &TaskMark { error, ..is_alive });
            }
        }
        done.map(Performed::Done)
    })?
}

/// Whether there are receipts of this plan for the task, with their files.
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
        // Those of an earlier plan are as good as none.
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

/// Does `work` and says all the while that it is alive.
fn marked<T>(folder: &TaskFolder, task: u32, mark: &TaskMark, work: impl FnOnce() -> T) -> T {
    std::thread::scope(|scope| {
        let (stop, stopped) = channel::<()>();
        scope.spawn(move || {
            loop {
                let now = SystemTime::now().duration_since(UNIX_EPOCH);
                let renewed = now.unwrap_or_default().as_secs();
                // For others to look at: the work goes on without it.
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

/// What an order did, and the zones above it where the cuts below it belong to the task.
type Below = (Option<Vec<CutPlane>>, Receipt);

/// One attempt at a task.
struct Attempt<'a> {
    name: String,
    folder: &'a TaskFolder,
    plan: &'a PlanRecord,
    orders: TaskOrders,
    /// Where its files are in the end.
    files: DiskPath,
    /// Where everything is until then, when that is elsewhere.
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
            // Empty by now, or of no use to anybody.
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

    /// Does all orders.
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
        // One part alone has all the memory: its children come when it is done.
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
        work_off(
            jobs.collect(),
            &vec![run as Hand<(WorkOrder, Plan), Below>; share.workers()],
            watch,
            &mut |(zones, receipt)| {
                let mut next = Vec::new();
                if let (Some(zones), Receipt::Cut(cut)) = (zones, &receipt) {
                    // What is in the store stays; only what this attempt wrote and has cut since is of no use any more.
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

    /// Files of orders that this machine does not see yet.
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

    /// Makes all files last where everybody finds them; their names and lengths.
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
