//! Meshing in tasks that a batch scheduler starts. Each task is a process of its own, on any machine.

use std::path::{Path, PathBuf};
use std::time::Duration;
use tetdb_schema::code::Code;

use super::store::say_how_locked;
use super::tasks_status::{GatherReport, TaskStatus, task_ranges};
use super::{Error, Settings, guarded, job};
use crate::pipeline::{self, Performed, TASKS_MAX, TaskSettings};
use tetdb_base::storage::{Budget, host_name};
use tetdb_store::store::{Catalog, StoreError};

/// Default time that an expected file may be late. Cluster file systems may cache the contents of a folder for up to a minute.
const WAIT: Duration = Duration::from_secs(60);

/// The remaining work of an unfinished store, divided into tasks.
///
/// One process creates the coarse mesh ([`Mesher::coarse_only`](super::Mesher::coarse_only)) and plans the tasks. The tasks of a stage
/// run in any order, on any machines that share the store's folder, and may be repeated. Between stages, one process gathers their
/// results. The mesh is the same as that of a single process.
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// use tetdb::{Mesher, Store, Surface, Tasks};
///
/// Mesher::new(Surface::sample("box,h=0.1")?).coarse_only(true).create_unfinished(&path)?;
/// let tasks = Tasks::of(&path);
/// let mut next = Some(tasks.plan(2)?);
/// while let Some(stage) = next {
///     for task in stage {
///         tasks.run(task)?; // on a machine of the cluster
///     }
///     next = tasks.gather()?;
/// }
/// let store = Store::open(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Tasks {
    store: PathBuf,
    settings: Settings,
    how: TaskSettings,
}

impl Tasks {
    /// Tasks of the store at `path`.
    pub fn of(path: impl AsRef<Path>) -> Self {
        Self {
            store: path.as_ref().to_owned(),
            settings: Settings::new(),
            how: TaskSettings { scratch: None, wait: WAIT },
        }
    }

    /// Sets memory, threads and progress of each call.
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// Sets a local folder where tasks write files before copying them to the store. Default: tasks write in the store's folder.
    pub fn scratch(mut self, dir: impl AsRef<Path>) -> Self {
        self.how.scratch = Some(dir.as_ref().to_owned());
        self
    }

    /// Sets how long an expected file may be late. Default: one minute.
    pub fn wait(mut self, wait: Duration) -> Self {
        self.how.wait = wait;
        self
    }

    /// Plans for about `n` concurrent tasks, at most 1,000 a stage. Returns the tasks that can run now.
    ///
    /// Repeating the same plan changes nothing.
    ///
    /// Errors: `no-tasks` if the store is finished or has no coarse mesh; `busy`; `usage`.
    pub fn plan(&self, n: u32) -> Result<Vec<u32>, Error> {
        if !(1..=TASKS_MAX).contains(&n) {
            let message = format!("{n} tasks cannot be planned");
            return Err(Error::new(Code::Usage, message).with_help("from 1 to 1000"));
        }
        guarded(&self.settings, || {
            let mut catalog = self.open()?;
            let options = catalog.job()?.options;
            pipeline::plan_tasks(&mut catalog, n, &options)?;
            let gathered = pipeline::gather(&mut catalog, Duration::ZERO)?;
            Ok(gathered.left.into_iter().map(|(task, _)| task).collect())
        })
    }

    /// Runs a task. Returns `false` if the task was already done. The store's catalog is opened only if no tasks are planned.
    ///
    /// Errors: `no-tasks` if the stage of the task has not begun or the store is finished; `task-file`; errors of a run, with the name of this machine.
    pub fn run(&self, task: u32) -> Result<bool, Error> {
        guarded(&self.settings, || {
            let budget = Budget::new(self.settings.cap()?);
            let watch = self.settings.watcher();
            self.refuse_finished()?;
            let done = pipeline::perform(&self.store, task, &self.how, &budget, &watch);
            let done = done.map_err(|error| {
                let mut error = Error::from(error);
                error.add(&format!(" (task {task} on {})", host_name()));
                error
            })?;
            Ok(done != Performed::Already)
        })
    }

    /// Commits the results of tasks. Returns the tasks that can run now, or `None` if the store is finished.
    ///
    /// Errors: `tasks-left` with the numbers of tasks of the stage that must be repeated; `no-tasks`; `busy`.
    pub fn gather(&self) -> Result<Option<Vec<u32>>, Error> {
        let gathered = self.gather_reported()?;
        Ok((!gathered.finished).then_some(gathered.next))
    }

    /// Like [`Tasks::gather`], with a report. Errors: as [`Tasks::gather`].
    pub fn gather_reported(&self) -> Result<GatherReport, Error> {
        guarded(&self.settings, || {
            let mut catalog = self.open()?;
            let gathered = pipeline::gather(&mut catalog, self.how.wait)?;
            if gathered.is_finished {
                catalog.close()?;
                return Ok(gathered.into());
            }
            let first = gathered.left.first();
            match first.filter(|_| gathered.is_begun()) {
                None => Ok(gathered.into()),
                Some((task, why)) => {
                    let left = gathered.left.len();
                    let message = format!(
                        "{left} of {} tasks of stage {} have to be done again: {}; of task {task}: {why}",
                        gathered.tasks.len(),
                        gathered.stage[0] + 1,
                        task_ranges(gathered.left.iter().map(|(task, _)| *task)),
                    );
                    let error = Error::new(Code::TasksLeft, message).at(self.store.display());
                    Err(error.with_help("do these tasks again, then gather again"))
                }
            }
        })
    }

    /// Reports the progress of the tasks; `None` if none are planned. Nothing is changed. Errors: damage.
    pub fn status(&self) -> Result<Option<TaskStatus>, Error> {
        Ok(pipeline::status(&self.store)?.map(TaskStatus::from))
    }

    /// Errors: `no-tasks` for a store without a plan that is finished, where waiting for the plan would not help; `no-such-store`.
    fn refuse_finished(&self) -> Result<(), Error> {
        if pipeline::is_planned(&self.store) {
            return Ok(());
        }
        let is_finished = match Catalog::open(&self.store) {
            Ok(mut catalog) => catalog.state()?.is_finished(),
            Err(error @ StoreError::NotFound { .. }) => return Err(error.into()),
            // Another process writes it, or it is not all there yet.
            Err(_) => false,
        };
        match is_finished {
            false => Ok(()),
            true => {
                let message = format!("{} is finished: no task is left", self.store.display());
                Err(Error::new(Code::NoTasks, message).with_help("go on with the finished mesh"))
            }
        }
    }

    fn open(&self) -> Result<Catalog, Error> {
        let mut catalog = Catalog::open_writable(&self.store)?;
        say_how_locked(&catalog, &self.settings);
        job::check_recipe(&mut catalog)?;
        Ok(catalog)
    }
}
