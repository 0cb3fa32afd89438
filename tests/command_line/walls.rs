//! A wall between two solids keeps the labels of both.
//!
//! Why: boundary conditions refer to labels, and a label that is lost on a wall is lost silently.
//! How: two adjacent cubes, each a file, with the wall between them in both files or in one.

use std::fmt::Write;

use super::place::Place;

/// Sides as corners (bits x, y, z), seen from outside: first the side at low x, then the one at high x.
const SIDES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// A unit cube starting at `x` as OBJ, without the first `skipped` sides.
fn cube(x: f64, skipped: usize) -> String {
    let mut text = String::new();
    for c in 0..8 {
        let [dx, y, z] = [c & 1, c >> 1 & 1, c >> 2];
        writeln!(text, "v {} {y} {z}", x + dx as f64).expect("text grows");
    }
    for side in &SIDES[skipped..] {
        let [a, b, c, d] = side.map(|v| v + 1);
        writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").expect("text grows");
    }
    text
}

#[test]
fn a_wall_in_two_files_keeps_both_labels() {
    let place = Place::new();
    place.write("left.obj", cube(0.0, 0));
    place.write("right.obj", cube(1.0, 0));
    place.run_line("mesh left.obj right.obj -o two.tetdb --hsiz 0.5").succeeds();
    // All six sides of each cube have their own names, and nothing else is present.
    for (label, x) in [("left", [0.0, 1.0]), ("right", [1.0, 2.0])] {
        let line = format!("query two.tetdb --label {label} --json");
        let found = place.run_line(&line).succeeds().stdout();
        assert_eq!(found.lines().count(), 12, "{label}");
        for hit in found.lines() {
            let hit: serde_json::Value = serde_json::from_str(hit).expect("a line is an object");
            let centroid = |p: &serde_json::Value| p[0].as_f64().expect("a number");
            let points = hit["points"].as_array().expect("points");
            let mean = points.iter().map(centroid).sum::<f64>() / 4.0;
            assert!(mean > x[0] && mean < x[1], "{label}: {hit}");
        }
    }
    place.run_line("export two.tetdb two.mesh").succeeds();
    let mesh = std::fs::read_to_string(place.path("two.mesh")).expect("it was written");
    let triangles = mesh.split("Triangles\n").nth(1).expect("there are some");
    let triangles: Vec<&str> = triangles.lines().skip(1).take(24).collect();
    for label in ["1", "2"] {
        let own = triangles.iter().filter(|t| t.split(' ').nth(3) == Some(label));
        assert_eq!(own.count(), 12, "{triangles:?}");
    }
    place.run_line("verify two.tetdb --full").succeeds();
}

#[test]
fn walls_that_contradict_filling_by_orientation_are_named_as_the_reason() {
    let place = Place::new();
    place.write("left.obj", cube(0.0, 0));
    place.write("right.obj", cube(1.0, 1));
    let run =
        place.run_line("mesh left.obj right.obj -o two.tetdb --regions by-orientation --json");
    assert_eq!(run.exit(), Some(3));
    let error = run.error();
    assert_eq!(error["code"], "contradicting-orientation");
    assert!(error["help"].to_string().contains("--regions all"), "{error}");
    place.run_line("mesh left.obj right.obj -o two.tetdb --regions all").succeeds();
}

#[test]
fn points_of_a_poly_that_mark_holes_and_regions_are_noted() {
    let place = Place::new();
    let text = "4 3\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n\n4\n1\n3 0 2 1\n1\n3 0 1 3\n1\n3 1 2 3\n1\n3 0 3 2\n\
        1\n1 0.1 0.1 0.1\n2\n1 0.2 0.2 0.2 7 0.1\n2 0.3 0.2 0.2 8\n";
    place.write("part.poly", text);
    let said = place.run_line("check part.poly").succeeds().stderr();
    for words in ["hole points (1) leave their", "regions of the file (2) are filled"] {
        assert!(said.contains(words), "{said}");
    }
}
