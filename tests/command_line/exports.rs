//! Exports go to the requested place in the requested format, or nowhere.
//!
//! Why: a solver computes with whatever mesh it reads, and a mixture of two meshes looks like a mesh.
//! How: a small sample in two sub-domains. Other programs read the formats in `tests/exports.py` and `tests/solvers.py`.

use std::collections::BTreeSet;

use super::fields::doubles;
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

/// The words of 4 bytes of an array file, less its head.
fn words(place: &Place, file: &str) -> Vec<u32> {
    let bytes = std::fs::read(place.path(file)).expect("the file is there");
    let head = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let words = bytes[head..].chunks_exact(4);
    words.map(|word| u32::from_le_bytes(word.try_into().expect("four bytes"))).collect()
}

/// The inner shells bound no filled region: a solver would have unknowns without equations at their vertices.
#[test]
fn only_vertices_of_tetrahedra_are_written() {
    for subdomains in [1, 2] {
        let place = Place::new();
        let shells = "sample:shells,count=3,h=0.12 --regions outer --hsiz 0.05";
        let line = format!("mesh {shells} -o a.tetdb --subdomains {subdomains} --no-verify");
        place.run_line(&line).succeeds();
        let info = place.run_line("info a.tetdb --json").succeeds().json();
        assert_eq!(info["subdomains"].as_array().expect("a list").len(), subdomains);
        place.run_line("field a.tetdb add T --at vertices --from x+2*y").succeeds();
        place.run_line("export a.tetdb m.npy").succeeds();
        let (points, tets) = (doubles(&place, "m_points.npy"), words(&place, "m_tets.npy"));
        let used: BTreeSet<u32> = tets.iter().copied().collect();
        assert_eq!(used.len() * 3, points.len());
        assert_eq!(used.last(), Some(&(used.len() as u32 - 1)));
        let all = info["subdomains"].as_array().expect("a list").iter();
        let all: u64 = all.map(|part| part["vertices"].as_u64().expect("a number")).sum();
        assert!(all > used.len() as u64, "the store has the vertices of all triangles");

        // Values in the order of an export, and by ids, are those of the vertices that are written.
        for (name, from) in [("by_order", "m_T.npy"), ("by_id", "m_T.npy --ids m_vertex_id.npy")] {
            place
                .run_line(&format!("field a.tetdb add {name} --at vertices --from {from}"))
                .succeeds();
        }
        place.run_line("export a.tetdb n.npy").succeeds();
        for name in ["n_by_order.npy", "n_by_id.npy"] {
            assert!(doubles(&place, name) == doubles(&place, "m_T.npy"), "{name}");
        }
        place.run_line("field a.tetdb drop T").succeeds();

        // The pieces have the vertices of their tetrahedra, and a list of neighbors their numbers.
        place.run_line("export a.tetdb p.mfem --pieces").succeeds();
        std::fs::create_dir(place.path("case")).expect("a folder");
        place.run_line("export a.tetdb case/p.foam --pieces").succeeds();
        place.run_line("export a.tetdb p.npy --pieces").succeeds();
        place.run_line("export a.tetdb p.json").succeeds();
        let text = std::fs::read_to_string(place.path("p.json")).expect("it was written");
        let topology: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        for rank in 0..subdomains {
            let used: BTreeSet<u32> =
                words(&place, &format!("p_{rank:05}_tets.npy")).into_iter().collect();
            let n = used.len();
            assert_eq!(n * 3, doubles(&place, &format!("p_{rank:05}_points.npy")).len());
            assert_eq!(topology["subdomains"][rank]["vertices"], n);
            let mfem = std::fs::read_to_string(place.path(&format!("p.{rank:06}")));
            assert!(mfem.expect("it was written").contains(&format!("\nvertices\n{n}\n3\n")));
            let points = format!("case/processor{rank}/constant/polyMesh/pointProcAddressing");
            let bytes = std::fs::read(place.path(&points)).expect("it was written");
            let text = String::from_utf8_lossy(&bytes).into_owned();
            assert!(text.contains(&format!("\n{n}\n")), "{points}");
        }

        // Another program takes the mesh whole.
        place.run_line("export a.tetdb b.mesh").succeeds();
        let import = place.run_line("import b.mesh -o b.tetdb").succeeds();
        assert!(!import.stderr().contains("no tetrahedron"), "{}", import.stderr());
    }
}
