//! Sizes asked for come out, and what a mesh takes is known before it is made.
//!
//! Why: who asks for sizes wants to see them in the mesh, and who has little room wants to know beforehand.
//! How: estimates beside the meshes they tell of; each size option with values that make sense and values that make none.

use super::place::Place;
use serde_json::Value;

fn number(value: &Value, name: &str) -> f64 {
    let found = value[name].as_f64();
    found.unwrap_or_else(|| panic!("no number {name} in {value}"))
}

#[test]
fn estimates_come_true() {
    let place = Place::new();
    for (k, line) in [
        "sample:box,h=0.1",
        "sample:box,h=0.2 --hsiz 0.05 --optimize none",
        "sample:balls,count=3",
        "sample:knot,h=0.2",
        "sample:shells,count=3,h=0.2 --regions all",
        "sample:box,h=0.2 --size-sphere 0.5,0.5,0.5,0.2,0.02",
    ]
    .into_iter()
    .enumerate()
    {
        let told = place.run_line(&format!("estimate {line} --json"));
        let told = told.succeeds().json();
        let made = place.run_line(&format!("mesh {line} -o {k}.tetdb --json"));
        let made = made.succeeds().json();
        for (name, off_max) in [("tets", 0.15), ("vertices", 0.15), ("peak_bytes", 0.35)] {
            let ratio = number(&told, name) / number(&made, name);
            assert!(
                (ratio - 1.0).abs() < off_max,
                "{line}: {name} is {ratio} of what came"
            );
        }
        let subdomains = made["subdomains"].as_array().map(Vec::len);
        assert_eq!(told["subdomains"].as_u64(), subdomains.map(|n| n as u64));
        assert_eq!(told["fits"]["memory"], true);
    }
}

#[test]
fn estimates_refuse_nothing() {
    let place = Place::new();
    let line = "estimate sample:box,h=0.5 --size-sphere 0.5,0.5,0.5,0.2,0.0001 --memory 64MiB";
    let told = place.run_line(&format!("{line} --json")).succeeds().json();
    assert!(number(&told, "tets") > 1e11, "{told}");
    assert_eq!(told["fits"]["disk"], false);
    assert_eq!(told["fits"]["memory"], true);
    let text = place.run_line(line).succeeds().stdout();
    assert!(text.contains("fits: no, the disk is too small"), "{text}");
    assert!(place.names().is_empty());
}

#[test]
fn the_look_ahead_can_be_left_out() {
    let place = Place::new();
    let line = "mesh sample:box,h=0.5 -o a.tetdb --no-preflight";
    place.run_line(line).succeeds();
}
