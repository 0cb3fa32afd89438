//! Labels and sheets of an exported mesh come back with an import.
//!
//! Why: the formats of VTK have tetrahedra and triangles in two files, and who imports the first loses the labels.
//! How: a box with a sheet goes out and comes back; then the second file is that of another mesh, or damaged.

use super::place::Place;

/// The boundary that an export writes beside its tetrahedra has the labels, and the triangles of sheets.
#[test]
fn the_boundary_beside_a_mesh_is_taken() {
    let place = Place::new();
    let sheet =
        "OFF\n4 2 0\n0.2 0.2 0.5\n0.8 0.2 0.5\n0.8 0.8 0.5\n0.2 0.8 0.5\n3 0 1 2\n3 0 2 3\n";
    place.write("middle.off", sheet);
    let mesh = "mesh sample:box,h=0.3 --embed middle.off -o a.tetdb --subdomains 2 --no-verify";
    place.run_line(mesh).succeeds();
    let before = place.run_line("info a.tetdb --json").succeeds().json();
    for ending in ["vtu", "vtkhdf"] {
        place.run_line(&format!("export a.tetdb b.{ending}")).succeeds();
        let import = format!("import b.{ending} -o b.tetdb --force");
        let taken = place.run_line(&import).succeeds();
        let note = format!("taken from b_boundary.{ending} beside it");
        assert!(taken.stderr().contains(&note), "{}", taken.stderr());
        let after = place.run_line("info b.tetdb --json").succeeds().json();
        let labels = |info: &serde_json::Value| {
            let list = info["labels"].as_array().expect("labels").iter();
            list.map(|label| label.to_string()).collect::<std::collections::BTreeSet<_>>()
        };
        assert_eq!(labels(&before), labels(&after));
        assert_eq!(before["input_triangles"], after["input_triangles"]);

        // A boundary of another mesh stays away.
        place.run_line("mesh sample:box,h=0.25 -o other.tetdb --no-verify --force").succeeds();
        place.run_line(&format!("export other.tetdb c.{ending}")).succeeds();
        let boundary = |name: &str| place.path(&format!("{name}_boundary.{ending}"));
        std::fs::copy(boundary("c"), boundary("b")).expect("a copy");
        let left = place.run_line(&import).succeeds();
        assert!(left.stderr().contains("is not of this mesh"), "{}", left.stderr());
        std::fs::write(boundary("b"), "no mesh").expect("writable");
        let left = place.run_line(&import).succeeds();
        assert!(left.stderr().contains("was left out"), "{}", left.stderr());
    }
    place.run_line("export a.tetdb b.npy").succeeds();
    let arrays = place.run_line("import b_tets.npy -o b.tetdb --force").succeeds();
    assert!(arrays.stderr().contains("labels have numbers for names"), "{}", arrays.stderr());
}
