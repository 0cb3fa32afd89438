//! A mesh by tasks is that of one process, in any order, with repetitions, and after kills at any point.
//!
//! Why: on a cluster, tasks are requeued, run twice, lose their machine, and see each other's files late.
//! How: real processes on one machine get only the store's path and their number. Some are killed; some files are damaged, removed or
//! delayed. The digest is compared with that of one process.

use std::collections::hash_map::RandomState;
use std::fs;
use std::hash::BuildHasher;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::Duration;

use super::place::{Done, Place};

const SAMPLE: &str = "sample:box,h=0.04";
const SUBDOMAINS: &str = "4";

/// Random numbers. The seed is printed, so that a failure can be repeated.
struct Random(u64);

impl Random {
    fn new() -> Self {
        let seed = RandomState::new().hash_one(0);
        println!("seed {seed}");
        Self(seed)
    }

    fn below(&mut self, n: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }

    fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// The mesh of one process, and an unfinished store of the same job with a plan.
fn planned(place: &Place, tasks: u32) -> String {
    let mesh = |out: &str, more: &str| {
        let line = format!("mesh {SAMPLE} -o {out} --subdomains {SUBDOMAINS} {more}");
        place.run_line(&line).succeeds();
    };
    mesh("one.tetdb", "--no-verify");
    mesh("a.tetdb", "--coarse-only");
    place.run_line(&format!("plan a.tetdb --tasks {tasks} --json")).succeeds();
    place.digest("one.tetdb")
}

fn gather(place: &Place) -> Done {
    place.run_line("gather a.tetdb --wait 0 --json")
}

/// The tasks that can run now; none if the store is finished.
fn next(place: &Place) -> Vec<u32> {
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let states = info["tasks"]["states"].as_array().cloned();
    let tasks = states.unwrap_or_default().into_iter();
    tasks.map(|t| t["task"].as_u64().expect("a number") as u32).collect()
}

fn started(place: &Place, task: u32, more: &str) -> Child {
    let line = format!("work a.tetdb --task {task} --wait 0 --memory 96MiB --threads 1 {more}");
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut command = place.command(&words);
    command.env_remove("TMPDIR").env_remove("SLURM_TMPDIR");
    command.spawn().expect("the program starts")
}

fn work(place: &Place, task: u32) {
    let done = started(place, task, "").wait_with_output();
    let done = done.expect("it is ours");
    let text = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "task {task}: {text}");
}

/// Runs all remaining tasks, one after the other.
fn run_jobs(place: &Place) {
    loop {
        next(place).into_iter().for_each(|task| work(place, task));
        if gather(place).succeeds().json()["finished"] == true {
            return;
        }
    }
}

/// The store is finished with this digest, and the folder has only the files that one process would leave.
fn is_as_of_one_process(place: &Place, digest: &str) {
    assert_eq!(place.digest("a.tetdb"), digest);
    place.run_line("verify a.tetdb").succeeds();
    let files = |store: &str| {
        let names = fs::read_dir(place.path(store)).expect("a store");
        let mut names: Vec<String> = names
            .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    };
    assert_eq!(files("a.tetdb"), files("one.tetdb"));
}

fn receipts(place: &Place) -> Vec<PathBuf> {
    let dir = fs::read_dir(place.path("a.tetdb/work")).expect("the folder of tasks");
    let paths = dir.map(|e| e.expect("an entry").path());
    paths.filter(|p| p.extension().is_some_and(|e| e == "receipts")).collect()
}

#[test]
fn tasks_in_any_order_and_each_twice_at_once_give_the_mesh_of_one_process() {
    let mut random = Random::new();
    for tasks in [1, 2, 7] {
        let place = Place::new();
        let expected = planned(&place, tasks);
        fs::create_dir(place.path("local")).expect("a folder");
        loop {
            let mut twice = [next(&place), next(&place)].concat();
            random.shuffle(&mut twice);
            for two in twice.chunks(2) {
                // With a local scratch folder and without.
                let both =
                    [two.first().map(|t| (t, "--scratch local")), two.get(1).map(|t| (t, ""))];
                let running = both.into_iter().flatten();
                let running: Vec<Child> =
                    running.map(|(t, more)| started(&place, *t, more)).collect();
                for mut child in running {
                    assert!(child.wait().expect("it is ours").success());
                }
            }
            let gathered = gather(&place).succeeds().json();
            if gathered["finished"] == true {
                break;
            }
        }
        is_as_of_one_process(&place, &expected);
        let left = fs::read_dir(place.path("local")).expect("a folder").count();
        assert_eq!(left, 0, "tasks leave nothing on their machine");
        // Running the same script again is not refused.
        assert_eq!(gather(&place).succeeds().json()["finished"], true);
    }
}

#[test]
fn tasks_and_gathers_that_are_killed_anywhere_lose_nothing() {
    let mut random = Random::new();
    let place = Place::new();
    let expected = planned(&place, 2);
    let (mut n_killed, mut n_gathers_killed) = (0, 0);
    let mut kill = |mut child: Child, within: usize| {
        std::thread::sleep(Duration::from_millis(random.below(within) as u64));
        let is_killed = child.try_wait().expect("it is ours").is_none();
        child.kill().expect("it can be killed");
        child.wait().expect("it is ours");
        usize::from(is_killed)
    };
    loop {
        for task in next(&place) {
            for _ in 0..4 {
                n_killed += kill(started(&place, task, ""), 300);
            }
            work(&place, task);
        }
        for _ in 0..5 {
            let words = ["gather", "a.tetdb", "--wait", "0"];
            let child = place.command(&words).spawn().expect("the program starts");
            n_gathers_killed += kill(child, 40);
        }
        // The run may have reached the next stage before it was killed. No task of that stage has started then.
        let done = gather(&place);
        if done.exit() == Some(0) && done.json()["finished"] == true {
            break;
        }
    }
    assert!(n_killed > 4 && n_gathers_killed > 2, "{n_killed} and {n_gathers_killed} killed");
    is_as_of_one_process(&place, &expected);
}

#[test]
fn a_damaged_or_missing_receipt_is_a_task_to_do_again_and_is_named() {
    let place = Place::new();
    let expected = planned(&place, 2);
    work(&place, 1);
    gather(&place).succeeds();
    let tasks = next(&place);
    let [first, ..] = tasks[..] else { panic!("a second stage") };
    let refused = |why: &str| {
        let error = gather(&place).error();
        assert_eq!(error["code"], "tasks-left");
        let message = error["message"].as_str().expect("a message").to_owned();
        assert!(
            message.contains(&format!("of task {first}")) && message.contains(why),
            "{message}"
        );
        let info = place.run_line("info a.tetdb").succeeds().stdout();
        assert!(info.contains("0 done"), "{info}");
    };
    refused("no receipt");
    work(&place, first);
    let path = receipts(&place).remove(0);
    let bytes = fs::read(&path).expect("a receipt");
    for at in [0, 20, bytes.len() / 2] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        fs::write(&path, damaged).expect("it can be damaged");
        refused("its receipt cannot be used");
    }
    fs::write(&path, &bytes[..bytes.len() - 1]).expect("it can be cut");
    refused("its receipt cannot be used");
    work(&place, first);
    // A receipt whose files are missing.
    let files = fs::read_dir(place.path("a.tetdb/work")).expect("a folder");
    for entry in files.map(|e| e.expect("an entry")) {
        if entry.file_name().to_string_lossy().starts_with("files-") {
            fs::remove_dir_all(entry.path()).expect("it can be removed");
        }
    }
    let error = gather(&place).error();
    assert!(error["message"].as_str().is_some_and(|m| m.contains("missing")), "{error}");
    // A task refuses damaged orders, and they are written again.
    let orders = place.path(&format!("a.tetdb/work/task-{first:05}.orders"));
    fs::write(&orders, b"nothing").expect("it can be damaged");
    let refused = place.run_line(&format!("work a.tetdb --task {first} --wait 0 --json"));
    assert_eq!((refused.error()["code"].as_str(), refused.exit()), (Some("task-file"), Some(4)));
    assert_eq!(gather(&place).exit(), Some(8));
    run_jobs(&place);
    is_as_of_one_process(&place, &expected);
}

#[test]
fn a_committed_task_is_neither_listed_nor_done_again() {
    let place = Place::new();
    let expected = planned(&place, 2);
    work(&place, 1);
    gather(&place).succeeds();
    let tasks = next(&place);
    let [first, second, ..] = tasks[..] else { panic!("two tasks in a stage: {tasks:?}") };
    work(&place, first);
    assert_eq!(gather(&place).error()["code"], "tasks-left");
    assert!(!next(&place).contains(&first) && next(&place).contains(&second));
    let again = place.run_line(&format!("work a.tetdb --task {first} --wait 0 --json"));
    assert_eq!(again.succeeds().json()["done_before"], true);
    run_jobs(&place);
    is_as_of_one_process(&place, &expected);
}

#[test]
fn files_that_are_seen_late_cost_time_only() {
    let place = Place::new();
    let expected = planned(&place, 1);
    let late = |path: PathBuf| {
        let hidden = path.with_extension("hidden");
        fs::rename(&path, &hidden).expect("it is there");
        std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(700));
            fs::rename(hidden, path).expect("nobody else touches it");
        })
    };
    let orders = late(place.path("a.tetdb/work/task-00001.orders"));
    place.run_line("work a.tetdb --task 1 --wait 60").succeeds();
    orders.join().expect("it was shown");
    let receipt = late(place.path("a.tetdb/work/task-00001.receipts"));
    place.run_line("gather a.tetdb --wait 60").succeeds();
    receipt.join().expect("it was shown");
    run_jobs(&place);
    is_as_of_one_process(&place, &expected);
}

#[test]
fn a_task_before_its_stage_or_without_a_plan_is_refused() {
    let place = Place::new();
    planned(&place, 2);
    let code = |line: &str| {
        let done = place.run_line(line);
        let code = done.error()["code"].as_str().map(str::to_owned);
        (code.unwrap_or_default(), done.exit())
    };
    let no_tasks = ("no-tasks".to_owned(), Some(8));
    let usage = ("usage".to_owned(), Some(2));
    assert_eq!(code("work a.tetdb --task 2 --wait 0 --json"), no_tasks);
    assert_eq!(code("work a.tetdb --task 99 --wait 0 --json"), usage);
    assert_eq!(code("work one.tetdb --task 1 --wait 0 --json"), no_tasks);
    assert_eq!(code("plan one.tetdb --tasks 4 --json"), no_tasks);
    assert_eq!(code("plan a.tetdb --tasks 0 --json"), usage);
}

#[test]
fn one_process_can_go_on_with_what_tasks_began_but_not_while_they_are_at_it() {
    let place = Place::new();
    let expected = planned(&place, 2);
    work(&place, 1);
    gather(&place).succeeds();
    let first = next(&place)[0];
    work(&place, first);
    // Another task is being performed, by this live process.
    let mark = place.path("a.tetdb/work/task-00003.mark");
    let host = fs::read_to_string("/proc/sys/kernel/hostname").expect("this test needs Linux");
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let now = now.expect("a clock").as_secs();
    let id = std::process::id();
    let text =
        format!(r#"{{"host":"{}","process":{id},"renewed":{now},"error":null}}"#, host.trim());
    fs::write(&mark, text).expect("the folder takes files");
    for line in ["resume a.tetdb --json", "plan a.tetdb --tasks 5 --json"] {
        let done = place.run_line(line);
        assert_eq!((done.error()["code"].as_str(), done.exit()), (Some("busy"), Some(5)), "{line}");
    }
    fs::remove_file(&mark).expect("it is there");
    place.run_line("plan a.tetdb --tasks 5").succeeds();
    place.run_line("resume a.tetdb").succeeds();
    is_as_of_one_process(&place, &expected);
}

/// A scheduler with job arrays that runs everything at once.
const SBATCH: &str = r#"#!/bin/bash
for word in "$@"; do
    case $word in --array=1-*) last=${word#--array=1-} ;; --dependency=*:) echo "empty dependency" >&2; exit 1 ;; esac
    command=$word
done
for ((k = 1; k <= ${last:-1}; k++)); do SLURM_ARRAY_TASK_ID=$k sh -c "$command" >&2 || true; done
echo "17;cluster"
"#;

#[test]
fn the_printed_scripts_run() {
    let place = Place::new();
    let expected = planned(&place, 2);
    fs::create_dir(place.path("bin")).expect("a folder");
    place.write("bin/sbatch", SBATCH);
    shell(&place, "chmod +x bin/sbatch");
    let script = |engine: &str| {
        let line = format!(
            "plan a.tetdb --tasks 2 --{engine} --memory-per-task 96MiB --export {engine}.pvtu"
        );
        place.run_line(&line).succeeds().stdout()
    };
    place.write("run.sh", script("slurm"));
    shell(&place, "PATH=$PWD/bin:$PATH sh run.sh");
    is_as_of_one_process(&place, &expected);
    assert!(place.path("slurm.pvtu").exists());
    for (engine, program, command) in [
        ("parallel", "parallel", "sh run.sh"),
        ("snakemake", "snakemake", "snakemake -q -c2 -s run.sh"),
    ] {
        fs::remove_dir_all(place.path("a.tetdb")).expect("a store");
        place
            .run_line(&format!("mesh {SAMPLE} -o a.tetdb --subdomains {SUBDOMAINS} --coarse-only"))
            .succeeds();
        place.write("run.sh", script(engine));
        let is_there = Command::new(program).arg("--version").output().is_ok();
        match is_there {
            true => {
                shell(&place, command);
                is_as_of_one_process(&place, &expected);
                assert!(place.path(&format!("{engine}_00003.vtu")).exists());
            }
            false => println!("skipped: {program} is not installed"),
        }
    }
}

fn shell(place: &Place, line: &str) {
    let done = Command::new("bash")
        .args(["-euo", "pipefail", "-c", line])
        .current_dir(Path::new(&place.path(".")))
        .output()
        .expect("bash is there");
    assert!(done.status.success(), "{line}\n{}", String::from_utf8_lossy(&done.stderr));
}
