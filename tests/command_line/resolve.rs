//! Crossing triangles are divided on request, and the store says so.
//!
//! Why: assemblies and scans cross themselves, and a surface that crosses itself has no inside.
//! How: boxes through each other, generated with a seed, and their union by hand.

use super::odd_inputs::{cube_at, off};
use super::place::Place;

#[test]
fn what_check_prints_for_crossings_gives_the_mesh_of_the_union() {
    let place = Place::new();
    let mut both = cube_at(0.0, 0.0, 0.0);
    both.extend(cube_at(0.5, 0.25, 0.375));
    place.write("two.off", off(&both));
    let refused = place.run_line("mesh two.off -o two.tetdb --hsiz 0.5");
    assert_eq!(refused.exit(), Some(3));
    assert!(refused.stderr().contains("--repair resolve"), "{}", refused.stderr());
    let said = place.run_line("check two.off").stdout();
    let command = said.split('`').find(|part| part.starts_with("tetdb mesh")).expect(&said);
    assert!(command.ends_with("--repair resolve --regions by-orientation"), "{command}");
    let line = format!("{} -o two.tetdb --hsiz 0.5", command.trim_start_matches("tetdb "));
    let notes = place.run_line(&line).succeeds().stderr();
    assert!(notes.contains("triangles were divided"), "{notes}");
    assert!((place.volume("two.tetdb") - (2.0 - 0.5 * 0.75 * 0.625)).abs() < 1e-12);
    // The store knows what was done: it verifies by itself, and against the same file repaired alike.
    for line in [
        "verify two.tetdb --full",
        "verify two.tetdb --against two.off",
        "verify two.tetdb --against two.off --repair resolve",
        "estimate two.off --repair resolve",
    ] {
        place.run_line(line).succeeds();
    }
    let info = place.run_line("info two.tetdb").succeeds().stdout();
    assert!(info.contains("crossings resolved (pairs="), "{info}");
    // Parity takes the common part out.
    place.run_line("mesh two.off -o odd.tetdb --hsiz 0.5 --repair resolve").succeeds();
    assert!(place.volume("odd.tetdb") < place.volume("two.tetdb") - 0.2);
}

#[test]
fn a_resolved_surface_is_resumed_and_is_the_same_on_any_number_of_threads() {
    let place = Place::new();
    let sample = "sample:broken,kind=crossings,count=3,seed=4 --regions all --hsiz 30%";
    place.run_line(&format!("mesh {sample} --repair resolve -o one.tetdb --threads 1")).succeeds();
    place
        .run_line(&format!("mesh {sample} --repair resolve -o two.tetdb --coarse-only"))
        .succeeds();
    place.run_line("resume two.tetdb --threads 2").succeeds();
    assert_eq!(place.digest("one.tetdb"), place.digest("two.tetdb"));
    place.run_line("verify two.tetdb --full").succeeds();
}

#[test]
fn a_changed_file_is_noticed_behind_a_repair() {
    let place = Place::new();
    let mut both = cube_at(0.0, 0.0, 0.0);
    both.extend(cube_at(0.5, 0.5, 0.5));
    place.write("two.off", off(&both));
    let mesh = "mesh two.off -o two.tetdb --hsiz 0.5 --repair resolve --coarse-only";
    place.run_line(mesh).succeeds();
    both.truncate(12);
    both.extend(cube_at(0.5, 0.5, 0.75));
    place.write("two.off", off(&both));
    let failed = place.run_line("verify two.tetdb");
    assert_ne!(failed.exit(), Some(0));
    // Without the repair the job is another one.
    assert_ne!(
        place.run_line("mesh two.off -o two.tetdb --hsiz 0.5 --coarse-only").exit(),
        Some(0)
    );
}

#[test]
fn twenty_seeds_of_crossings_and_shared_walls_are_resolved() {
    let place = Place::new();
    for kind in ["crossings", "doubled"] {
        for seed in 0..20 {
            let line = format!(
                "check sample:broken,kind={kind},seed={seed},count=6 --repair=resolve --write out.obj --json"
            );
            let answer = place.run_line(&line).succeeds().json();
            let done = &answer["resolve"];
            assert!(done["pairs"].as_u64() > Some(0), "{kind} {seed}: {done}");
            assert!(done["moved_most"].as_f64() < Some(1e-14), "{kind} {seed}: {done}");
        }
    }
}

#[test]
fn each_kind_of_broken_surface_is_found_broken() {
    let place = Place::new();
    for (kind, exit) in [
        ("holes", 3),
        ("crossings", 3),
        ("doubled", 3),
        ("cracks", 3),
        // Reading turns them back.
        ("turned", 0),
        ("tjunctions", 3),
        ("soup", 3),
    ] {
        for file in ["a.off", "b.off"] {
            place.run_line(&format!("sample broken,kind={kind},seed=3 -o {file}")).succeeds();
        }
        let [a, b] = ["a.off", "b.off"].map(|f| std::fs::read(place.path(f)).expect("written"));
        assert_eq!(a, b, "{kind}");
        assert_eq!(place.run_line("check a.off").exit(), Some(exit), "{kind}");
    }
    let run = place.run_line("sample broken,kind=torn -o a.off");
    assert!(run.stderr().contains("one of holes, crossings"), "{}", run.stderr());
}

#[test]
fn a_repair_that_cannot_be_is_an_error() {
    let place = Place::new();
    // Resolving closes no hole.
    let hole = "mesh sample:broken,kind=holes -o a.tetdb --repair resolve";
    assert_eq!(place.run_line(hole).exit(), Some(3));
    assert_eq!(place.run_line("mesh sample:box -o a.tetdb --repair wonder").exit(), Some(2));
    assert_eq!(place.run_line("check sample:box --repair=resolve").exit(), Some(2));
    // Sheets are embedded after the repair.
    place.write("box.off", off(&cube_at(0.0, 0.0, 0.0)));
    let checked = "check box.off --repair=resolve --write b.off --embed box.off";
    assert_eq!(place.run_line(checked).exit(), Some(2));
    assert!(!place.path("a.tetdb").exists());
}
