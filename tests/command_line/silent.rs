//! Nothing is lost silently: inputs, answers, stores of other runs.
//!
//! Why: users lose their trust in a tool that overwrites its input, or reports success with half an answer.
//! How: each known way of losing something is tried. It must end with an error, and everything must be unchanged.

use std::fs::{self, File};
use std::process::{Command, Stdio};
use std::time::Duration;

use super::place::{Place, TETRA, program};

#[test]
fn what_a_run_reads_is_never_what_it_writes() {
    let place = Place::new();
    let mesh = "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTriangles\n4\n\
        1 3 2 1\n1 2 4 1\n2 3 4 1\n1 4 3 1\nEnd\n";
    place.write("k.mesh", mesh);
    place.write("s.off", TETRA);
    fs::hard_link(place.path("s.off"), place.path("linked.off")).expect("a link");
    place.run_line("mesh k.mesh").succeeds();
    let mut refused = vec![
        "refine-surface s.off s.off --hsiz 0.1",
        "refine-surface s.off linked.off --hsiz 0.1",
        "check s.off --repair --write s.off",
        "export k.tetdb k.mesh",
        "export k.tetdb k.tetdb",
        "snapshot k.tetdb k.tetdb",
        "mesh s.off --export s.off",
        "mesh k.mesh -o other.tetdb --export k.mesh",
        "query k.tetdb -o k.mesh",
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(place.path("k.mesh"), place.path("soft.mesh")).expect("a link");
        refused.push("export k.tetdb soft.mesh");
    }
    for line in refused {
        let done = place.run_line(line);
        assert_ne!(done.exit(), Some(0), "{line}");
        assert!(!place.path("other.tetdb").exists(), "{line}");
        let files = [("k.mesh", mesh), ("s.off", TETRA)];
        for (name, content) in files {
            let found = fs::read_to_string(place.path(name)).expect("it is still there");
            assert_eq!(found, content, "{line}");
        }
    }
    place.run_line("refine-surface s.off s.off --hsiz 0.5 --force").succeeds();
    place.run_line("export k.tetdb k.mesh --force").succeeds();
}

#[test]
fn a_folder_is_no_file_to_be_written() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.5 -o k.tetdb --no-verify").succeeds();
    for (name, command) in [
        ("d.vtu", "export k.tetdb"),
        ("d.csv", "query k.tetdb -o"),
        ("d.png", "snapshot k.tetdb"),
        ("d.html", "report k.tetdb"),
        ("d.off", "sample box,h=0.5 -o"),
        ("e.off", "refine-surface sample:box,h=0.5 --hsiz 0.3"),
        ("e.vtu", "mesh sample:box,h=0.5 -o other.tetdb --export"),
    ] {
        fs::create_dir(place.path(name)).expect("a folder");
        let done = place.run_line(&format!("{command} {name} --json"));
        assert_eq!(done.exit(), Some(2), "{command}: {}", done.stderr());
        assert_eq!(done.error()["code"], "usage", "{command}");
        let holds = fs::read_dir(place.path(name)).expect("it stays").count();
        assert_eq!(holds, 0, "{command}");
        // Refused before work begins.
        assert!(!place.path("other.tetdb").exists());
    }
}

#[test]
fn files_that_were_embedded_are_not_overwritten() {
    let place = Place::new();
    place.run_line("sample wells,count=2,cells=6 -o w.obj").succeeds();
    place
        .run_line("mesh w.obj --embed w_sheets.obj --embed-edges w_wires.obj --embed-points w_wires.obj --no-verify")
        .succeeds();
    for name in ["w.obj", "w_sheets.obj", "w_wires.obj"] {
        let before = fs::read(place.path(name)).expect("it is there");
        let done = place.run_line(&format!("query w.tetdb --limit 1 -o {name}"));
        assert_eq!(done.exit(), Some(2), "{name}");
        assert_eq!(fs::read(place.path(name)).expect("still"), before, "{name}");
    }
}

#[test]
fn what_is_read_or_written_beside_a_file_is_never_overwritten_either() {
    let place = Place::new();
    let points = "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n# mine\n";
    let facets = "0 3 0 0\n4 0\n1\n3 0 2 1\n1\n3 0 1 3\n1\n3 1 2 3\n1\n3 0 3 2\n0\n0\n";
    let asked = "0.1 0.1 0.1\n";
    let all = [("k.poly", facets), ("k.node", points), ("asked.csv", asked)];
    for (name, content) in all {
        place.write(name, content);
    }
    place.run_line("mesh k.poly").succeeds();
    for line in [
        "mesh k.poly -o other.tetdb --export k.ele",
        "export k.tetdb k.ele",
        "resume k.tetdb --export k.ele",
        "resaturate k.tetdb --subdomain 0 --refine-by 0.5 --export k.ele",
        "query k.tetdb --points asked.csv -o asked.csv",
    ] {
        let done = place.run_line(line);
        assert_eq!(done.exit(), Some(2), "{line}");
        assert!(!place.path("other.tetdb").exists(), "{line}");
        for (name, content) in all {
            let found = fs::read_to_string(place.path(name)).expect("it is still there");
            assert_eq!(found, content, "{line}");
        }
    }
    place.run_line("export k.tetdb k.ele --force").succeeds();
}

#[cfg(target_os = "linux")]
#[test]
fn an_answer_that_cannot_be_written_is_an_error_and_a_closed_pipe_is_none() {
    let place = Place::new();
    place.write("a.off", TETRA);
    place.run_line("mesh a.off").succeeds();
    let lines = [
        "info a.tetdb",
        "info a.tetdb --json",
        "digest a.tetdb",
        "query a.tetdb",
        "query a.tetdb --csv",
        "query a.tetdb --json",
        "verify a.tetdb",
        "compare a.tetdb a.tetdb",
        "check a.off",
        "estimate a.off",
        "completions bash",
        "man",
        "--help",
        "--version",
        "help mesh",
        "export a.tetdb - --format mesh",
    ];
    for line in lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        let full = File::create("/dev/full").expect("it is always there");
        let mut full_run = place.command(&words);
        let output = full_run.stdout(full).output().expect("the program starts");
        let talk = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(6), "{line}: {talk}");
        let mut child = place.command(&words).spawn().expect("the program starts");
        drop(child.stdout.take());
        let status = child.wait().expect("it ends");
        assert_eq!(status.code(), Some(0), "{line} into a closed pipe");
    }
}

#[test]
fn of_two_runs_at_once_onto_one_path_neither_is_replaced_in_silence() {
    let place = Place::new();
    let digest_of = |h: &str| {
        let word = format!("sample:box,h={h}");
        let store = format!("{h}.tetdb");
        place.run(&["mesh", &word, "-o", &store]).succeeds();
        place.digest(&store)
    };
    let (first, second) = (digest_of("0.2"), digest_of("0.25"));
    for delay in [0, 1, 2, 5, 10, 20, 40, 80, 160, 320] {
        let start = |word: &str| {
            let words = ["mesh", word, "-o", "x.tetdb"];
            let mut command = place.command(&words);
            command.stdout(Stdio::null()).stderr(Stdio::null());
            command.spawn().expect("the program starts")
        };
        let mut one = start("sample:box,h=0.2");
        std::thread::sleep(Duration::from_millis(delay));
        let mut two = start("sample:box,h=0.25");
        let exits = [&mut one, &mut two].map(|child| child.wait().expect("it ends").code());
        let winner = match exits {
            [Some(0), Some(5 | 8)] => &first,
            [Some(5 | 8), Some(0)] => &second,
            other => panic!("{delay} ms apart: exit codes {other:?}"),
        };
        assert_eq!(&place.digest("x.tetdb"), winner, "{delay} ms apart");
        fs::remove_dir_all(place.path("x.tetdb")).expect("it is ours");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_run_that_nobody_hears_goes_on() {
    let place = Place::new();
    let lines = [
        "mesh sample:box,h=0.1 -o b.tetdb --json",
        "resaturate b.tetdb --subdomain 0 --refine-by 0.7 --json",
    ];
    for line in lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        let mut child = place.command(&words).spawn().expect("the program starts");
        drop((child.stderr.take(), child.stdout.take()));
        let status = child.wait().expect("it ends");
        assert_eq!(status.code(), Some(0), "{line}");
    }
    place.run_line("verify b.tetdb").succeeds();
}

#[test]
fn no_message_repeats_all_that_was_typed_however_long() {
    let place = Place::new();
    let long = "x".repeat(100_000);
    place.write("long.toml", format!("hsiz = '{long}'"));
    let sample = format!("sample:{long}");
    for words in [
        &["check", &sample][..],
        &["check", &long],
        &["info", &long],
        &["estimate", "sample:box", "--hsiz", &long],
        &["estimate", "sample:box", "--memory", &long],
        &["estimate", "sample:box", &format!("--{long}")],
        &["estimate", "sample:box", "--config", "long.toml"],
    ] {
        for json in [&[][..], &["--json"]] {
            let done = place.run(&[words, json].concat());
            assert!(matches!(done.exit(), Some(2 | 3)), "{:?}", done.exit());
            let n = done.stderr().len();
            assert!((20..20_000).contains(&n), "{n} bytes of {}", words[0]);
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_export_that_is_stopped_leaves_no_file_behind() {
    let place = Place::new();
    let words = ["mesh", "sample:box,h=0.05", "-o", "b.tetdb", "--no-verify"];
    place.run(&words).succeeds();
    for millis in [5, 20, 60] {
        let mut child =
            place.command(&["export", "b.tetdb", "b.mesh"]).spawn().expect("the program starts");
        std::thread::sleep(Duration::from_millis(millis));
        let id = child.id().to_string();
        let sent = Command::new("kill").args(["-TERM", &id]).status();
        assert!(sent.is_ok());
        child.wait().expect("it ends");
        let left: Vec<String> =
            (place.names().into_iter()).filter(|name| name.contains(".tmp")).collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn without_a_cap_a_run_goes_by_the_limits_of_its_process() {
    let place = Place::new();
    for limit in ["--as=1500000000", "--data=300000000"] {
        let run = Command::new("prlimit")
            .arg(limit)
            .arg(program())
            .args(["mesh", "sample:box,h=0.3"])
            .args(["-o", "l.tetdb", "--force", "--threads", "2"])
            .current_dir(place.path(""))
            .output();
        let Ok(output) = run else { return };
        let talk = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{limit}: {talk}");
    }
}
