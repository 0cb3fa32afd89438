//! Mutates a corpus and feeds what comes of it to a target: `tetdb-fuzz TARGET|all [SECONDS] [SEED] [CORPUS]`.
//!
//! Runs on stable Rust, without coverage: seeds are files of every shape a format has, mutations know numbers that readers
//! trip over. An input that panics, or takes longer than a second, is written beside the corpus as `TARGET/found-HASH`.
#![forbid(unsafe_code)]

mod mutate;
mod store;
mod targets;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use mutate::Mutator;
use targets::{TARGETS, Target};

/// An input that takes longer is a finding.
const SLOW: Duration = Duration::from_secs(1);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: u64| {
        arguments
            .get(i)
            .and_then(|word| word.parse().ok())
            .unwrap_or(default)
    };
    let wanted = arguments.first().map_or("all", String::as_str);
    let (seconds, seed) = (number(1, 60), number(2, 1));
    let corpus = arguments.get(3).map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/corpus")),
        PathBuf::from,
    );
    let mut found = 0;
    for target in TARGETS
        .iter()
        .filter(|t| wanted == "all" || t.name == wanted)
    {
        match run(
            target,
            &corpus.join(target.name),
            Duration::from_secs(seconds),
            seed,
        ) {
            Ok(n) => found += n,
            Err(error) => {
                eprintln!("{}: {error}", target.name);
                return ExitCode::from(2);
            }
        }
    }
    ExitCode::from(u8::from(found > 0))
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
    while clock.elapsed() < time && found < 10 {
        let input = mutator.mutated(&seeds);
        let (mut ended, mut took) = timed(target, &input);
        if ended && took > SLOW {
            // A busy machine is no finding.
            (ended, took) = worked(target, &input);
        }
        (n, slowest) = (n + 1, slowest.max(took));
        if !ended || took > SLOW {
            found += 1;
            let hash = xxhash_rust::xxh3::xxh3_64(&input);
            let path = folder.join(format!("found-{hash:016x}"));
            std::fs::write(&path, &input)?;
            println!("{}: {} after {took:?}", target.name, path.display());
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
