//! What can be typed behind `plan`, `work` and `gather`.

use std::path::PathBuf;

/// Who starts the tasks.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
pub struct EngineArgs {
    /// Print a shell script that submits arrays to Slurm, each after the one before
    #[arg(long)]
    pub slurm: bool,
    /// Print a shell script for GNU parallel
    #[arg(long)]
    pub parallel: bool,
    /// Print a Snakefile
    #[arg(long)]
    pub snakemake: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tetdb mesh part.stl -o part.tetdb --coarse-only\n  tetdb plan part.tetdb --tasks 64 --slurm > part.sh\n  sh part.sh\n\n\
    Without --slurm, --parallel or --snakemake the commands are listed, to be run by hand or by another scheduler. The same plan again changes nothing."
)]
pub struct PlanArgs {
    /// A store with its coarse mesh, see `tetdb mesh --coarse-only`
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Tasks that are to run at once, 1 to 1000
    #[arg(long, value_name = "N")]
    pub tasks: u32,
    #[command(flatten)]
    pub engine: EngineArgs,
    /// Most memory a task holds [default: 4GiB]
    #[arg(long, value_name = "SIZE")]
    pub memory_per_task: Option<String>,
    /// Threads of a task
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub threads_per_task: usize,
    /// A folder on each machine for the files of its tasks, as in `tetdb work --scratch`
    #[arg(long, value_name = "DIR")]
    pub scratch: Option<PathBuf>,
    /// At the end, also export the mesh in pieces by tasks that write a share each, as `tetdb export --pieces --share K/N` does
    #[arg(long, value_name = "FILE")]
    pub export: Option<PathBuf>,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  tetdb work part.tetdb --task 17 --memory 4GiB --threads 2 --scratch /local/scratch"
)]
pub struct WorkArgs {
    /// The store, on a file system that all machines share
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Number of the task, from the plan
    #[arg(long, value_name = "K")]
    pub task: u32,
    /// Most memory to hold, such as 512MiB or 8GiB [default: 60 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// Threads to use [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// A folder of this machine to write in before files are copied to the store [default: $SLURM_TMPDIR, $TMPDIR, or the store's folder]
    #[arg(long, value_name = "DIR")]
    pub scratch: Option<PathBuf>,
    /// Seconds to wait for files of other machines that show up late
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    pub wait: u64,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  tetdb gather part.tetdb\n\nExit code 0: the next tasks can begin, or the store is finished; 8: tasks have to be done again, and are listed."
)]
pub struct GatherArgs {
    /// The store whose tasks have run
    #[arg(value_name = "STORE")]
    pub store: PathBuf,
    /// Seconds to wait for files of other machines that show up late
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    pub wait: u64,
    /// Answer with one JSON object
    #[arg(long)]
    pub json: bool,
}
