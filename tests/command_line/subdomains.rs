//! A mesh in several sub-domains is equally valid, and its cuts are not visible in it.
//!
//! Why: sub-domains allow a mesh to be larger than memory. They must not reduce validity or quality, nor depend on the machine.
//! How: one sample in several numbers of sub-domains is verified, compared with the mesh in one piece, killed and resumed.

use std::time::Duration;

use serde_json::Value;

use super::place::Place;

const SAMPLE: &str = "sample:box,h=0.045";

fn info(place: &Place, store: &str) -> Value {
    let line = format!("info {store} --json");
    place.run_line(&line).succeeds().json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn any_number_of_parts_is_valid_and_of_the_same_size() {
    let place = Place::new();
    let line = format!("mesh {SAMPLE} -o one.tetdb");
    place.run_line(&line).succeeds();
    let whole = info(&place, "one.tetdb");
    for n in [2u64, 3] {
        let store = format!("{n}.tetdb");
        let line = format!("mesh {SAMPLE} -o {store} --subdomains {n}");
        place.run_line(&line).succeeds();
        let line = format!("verify {store} --full --json");
        let proof = place.run_line(&line).succeeds().json();
        assert_eq!(proof["subdomains"], n);
        assert_eq!(proof["triangles_missing"], 0);
        let info = info(&place, &store);
        let ratio = number(&info["tets"]) / number(&whole["tets"]);
        assert!((ratio - 1.0).abs() < 0.02, "{n} parts: {ratio} times as many");
        for part in info["subdomains"].as_array().expect("a list") {
            let share = number(&part["tets"]) * n as f64 / number(&info["tets"]);
            assert!((0.97..1.03).contains(&share), "{n} parts: {share} of the mean");
            assert!(number(&part["worst_q"]) < 3.5, "{part}");
        }
        topology_is_symmetric(&info);
        cuts_are_good(&info);
    }
}

/// Both neighbors list each other with the same number of faces, which is the number in the interfaces.
fn topology_is_symmetric(info: &Value) {
    let parts = info["subdomains"].as_array().expect("a list");
    let shared = |a: &Value, b: &Value| {
        let neighbors = a["neighbors"].as_array().expect("a list");
        let found = neighbors.iter().find(|n| n["subdomain"] == b["id"]);
        found.map_or(0.0, |n| number(&n["faces"]))
    };
    let mut sum = 0.0;
    for a in parts {
        for b in parts {
            assert_eq!(shared(a, b), shared(b, a));
            let between = info["interfaces"].as_array().expect("a list");
            let between = between.iter().filter(|i| {
                (i["low"] == a["id"] && i["high"] == b["id"])
                    || (i["low"] == b["id"] && i["high"] == a["id"])
            });
            assert_eq!(between.map(|i| number(&i["faces"])).sum::<f64>(), shared(a, b));
            sum += shared(a, b);
        }
    }
    let counted: f64 = parts.iter().map(|p| number(&p["interface_faces"])).sum();
    assert_eq!(sum, counted);
}

fn cuts_are_good(info: &Value) {
    let mut n_cuts = 0;
    for step in info["journal"].as_array().expect("a list") {
        if step["step"] != "bisect" {
            continue;
        }
        n_cuts += 1;
        let measures = step["measures"].as_array().expect("a list");
        let measure = |name: &str| {
            let found = measures.iter().find(|m| m["name"] == name);
            number(&found.unwrap_or_else(|| panic!("no {name}"))["value"])
        };
        assert!(measure("interface_faces") < 0.8 * measure("natural_faces"));
        // One cut has 1.159, and 1.157 for natural faces, whose vertices stay in place.
        assert!(measure("interface_face_quality") <= 1.003 * measure("natural_face_quality"));
        assert!(measure("over_constrained") <= 0.05 * measure("natural_over_constrained"));
        assert_eq!(measure("pinched"), 0.0);
        assert_eq!(measure("frozen_hits"), 0.0);
        assert_eq!(measure("z_enclosed"), measure("z_tets"));
    }
    assert_eq!(n_cuts + 1, info["subdomains"].as_array().map_or(0, Vec::len));
}

#[test]
fn threads_memory_and_interruptions_do_not_change_the_parts() {
    let place = Place::new();
    let mut digests = Vec::new();
    for (store, options) in [
        ("a", "--threads 1 --memory 64MiB"),
        ("b", "--threads 2 --memory 1GiB"),
        ("c", "--threads 2 --memory 96MiB"),
    ] {
        let line = format!("mesh {SAMPLE} -o {store}.tetdb --subdomains 3 {options}");
        place.run_line(&line).succeeds();
        digests.push(place.digest(&format!("{store}.tetdb")));
    }
    for millis in [200, 700, 1500, 2500] {
        let line = format!("mesh {SAMPLE} -o k.tetdb --subdomains 3 --threads 1");
        let words: Vec<&str> = line.split_whitespace().collect();
        let mut child = place.command(&words).spawn().expect("the program starts");
        std::thread::sleep(Duration::from_millis(millis));
        child.kill().expect("the child can be killed");
        child.wait().expect("the child can be waited for");
        if place.path("k.tetdb/catalog.redb").exists() {
            place.run_line("resume k.tetdb").succeeds();
            digests.push(place.digest("k.tetdb"));
            let names = place.names();
            let mut files = names.iter().filter(|n| n.starts_with("k.tetdb/"));
            // The catalog, and for each sub-domain its sealed mesh and its coarse snapshot.
            assert_eq!(files.clone().count(), 7, "{:?}", files.next());
        }
        if place.path("k.tetdb").exists() {
            std::fs::remove_dir_all(place.path("k.tetdb")).expect("the folder can be removed");
        }
    }
    assert!(digests.len() > 3, "no killed run had begun");
    assert!(digests.iter().all(|d| *d == digests[0]), "{digests:?}");
}

#[test]
fn more_parts_than_the_mesh_allows_are_not_made() {
    let place = Place::new();
    let made = place.run_line("mesh sample:box,h=0.1 -o a.tetdb --subdomains 50").succeeds();
    assert!(made.stderr().contains("50 sub-domains were asked for"), "{}", made.stderr());
    let info = info(&place, "a.tetdb");
    assert_eq!(info["subdomains"].as_array().map(Vec::len), Some(1));
    for bad in ["0", "-1", "many", "1.5"] {
        let word = format!("--subdomains={bad}");
        let done = place.run(&["mesh", "sample:box,h=0.3", "-o", "b.tetdb", &word]);
        assert_eq!(done.exit(), Some(2), "{bad}");
        assert!(!place.path("b.tetdb").exists());
    }
}

#[test]
fn a_surface_made_finer_is_the_same_surface() {
    let place = Place::new();
    place.run_line("sample box,h=0.5 -o a.off").succeeds();
    let made = place.run_line("refine-surface a.off b.off --hsiz 0.1 --json").succeeds().json();
    assert_eq!(number(&made["report"]["deviation_max"]), 0.0);
    assert!(number(&made["triangles"]) > 10.0 * number(&made["triangles_before"]));
    place.run_line("mesh b.off -o b.tetdb").succeeds();
    let volume: f64 = info(&place, "b.tetdb")["subdomains"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|part| number(&part["volume"]))
        .sum();
    assert!((volume - 1.0).abs() < 1e-12, "{volume}");
    for bad in ["0", "-1", "x", "nan"] {
        let word = format!("--hsiz={bad}");
        let done = place.run(&["refine-surface", "a.off", "c.off", &word]);
        assert_eq!(done.exit(), Some(2), "{bad}");
        assert!(!place.path("c.off").exists());
    }
}

#[test]
fn two_meshes_are_compared_by_kind_of_tetrahedron() {
    let place = Place::new();
    for (store, options) in [("a", ""), ("b", "--subdomains 2")] {
        let line = format!("mesh {SAMPLE} -o {store}.tetdb {options}");
        place.run_line(&line).succeeds();
    }
    let same = place.run_line("compare a.tetdb a.tetdb --json").succeeds().json();
    assert_eq!(same["same"], true);
    let done = place.run_line("compare a.tetdb b.tetdb --json");
    assert_eq!(done.exit(), Some(7));
    let found = done.json();
    assert_eq!(found["first"]["at_interface"]["tets"], 0);
    for mesh in ["first", "second"] {
        let count = |kind: &str| number(&found[mesh][kind]["tets"]);
        assert_eq!(count("forced") + count("unforced"), count("all"));
    }
    assert!(number(&found["second"]["at_interface"]["tets"]) > 1000.0);
    let text = place.run_line("compare a.tetdb b.tetdb").stdout();
    assert!(text.contains("at interfaces") && text.contains("the meshes differ"), "{text}");
}
