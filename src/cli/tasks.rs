//! The commands `plan`, `work` and `gather`.

use std::env;
use std::path::PathBuf;
use std::time::Duration;

use serde_json::{Value, json};

use super::args::{GatherArgs, PlanArgs, WorkArgs};
use super::console::Console;
use super::failure::Failure;
use super::task_scripts::Script;
use super::words::quoted;
use super::{memory, threads};
use tetdb_engine::api::{ExportOptions, TaskStage, TaskStatus, Tasks, task_ranges};

/// Number of sub-domains per task in the last stage, so that tasks end at about the same time.
const SUBDOMAINS_PER_TASK: u32 = 4;
/// Default memory cap of a task.
const MEMORY_PER_TASK: u64 = 4 << 30;

pub fn plan(args: &PlanArgs, console: &Console) -> Result<u8, Failure> {
    let memory_bytes =
        memory::requested(args.memory_per_task.as_deref())?.unwrap_or(MEMORY_PER_TASK);
    if let Some(out) = &args.export {
        ExportOptions::new().pieces().check(out)?;
    }
    let tasks = Tasks::of(&args.store).settings(console.settings(None, None));
    tasks.plan(args.tasks)?;
    console.done();
    let Some(planned) = tasks.status()? else {
        console.note("nothing is left to be planned: the store is finished");
        return Ok(0);
    };
    let suits = SUBDOMAINS_PER_TASK * args.tasks;
    if planned.subdomains < suits {
        console.note(&format!(
            "note: the mesh has {} sub-domains; with --subdomains {suits} {} tasks would have as much to do each",
            planned.subdomains, args.tasks
        ));
    }
    let script = Script {
        store: std::path::absolute(&args.store).unwrap_or_else(|_| args.store.clone()),
        program: env::current_exe().unwrap_or_else(|_| "tetdb".into()),
        memory_bytes,
        threads: args.threads_per_task.max(1),
        scratch: args.scratch.clone(),
        export: (args.export.as_ref())
            .map(|out| std::path::absolute(out).unwrap_or_else(|_| out.clone())),
        planned: &planned,
    };
    if console.is_json() {
        let mut answer = object(&planned);
        answer["schema"] = json!(1);
        answer["store"] = json!(args.store.display().to_string());
        answer["subdomains_suited"] = json!(suits.max(planned.subdomains));
        console.answer(&answer);
        return Ok(0);
    }
    let text = match &args.engine {
        engine if engine.slurm => script.slurm(),
        engine if engine.parallel => script.parallel(),
        engine if engine.snakemake => script.snakemake(),
        _ => script.list(),
    };
    console.line(text.trim_end());
    Ok(0)
}

pub fn work(args: &WorkArgs, console: &Console) -> Result<u8, Failure> {
    let cap = memory::requested(args.memory.as_deref())?;
    let settings = console.settings(cap, threads::requested(args.threads)?);
    let mut tasks = Tasks::of(&args.store).wait(Duration::from_secs(args.wait));
    if let Some(dir) = args.scratch.clone().or_else(scratch_of_machine) {
        tasks = tasks.scratch(dir);
    }
    let is_new = tasks.settings(settings).run(args.task)?;
    console.done();
    let words = match is_new {
        true => "done",
        false => "done before",
    };
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "task": args.task, "done_before": !is_new, "peak_bytes": memory::peak() }));
    } else {
        console.note(&format!("task {}: {words}", args.task));
    }
    Ok(0)
}

/// The folder that the scheduler or the system provides for a job on this machine.
pub(super) fn scratch_of_machine() -> Option<PathBuf> {
    let set = |name| env::var_os(name).filter(|dir| !dir.is_empty());
    let dir = set("SLURM_TMPDIR").or_else(|| set("TMPDIR"))?;
    Some(PathBuf::from(dir)).filter(|dir| dir.is_dir())
}

pub fn gather(args: &GatherArgs, console: &Console) -> Result<u8, Failure> {
    let tasks = Tasks::of(&args.store)
        .settings(console.settings(None, None))
        .wait(Duration::from_secs(args.wait));
    let gathered = tasks.gather_reported()?;
    console.done();
    if console.is_json() {
        let mut answer = json!(gathered);
        answer["schema"] = json!(1);
        console.answer(&answer);
    } else if gathered.finished {
        console.line(&format!("{} is finished", args.store.display()));
        let store = quoted(&args.store);
        console.note(&format!("next: `tetdb resume {store}` verifies it"));
    } else {
        console.line(&format!(
            "stage {} of {}: tasks {} can begin",
            gathered.stage + 1,
            gathered.stages,
            task_ranges(gathered.next)
        ));
    }
    Ok(0)
}

/// The tasks of a store as a JSON object, for `info`.
pub(super) fn object(status: &TaskStatus) -> Value {
    json!(status)
}

/// Prints the tasks of a store for people.
pub(super) fn print(status: &TaskStatus, console: &Console) {
    let TaskStatus { done, running, failed, waiting, stage, stages, .. } = status;
    let current = stages.get(*stage);
    let range = current.map_or(0..0, TaskStage::range);
    let does = current.map_or("", |stage| stage.does);
    console.line(&format!(
        "tasks {}-{} of stage {} of {} ({does}): {done} done, {running} running, {failed} failed, {waiting} waiting",
        range.start,
        range.end.saturating_sub(1),
        stage + 1,
        stages.len(),
    ));
    for report in &status.states {
        if let Some(why) = &report.why {
            console.line(&format!("  task {} has to be done again: {why}", report.task));
        }
    }
    if let Some(mean) = status.task_mean_s {
        let left = (running + failed + waiting) as f64 * mean;
        console.line(&format!(
            "{mean:.0} s a task so far: {left:.0} s of work are left in this stage, shared by the tasks that run at once"
        ));
    }
}
