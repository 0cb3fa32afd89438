//! Memory limits: the cap of a command, and limits of the system.
//!
//! Why: a cap is worthless if one command ignores it, or if it fails only for large surfaces.
//! How: each command gets caps that are too small, and then runs under a limit of the system slightly above its cap. A command that
//! cannot get its memory ends with the exit code for that.

use super::place::Place;
#[cfg(target_os = "linux")]
use {
    super::place::program,
    std::process::{Command, Output},
};

#[test]
fn commands_that_read_a_surface_or_rows_take_a_cap_like_all_others() {
    let place = Place::new();
    place.run_line("sample box,h=0.5 -o b.off --memory 64MiB").succeeds();
    place.run_line("mesh b.off --memory 64MiB").succeeds();
    for line in [
        "check b.off",
        "refine-surface b.off fine.off --hsiz 0.2",
        "sample box,h=0.5 -o again.off",
        "info b.tetdb",
        "digest b.tetdb",
    ] {
        let words: Vec<&str> = line.split_whitespace().collect();
        let with = |cap: &str| place.run(&[&words[..], &["--memory", cap, "--json"]].concat());
        with("64MiB").succeeds();
        for (cap, exit, code) in [("1MiB", 6, "memory"), ("64", 2, "bad-memory")] {
            let done = with(cap);
            assert_eq!(done.exit(), Some(exit), "{line} --memory {cap}");
            assert_eq!(done.error()["code"], code, "{line} --memory {cap}");
        }
    }
}

#[test]
fn a_surface_that_does_not_fit_the_cap_is_refused_with_the_cap_that_would_do() {
    let place = Place::new();
    for line in [
        "check sample:box,h=0.0018",
        "sample box,h=0.0018 -o b.off",
        "refine-surface sample:box,h=0.0018 b.off --hsiz 1",
        "mesh sample:box,h=0.0018 -o b.tetdb",
    ] {
        let done = place.run_line(&format!("{line} --memory 64MiB --json"));
        assert_eq!(done.exit(), Some(6), "{line}: {}", done.stderr());
        let error = done.error();
        assert_eq!(error["code"], "memory", "{line}: {error}");
        let help = error["help"].as_str().unwrap_or_default();
        assert!(help.starts_with("give at least --memory "), "{line}: {help}");
        assert!(place.names().is_empty(), "{line}: {:?}", place.names());
    }
    // The size of the generated surface is not known in advance, so it is refused during the work.
    let line = "refine-surface sample:box,h=0.2 fine.off --hsiz 0.002 --memory 64MiB --json";
    let done = place.run_line(line);
    assert_eq!(done.exit(), Some(6), "{}", done.stderr());
    assert_eq!(done.error()["code"], "memory");
    assert!(place.names().is_empty(), "{:?}", place.names());
}

/// Runs the program under a data limit in MiB; `None` if limits cannot be set.
#[cfg(target_os = "linux")]
fn limited(place: &Place, mebibytes: u64, line: &str) -> Option<Output> {
    let mut command = Command::new("prlimit");
    command.arg(format!("--data={}", mebibytes << 20));
    command.arg(program()).args(line.split_whitespace());
    command.current_dir(place.path("")).output().ok()
}

#[cfg(target_os = "linux")]
#[test]
fn memory_that_the_system_refuses_is_an_error_and_no_abort() {
    let place = Place::new();
    for line in [
        "sample balls,count=800 -o b.off",
        "check sample:balls,count=800",
        "refine-surface sample:balls,count=10 b.off --hsiz 0.005",
        "mesh sample:balls,count=800 -o b.tetdb --threads 1",
    ] {
        for mebibytes in [24, 40, 64] {
            let Some(output) = limited(&place, mebibytes, line) else {
                return;
            };
            let talk = String::from_utf8_lossy(&output.stderr);
            assert!(
                matches!(output.status.code(), Some(0 | 6)),
                "{line} within {mebibytes} MiB: {:?} {talk}",
                output.status
            );
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn what_is_said_to_fit_a_cap_runs_within_little_more() {
    let place = Place::new();
    let mesh = "sample:balls,count=60 --hsiz 0.05";
    let told = place.run_line(&format!("estimate {mesh} --memory 64MiB --json"));
    assert_eq!(told.succeeds().json()["fits"]["memory"], true);
    for line in [
        format!("mesh {mesh} -o b.tetdb --threads 2").as_str(),
        "verify b.tetdb --full",
        "query b.tetdb --where quality>2 --csv",
        "export b.tetdb b.vtu",
        "export b.tetdb b.msh",
        "resaturate b.tetdb --subdomain 0 --refine-by 0.9 --threads 2",
        "resaturate b.tetdb --undo",
    ] {
        let capped = match line.contains("--undo") {
            true => line.to_owned(),
            false => format!("{line} --memory 64MiB"),
        };
        let Some(output) = limited(&place, 96, &capped) else {
            return;
        };
        let talk = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{line}: {talk}");
    }
}
