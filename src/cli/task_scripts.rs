//! Scripts that run the stages of a plan, one for each kind of scheduler.
//!
//! Each stage is an array of tasks, then a `gather`, which fails while any of them has no receipt. So a script that is run again goes on.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use tetdb_engine::api::{TaskStage, TaskStatus};

/// Beside the cap: code and stacks.
const MEMORY_BESIDE: u64 = 64 << 20;

/// What a script is written from.
pub(super) struct Script<'a> {
    pub store: PathBuf,
    pub program: PathBuf,
    pub memory_bytes: u64,
    pub threads: usize,
    pub scratch: Option<PathBuf>,
    /// A mesh file to be written in pieces at the end.
    pub export: Option<PathBuf>,
    pub planned: &'a TaskStatus,
}

impl Script<'_> {
    /// Stages that are not complete, with their numbers from 1.
    fn stages(&self) -> impl Iterator<Item = (usize, &TaskStage)> {
        (1..).zip(&self.planned.stages).skip(self.planned.stage)
    }

    /// A task, whose number the shell or the scheduler puts in.
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

    /// The export of one share, where one is wanted, and how many there are.
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

    /// Arrays with dependencies: a gather runs whatever became of its array, and stops what follows if tasks are left.
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
            // Tasks that are cancelled because a stage failed count as ended: nothing is there to be gathered.
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

    /// Tasks that fail are begun three times; what is left then, gather says.
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

    /// Flags in a folder of their own stand for what is done.
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

    /// What to run, for any other scheduler and for hands.
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

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = path.to_string_lossy();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@%".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text.into_owned(),
        false => single_quoted(&text),
    }
}

fn single_quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}
