//! A run may end at any moment and loses no more than its current step.
//!
//! Why: long runs meet power cuts, full disks and impatient users.
//! How: the process is killed or signalled as soon as its store exists, and again later. `resume` must give the mesh of an undisturbed
//! run.

use std::io::Read;
use std::process::{Child, Command};
use std::time::Duration;

use super::place::{Done, Place};

const SAMPLE: &str = "sample:balls,count=12";

/// Starts a run and waits until its catalog exists.
fn started(place: &Place) -> Child {
    let child =
        place.command(&["mesh", SAMPLE, "-o", "a.tetdb", "--threads", "1", "--json"]).spawn();
    let mut child = child.expect("the program starts");
    while !place.path("a.tetdb/catalog.redb").exists() {
        let ended = child.try_wait().expect("the child can be asked");
        assert!(ended.is_none(), "the run ended before its store was seen");
        std::thread::sleep(Duration::from_millis(1));
    }
    child
}

fn undisturbed(place: &Place) -> String {
    place.run(&["mesh", SAMPLE, "-o", "whole.tetdb"]).succeeds();
    place.digest("whole.tetdb")
}

#[test]
fn a_killed_run_is_resumed_to_the_same_mesh() {
    let place = Place::new();
    let expected = undisturbed(&place);
    let mut n_unfinished = 0;
    for millis in [0, 100, 300, 900] {
        let mut child = started(&place);
        std::thread::sleep(Duration::from_millis(millis));
        // The step in progress does not matter; the same must hold for all steps.
        child.kill().expect("the child can be killed");
        child.wait().expect("the child can be waited for");
        if !is_finished(&place) {
            n_unfinished += 1;
            refuses_to_be_read(&place);
        }
        place.run_line("resume a.tetdb").succeeds();
        assert_eq!(
            place.digest("a.tetdb"),
            expected,
            "killed {millis} ms after the store was made"
        );
        assert!(is_finished(&place));
        std::fs::remove_dir_all(place.path("a.tetdb")).expect("the store can be removed");
    }
    assert!(
        n_unfinished > 0,
        "every run had finished before it was killed: give this test a larger sample"
    );
}

fn is_finished(place: &Place) -> bool {
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let finished = info["finished"].as_bool().expect("info says whether it is finished");
    let text = place.run_line("info a.tetdb").succeeds().stdout();
    assert_eq!(text.contains("unfinished") && text.contains("tetdb resume"), !finished, "{text}");
    finished
}

fn refuses_to_be_read(place: &Place) {
    let line = format!("mesh {SAMPLE} -o a.tetdb --json");
    for line in ["verify a.tetdb --json", "digest a.tetdb --json", line.as_str()] {
        let done = place.run_line(line);
        assert_eq!(
            (done.error()["code"].as_str(), done.exit()),
            (Some("store-unfinished"), Some(8)),
            "{line}"
        );
    }
}

#[test]
fn a_store_being_written_is_busy() {
    let place = Place::new();
    let mut child = started(&place);
    let still_running =
        |child: &mut Child| child.try_wait().expect("the child can be asked").is_none();
    let done = place.run_line("info a.tetdb --json");
    if still_running(&mut child) {
        assert_eq!((done.error()["code"].as_str(), done.exit()), (Some("busy"), Some(5)));
        let message = done.error()["message"].to_string();
        assert!(message.contains(&format!("process {} on ", child.id())), "{message}");
    }
    child.kill().expect("the child can be killed");
    child.wait().expect("the child can be waited for");
}

#[test]
#[cfg(unix)]
fn a_stopped_run_says_so_and_can_be_resumed() {
    let place = Place::new();
    let expected = undisturbed(&place);
    for (signal, exit) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let mut child = started(&place);
        std::thread::sleep(Duration::from_millis(30));
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("kill is there");
        assert!(sent.success());
        let status = child.wait().expect("the child can be waited for");
        let mut stderr = String::new();
        child
            .stderr
            .take()
            .expect("stderr was piped")
            .read_to_string(&mut stderr)
            .expect("stderr is UTF-8");
        // A run may have finished before the signal arrived.
        if status.code() != Some(0) {
            assert_eq!(status.code(), Some(exit), "{stderr}");
            assert!(stderr.contains("\"stopped\"") && stderr.contains("resume"), "{stderr}");
        }
        let resumed: Done = place.run_line("resume a.tetdb").succeeds();
        assert!(resumed.stdout().contains(&expected), "{}", resumed.stdout());
        std::fs::remove_dir_all(place.path("a.tetdb")).expect("the store can be removed");
    }
}

/// A store to be replaced stays until the new one is complete, and an interrupted replacement is continued.
#[test]
fn a_killed_replacement_is_taken_up() {
    let place = Place::new();
    let expected = undisturbed(&place);
    let (old, new) =
        ("mesh sample:box,h=0.2 -o a.tetdb", ["mesh", SAMPLE, "-o", "a.tetdb", "--force"]);
    let begun = |place: &Place| {
        let mut child = place
            .command(&[&new[..], &["--threads", "1"]].concat())
            .spawn()
            .expect("the program starts");
        // Waits until the coarse mesh exists, or the run has ended.
        while !place.path("a.tetdb.being-made/subdomain-00000-g1.redb").exists() {
            if child.try_wait().expect("the child can be asked").is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(40));
        child.kill().expect("the child can be killed");
        child.wait().expect("the child can be waited for");
    };
    let whole = |place: &Place| {
        assert_eq!(place.digest("a.tetdb"), expected);
        for left in ["a.tetdb.being-made", "a.tetdb.being-replaced"] {
            assert!(!place.path(left).exists(), "{left} is still there");
        }
        std::fs::remove_dir_all(place.path("a.tetdb")).expect("the store can be removed");
    };
    // `resume` continues the begun replacement.
    place.run_line(old).succeeds();
    let first = place.digest("a.tetdb");
    begun(&place);
    assert_eq!(place.digest("a.tetdb"), first, "it is there until the end");
    place.run_line("resume a.tetdb").succeeds();
    whole(&place);
    // Repeating the same command does so too; a different command starts anew.
    place.run_line(old).succeeds();
    begun(&place);
    place.run(&new).succeeds();
    whole(&place);
    place.run_line(old).succeeds();
    begun(&place);
    place.run_line(&format!("{old} --force --optimize none")).succeeds();
    assert_ne!(place.digest("a.tetdb"), expected);
    assert!(!place.path("a.tetdb.being-made").exists());
    // As if killed between two renames, and before the old store was removed.
    for (from, to) in [("whole.tetdb", "a.tetdb.being-made"), ("a.tetdb", "a.tetdb.being-replaced")]
    {
        std::fs::rename(place.path(from), place.path(to)).expect("names can be changed");
    }
    place.run_line("resume a.tetdb").succeeds();
    whole(&place);
}

/// A folder that has the name of a replacement but is no store is not removed. Copies that a user keeps next to a store are not removed
/// either.
#[test]
fn a_replacement_removes_nothing_of_a_user() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.2 -o a.tetdb").succeeds();
    let first = place.digest("a.tetdb");
    let copies = ["a.tetdb-old", "a.tetdb-new"];
    for copy in copies {
        place.run_line(&format!("mesh sample:box,h=0.2 -o {copy}")).succeeds();
    }
    let own = place.path("a.tetdb.being-made");
    std::fs::create_dir(&own).expect("a folder");
    std::fs::write(own.join("notes.txt"), "mine").expect("a file");
    let again = "mesh sample:box,h=0.25 -o a.tetdb --force";
    let done = place.run_line(&format!("{again} --json"));
    assert_eq!((done.error()["code"].as_str(), done.exit()), (Some("not-a-store"), Some(8)));
    assert!(own.join("notes.txt").exists());
    assert_eq!(place.digest("a.tetdb"), first);
    std::fs::remove_dir_all(&own).expect("the folder can be removed");
    place.run_line(again).succeeds();
    assert_ne!(place.digest("a.tetdb"), first);
    for copy in copies {
        assert_eq!(place.digest(copy), first, "{copy}");
    }
}
