//! Sheets inside a volume become faces with tetrahedra on both sides in every step, or are refused with a place.
//!
//! Why: a fault that has a hole, or is not where it was given, conducts what it should seal.
//! How: a box with faults on a grid, from a sample and from files; sheets of a few triangles in wrong places.

use super::place::Place;

const FAULTS: &str = "sample:faults,count=6,cells=4";
/// Large enough for four sub-domains.
const MANY: &str = "sample:faults,count=6,cells=28";

/// A box from 0 to 1 with twelve triangles, without the first `skipped`.
fn shell(skipped: usize) -> String {
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n";
    let faces = [
        "1 3 4", "1 4 2", "5 6 8", "5 8 7", "1 2 6", "1 6 5", "3 7 8", "3 8 4", "1 5 7", "1 7 3",
        "2 4 8", "2 8 6",
    ];
    let faces: Vec<String> = faces[skipped..].iter().map(|f| format!("f {f}\n")).collect();
    points.to_owned() + &faces.concat()
}

fn obj(points: &[[f64; 3]], faces: &[[usize; 3]]) -> String {
    let points = points.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = faces.iter().map(|[a, b, c]| format!("f {a} {b} {c}\n"));
    points.chain(faces).collect()
}

#[test]
fn faults_are_faces_with_tetrahedra_on_both_sides_in_one_piece_and_in_several() {
    let place = Place::new();
    let mut counts = Vec::new();
    for (store, n) in [("one", 1), ("four", 4)] {
        let line = format!("mesh {MANY} -o {store}.tetdb --subdomains {n}");
        place.run_line(&line).succeeds();
        let verified = place.run_line(&format!("verify {store}.tetdb --full --json")).succeeds();
        assert_eq!(verified.json()["triangles_missing"], 0, "{store}");
        let info = place.run_line(&format!("info {store}.tetdb --json")).succeeds().json();
        assert_eq!(info["subdomains"].as_array().map(Vec::len), Some(n));
        // No fault separates regions.
        assert_eq!(info["regions"].as_array().map(Vec::len), Some(1));
        let line = format!("query {store}.tetdb --json --select id --touching-sheet");
        let found = place.run_line(&line).succeeds().stdout();
        counts.push(found.lines().count());
        let of_label = format!("query {store}.tetdb --json --select id --label fault-1");
        assert!(place.run_line(&of_label).succeeds().stdout().lines().count() >= 2);
    }
    assert!(counts.iter().all(|&n| n > 100), "{counts:?}");
    place.check_four(MANY);
}

#[test]
fn sheets_of_files_keep_their_names_and_give_the_mesh_of_the_sample() {
    let place = Place::new();
    let sample = FAULTS.trim_start_matches("sample:");
    place.run_line(&format!("sample {sample} -o box.obj")).succeeds();
    place
        .run_line("mesh box.obj --embed box_sheets.obj --name box_sheets.obj=faults -o files.tetdb")
        .succeeds();
    place.run_line(&format!("mesh {FAULTS} -o sample.tetdb")).succeeds();
    assert_eq!(place.digest("files.tetdb"), place.digest("sample.tetdb"));
    let labels = place.run_line("info files.tetdb --json").succeeds().json()["labels"].clone();
    let labels: Vec<&str> =
        labels.as_array().expect("a list").iter().filter_map(|l| l.as_str()).collect();
    assert!(labels[0] == "box" && labels.contains(&"faults:fault-1"), "{labels:?}");
    // The finished mesh of this job is recognized. The recorded surface is read again with its sheets.
    let same = "mesh box.obj --embed box_sheets.obj --name box_sheets.obj=faults -o files.tetdb";
    assert!(place.run_line(same).succeeds().stderr().contains("already holds"));
    place.run_line("verify files.tetdb --full").succeeds();
    place.run_line("export files.tetdb files.msh").succeeds();
    let text = std::fs::read(place.path("files.msh")).expect("it was written");
    assert!(text.windows(14).any(|w| w == b"faults:fault-1"));
}

#[test]
fn open_parts_of_a_surface_are_sheets_when_they_are_allowed() {
    let place = Place::new();
    let sheet = obj(
        &[[0.2, 0.2, 0.5], [0.8, 0.3, 0.5], [0.5, 0.8, 0.6], [0.9, 0.9, 0.4]],
        &[[9, 10, 11], [10, 12, 11]],
    );
    place.write("all.obj", shell(0) + &sheet);
    let run = place.run_line("mesh all.obj --json");
    assert_eq!(run.error()["code"], "open-surface");
    place.run_line("mesh all.obj --allow-open").succeeds();
    place.run_line("verify all.tetdb --full").succeeds();
    let sheets = place.run_line("query all.tetdb --touching-sheet --json --select id");
    assert_eq!(sheets.succeeds().stdout().lines().count(), 4);
    // Without its sides, the whole surface is one sheet and encloses nothing.
    place.write("open.obj", shell(1));
    let run = place.run_line("mesh open.obj --allow-open --json");
    assert_eq!(run.error()["code"], "sheet-outside");
}

#[test]
fn sheets_in_wrong_places_are_refused_with_the_place() {
    let place = Place::new();
    place.write("box.obj", shell(0));
    place.write("open.obj", shell(1));
    let good = [[0.25, 0.25, 0.5], [0.75, 0.25, 0.5], [0.5, 0.75, 0.625]];
    let one: &[[usize; 3]] = &[[1, 2, 3]];
    let place_of = |name: &str, points: &[[f64; 3]], faces: &[[usize; 3]]| {
        place.write(name, obj(points, faces));
    };
    place_of("good.obj", &good, one);
    place_of("outside.obj", &[[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.0]], one);
    place_of("through.obj", &[[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [0.5, 0.6, 0.9]], one);
    place_of("touching.obj", &[[0.5, 0.5, 0.5], [1.0, 0.5, 0.6], [0.5, 0.6, 0.9]], one);
    place_of("on_edge.obj", &[[0.5, 0.5, 0.5], [1.0, 0.0, 0.5], [0.5, 0.6, 0.9]], one);
    place_of("in_face.obj", &[[0.2, 0.2, 0.0], [0.8, 0.3, 0.0], [0.5, 0.8, 0.0]], one);
    place_of("of_shell.obj", &[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]], one);
    place_of("of_shell_back.obj", &[[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]], one);
    place_of("line.obj", &[[0.2, 0.2, 0.2], [0.4, 0.4, 0.4], [0.6, 0.6, 0.6]], one);
    place_of("twice.obj", &good, &[[1, 2, 3], [2, 3, 1]]);
    place_of("twice_back.obj", &good, &[[1, 2, 3], [2, 1, 3]]);
    let more = |p: [[f64; 3]; 3]| [good.to_vec(), p.to_vec()].concat();
    let two: &[[usize; 3]] = &[[1, 2, 3], [4, 5, 6]];
    place_of("cross.obj", &more([[0.5, 0.4, 0.2], [0.5, 0.5, 0.9], [0.4, 0.4, 0.9]]), two);
    place_of("corner.obj", &more([[0.375, 0.5, 0.5625], [0.3, 0.9, 0.9], [0.2, 0.9, 0.9]]), two);
    place.write("nan.obj", "v 0.1 0.1 nan\nv 0.2 0.1 0.1\nv 0.1 0.3 0.1\nf 1 2 3\n");
    place.write("index.obj", "v 0.1 0.1 0.2\nv 0.2 0.1 0.1\nv 0.1 0.3 0.1\nf 1 2 4\n");
    place.write("empty.obj", "");
    place.write("points.obj", "v 0.1 0.1 0.2\nv 0.2 0.1 0.1\n");
    place.write("text.stl", "no stl at all");
    for (surface, sheet, code) in [
        ("box.obj", "outside.obj", "sheet-outside"),
        ("box.obj", "through.obj", "self-intersection"),
        ("box.obj", "touching.obj", "self-intersection"),
        ("box.obj", "on_edge.obj", "self-intersection"),
        ("box.obj", "in_face.obj", "self-intersection"),
        ("box.obj", "of_shell.obj", "duplicate-triangle"),
        ("box.obj", "of_shell_back.obj", "duplicate-triangle"),
        ("box.obj", "box.obj", "duplicate-triangle"),
        ("box.obj", "line.obj", "degenerate-triangle"),
        ("box.obj", "twice.obj", "duplicate-triangle"),
        ("box.obj", "twice_back.obj", "duplicate-triangle"),
        ("box.obj", "cross.obj", "self-intersection"),
        ("box.obj", "corner.obj", "self-intersection"),
        ("open.obj", "good.obj", "open-surface"),
        ("good.obj", "box.obj", "open-surface"),
        ("box.obj", "nan.obj", "not-a-number"),
        ("box.obj", "index.obj", "index-out-of-range"),
        ("box.obj", "empty.obj", "empty-surface"),
        ("box.obj", "points.obj", "empty-surface"),
        ("box.obj", "text.stl", "truncated-file"),
        ("box.obj", "nothing.obj", "unreadable-file"),
    ] {
        let run = place.run_line(&format!("mesh {surface} --embed {sheet} -o s.tetdb --json"));
        assert_eq!(run.exit(), Some(3), "{sheet}");
        let error = run.error();
        assert_eq!(error["code"], code, "{sheet}: {error}");
        assert!(!error["where"].is_null() || code == "unreadable-file", "{sheet}: {error}");
        assert!(!place.path("s.tetdb").exists(), "{sheet}");
    }
    let run = place.run_line("mesh box.obj --embed good.obj --name other.obj=x --json");
    assert_eq!(run.error()["code"], "usage");
    place.run_line("mesh box.obj --embed good.obj").succeeds();
}
