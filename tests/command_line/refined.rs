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
