//! Sub-domains are exported one by one, with everything that a parallel solver needs about their neighbors.
//!
//! Why: a mesh created in parts is used in parts. What two parts share must be equal in both files, or a solver is silently wrong.
//! How: one sample in four sub-domains. Each part is read from its own file and compared with the others and with the store's record.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::place::Place;

/// A MEDIT text file: vertices as text, triangles with their reference, number of tetrahedra.
struct Piece {
    vertices: Vec<String>,
    triangles: Vec<([usize; 3], u32)>,
    tets: usize,
}

impl Piece {
    fn read(place: &Place, name: &str) -> Self {
        let text = std::fs::read_to_string(place.path(name)).expect("the piece is there");
        let section = |keyword: &str| -> Vec<&str> {
            let mut lines = text.lines().skip_while(move |l| *l != keyword).skip(1);
            let n = lines.next().expect("a count").parse().expect("a number");
            lines.take(n).collect()
        };
        let vertices = section("Vertices").into_iter().map(str::to_owned).collect();
        let triangles = section("Triangles").into_iter().map(|line| {
            let words: Vec<usize> = line.split(' ').map(|w| w.parse().expect("a number")).collect();
            ([words[0] - 1, words[1] - 1, words[2] - 1], words[3] as u32)
        });
        Self { vertices, triangles: triangles.collect(), tets: section("Tetrahedra").len() }
    }

    /// Triangles with a reference, each as the texts of its corners in ascending order.
    fn faces(&self, reference: u32) -> HashSet<[&str; 3]> {
        let of = self.triangles.iter().filter(|t| t.1 == reference);
        of.map(|(corners, _)| {
            let mut face = corners.map(|v| self.vertices[v].as_str());
            face.sort_unstable();
            face
        })
        .collect()
    }
}

fn list(value: &Value) -> Vec<usize> {
    let items = value.as_array().expect("a list").iter();
    items.map(|v| v.as_u64().expect("a number") as usize).collect()
}

#[test]
fn what_two_parts_share_is_the_same_in_both_files() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.038 -o four.tetdb --subdomains 4").succeeds();
    place.run_line("export four.tetdb part.mesh --pieces").succeeds();
    place.run_line("export four.tetdb topology.json").succeeds();
    let info = place.run_line("info four.tetdb --json").succeeds().json();
    let parts = info["subdomains"].as_array().expect("a list");
    let n_labels = info["labels"].as_array().expect("a list").len() as u32;
    let pieces: Vec<Piece> =
        (0..parts.len()).map(|rank| Piece::read(&place, &format!("part_{rank:05}.mesh"))).collect();
    assert_eq!(pieces.len(), 4);
    for (piece, part) in pieces.iter().zip(parts) {
        assert_eq!(piece.tets as u64, part["tets"]);
        assert_eq!(piece.vertices.len() as u64, part["vertices"]);
        let faces = part["facets"].as_u64().expect("a number")
            + part["interface_faces"].as_u64().expect("a number");
        assert_eq!(piece.triangles.len() as u64, faces);
    }
    let text = std::fs::read_to_string(place.path("topology.json")).expect("the topology");
    let topology: Value = serde_json::from_str(&text).expect("JSON");
    let mut shared_faces = BTreeMap::new();
    for pair in topology["pairs"].as_array().expect("a list") {
        let [low, high] =
            ["low", "high"].map(|side| pair[side].as_u64().expect("a number") as usize);
        let numbers = list(&pair["vertices"][0]);
        assert!(low < high && !numbers.is_empty());
        let others = list(&pair["vertices"][1]);
        assert_eq!(numbers.len(), others.len());
        for (&a, &b) in numbers.iter().zip(&others) {
            assert_eq!(pieces[low].vertices[a], pieces[high].vertices[b]);
        }
        // Points are written from exact coordinates, so equal text means the same vertex.
        let here: HashSet<&String> = pieces[low].vertices.iter().collect();
        let both = pieces[high].vertices.iter().filter(|v| here.contains(v)).count();
        assert_eq!(both, numbers.len(), "{low} and {high} share vertices that are not listed");
        let reference = |other: usize| n_labels + other as u32 + 1;
        let faces = pieces[low].faces(reference(high));
        assert_eq!(faces, pieces[high].faces(reference(low)));
        assert_eq!(faces.len(), list(&pair["faces"][0]).len());
        assert_eq!(faces.len(), list(&pair["faces"][1]).len());
        if !faces.is_empty() {
            shared_faces.insert((low, high), faces.len() as u64);
        }
    }
    let told = info["interfaces"].as_array().expect("a list").iter();
    let mut by_pair = BTreeMap::new();
    for row in told {
        let [low, high, faces] =
            ["low", "high", "faces"].map(|key| row[key].as_u64().expect("a number"));
        *by_pair.entry((low as usize, high as usize)).or_insert(0) += faces;
    }
    assert_eq!(shared_faces, by_pair);
}

#[test]
fn some_parts_are_a_mesh_with_a_closed_boundary() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.045 -o three.tetdb --subdomains 3").succeeds();
    place.run_line("export three.tetdb two.mesh --subdomain 0,1").succeeds();
    let two = Piece::read(&place, "two.mesh");
    let mut edges = BTreeMap::new();
    for (corners, _) in &two.triangles {
        for i in 0..3 {
            let [a, b] = [corners[i], corners[(i + 1) % 3]];
            *edges.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
        }
    }
    assert!(!edges.is_empty() && edges.values().all(|n| n % 2 == 0), "the boundary has a rim");
    // The boundary is a valid surface, which can be meshed.
    place.run_line("check two.mesh").succeeds();
    let nine = place.run_line("export three.tetdb nine.mesh --subdomain 9");
    assert_eq!(nine.exit(), Some(3));
    let faces = place.run_line("export three.tetdb faces.msh --interfaces");
    assert_eq!(faces.exit(), Some(2));
    assert!(!place.path("nine.mesh").exists() && !place.path("faces.msh").exists());
    place.run_line("export three.tetdb faces.vtu --interfaces").succeeds();
}

#[test]
fn regions_apart_are_closed_and_together_the_whole() {
    let place = Place::new();
    place
        .run_line("mesh sample:balls,count=4 -o all.tetdb --regions all --subdomains 3")
        .succeeds();
    let info = place.run_line("info all.tetdb --json").succeeds().json();
    let regions = info["regions"].as_array().expect("a list").iter();
    let mut left = info["tets"].as_u64().expect("a number") as usize;
    for row in regions.filter(|row| row["filled"] == true) {
        let region = &row["region"];
        let line = format!("export all.tetdb one.mesh --region {region}");
        place.run_line(&line).succeeds();
        let one = Piece::read(&place, "one.mesh");
        assert_eq!(one.tets as u64, row["tets"]);
        place.run_line("check one.mesh").succeeds();
        place.run_line(&format!("{line} --pieces")).succeeds();
        let pieces = (0..3).map(|rank| format!("one_{rank:05}.mesh"));
        let there = pieces.filter(|name| place.path(name).exists());
        let in_pieces: usize = there
            .map(|name| {
                let piece = Piece::read(&place, &name);
                std::fs::remove_file(place.path(&name)).expect("it is there");
                piece.tets
            })
            .sum();
        assert_eq!(in_pieces, one.tets);
        left -= one.tets;
    }
    assert_eq!(left, 0);
    for (line, code) in [
        ("export all.tetdb x.mesh --region 99", 3),
        ("export all.tetdb x.mesh --region nowhere", 2),
        ("export all.tetdb x.mfem --region 1 --pieces", 2),
        ("export all.tetdb x.json --region 1", 2),
        ("export all.tetdb x.json --subdomain 1", 2),
        ("export all.tetdb x.mfem --order 2", 2),
        ("export all.tetdb x.vtu --ghosts", 2),
    ] {
        assert_eq!(place.run_line(line).exit(), Some(code), "{line}");
    }
}

#[test]
fn shares_of_an_export_in_pieces_are_together_that_of_one_process() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.038 -o four.tetdb --subdomains 4").succeeds();
    std::fs::create_dir(place.path("one")).expect("a folder");
    for out in ["a.pvtu", "a.vtu --region 1", "a.msh", "a.mfem", "a.foam"] {
        let export = |folder: &str, more: &str| {
            let line = format!("export four.tetdb {folder}/{out} --pieces {more}");
            place.run_line(&line).succeeds();
        };
        export("one", "");
        // With more shares than sub-domains, some shares are empty.
        for of in [2, 5] {
            let folder = format!("of-{of}");
            std::fs::create_dir_all(place.path(&folder)).expect("a folder");
            (1..=of).for_each(|k| export(&folder, &format!("--share {k}/{of}")));
        }
    }
    let expected = contents(&place.path("one"));
    for of in ["of-2", "of-5"] {
        assert!(contents(&place.path(of)) == expected, "{of}");
    }
    for refused in ["a.vtu --share 1/2", "a.pvtu --share 3/2", "a.pvtu --share 0/0"] {
        let line = format!("export four.tetdb {refused}");
        assert_eq!(place.run_line(&line).exit(), Some(2), "{refused}");
    }
}

/// Bytes of all files in a folder and its subfolders, by relative path.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    let name = path.strip_prefix(folder).expect("it is below");
                    let bytes = std::fs::read(&path).expect("it is there");
                    found.insert(name.to_owned(), bytes);
                }
            }
        }
    }
    found
}

#[test]
fn pieces_are_the_same_whoever_writes_them() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.038 -o four.tetdb --subdomains 4").succeeds();
    let outs = [
        "part.mesh",
        "part.vtu --order 2",
        "part.inp",
        "part.su2",
        "part.exo",
        "part.xdmf",
        "part.bdf",
        "part.msh --ghosts --order 2",
        "part.mfem",
        "part.foam",
    ];
    for (i, out) in outs.iter().enumerate() {
        for folder in ["all", "each"] {
            std::fs::create_dir_all(place.path(&format!("{folder}{i}"))).expect("a folder");
        }
        let words = format!("export four.tetdb all{i}/{out} --pieces");
        place.run_line(&words).succeeds();
        // Four independent processes at once.
        let tasks: Vec<_> = (0..4)
            .map(|rank| {
                let words = format!("export four.tetdb each{i}/{out} --pieces --subdomain {rank}");
                let words: Vec<&str> = words.split_whitespace().collect();
                place.command(&words).spawn().expect("the program starts")
            })
            .collect();
        for task in tasks {
            let done = task.wait_with_output().expect("it ends");
            assert!(done.status.success(), "{out}: {done:?}");
        }
        let files = |folder: &str| files_below(&place.path(&format!("{folder}{i}")));
        let (all, each) = (files("all"), files("each"));
        assert!(all.len() >= 4);
        assert!(all == each, "{out}: {:?} {:?}", all.keys(), each.keys());
    }
}

/// All files in a folder and its direct subfolders, by relative path.
fn files_below(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("the folder is readable") {
        let path = entry.expect("an entry is readable").path();
        let name = PathBuf::from(path.file_name().expect("entries have names"));
        if path.is_dir() {
            let inner = files_below(&path).into_iter();
            files.extend(inner.map(|(path, bytes)| (name.join(path), bytes)));
        } else {
            let bytes = std::fs::read(&path).expect("the file is readable");
            files.insert(name, bytes);
        }
    }
    files
}
