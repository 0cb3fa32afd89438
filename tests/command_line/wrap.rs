//! `wrap` and `--repair wrap`: a closed surface around anything.
//!
//! Why: soups and surfaces with a thousand gaps have no inside that could be repaired.
//! How: generated soups and a box with a missing side; what comes out is checked, meshed and verified like any input.

use super::odd_inputs::{cube_at, off};
use super::place::Place;

#[test]
fn a_soup_becomes_a_surface_that_can_be_meshed() {
    let place = Place::new();
    let line = "wrap sample:broken,kind=soup,seed=2 -o a.obj --gap 5% --offset 1% --json";
    let made = place.run_line(&format!("{line} --threads 1")).succeeds().json();
    let report = &made["report"];
    let number = |key: &str| report[key].as_f64().expect("a number");
    assert_eq!(made["triangles"], report["triangles"]);
    assert!(number("gap") > 4.9 * number("offset") && number("samples") > 1000.0, "{report}");
    assert!(number("distance_to_input_max") >= 0.9 * number("offset"), "{report}");
    place.run_line("check a.obj").succeeds();
    place.run_line(&line.replace("a.obj", "b.obj --threads 2")).succeeds();
    let [a, b] = ["a.obj", "b.obj"].map(|f| std::fs::read(place.path(f)).expect("written"));
    assert_eq!(a, b, "the same for any number of threads");
    place.run_line("mesh a.obj -o a.tetdb").succeeds();
    place.run_line("verify a.tetdb --full").succeeds();
}

#[test]
fn a_mesh_that_begins_with_a_wrap_is_resumed_and_verified() {
    let place = Place::new();
    // A side is missing, and the opening is narrower than twice the gap.
    let mut open = cube_at(0.0, 0.0, 0.0);
    open.truncate(10);
    place.write("open.off", off(&open));
    let repair = "--repair wrap --wrap-gap 0.9 --wrap-offset 2%";
    let line = format!("mesh open.off {repair} --hsiz 0.5");
    let notes = place.run_line(&format!("{line} -o one.tetdb --threads 1")).succeeds().stderr();
    assert!(notes.contains("encloses all 10 triangles"), "{notes}");
    place.run_line(&format!("{line} -o two.tetdb --coarse-only")).succeeds();
    place.run_line("resume two.tetdb --threads 2").succeeds();
    assert_eq!(place.digest("one.tetdb"), place.digest("two.tetdb"));
    place.run_line("verify two.tetdb --full").succeeds();
    place.run_line(&format!("verify two.tetdb --against open.off {repair}")).succeeds();
    let other = "verify two.tetdb --against open.off --repair wrap --wrap-gap 0.8";
    assert_eq!(place.run_line(other).exit(), Some(7));
    let info = place.run_line("info two.tetdb").succeeds().stdout();
    assert!(info.contains("wrapped (gap=9e-1,offset="), "{info}");
    place.run_line(&format!("estimate open.off {repair}")).succeeds();
    place.run_line("check open.off --repair=wrap --write closed.off").succeeds();
    place.run_line("check closed.off").succeeds();
}

#[test]
fn bad_options_are_refused_before_anything_is_written() {
    let place = Place::new();
    place.write("box.off", off(&cube_at(0.0, 0.0, 0.0)));
    place.write("far.off", off(&cube_at(1e9, 0.0, 0.0)));
    for (line, exit, words) in [
        ("wrap box.off -o out.off --gap 0", 2, "gap"),
        ("wrap box.off -o out.off --gap nan", 2, "gap"),
        ("wrap box.off -o out.off --offset -1", 2, "offset"),
        ("wrap box.off -o out.off --offset 1e-14", 2, "rounding"),
        ("wrap far.off -o out.off --offset 1e-3", 2, "rounding"),
        ("wrap box.off -o box.off", 2, "--force"),
        ("wrap nothing.off -o out.xyz", 3, "xyz"),
        ("wrap nothing.off -o out.off", 3, "nothing.off"),
        ("mesh box.off -o a.tetdb --wrap-gap 1%", 2, "--repair"),
        ("mesh box.off -o a.tetdb --repair resolve --wrap-gap 1%", 2, "--repair wrap"),
        ("mesh box.off -o a.tetdb --repair wrap --wrap-offset 0", 2, "offset"),
    ] {
        let refused = place.run_line(line);
        assert_eq!(refused.exit(), Some(exit), "{line}: {}", refused.stderr());
        assert!(refused.stderr().contains(words), "{line}: {}", refused.stderr());
        assert!(!place.path("out.off").exists() && !place.path("a.tetdb").exists(), "{line}");
    }
    let line = "wrap box.off -o out.off --gap 0.1% --offset 0.01% --memory 64MiB --json";
    let refused = place.run_line(line);
    assert_eq!(refused.exit(), Some(6), "{}", refused.stderr());
    assert_eq!(refused.error()["code"], "memory");
}
