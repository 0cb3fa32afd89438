//! Holes are closed on request, and the cheapest repair is chosen; the store says so.
//!
//! Why: scans and assemblies have holes, turned shells and parts that overlap.
//! How: boxes with walls left out, generated surfaces with a seed, and unions whose volume is known.

use super::odd_inputs::{cube_at, off};
use super::place::Place;

#[test]
fn what_check_prints_for_a_hole_gives_the_mesh() {
    let place = Place::new();
    place.write("open.off", off(&cube_at(0.0, 0.0, 0.0)[..10]));
    let refused = place.run_line("mesh open.off --hsiz 0.5");
    assert_eq!(refused.exit(), Some(3));
    assert!(refused.stderr().contains("--repair auto"), "{}", refused.stderr());
    let said = place.run_line("check open.off").stdout();
    let command = said.split('`').find(|part| part.starts_with("tetdb mesh")).expect(&said);
    assert!(command.ends_with("--repair winding"), "{command}");
    let line = format!("{} -o a.tetdb --hsiz 0.5", command.trim_start_matches("tetdb "));
    let notes = place.run_line(&line).succeeds().stderr();
    assert!(notes.contains("1 hole was closed, with 2 triangles of area 1 "), "{notes}");
    assert!((place.volume("a.tetdb") - 1.0).abs() < 1e-12);
    for line in [
        "verify a.tetdb --full",
        "verify a.tetdb --against open.off",
        "verify a.tetdb --against open.off --repair winding",
        "verify a.tetdb --against open.off --repair auto",
        "estimate open.off --repair winding",
    ] {
        place.run_line(line).succeeds();
    }
    let info = place.run_line("info a.tetdb").succeeds().stdout();
    assert!(info.contains("closed by winding numbers (holes=1,area=1e0"), "{info}");
    place.run_line("report a.tetdb a.html").succeeds();
    let page = std::fs::read_to_string(place.path("a.html")).expect("written");
    assert!(page.contains("closed:holes=1"));
    // The new triangles have a label of their own.
    let answer = place.run_line("check open.off --repair=winding --write whole.obj --json");
    let answer = answer.succeeds().json();
    assert_eq!(answer["winding"]["holes"][0]["label"], "closed-hole-1", "{answer}");
    assert_eq!(answer["labels"], serde_json::json!(["open", "closed-hole-1"]), "{answer}");
    place.run_line("mesh whole.obj --hsiz 0.5").succeeds();
}

#[test]
fn a_closed_surface_is_resumed_and_is_the_same_on_any_number_of_threads() {
    let place = Place::new();
    for (kind, repair) in [("holes", "winding"), ("cracks", "auto"), ("crossings", "winding")] {
        let sample = format!("sample:broken,kind={kind},count=3,seed=4 --hsiz 30%");
        place
            .run_line(&format!("mesh {sample} --repair {repair} -o {kind}1.tetdb --threads 1"))
            .succeeds();
        let begun = format!("mesh {sample} --repair {repair} -o {kind}2.tetdb --coarse-only");
        place.run_line(&begun).succeeds();
        let [one, two] = [1, 2].map(|n| format!("{kind}{n}.tetdb"));
        place.run_line(&format!("resume {two} --threads 2")).succeeds();
        assert_eq!(place.digest(&one), place.digest(&two), "{kind}");
        place.run_line(&format!("verify {two} --full")).succeeds();
    }
}

#[test]
fn what_came_from_no_file_is_kept_as_it_was_repaired() {
    let place = Place::new();
    place.write("open.off", off(&cube_at(0.0, 0.0, 0.0)[..10]));
    let words =
        ["mesh", "-", "-o", "a.tetdb", "--repair", "auto", "--hsiz", "0.5", "--coarse-only"];
    let file = std::fs::File::open(place.path("open.off")).expect("written");
    let done = place.command(&words).stdin(file).output().expect("it runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    place.run_line("resume a.tetdb").succeeds();
    place.run_line("verify a.tetdb --full").succeeds();
    assert!((place.volume("a.tetdb") - 1.0).abs() < 1e-12);
}

#[test]
fn the_cheapest_repair_is_taken() {
    let place = Place::new();
    let mut both = cube_at(0.0, 0.0, 0.0);
    both.extend(cube_at(0.5, 0.25, 0.375));
    place.write("two.off", off(&both));
    let mut cracked = cube_at(0.0, 0.0, 0.0);
    cracked[3] = cracked[3].map(|[x, y, z]| [x + 1e-7, y, z]);
    place.write("cracked.off", off(&cracked));
    place.write("open.off", off(&cube_at(0.0, 0.0, 0.0)[..10]));
    let mut all = both.clone();
    all.truncate(23);
    place.write("all.off", off(&all));
    place.write("box.off", off(&cube_at(0.0, 0.0, 0.0)));
    let union = 2.0 - 0.5 * 0.75 * 0.625;
    for (file, keys, wanted) in [
        ("box.off", "", 1.0),
        ("cracked.off", "repair", 1.0),
        ("open.off", "winding", 1.0),
        ("two.off", "resolve winding", union),
        ("all.off", "resolve winding", union),
    ] {
        let line = format!("check {file} --repair=auto --write out.obj --json");
        let answer = place.run_line(&line).succeeds().json();
        let found = ["repair", "resolve", "winding"].into_iter();
        let found: Vec<&str> = found.filter(|key| answer[key].is_object()).collect();
        assert_eq!(found.join(" "), keys, "{file}: {answer}");
        place
            .run_line(&format!("mesh {file} -o a.tetdb --force --hsiz 0.5 --repair auto"))
            .succeeds();
        assert!((place.volume("a.tetdb") - wanted).abs() < 1e-5, "{file}");
        place.run_line("verify a.tetdb").succeeds();
        place.run_line(&format!("verify a.tetdb --against {file} --repair auto")).succeeds();
    }
}

#[test]
fn twenty_seeds_of_each_broken_kind_become_closed() {
    let place = Place::new();
    for kind in ["holes", "turned", "doubled", "cracks", "tjunctions"] {
        for seed in 0..20 {
            let line = format!(
                "check sample:broken,kind={kind},seed={seed},count=6 --repair=auto --write out.obj --json"
            );
            let answer = place.run_line(&line).succeeds().json();
            assert_eq!(answer["n_defects"], 0, "{kind} {seed}: {answer}");
        }
    }
}

#[test]
fn a_surface_around_nothing_is_refused() {
    let place = Place::new();
    place.write("sheet.off", off(&cube_at(0.0, 0.0, 0.0)[..2]));
    for line in [
        "mesh sheet.off -o a.tetdb --repair winding",
        "mesh sheet.off -o a.tetdb --repair auto",
        "check sheet.off --repair=winding --write b.off",
    ] {
        let failed = place.run_line(line);
        assert_eq!(failed.exit(), Some(3), "{line}");
        assert!(failed.stderr().contains("goes around nothing"), "{}", failed.stderr());
    }
    place.write("box.off", off(&cube_at(0.0, 0.0, 0.0)));
    let sheets = "check box.off --repair=winding --write b.off --embed sheet.off";
    assert_eq!(place.run_line(sheets).exit(), Some(2));
    assert!(!place.path("a.tetdb").exists() && !place.path("b.off").exists());
}
