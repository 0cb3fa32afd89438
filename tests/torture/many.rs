//! Many random cases, and counts of their outcomes.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::cuts::draw;
use super::mesher::{Outcome, recovery, whole};

/// Cases of the smoke run.
const SMOKE: u64 = 400;
/// A case that takes longer is printed at once, because it may never end.
const SLOW: Duration = Duration::from_secs(20);

/// Counts of a run.
#[derive(Default)]
struct Counts {
    meshed: u64,
    refused: u64,
    too_near: Vec<String>,
    gave_up: Vec<String>,
    wrong: Vec<String>,
    panicked: Vec<String>,
    missing: u64,
    by_points: u64,
    steiner: u64,
    tets: u64,
    time: Duration,
    slowest: (Duration, String),
}

impl Counts {
    fn add(&mut self, name: String, took: Duration, outcome: std::thread::Result<Outcome>) {
        if took > self.slowest.0 {
            self.slowest = (took, name.clone());
        }
        match outcome {
            Ok(Outcome::Meshed { tets, recovery }) => {
                self.tets += tets;
                self.time += recovery.time;
                self.meshed += 1;
                self.missing += u64::from(recovery.missing);
                self.by_points += u64::from(recovery.by_points);
                self.steiner += u64::from(recovery.steiner);
            }
            Ok(Outcome::Refused(_)) => self.refused += 1,
            Ok(Outcome::TooNear(why)) => told(&mut self.too_near, &name, &why),
            Ok(Outcome::GaveUp(why)) => told(&mut self.gave_up, &name, &why),
            Ok(Outcome::Wrong(what)) => told(&mut self.wrong, &name, &what),
            Err(panic) => {
                let text = panic
                    .downcast_ref::<String>()
                    .cloned()
                    .or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string));
                let text = text.unwrap_or_default();
                told(&mut self.panicked, &name, &text);
            }
        }
    }
}

/// Lists a case and prints it at once, because a run takes hours.
fn told(list: &mut Vec<String>, name: &str, what: &str) {
    list.push(format!("{name}: {what}"));
    println!("{name}: {what}");
}

/// Runs the cases `first..first + n` of a seed on `threads` threads.
fn run(seed: u64, first: u64, n: u64, threads: usize) -> Counts {
    let counts = Mutex::new(Counts::default());
    let next = AtomicU64::new(first);
    let working: Vec<Mutex<Option<(Instant, u64)>>> =
        (0..threads).map(|_| Mutex::new(None)).collect();
    let done = AtomicU64::new(0);
    std::thread::scope(|scope| {
        for slot in &working {
            let (counts, next, done) = (&counts, &next, &done);
            scope.spawn(move || {
                loop {
                    let case = next.fetch_add(1, Ordering::Relaxed);
                    if case >= first + n {
                        break;
                    }
                    let shape = draw(seed, case);
                    let clock = Instant::now();
                    *slot.lock().expect("no panic holds it") = Some((clock, case));
                    let outcome = catch_unwind(AssertUnwindSafe(|| recovery(&shape)));
                    *slot.lock().expect("no panic holds it") = None;
                    let mut counts = counts.lock().expect("no panic holds it");
                    counts.add(shape.name, clock.elapsed(), outcome);
                }
                done.fetch_add(1, Ordering::Relaxed);
            });
        }
        while done.load(Ordering::Relaxed) < threads as u64 {
            std::thread::sleep(Duration::from_millis(100));
            for slot in &working {
                let mut slot = slot.lock().expect("no panic holds it");
                if let Some((clock, case)) = *slot
                    && clock.elapsed() > SLOW
                {
                    println!("seed {seed} case {case} takes longer than {SLOW:?}");
                    *slot = None;
                }
            }
        }
    });
    counts.into_inner().expect("no panic holds it")
}

fn judge(counts: &Counts) {
    println!(
        "{} meshed with {} tetrahedra, {} refused by the validator, {} too near for doubles, {} given up, {} wrong, {} panics; {} triangles missing, {} recovered with points, {} Steiner points, {:?} of recovery; slowest {:?}: {}",
        counts.meshed,
        counts.tets,
        counts.refused,
        counts.too_near.len(),
        counts.gave_up.len(),
        counts.wrong.len(),
        counts.panicked.len(),
        counts.missing,
        counts.by_points,
        counts.steiner,
        counts.time,
        counts.slowest.0,
        counts.slowest.1,
    );
    // Too many cases refused as too near would hide failures.
    assert!((counts.too_near.len() as u64) * 1000 <= counts.meshed);
    assert!(counts.gave_up.is_empty() && counts.wrong.is_empty() && counts.panicked.is_empty());
}

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|word| word.parse().ok()).unwrap_or(default)
}

#[test]
fn some_random_cuts_are_recovered() {
    judge(&run(1, 0, SMOKE, 2));
}

/// Nested shells in which vertices that leave one after the other end up nearer to each other than doubles can represent, unless they
/// stay exact for a while.
#[test]
fn vertices_without_room_for_doubles_leave_the_surface() {
    judge(&run(5, 62_066, 1, 1));
}

#[test]
fn a_few_random_cuts_are_meshed_and_verified_in_a_store() {
    for case in 0..12 {
        let shape = draw(2, case);
        match whole(&shape, "full") {
            Outcome::Meshed { .. } | Outcome::Refused(_) | Outcome::TooNear(_) => {}
            other => panic!("{}: {other:?}", shape.name),
        }
    }
}

#[test]
#[ignore = "a hundred thousand cases"]
fn random_cuts_by_the_hundred_thousand() {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let (seed, first) = (number("TETDB_TORTURE_SEED", 1), number("TETDB_TORTURE_FIRST", 0));
    let clock = Instant::now();
    let counts = run(seed, first, number("TETDB_TORTURE_CASES", 100_000), threads);
    println!("{:.0} s on {threads} threads", clock.elapsed().as_secs_f64());
    judge(&counts);
}

/// Repeats one case with full output. Its surface is written to the path in `TETDB_TORTURE_OFF`.
#[test]
#[ignore = "one case, for a look at it"]
fn one_random_case() {
    let seed = number("TETDB_TORTURE_SEED", 1);
    let shape = draw(seed, number("TETDB_TORTURE_FIRST", 0));
    if let Some(path) = std::env::var_os("TETDB_TORTURE_OFF") {
        std::fs::write(path, shape.to_off()).expect("the file can be written");
    }
    println!("{}: {} triangles", shape.name, shape.triangles.len());
    println!("{:?}", recovery(&shape));
}
