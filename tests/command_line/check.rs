//! `check` reports the defects of a surface and how to repair them, and repairs only on request.
//!
//! Why: a surface that is changed silently is a different surface.
//! How: cubes with holes, cracks and repeated triangles are checked, repaired, checked again and meshed. The folder is compared before
//! and after.

use super::json::NEEDLES;
use super::odd_inputs::{Triangles, cube_at, off};
use super::place::Place;
use serde_json::json;

/// A cube whose sides are displaced, each by `step` more than the one before.
fn cracked(step: f64) -> Triangles {
    let mut triangles = cube_at(0.0, 0.0, 0.0);
    for (t, corners) in triangles.iter_mut().enumerate() {
        for p in corners {
            p[0] += step * (t / 2) as f64;
        }
    }
    triangles
}

#[test]
fn an_open_surface_tells_its_holes() {
    let place = Place::new();
    place.write("open.off", off(&cube_at(0.0, 0.0, 0.0)[..10]));
    let names = place.names();
    let done = place.run_line("check open.off --json");
    let answer = done.json();
    assert_eq!(done.exit(), Some(3));
    assert_eq!(answer["open_edges"], 4);
    let rim = &answer["open_loops"][0];
    assert_eq!((&rim["edges"], rim["length"].as_f64()), (&4.into(), Some(4.0)), "{rim}");
    assert!(rim["at"].is_array() && rim["triangle"].is_u64(), "{rim}");
    assert!(answer["closing"]["smallest"].is_null(), "{answer}");
    let text = place.run_line("check open.off").stdout();
    assert!(text.contains("4 open edges around 1 hole"), "{text}");
    assert!(text.contains("joining points does not close it"), "{text}");
    assert_eq!(place.names(), names);
}

#[test]
fn a_t_junction_is_named_and_divided() {
    let mut triangles = cube_at(0.0, 0.0, 0.0);
    let [a, b, c] = triangles[0];
    let middle = [0, 1, 2].map(|i| (a[i] + c[i]) / 2.0);
    triangles[0] = [a, b, middle];
    triangles.push([middle, b, c]);
    let place = Place::new();
    place.write("a.off", off(&triangles));
    let error = place.run_line("mesh a.off --json").error();
    assert!(error["message"].as_str().is_some_and(|m| m.contains("T-junction")), "{error}");
    let answer = place.run_line("check a.off --json").json();
    assert_eq!(answer["t_junctions"][0]["distance"], 0.0, "{answer}");
    assert_eq!(answer["closing"]["smallest"], 0.0, "{answer}");
    let text = place.run_line("check a.off").stdout();
    assert!(text.contains("1 T-junction"), "{text}");
    let answer = place.run_line("check a.off --repair --write b.off --json").succeeds().json();
    assert_eq!(answer["repair"]["divided"], 1, "{answer}");
    place.run_line("mesh b.off").succeeds();
}

#[test]
fn a_crack_is_joined_only_when_told_to() {
    let place = Place::new();
    place.write("a.off", off(&cracked(1e-7)));
    let answer = place.run_line("check a.off --json").json();
    assert_eq!(answer["closing"]["smallest"], 1e-6, "{answer}");
    let text = place.run_line("check a.off").stdout();
    let command = "check a.off --repair --weld 1e-6 --write OUT";
    assert!(text.contains(command), "{text}");
    let done = place.run_line("check a.off --repair --write fixed.off");
    assert_eq!(done.exit(), Some(3));
    assert!(done.stderr().contains("still with"), "{}", done.stderr());
    let done = place.run_line(&command.replace("OUT", "fixed.off")).succeeds();
    assert!(done.stdout().contains(" points joined"), "{}", done.stdout());
    assert!(done.stderr().contains("free of defects"), "{}", done.stderr());
    place.run_line("mesh fixed.off").succeeds();
}

#[test]
fn each_repair_is_counted() {
    let mut triangles = cube_at(0.0, 0.0, 0.0);
    triangles[5].swap(0, 1);
    triangles.push(triangles[2]);
    let [a, b, _] = triangles[0];
    triangles.push([a, b, b]);
    let place = Place::new();
    place.write("a.off", off(&triangles));
    let done = place.run_line("check a.off --repair --write b.stl --json").succeeds();
    let answer = done.json();
    let repair = &answer["repair"];
    let counts = ["collapsed_dropped", "repeated_dropped", "turned", "divided", "points_joined"]
        .map(|field| repair[field].as_u64());
    assert_eq!(counts, [Some(1), Some(1), Some(1), Some(0), Some(0)], "{answer}");
    assert_eq!(repair["before"]["n_defects"], 2, "{answer}");
    assert_eq!((&answer["triangles"], &answer["valid"]), (&12.into(), &true.into()));
    assert_eq!(answer["written"]["file"], "b.stl");
    place.run_line("mesh b.stl").succeeds();
}

#[test]
fn bad_triangles_are_written_to_be_looked_at() {
    let mut triangles = cube_at(0.0, 0.0, 0.0);
    triangles.push(triangles[2]);
    triangles.extend(cube_at(0.3, 0.4, 0.5));
    let place = Place::new();
    place.write("a.off", off(&triangles));
    let done = place.run_line("check a.off --write-bad bad.vtu --json");
    let answer = done.json();
    assert_eq!(done.exit(), Some(3));
    let n = answer["bad_triangles"]["triangles"].as_u64().expect("a count");
    let mut ids: Vec<u64> = answer["defects"]
        .as_array()
        .expect("a list")
        .iter()
        .flat_map(|d| d["triangles"].as_array().expect("a list"))
        .map(|t| t.as_u64().expect("an id"))
        .collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len() as u64, n, "{answer}");
    let bytes = std::fs::read(place.path("bad.vtu")).expect("the file was written");
    let head = String::from_utf8_lossy(&bytes);
    let piece = format!("NumberOfPoints=\"{}\" NumberOfCells=\"{n}\"", 3 * n);
    assert!(head.contains(&piece), "{head}");
    for array in ["defect", "defects", "input_id", "label", "defect_names"] {
        assert!(head.contains(&format!("Name=\"{array}\"")), "{head}");
    }
    let error = place.run_line("check a.off --write-bad bad.txt --json").error();
    assert_eq!(error["code"], "unknown-format", "{error}");
}

#[test]
fn without_bad_triangles_no_file_is_written() {
    let place = Place::new();
    place.write("a.off", off(&cube_at(0.0, 0.0, 0.0)));
    let answer = place.run_line("check a.off --write-bad bad.vtu --json").json();
    assert_eq!(answer["bad_triangles"]["triangles"], 0, "{answer}");
    assert!(answer["bad_triangles"]["file"].is_null(), "{answer}");
    assert!(!place.path("bad.vtu").exists());
}

#[test]
fn fitness_is_told_and_advice_given() {
    let place = Place::new();
    let answer = place.run_line("check sample:knot,h=0.2 --json").succeeds().json();
    let fitness = &answer["fitness"];
    assert_eq!(fitness["small_angles"], 0, "{answer}");
    assert!(fitness["tets_expected"].as_f64() > Some(100.0), "{answer}");
    assert_eq!(answer["advice"].as_array().map(Vec::len), Some(0), "{answer}");
    let mut flat = cube_at(0.0, 0.0, 0.0);
    for p in flat.iter_mut().flatten() {
        p[2] *= 0.01;
    }
    place.write("flat.off", off(&flat));
    let text = place.run_line("check flat.off").succeeds().stdout();
    assert!(text.contains("66.67 % of the triangles"), "{text}");
    assert!(text.contains("advice: 8 triangles"), "{text}");
}

#[test]
fn cures_of_needles_are_tried_and_keep_their_promise() {
    let place = Place::new();
    place.write("needles.off", NEEDLES);
    let answer = place.run_line("check needles.off --json").succeeds().json();
    assert!(answer["fitness"]["least_quality"].as_f64() > Some(1e4));
    let cure = &answer["cures"][0];
    assert_eq!((&cure["way"], &cure["weld"]), (&json!("weld"), &json!(1e-5)));
    let text = place.run_line("check needles.off").succeeds().stdout();
    let command = "`tetdb check needles.off --repair --weld 1e-5 --write OUT`";
    assert!(text.contains(&format!("cure: {command}")), "{text}");
    let command = "check needles.off --repair --weld 1e-5 --write mended.off";
    place.run_line(command).succeeds();
    let mended = place.run_line("check mended.off --json").succeeds().json();
    assert_eq!(mended["triangles"], cure["triangles"]);
    assert_eq!(mended["fitness"]["hopeless_triangles"], 0);
    assert_eq!(mended["cures"], json!([]));
}

#[test]
fn options_without_meaning_are_refused_before_anything_is_written() {
    let place = Place::new();
    place.write("a.off", off(&cube_at(0.0, 0.0, 0.0)));
    let names = place.names();
    for (line, word) in [
        ("check a.off --repair", "usage"),
        ("check a.off --write b.off", "usage"),
        ("check a.off --weld 1e-6", "usage"),
        ("check a.off --repair --write a.off", "usage"),
        ("check a.off --repair --weld 0 --write b.off", "bad-size"),
        ("check a.off --repair --weld 1 --write b.off", "bad-size"),
        ("check a.off --repair --weld x --write b.off", "bad-size"),
        ("check a.off --repair --write b.txt", "unknown-format"),
    ] {
        let done = place.run_line(&format!("{line} --json"));
        assert_eq!(done.error()["code"], word, "{line}");
        assert_eq!(place.names(), names, "{line}");
    }
}

/// The fields that scripts rely on are present.
#[test]
fn the_answer_has_its_fields() {
    let place = Place::new();
    let answer = place.run_line("check sample:box,h=0.5 --json").json();
    let mut fields: Vec<&String> = answer.as_object().expect("an object").keys().collect();
    fields.sort();
    assert_eq!(
        fields,
        [
            "advice",
            "bounds",
            "closing",
            "cures",
            "defects",
            "edges",
            "enclosing",
            "fitness",
            "label_sets",
            "labels",
            "n_defects",
            "nonmanifold_edges",
            "open_edges",
            "open_loops",
            "parts",
            "resolving",
            "schema",
            "t_junctions",
            "triangles",
            "turned_triangles",
            "two_sided_triangles",
            "valid",
            "vertices",
        ]
    );
}

#[test]
fn a_wrap_is_named_where_nothing_cheaper_works() {
    let place = Place::new();
    place.run_line("sample broken,kind=soup,seed=3 -o soup.off").succeeds();
    let one = cube_at(0.0, 0.0, 0.0);
    place.write("two.off", off(&one[..2]));
    place.write("one.off", off(&one[..1]));
    for file in ["two.off", "one.off", "soup.off"] {
        let said = place.run_line(&format!("check {file}"));
        assert_eq!(said.exit(), Some(3), "{file}");
        let named = said.stdout().contains(&format!("tetdb mesh {file} --repair wrap"));
        let cheaper = said.stdout().contains("--repair winding");
        assert!(named != cheaper, "{file}: {}", said.stdout());
    }
}
