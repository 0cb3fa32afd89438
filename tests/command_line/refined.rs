//! A surface is divided to the wanted lengths before it is meshed.
//!
//! Why: edges of the surface stay, so `--hsiz` alone cannot be reached near long ones.

use super::place::Place;

#[test]
fn hsiz_is_reached_in_one_command_and_a_run_goes_on_after_a_stop() {
    let place = Place::new();
    let options = "sample:box,h=1 --hsiz 0.25 --refine-surface";
    for (store, more) in [("whole.tetdb", ""), ("begun.tetdb", "--coarse-only")] {
        let line = format!("mesh {options} -o {store} {more}");
        place.run_line(&line).succeeds();
    }
    place.run_line("resume begun.tetdb").succeeds();
    assert_eq!(place.digest("whole.tetdb"), place.digest("begun.tetdb"));

    // The undivided triangles would leave edges of 0.5 and more.
    let line = "query whole.tetdb --order-by edge_max --desc --limit 1 --select edge_max --json";
    let answer = place.run_line(line).succeeds().stdout();
    let first = answer.lines().next().expect("a tetrahedron");
    let hit: serde_json::Value = serde_json::from_str(first).expect("an object");
    let longest = hit["edge_max"].as_f64().expect("a number");
    assert!(longest < 0.5, "{longest}");

    let tets = |line: &str| {
        let answer = place.run_line(line).succeeds().json();
        answer["tets"].as_f64().expect("a number")
    };
    let ratio = tets(&format!("estimate {options} --json")) / tets("info whole.tetdb --json");
    assert!((0.5..2.0).contains(&ratio), "{ratio}");

    let again = place.run_line(&format!("mesh {options} -o whole.tetdb"));
    assert!(again.succeeds().stderr().contains("already holds"));
    let other = place.run_line("mesh sample:box,h=1 --hsiz 0.25 -o whole.tetdb");
    assert_eq!(other.exit(), Some(8), "another job without the option");
}

#[test]
fn a_divided_surface_without_room_is_refused_before_a_store_exists() {
    let place = Place::new();
    let line = "mesh sample:box,h=1 --hsiz 1e-4 --refine-surface -o a.tetdb --memory 64MiB --json";
    let refused = place.run_line(line);
    assert_eq!(refused.exit(), Some(6));
    assert_eq!(refused.error()["code"], "memory");
    assert!(!place.path("a.tetdb").exists());
}

#[test]
fn a_refined_surface_is_named_where_another_is_compared_with() {
    let place = Place::new();
    place.run_line("sample box,h=1 -o box.off").succeeds();
    place.run_line("mesh box.off --hsiz 0.25 --refine-surface -o a.tetdb").succeeds();
    let told = place.run_line("info a.tetdb").succeeds().stdout();
    assert!(told.contains("from a copy in the store of its surface"), "{told}");
    let found = place.run_line("verify a.tetdb --against box.off");
    assert_eq!(found.exit(), Some(7));
    assert!(found.stderr().contains("was refined before"), "{}", found.stderr());
    place.run_line("verify a.tetdb").succeeds();
    place.run_line("verify a.tetdb --against a.tetdb/surface.obj").succeeds();
}

#[test]
fn a_file_that_is_read_is_not_overwritten_without_force() {
    let place = Place::new();
    place.run_line("sample box,h=1 -o box.off").succeeds();
    let refused = place.run_line("refine-surface box.off box.off --hsiz 0.5");
    assert_eq!(refused.exit(), Some(2));
    for part in ["box.off is an input, and would be overwritten", "--force"] {
        assert!(refused.stderr().contains(part), "{}", refused.stderr());
    }
    place.run_line("refine-surface box.off box.off --hsiz 0.5 --force").succeeds();
}
