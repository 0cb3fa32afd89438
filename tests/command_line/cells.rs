//! The boundary of a mesh of volume cells is a surface like any other; messages name files and quote paths.
//!
//! Why: a file with tetrahedra alone has all that a surface needs, and a number of a triangle helps only with its file.
//! How: a mesh is exported, its tetrahedra are read again, meshed and resumed; defects of several files are looked up.

use super::odd_inputs::{cube_at, off};
use super::place::Place;

#[test]
fn tetrahedra_of_a_file_are_meshed_again() {
    let place = Place::new();
    place.run_line("mesh sample:balls,count=2 -o a.tetdb --regions all").succeeds();
    place.run_line("export a.tetdb a.mesh a.msh a.ele").succeeds();
    let volume = |info: &serde_json::Value| -> f64 {
        let regions = info["regions"].as_array().expect("regions");
        regions.iter().filter(|r| r["filled"] == true).filter_map(|r| r["volume"].as_f64()).sum()
    };
    for (n, file) in ["boundary-of:a.mesh", "boundary-of:a.msh", "a.ele"].into_iter().enumerate() {
        let store = format!("{n}.tetdb");
        let line = format!("mesh {file} -o {store} --regions all --coarse-only");
        let text = place.run_line(&line).succeeds().stderr();
        assert!(text.contains("the boundary of"), "{text}");
        place.run_line(&format!("resume {store}")).succeeds();
        let info = place.run_line(&format!("info {store} --json")).json();
        assert!((volume(&info) - 1.0).abs() < 1e-9, "{file}: {info}");
        place.run_line(&format!("verify {store} --full --against {file}")).succeeds();
    }
    let error = place.run_line("mesh boundary-of:no.msh --json").error();
    assert_eq!(error["code"], "unreadable-file", "{error}");
    place.write("a.off", off(&cube_at(0.0, 0.0, 0.0)));
    let error = place.run_line("mesh boundary-of:a.off --json").error();
    assert_eq!(error["code"], "unsupported-content", "{error}");
}

#[test]
fn triangles_of_several_files_are_named_with_their_file() {
    let place = Place::new();
    place.write("one.off", off(&cube_at(0.0, 0.0, 0.0)));
    place.write("two.off", off(&cube_at(0.5, 0.5, 0.5)));
    let text = place.run_line("check one.off two.off").stdout();
    assert!(
        text.contains(" of one.off and triangle ") && text.contains(" of two.off meet"),
        "{text}"
    );
    let answer = place.run_line("check one.off two.off --json").json();
    let sources = &answer["defects"][0]["sources"];
    assert_eq!(sources[0]["file"], "one.off", "{answer}");
    assert!(sources[1]["triangle"].as_u64().is_some_and(|t| t < 12), "{answer}");
    let error = place.run_line("mesh one.off two.off --json").error();
    assert!(error["where"].to_string().contains(" of two.off"), "{error}");
    place.write("open.off", off(&cube_at(3.0, 0.0, 0.0)[..11]));
    let error = place.run_line("mesh one.off open.off --json").error();
    assert!(error["message"].to_string().contains(" of open.off"), "{error}");
    // One file needs no name.
    let text = place.run_line("check open.off").stdout();
    assert!(!text.contains(" of open.off"), "{text}");
}

#[test]
fn printed_commands_are_words_of_a_shell() {
    let place = Place::new();
    place.write("my part's.off", off(&cube_at(0.0, 0.0, 0.0)));
    let text = place.run(&["mesh", "my part's.off", "-o", "my store.tetdb"]).succeeds().stderr();
    assert!(text.contains("`tetdb report 'my store.tetdb' 'my store.html'`"), "{text}");
    let repeated = [cube_at(0.0, 0.0, 0.0), cube_at(0.0, 0.0, 0.0)[..1].to_vec()].concat();
    place.write("my part's.off", off(&repeated));
    let text = place.run(&["check", "my part's.off"]).stdout();
    assert!(text.contains(r"`tetdb check 'my part'\''s.off' --repair"), "{text}");
}

#[test]
fn steps_of_short_coordinates_are_noted_where_they_explain_crossings() {
    let place = Place::new();
    // Two cubes that should touch, far from the origin: the second begins a step of 32 bits too early.
    let [low, step] = [8388.0f32, 8388.0f32.next_down()];
    let at = |x: f32| cube_at(f64::from(x), 8000.0, 8000.0);
    place.write("a.off", off(&at(low - 1.0)));
    place.write("b.off", off(&at(step)));
    let text = place.run_line("check a.off b.off").stdout();
    assert!(text.contains("32-bit numbers"), "{text}");
    place.write("b.off", off(&at(low - 0.5)));
    let text = place.run_line("check a.off b.off").stdout();
    assert!(text.contains("self-intersection") && !text.contains("32-bit"), "{text}");
}

#[test]
fn what_a_format_does_not_keep_is_said() {
    let place = Place::new();
    let text = place.run_line("sample balls,count=2 -o a.off").succeeds().stderr();
    assert!(text.contains("no place for the labels"), "{text}");
    place.run_line("mesh sample:balls,count=2 -o a.tetdb").succeeds();
    let text = place.run_line("export a.tetdb a.mesh").succeeds().stderr();
    assert!(text.contains("numbers in place of the names"), "{text}");
}
