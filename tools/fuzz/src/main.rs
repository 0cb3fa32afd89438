//! Mutates a corpus and feeds what comes of it to a target: `tetdb-fuzz TARGET|all [SECONDS] [SEED] [CORPUS]`. `tetdb-fuzz TARGET FILE`
//! feeds one input as it is.
//!
//! Runs on stable Rust, without coverage: seeds are files of every shape a format has, mutations know numbers that readers
//! trip over. An input that panics, ends the process, or takes longer than a second, is written beside the corpus as
//! `TARGET/found-HASH`. Stores, their files, and files of HDF5 are fed to a process of their own, for one that panics
//! twice or runs out of stack is gone.
#![forbid(unsafe_code)]

mod file;
mod mesh;
mod mutate;
mod store;
mod targets;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use mutate::Mutator;
use targets::{TARGETS, Target};

/// An input that takes longer is a finding.
const SLOW: Duration = Duration::from_secs(1);
/// An input that takes longer than this is not waited for, where it has a process of its own.
const HANGS: Duration = Duration::from_secs(60);
/// So many findings are enough.
const FOUND_MAX: u32 = 10;
/// Targets whose inputs may end the process.
const APART: [&str; 3] = ["file", "store", "vtkhdf"];
/// Where a process that runs on behalf of another leaves each input before it runs it.
const INPUT_FILE: &str = "TETDB_FUZZ_INPUT";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: u64| {
        arguments.get(i).and_then(|word| word.parse().ok()).unwrap_or(default)
    };
    let wanted = arguments.first().map_or("all", String::as_str);
    if let Some(file) = arguments.get(1).filter(|word| Path::new(word).is_file()) {
        return again(wanted, Path::new(file));
    }
    let (seconds, seed) = (number(1, 60), number(2, 1));
    let corpus = arguments.get(3).map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/corpus")),
        PathBuf::from,
    );
    let mut found = 0;
    for target in TARGETS.iter().filter(|t| wanted == "all" || t.name == wanted) {
        let folder = corpus.join(target.name);
        let time = Duration::from_secs(seconds);
        let is_apart = APART.contains(&target.name) && std::env::var_os(INPUT_FILE).is_none();
        let done = match is_apart {
            true => run_apart(target, &folder, time, seed),
            false => run(target, &folder, time, seed),
        };
        match done {
            Ok(n) => found += n,
            Err(error) => {
                eprintln!("{}: {error}", target.name);
                return ExitCode::from(2);
            }
        }
    }
    ExitCode::from(u8::from(found > 0))
}

/// Feeds one input.
fn again(wanted: &str, file: &Path) -> ExitCode {
    let (Some(target), Ok(input)) =
        (TARGETS.iter().find(|t| t.name == wanted), std::fs::read(file))
    else {
        eprintln!("{wanted}: no such target, or {} cannot be read", file.display());
        return ExitCode::from(2);
    };
    let (ended, took) = timed(target, &input);
    println!("{wanted}: {took:?}");
    ExitCode::from(u8::from(!ended))
}

/// Feeds a target for some time; returns the number of findings.
fn run(target: &Target, folder: &Path, time: Duration, seed: u64) -> std::io::Result<u32> {
    let mut seeds = Vec::new();
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<_, _>>()?;
    paths.sort();
    for path in &paths {
        seeds.push(std::fs::read(path)?);
    }
    if seeds.is_empty() {
        seeds.push(Vec::new());
    }
    let mut mutator = Mutator::new(seed);
    let (clock, mut n, mut found) = (Instant::now(), 0u64, 0);
    let mut slowest = Duration::ZERO;
    let input_file = std::env::var_os(INPUT_FILE);
    while clock.elapsed() < time && found < FOUND_MAX {
        let input = mutator.mutated(&seeds);
        if let Some(path) = &input_file {
            std::fs::write(path, &input)?;
            std::fs::write(counted(path), (n + 1).to_string())?;
        }
        let (mut ended, mut took) = timed(target, &input);
        if ended && took > SLOW {
            // A busy machine is no finding.
            (ended, took) = worked(target, &input);
        }
        (n, slowest) = (n + 1, slowest.max(took));
        if !ended || took > SLOW {
            found += 1;
            keep(target, folder, &input, &format!("after {took:?}"))?;
        }
    }
    println!(
        "{}: {n} inputs from {} seeds in {:.0} s, {found} findings, slowest {slowest:?}",
        target.name,
        seeds.len(),
        clock.elapsed().as_secs_f64()
    );
    Ok(found)
}

/// The file beside the input that says how many there were.
fn counted(input: impl AsRef<Path>) -> PathBuf {
    input.as_ref().with_extension("count")
}

/// Feeds a target in processes of their own, one after the other; an input that ends one is a finding.
fn run_apart(target: &Target, folder: &Path, time: Duration, seed: u64) -> std::io::Result<u32> {
    let dir = tempfile::tempdir()?;
    let input = dir.path().join("input");
    let (clock, mut found, mut part, mut n) = (Instant::now(), 0, 0, 0);
    while clock.elapsed() < time && found < FOUND_MAX {
        let left = time.saturating_sub(clock.elapsed()).as_secs().max(1);
        let mut child = Command::new(std::env::current_exe()?)
            .args([target.name, &left.to_string(), &(seed + part).to_string()])
            .arg(folder.parent().unwrap_or(folder))
            .env(INPUT_FILE, &input)
            .spawn()?;
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            std::thread::sleep(Duration::from_millis(100));
            let begun = std::fs::metadata(&input).and_then(|m| m.modified());
            let runs = begun.ok().and_then(|begun| begun.elapsed().ok());
            if runs.is_some_and(|runs| runs > HANGS) {
                child.kill()?;
            }
        };
        part += 1_000_000;
        let count = std::fs::read_to_string(counted(&input));
        n += count.map_or(0, |count| count.parse::<u64>().unwrap_or(0));
        match status.code() {
            Some(0) => {}
            Some(1) => found += 1,
            Some(_) => break,
            None => {
                found += 1;
                keep(target, folder, &std::fs::read(&input)?, &status.to_string())?;
            }
        }
    }
    println!("{}: {n} inputs in all", target.name);
    Ok(found)
}

/// Writes a finding beside the corpus.
fn keep(target: &Target, folder: &Path, input: &[u8], what: &str) -> std::io::Result<()> {
    let hash = xxhash_rust::xxh3::xxh3_64(input);
    let path = folder.join(format!("found-{hash:016x}"));
    std::fs::write(&path, input)?;
    println!("{}: {} {what}", target.name, path.display());
    Ok(())
}

/// Runs one input; whether it ended without a panic, and how long it took.
fn timed(target: &Target, input: &[u8]) -> (bool, Duration) {
    let clock = Instant::now();
    let ended = catch_unwind(AssertUnwindSafe(|| (target.run)(input)));
    (ended.is_ok(), clock.elapsed())
}

/// The same in CPU time of the process, where the system tells it.
fn worked(target: &Target, input: &[u8]) -> (bool, Duration) {
    let before = cpu_time();
    let (ended, took) = timed(target, input);
    let spent = before.and_then(|before| cpu_time()?.checked_sub(before));
    (ended, spent.unwrap_or(took))
}

/// User and system time of all threads: fields 14 and 15 of `/proc/self/stat`, in hundredths of a second on Linux.
fn cpu_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is a name in parentheses, with anything in it.
    let fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let ticks: u64 = fields.take(2).filter_map(|f| f.parse::<u64>().ok()).sum();
    Some(Duration::from_millis(10 * ticks))
}
