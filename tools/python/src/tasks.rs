//! A mesh by tasks, each in a process of its own.

use std::path::PathBuf;
use std::time::Duration;

use pyo3::prelude::*;
use tetdb::{CancelToken, Tasks};

use crate::failure::Failure;
use crate::run::SettingWords;
use crate::watched::watched;

/// Where tasks write before they copy, and how many seconds a file may be late.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct TaskWords {
    scratch: Option<PathBuf>,
    wait: Option<f64>,
}

/// `work` with the tasks of the store at `path`.
fn with<T: Send>(
    py: Python<'_>,
    path: PathBuf,
    how: TaskWords,
    settings: SettingWords,
    work: impl FnOnce(Tasks) -> Result<T, tetdb::Error> + Send,
) -> PyResult<T> {
    let token = CancelToken::new();
    let mut tasks = Tasks::of(path).settings(settings.settings(&token, None));
    if let Some(dir) = how.scratch {
        tasks = tasks.scratch(dir);
    }
    if let Some(seconds) = how.wait {
        tasks = tasks.wait(Duration::from_secs_f64(seconds));
    }
    watched(py, &token, None, || work(tasks).map_err(Failure::from))
}

#[pyfunction]
pub fn plan(
    py: Python<'_>,
    path: PathBuf,
    n: u32,
    how: TaskWords,
    settings: SettingWords,
) -> PyResult<Vec<u32>> {
    with(py, path, how, settings, |tasks| tasks.plan(n))
}

#[pyfunction]
pub fn run_task(
    py: Python<'_>,
    path: PathBuf,
    task: u32,
    how: TaskWords,
    settings: SettingWords,
) -> PyResult<bool> {
    with(py, path, how, settings, |tasks| tasks.run(task))
}

#[pyfunction]
pub fn gather(
    py: Python<'_>,
    path: PathBuf,
    how: TaskWords,
    settings: SettingWords,
) -> PyResult<Option<Vec<u32>>> {
    with(py, path, how, settings, |tasks| tasks.gather())
}
