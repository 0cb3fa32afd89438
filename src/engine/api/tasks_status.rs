//! Progress of the tasks of a store.

use crate::pipeline::{Gathered, Planned, Stage, StageKind, TaskState};
use serde::Serialize;
use std::ops::Range;

/// The plan of a store and the progress of its tasks; see [`Tasks::status`](super::Tasks::status).
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TaskStatus {
    /// Sub-domains of the mesh.
    pub subdomains: u32,
    /// Planned number of concurrent tasks.
    pub tasks: u32,
    /// Position of the current stage in `stages`.
    pub stage: usize,
    /// All stages, in order.
    pub stages: Vec<TaskStage>,
    /// Tasks of the current stage that are done.
    pub done: usize,
    /// Tasks that are running.
    pub running: usize,
    /// Tasks that ended without a result.
    pub failed: usize,
    /// Tasks that have not begun.
    pub waiting: usize,
    /// Mean seconds of the tasks that are done; `None` while there is none.
    pub task_mean_s: Option<f64>,
    /// The tasks of the current stage that are not committed.
    pub states: Vec<TaskReport>,
}

/// Tasks that can run at once, after all tasks of the earlier stages.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TaskStage {
    /// The work of each task, in words.
    pub does: &'static str,
    /// Number of the first task, from 1.
    pub first_task: u32,
    /// Number of tasks.
    pub tasks: u32,
}

impl TaskStage {
    /// Numbers of the tasks of this stage.
    pub fn range(&self) -> Range<u32> {
        self.first_task..self.first_task + self.tasks
    }
}

/// One task of the current stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskReport {
    /// Number of the task.
    pub task: u32,
    /// `waiting`, `running`, `failed` or `done`.
    pub state: &'static str,
    /// Machine that runs the task.
    pub host: Option<String>,
    /// Place and reason of the failure.
    pub why: Option<String>,
    /// Run time in seconds.
    pub wall_s: Option<f64>,
}

/// The result of [`Tasks::gather_reported`](super::Tasks::gather_reported).
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct GatherReport {
    /// Tasks whose results were committed.
    pub committed: Vec<u32>,
    /// Tasks that can run now.
    pub next: Vec<u32>,
    /// Number of the stage of these tasks, from 0.
    pub stage: usize,
    /// Number of stages.
    pub stages: usize,
    /// True if all tasks are done.
    pub finished: bool,
}

impl From<Gathered> for GatherReport {
    fn from(gathered: Gathered) -> Self {
        let [stage, stages] = gathered.stage;
        Self {
            committed: gathered.committed,
            next: gathered.left.into_iter().map(|(task, _)| task).collect(),
            stage,
            stages,
            finished: gathered.is_finished,
        }
    }
}

impl From<Planned> for TaskStatus {
    fn from(planned: Planned) -> Self {
        let [done, running, failed, waiting] = planned.counts();
        Self {
            subdomains: planned.subdomains,
            tasks: planned.tasks,
            stage: planned.stage,
            stages: planned.stages.iter().map(TaskStage::from).collect(),
            done,
            running,
            failed,
            waiting,
            task_mean_s: planned.seconds_mean(),
            states: planned.states.into_iter().map(TaskReport::from).collect(),
        }
    }
}

impl From<&Stage> for TaskStage {
    fn from(stage: &Stage) -> Self {
        let does = match stage.kind {
            StageKind::Cuts => "one cut each",
            StageKind::Subtrees => "all cuts of a part",
            StageKind::Subdomains => "sub-domains",
        };
        Self { does, first_task: stage.first, tasks: stage.tasks().len() as u32 }
    }
}

impl From<(u32, TaskState)> for TaskReport {
    fn from((task, state): (u32, TaskState)) -> Self {
        let mut report = Self { task, state: "waiting", host: None, why: None, wall_s: None };
        match state {
            TaskState::Waiting => {}
            TaskState::Running { host } => (report.state, report.host) = ("running", Some(host)),
            TaskState::Failed { why } => (report.state, report.why) = ("failed", Some(why)),
            TaskState::Done { seconds } => {
                (report.state, report.wall_s) = ("done", Some(seconds));
            }
        }
        report
    }
}

/// Formats task numbers as batch schedulers do: `3,7-9`. The numbers must ascend.
pub fn task_ranges(numbers: impl IntoIterator<Item = u32>) -> String {
    let mut ranges: Vec<[u32; 2]> = Vec::new();
    for n in numbers {
        match ranges.last_mut() {
            Some([_, last]) if *last + 1 == n => *last = n,
            _ => ranges.push([n, n]),
        }
    }
    let words = ranges.iter().map(|[first, last]| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    });
    words.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_listed_as_schedulers_want_them() {
        assert_eq!(task_ranges([]), "");
        assert_eq!(task_ranges([3]), "3");
        assert_eq!(task_ranges([1, 2, 3, 5, 7, 8]), "1-3,5,7-8");
    }
}
