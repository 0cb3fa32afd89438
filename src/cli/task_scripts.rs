//! Scripts that run the stages of a plan, one for each kind of scheduler.
//!
//! Each stage is an array of tasks followed by a `gather`, which fails if any task has no receipt. A script that is run again therefore
//! continues.

use std::fmt::Write;
use std::path::PathBuf;

use super::words::{quoted, single_quoted};
use tetdb_engine::api::{TaskStage, TaskStatus};

/// Memory of a task that does not count towards its cap: code and stacks.
const MEMORY_BESIDE: u64 = 64 << 20;

/// Data for writing a script.
pub(super) struct Script<'a> {
    pub store: PathBuf,
    pub program: PathBuf,
    pub memory_bytes: u64,
    pub threads: usize,
    pub scratch: Option<PathBuf>,
    /// A mesh file to write in pieces at the end.
    pub export: Option<PathBuf>,
    pub planned: &'a TaskStatus,
}

impl Script<'_> {
    /// Incomplete stages, with their numbers from 1.
    fn stages(&self) -> impl Iterator<Item = (usize, &TaskStage)> {
        (1..).zip(&self.planned.stages).skip(self.planned.stage)
    }

    /// The command of a task. The shell or the scheduler inserts the number.
    fn work(&self, task: &str) -> String {
        let mut line = format!(
            "{} work {} --task {task} --memory {}MiB --threads {}",
            quoted(&self.program),
            quoted(&self.store),
            self.memory_bytes >> 20,
            self.threads,
        );
        if let Some(dir) = &self.scratch {
            line += &format!(" --scratch {}", quoted(dir));
        }
        line
    }

    /// The command for exporting one share, if an export is requested, and the number of shares.
    fn export(&self, share: &str) -> Option<(String, u32)> {
        let of = self.planned.tasks.min(self.planned.subdomains);
        let line = format!(
            "{} export {} {} --pieces --share {share}/{of} --memory {}MiB",
            quoted(&self.program),
            quoted(&self.store),
            quoted(self.export.as_ref()?),
            self.memory_bytes >> 20,
        );
        Some((line, of))
    }

    fn command(&self, name: &str) -> String {
        format!("{} {name} {}", quoted(&self.program), quoted(&self.store))
    }

    fn head(&self) -> String {
        let planned = self.planned;
        format!(
            "#!/bin/sh\n# {} sub-domains, {} tasks at once.\nset -eu\n",
            planned.subdomains, planned.tasks
        )
    }

    /// A Slurm script: job arrays with dependencies. A gather runs even if its array failed, and stops the later stages if tasks are
    /// left.
    pub fn slurm(&self) -> String {
        let mut text = self.head();
        let megabytes = (self.memory_bytes + MEMORY_BESIDE).div_ceil(1 << 20);
        text += "# SBATCH may hold more options of sbatch, such as SBATCH='--partition=long --time=4:00:00'.\n";
        text += "submit() { sbatch --parsable --kill-on-invalid-dep=yes ${SBATCH:-} \"$@\" | cut -d';' -f1; }\n";
        let (mut after, mut and) = (String::new(), "");
        for (number, stage) in self.stages() {
            let offset = stage.first_task - 1;
            let work = self.work(&format!("$((SLURM_ARRAY_TASK_ID + {offset}))"));
            let _ = writeln!(
                text,
                "# Stage {number}: {}.\na=$(submit{after} --job-name=tetdb-{number} --requeue --array=1-{} --mem={megabytes}M --cpus-per-task={} --wrap {})\n\
                 g=$(submit --dependency=afterany:$a{and} --job-name=tetdb-gather --mem=1G --wrap {})",
                stage.does,
                stage.range().len(),
                self.threads,
                single_quoted(&work),
                single_quoted(&self.command("gather")),
            );
            after = " --dependency=afterok:$g".to_owned();
            // Tasks cancelled because a stage failed count as ended, although there is nothing to gather.
            and = ",afterok:$g";
        }
        let resume = format!("{} --memory {}MiB", self.command("resume"), self.memory_bytes >> 20);
        let _ = writeln!(
            text,
            "# Verified as one.\nv=$(submit{after} --job-name=tetdb-verify --mem={megabytes}M --cpus-per-task={} --wrap {})",
            self.threads,
            single_quoted(&resume),
        );
        if let Some((line, of)) = self.export("$SLURM_ARRAY_TASK_ID") {
            let _ = writeln!(
                text,
                "# Exported in pieces.\nsubmit --dependency=afterok:$v --job-name=tetdb-export --requeue --array=1-{of} --mem={megabytes}M --wrap {}",
                single_quoted(&line),
            );
        }
        text
    }

    /// A GNU parallel script. Failed tasks are tried three times; the gather then reports what is left.
    pub fn parallel(&self) -> String {
        let mut text = self.head();
        text += "# PARALLEL_OPTIONS may hold more options of parallel, such as '--jobs 4' or '--sshloginfile hosts'.\n";
        for (number, stage) in self.stages() {
            let tasks = stage.range();
            let _ = writeln!(
                text,
                "# Stage {number}: {}.\nseq {} {} | parallel ${{PARALLEL_OPTIONS:-}} --retries 3 {} || :\n{}",
                stage.does,
                tasks.start,
                tasks.end - 1,
                single_quoted(&self.work("{}")),
                self.command("gather"),
            );
        }
        let _ = writeln!(text, "# Verified as one.\n{}", self.command("resume"));
        if let Some((line, of)) = self.export("{}") {
            let _ = writeln!(
                text,
                "# Exported in pieces.\nseq {of} | parallel ${{PARALLEL_OPTIONS:-}} --retries 3 {}",
                single_quoted(&line),
            );
        }
        text
    }

    /// A Snakemake file. Flag files in a folder of their own mark finished work.
    pub fn snakemake(&self) -> String {
        let mut text = String::from("# Flags of what is done; the results are in the store.\n");
        let flags = self.store.with_extension("tasks");
        let flag = |name: String| format!("{:?}", flags.join(name).to_string_lossy());
        let last = self.planned.stages.len();
        let export = self.export("{wildcards.share}");
        if let Some((line, of)) = &export {
            let _ = writeln!(
                text,
                "rule exported:\n    input: expand({0}, share=range(1, {of} + 1))\n\nrule export:\n    input: {1}\n    output: touch({0})\n    shell: {line:?}\n",
                flag("share-{share}".to_owned()),
                flag("verified".to_owned()),
            );
        }
        let _ = writeln!(
            text,
            "rule verified:\n    input: {}\n    output: touch({})\n    shell: {:?}\n",
            flag(format!("stage-{last}")),
            flag("verified".to_owned()),
            self.command("resume"),
        );
        for (number, stage) in self.stages() {
            let tasks = stage.range();
            let before = match number == self.planned.stage + 1 {
                true => String::new(),
                false => format!("    input: {}\n", flag(format!("stage-{}", number - 1))),
            };
            let _ = writeln!(
                text,
                "# {}.\nrule work_{number}:\n{before}    output: touch({})\n    threads: {}\n    resources: mem_mb={}\n    retries: 3\n    shell: {:?}\n",
                stage.does,
                flag(format!("task-{number}-{{task}}")),
                self.threads,
                (self.memory_bytes + MEMORY_BESIDE) >> 20,
                self.work("{wildcards.task}"),
            );
            let _ = writeln!(
                text,
                "rule gather_{number}:\n    input: expand({}, task=range({}, {}))\n    output: touch({})\n    shell: {:?}\n",
                flag(format!("task-{number}-{{task}}")),
                tasks.start,
                tasks.end,
                flag(format!("stage-{number}")),
                self.command("gather"),
            );
        }
        text
    }

    /// The list of commands, for other schedulers or for running by hand.
    pub fn list(&self) -> String {
        let mut text = String::new();
        for (number, stage) in self.stages() {
            let tasks = stage.range();
            let _ = writeln!(
                text,
                "stage {number} ({}), in any order and at once, K from {} to {}:\n  {}\nthen:\n  {}",
                stage.does,
                tasks.start,
                tasks.end - 1,
                self.work("K"),
                self.command("gather"),
            );
        }
        let _ = writeln!(text, "at the end:\n  {}", self.command("resume"));
        if let Some((line, of)) = self.export("K") {
            let _ = writeln!(text, "then, K from 1 to {of}:\n  {line}");
        }
        text
    }
}
