//! Exports go to the requested place in the requested format, or nowhere.
//!
//! Why: a solver computes with whatever mesh it reads, and a mixture of two meshes looks like a mesh.
//! How: a small sample in two sub-domains. Other programs read the formats in `tests/exports.py` and `tests/solvers.py`.

use super::place::Place;

fn two_parts() -> Place {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.045 -o two.tetdb --subdomains 2 --no-verify").succeeds();
    place
}

#[test]
fn the_standard_output_gets_the_bytes_of_the_file() {
    let place = two_parts();
    for (name, word) in [
        ("a.mesh", "mesh"),
        ("a.json", "json"),
        ("a.inp", "inp"),
        ("a.mfem", "mfem"),
        ("a.su2", "su2"),
        ("a.bdf", "bdf"),
    ] {
        place.run_line(&format!("export two.tetdb {name}")).succeeds();
        let before = place.names();
        let line = format!("export two.tetdb - --format {word}");
        let written = place.run_line(&line).succeeds().stdout();
        let file = std::fs::read_to_string(place.path(name)).expect("it was written");
        assert!(written == file, "{word}");
        assert_eq!(place.names(), before);
    }
    for refused in [
        "export two.tetdb - --format vtkhdf",
        "export two.tetdb - --format exo",
        "export two.tetdb - --format mesh --json",
        "export two.tetdb - --format mesh --pieces",
        "export two.tetdb b.vtu --ascii",
    ] {
        assert_eq!(place.run_line(refused).exit(), Some(2), "{refused}");
    }
    for unknown in ["export two.tetdb -", "export two.tetdb a --format cgns"] {
        assert_eq!(place.run_line(unknown).exit(), Some(3), "{unknown}");
    }
}

#[test]
fn a_format_given_by_its_word_is_that_of_the_ending() {
    let place = two_parts();
    place.run_line("export two.tetdb a.msh").succeeds();
    place.run_line("export two.tetdb plain --format msh").succeeds();
    let read = |name: &str| std::fs::read(place.path(name)).expect("it was written");
    assert!(read("a.msh") == read("plain"));
    place.run_line("export two.tetdb a.msh --format msh22").succeeds();
    assert!(read("a.msh").starts_with(b"$MeshFormat\n2.2 1 8\n"));
}

#[test]
fn a_case_of_more_processors_is_left_as_it_is() {
    let place = two_parts();
    std::fs::create_dir_all(place.path("case/processor2")).expect("a folder");
    let refused = place.run_line("export two.tetdb case/a.foam --pieces");
    assert_eq!(refused.exit(), Some(6), "{}", refused.stderr());
    let names = || std::fs::read_dir(place.path("case")).expect("a folder");
    assert_eq!(names().count(), 1, "nothing was written");
    std::fs::remove_dir(place.path("case/processor2")).expect("it is empty");
    place.run_line("export two.tetdb case/a.foam --pieces --subdomain 1").succeeds();
    let mut there: Vec<_> = names().map(|e| e.expect("an entry").file_name()).collect();
    there.sort();
    assert_eq!(there, ["a.foam", "processor1"]);
}
