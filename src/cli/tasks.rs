//! `plan`, `work` and `gather`.

use std::env;
use std::path::PathBuf;
use std::time::Duration;

use serde_json::{Value, json};

use super::args::{GatherArgs, PlanArgs, WorkArgs};
use super::console::Console;
use super::failure::Failure;
use super::task_scripts::{Script, kind};
use super::{memory, threads};
use tetdb_engine::api::tasks::ranges;
use tetdb_engine::api::{Error, Tasks};
use tetdb_engine::pipeline::{Planned, TaskState};
use tetdb_io::write::{ExportSelection, check};

/// Sub-domains a task of the last stage should have, so that tasks end at about the same time.
const SUBDOMAINS_PER_TASK: u32 = 4;
/// What a task holds at most where nothing is asked for.
const MEMORY_PER_TASK: u64 = 4 << 30;

pub fn plan(args: &PlanArgs, console: &Console) -> Result<u8, Failure> {
    let memory_bytes = memory::asked(args.memory_per_task.as_deref())?.unwrap_or(MEMORY_PER_TASK);
    if let Some(out) = &args.export {
        let pieces = ExportSelection { pieces: true, ..ExportSelection::default() };
        check(out, &pieces).map_err(Error::from)?;
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
    let cap = memory::asked(args.memory.as_deref())?;
    let settings = console.settings(cap, threads::asked(args.threads)?);
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

/// The folder that the scheduler or the system gives a job on this machine.
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
    let next: Vec<u32> = gathered.left.iter().map(|(task, _)| *task).collect();
    if console.is_json() {
        console.answer(&json!({
            "schema": 1, "committed": gathered.committed, "next": next, "stage": gathered.stage[0],
            "stages": gathered.stage[1], "finished": gathered.is_finished,
        }));
    } else if gathered.is_finished {
        console.line(&format!("{} is finished", args.store.display()));
        console.note(&format!("next: `tetdb resume {}` verifies it", args.store.display()));
    } else {
        console.line(&format!(
            "stage {} of {}: tasks {} can begin",
            gathered.stage[0] + 1,
            gathered.stage[1],
            ranges(next)
        ));
    }
    Ok(0)
}

/// The tasks of a store for `info`.
pub(super) fn object(planned: &Planned) -> Value {
    let [done, running, failed, waiting] = planned.counts();
    let states: Vec<Value> =
        (planned.states.iter()).map(|(task, state)| state_object(*task, state)).collect();
    let stages: Vec<Value> = (planned.stages.iter())
        .map(|s| json!({ "does": kind(s.kind), "first_task": s.first, "tasks": s.tasks().len() }))
        .collect();
    json!({
        "subdomains": planned.subdomains, "tasks": planned.tasks, "stage": planned.stage, "stages": stages,
        "done": done, "running": running, "failed": failed, "waiting": waiting,
        "task_mean_s": planned.seconds_mean(), "states": states,
    })
}

fn state_object(task: u32, state: &TaskState) -> Value {
    let (word, host, why, seconds) = match state {
        TaskState::Waiting => ("waiting", None, None, None),
        TaskState::Running { host } => ("running", Some(host), None, None),
        TaskState::Failed { why } => ("failed", None, Some(why), None),
        TaskState::Done { seconds } => ("done", None, None, Some(seconds)),
    };
    json!({ "task": task, "state": word, "host": host, "why": why, "wall_s": seconds })
}

/// The same for people.
pub(super) fn print(planned: &Planned, console: &Console) {
    let [done, running, failed, waiting] = planned.counts();
    let range = planned.range();
    let what = planned.stages.get(planned.stage).map_or("", |s| kind(s.kind));
    console.line(&format!(
        "tasks {}-{} of stage {} of {} ({what}): {done} done, {running} running, {failed} failed, {waiting} waiting",
        range.start,
        range.end.saturating_sub(1),
        planned.stage + 1,
        planned.stages.len(),
    ));
    for (task, state) in &planned.states {
        if let TaskState::Failed { why } = state {
            console.line(&format!("  task {task} has to be done again: {why}"));
        }
    }
    if let Some(mean) = planned.seconds_mean() {
        let left = (running + failed + waiting) as f64 * mean;
        console.line(&format!(
            "{mean:.0} s a task so far: {left:.0} s of work are left in this stage, shared by the tasks that run at once"
        ));
    }
}
