//! Sizes from a background mesh, or at the surface's own vertices.
//!
//! Why: solvers report where they need small elements as numbers at vertices.
//! How: small files are written here. The mesh must follow them, must not depend on how it is created, and each fault must be named.

use super::place::Place;
use serde_json::Value;
use std::fmt::Write;

/// The cube from `-1` to `2` in six tetrahedra.
fn background(place: &Place) {
    let mut text = "MeshVersionFormatted 2\nDimension 3\nVertices\n8\n".to_owned();
    for k in 0..8 {
        let at = |axis: usize| if k >> axis & 1 == 1 { 2 } else { -1 };
        let _ = writeln!(text, "{} {} {} 0", at(0), at(1), at(2));
    }
    text +=
        "Tetrahedra\n6\n1 2 4 8 1\n1 2 6 8 1\n1 3 4 8 1\n1 3 7 8 1\n1 5 6 8 1\n1 5 7 8 1\nEnd\n";
    place.write("back.mesh", text);
}

/// Sizes from `low` at x = -1 to `high` at x = 2.
fn sizes(place: &Place, low: &str, high: &str) {
    let values = [low, high].repeat(4).join("\n");
    let head = "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n8\n1 1\n";
    place.write("back.sol", format!("{head}{values}\nEnd\n"));
}

fn tets(answer: &Value) -> f64 {
    answer["tets"].as_f64().expect("a number")
}

#[test]
fn a_background_mesh_tells_sizes() {
    let place = Place::new();
    background(&place);
    // At x = 0 one third of the range, at x = 1 two thirds.
    sizes(&place, "0.01", "0.22");
    place.write("job.toml", "size_field = \"back.sol\"\n");
    let mut digests = Vec::new();
    let mut made = Vec::new();
    for (store, options) in [
        ("a", "--size-field back.sol --threads 1 --memory 64MiB"),
        ("b", "--size-field back.mesh --threads 2 --memory 1GiB"),
        ("c", "--config job.toml"),
        ("formula", "--size-expr 0.08+0.07*x"),
    ] {
        let line = format!("mesh sample:box,h=0.25 {options} -o {store}.tetdb --json");
        made.push(tets(&place.run_line(&line).succeeds().json()));
        digests.push(place.digest(&format!("{store}.tetdb")));
    }
    assert_eq!(digests[0], digests[1]);
    assert_eq!(digests[0], digests[2]);
    // The same lengths by an expression give nearly as many tetrahedra.
    assert!((made[0] / made[3] - 1.0).abs() < 0.1, "{made:?}");
    let line = "estimate sample:box,h=0.25 --size-field back.sol --json";
    let told = tets(&place.run_line(line).succeeds().json());
    assert!((told / made[0] - 1.0).abs() < 0.15, "{told} {made:?}");
    // A file with the same name and other sizes is a different job.
    sizes(&place, "0.02", "0.22");
    let done = place.run_line("mesh sample:box,h=0.25 --size-field back.sol -o a.tetdb --json");
    assert_eq!(done.error()["code"], "store-exists");
}

#[test]
fn sizes_at_the_surfaces_own_vertices() {
    let place = Place::new();
    place.run_line("sample box,h=0.4 -o a.off").succeeds();
    let plain = place.run_line("mesh a.off -o plain.tetdb --json").succeeds();
    let plain = plain.json();
    let text = std::fs::read_to_string(place.path("a.off")).expect("a text");
    let n: usize = text.split_whitespace().nth(1).and_then(|w| w.parse().ok()).expect("a count");
    let head = format!("MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n{n}\n1 1\n");
    place.write("own.sol", head.clone() + &"0.15\n".repeat(n));
    let line = "mesh a.off --size-field own.sol -o fine.tetdb --json";
    let fine = place.run_line(line).succeeds().json();
    assert!(tets(&fine) > 3.0 * tets(&plain), "{} {}", fine["tets"], plain["tets"]);
    place.write("own.sol", head.replace(&format!("\n{n}\n"), "\n3\n") + &"0.15\n".repeat(3));
    let done = place.run_line("mesh a.off --size-field own.sol -o bad.tetdb --json");
    let error = done.error();
    assert_eq!((error["code"].as_str(), done.exit()), (Some("bad-size"), Some(2)));
    let message = error["message"].as_str().unwrap_or_default();
    assert!(message.contains(&format!("3 sizes for the {n} vertices")), "{message}");
}

#[test]
fn faults_are_named_with_their_place() {
    let place = Place::new();
    background(&place);
    let run = |code: &str, exit: i32, names: &str| {
        let line = "mesh sample:box,h=0.5 --size-field back.sol -o x.tetdb --json";
        let done = place.run_line(line);
        let error = done.error();
        assert_eq!((error["code"].as_str(), done.exit()), (Some(code), Some(exit)), "{error}");
        let said = format!("{} {}", error["message"], error["where"]);
        assert!(said.contains(names), "{said} does not name {names}");
        assert!(!place.path("x.tetdb").exists());
    };
    run("unreadable-file", 3, "back.sol");
    for (low, names) in [
        ("0", "back.sol, line 6"),
        ("-1", "found `-1`"),
        ("nan", "back.sol, line 6"),
        ("inf", "back.sol, line 6"),
    ] {
        sizes(&place, low, "0.1");
        run("unexpected-text", 3, names);
    }
    sizes(&place, "much", "0.1");
    run("not-a-number", 3, "back.sol, line 6");
    let head = "MeshVersionFormatted 2\nDimension 3\n";
    place.write("back.sol", format!("{head}SolAtVertices\n8\n1 2\n{}", "1 1 1\n".repeat(8)));
    run("unsupported-content", 3, "back.sol, line");
    place.write("back.sol", format!("{head}SolAtVertices\n3\n1 1\n1\n1\n"));
    run("count-mismatch", 3, "back.sol");
    place.write("back.sol", format!("{head}SolAtVertices\n2\n1 1\n1\n1\n"));
    run("count-mismatch", 3, "8 vertices in");
    place.write("back.sol", head);
    run("unexpected-text", 3, "SolAtVertices");
    let line = "mesh sample:box,h=0.5 --size-field back.txt -o x.tetdb --json";
    assert_eq!(place.run_line(line).error()["code"], "unknown-format");
}

#[test]
fn changed_sizes_are_noticed() {
    let place = Place::new();
    background(&place);
    sizes(&place, "0.1", "0.3");
    let line = "mesh sample:balls,count=60 --size-field back.sol -o k.tetdb --threads 1";
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut child = place.command(&words).spawn().expect("the program starts");
    // The coarse mesh is finished well after the catalog exists.
    while !place.path("k.tetdb/catalog.redb").exists() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().expect("the child can be killed");
    child.wait().expect("the child can be waited for");
    sizes(&place, "0.1", "0.4");
    let done = place.run_line("resume k.tetdb --json");
    let error = done.error();
    let expected = (Some("size-field-changed"), Some(8));
    assert_eq!((error["code"].as_str(), done.exit()), expected, "{error}");
    sizes(&place, "0.1", "0.3");
    place.run_line("resume k.tetdb").succeeds();
}
