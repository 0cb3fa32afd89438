//! Progress of the tasks of a store.

use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::folder::{Patience, TaskFolder, read_record};
use super::schedule::{Stage, stages};
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{StorageError, is_process_gone};
use tetdb_schema::work::{TaskMark, TaskReceipts, WorkKind};
use tetdb_store::store::Catalog;

/// Seconds without a renewed mark after which a task counts as dead: twelve renewal intervals.
const SILENT: u64 = 60;

/// State of a task.
#[derive(Clone, Debug, PartialEq)]
pub enum TaskState {
    /// The task has not begun.
    Waiting,
    /// The task is running.
    Running {
        /// Host of the task.
        host: String,
    },
    /// The task ended without a usable receipt and must be performed once more.
    Failed {
        /// Host, if known, and reason.
        why: String,
    },
    /// The task is done, and its receipts can be gathered.
    Done {
        /// Wall time of the task.
        seconds: f64,
    },
}

/// The plan of a store, and the progress of its tasks.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Number of sub-domains.
    pub subdomains: u32,
    /// Requested number of tasks at once.
    pub tasks: u32,
    /// All stages, in order.
    pub stages: Vec<Stage>,
    /// Number of the current stage, from 0.
    pub stage: usize,
    /// States of the current stage's tasks that have orders, by task number.
    pub states: Vec<(u32, TaskState)>,
}

impl Planned {
    /// Numbers of tasks that are done, running, failed and waiting.
    pub fn counts(&self) -> [usize; 4] {
        let mut counts = [0; 4];
        for (_, state) in &self.states {
            counts[match state {
                TaskState::Done { .. } => 0,
                TaskState::Running { .. } => 1,
                TaskState::Failed { .. } => 2,
                TaskState::Waiting => 3,
            }] += 1;
        }
        counts
    }

    /// Mean seconds of the finished tasks of this stage; `None` while there is none.
    pub fn seconds_mean(&self) -> Option<f64> {
        let seconds = self.states.iter().filter_map(|(_, state)| match state {
            TaskState::Done { seconds } => Some(*seconds),
            _ => None,
        });
        let (n, sum) = seconds.fold((0, 0.0), |(n, sum), s| (n + 1, sum + s));
        (n > 0).then(|| sum / f64::from(n))
    }
}

/// Returns the progress of the tasks of the store at `store`; `None` if no tasks are planned. Effects: none; the catalog is not
/// opened.
pub fn status(store: &Path) -> Result<Option<Planned>, PipelineError> {
    let folder = TaskFolder::of(Catalog::work_dir_at(store));
    // The folder of a finished store is about to be removed.
    if !folder.plan_path().exists() {
        return Ok(None);
    }
    let plan = folder.plan(Patience::of(Duration::ZERO))?;
    let stages = stages(plan.n, plan.tasks);
    let stage = folder.stage()?;
    let range = stages.get(stage).map_or(0..0, Stage::tasks);
    let committed = folder.committed()?;
    let is_open = |task: &u32| !committed.contains(task) && folder.orders_path(*task).exists();
    let open = range.filter(is_open);
    let states = open.map(|task| Ok((task, state(&folder, plan.run, task)?)));
    Ok(Some(Planned {
        subdomains: plan.n,
        tasks: plan.tasks,
        states: states.collect::<Result<_, StorageError>>()?,
        stages,
        stage,
    }))
}

fn state(folder: &TaskFolder, run: u64, task: u32) -> Result<TaskState, StorageError> {
    let found = read_record::<TaskReceipts>(&folder.receipts_path(task), WorkKind::Receipts)?;
    let mark = folder.mark(task);
    Ok(match (found, mark) {
        (Some(Ok(receipts)), _) if receipts.run == run => {
            TaskState::Done { seconds: receipts.seconds }
        }
        (Some(Err(why)), _) => {
            TaskState::Failed { why: format!("its receipt cannot be used: {why}") }
        }
        (_, Some(TaskMark { host, error: Some(error), .. })) => {
            TaskState::Failed { why: format!("on {host}: {error}") }
        }
        (_, Some(mark)) if is_alive(&mark) => TaskState::Running { host: mark.host },
        (_, Some(mark)) => {
            TaskState::Failed { why: format!("on {}: it ended without a word", mark.host) }
        }
        (_, None) => TaskState::Waiting,
    })
}

fn is_alive(mark: &TaskMark) -> bool {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let now = now.unwrap_or_default().as_secs();
    mark.error.is_none()
        && mark.renewed + SILENT > now
        && !is_process_gone(&mark.host, mark.process)
}

/// Returns whether tasks of the store at `store` are planned.
pub fn is_planned(store: &Path) -> bool {
    TaskFolder::of(Catalog::work_dir_at(store)).plan_path().is_file()
}

/// Returns the number and host of a task of the store at `store` that is running, if there is one.
pub fn is_being_worked(store: &Path) -> Result<Option<(u32, String)>, PipelineError> {
    let running = |(task, state)| match state {
        TaskState::Running { host } => Some((task, host)),
        _ => None,
    };
    Ok(status(store)?.and_then(|planned| planned.states.into_iter().find_map(running)))
}
