//! Small stores exported and read back by other means than those that wrote them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use tetdb_schema::code::Code;

use tetdb_schema::ids::{Owner, SubdomainId, VertexId};
use tetdb_schema::record::{
    FACES, InterfaceFace, NO_TET, SealedFacet, SealedTet, SealedVertex, tag,
};

use super::*;
use crate::read::read_surface;
use tetdb_base::geom::Point;
use tetdb_base::storage::RemoteFailure;
use tetdb_base::surface::{Surface, SurfaceBuilder};
use tetdb_schema::catalog::{Job, StoreState};
use tetdb_store::sealed::SealedWriter;
use tetdb_store::store::{Catalog, two_subdomains};

type Outcome<T = ()> = std::result::Result<T, Box<dyn std::error::Error>>;

/// A mesh as a reader of the file sees it; all by position.
#[derive(Debug, PartialEq, Default)]
struct Seen {
    points: Vec<[f64; 3]>,
    tets: Vec<[usize; 4]>,
    regions: Vec<u32>,
}

impl Seen {
    /// Corners of each tetrahedron, its nodes sorted by position, with its region: free of any numbering.
    fn canonical(&self) -> Vec<([[u64; 3]; 4], u32)> {
        let mut all: Vec<_> = self
            .tets
            .iter()
            .zip(&self.regions)
            .map(|(t, &region)| {
                let mut corners = t.map(|v| self.points[v].map(f64::to_bits));
                corners.sort_unstable();
                (corners, region)
            })
            .collect();
        all.sort_unstable();
        all
    }

    fn volume(&self) -> f64 {
        let volume = |t: &[usize; 4]| {
            let [a, b, c, d] = t.map(|v| Point::from_array(self.points[v]));
            (b - a).dot((c - a).cross(d - a)) / 6.0
        };
        self.tets.iter().map(volume).sum()
    }
}

/// Arrays of a VTU file by group and name, found by the offsets in its head.
struct Vtu {
    arrays: BTreeMap<String, Vec<u8>>,
    head: String,
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let at = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[at..].split('"').next()
}

impl Vtu {
    fn read(path: &Path) -> Outcome<Self> {
        let bytes = std::fs::read(path)?;
        let mark = b"<AppendedData encoding=\"raw\">\n   _";
        let begin = bytes.windows(mark.len()).position(|w| w == mark);
        let begin = begin.ok_or("no appended data")? + mark.len();
        let head = String::from_utf8(bytes[..begin].to_vec())?;
        let mut arrays = BTreeMap::new();
        let (mut group, mut end) = (String::new(), 0);
        for line in head.lines().map(str::trim) {
            if let (Some(name), Some(offset)) = (attribute(line, "Name"), attribute(line, "offset"))
            {
                let at = begin + offset.parse::<usize>()?;
                let length = u64::from_le_bytes(bytes[at..at + 8].try_into()?) as usize;
                let array = bytes[at + 8..at + 8 + length].to_vec();
                arrays.insert(format!("{group}.{name}"), array);
                end = end.max(at + 8 + length);
            } else if !line.starts_with("</") {
                group = line.trim_matches(['<', '>']).to_owned();
            }
        }
        assert!(bytes[end..].starts_with(b"\n  </AppendedData>"));
        Ok(Self { arrays, head })
    }

    fn numbers<const N: usize, T>(&self, name: &str, of: fn([u8; N]) -> T) -> Vec<T> {
        let bytes = &self.arrays[name];
        assert_eq!(bytes.len() % N, 0);
        let number = |c: &[u8]| of(c.try_into().expect("N bytes"));
        bytes.chunks(N).map(number).collect()
    }

    fn points(&self) -> Vec<[f64; 3]> {
        let x = self.numbers("Points.Points", f64::from_le_bytes);
        x.chunks(3).map(|p| [p[0], p[1], p[2]]).collect()
    }

    fn seen(&self) -> Seen {
        let nodes = self.numbers("Cells.connectivity", i32::from_le_bytes);
        let seen = Seen {
            points: self.points(),
            tets: nodes.chunks(4).map(|t| [0, 1, 2, 3].map(|i| t[i] as usize)).collect(),
            regions: self.numbers("CellData.region", u32::from_le_bytes),
        };
        let ends = self.numbers("Cells.offsets", i32::from_le_bytes);
        assert!(ends.iter().zip(1..).all(|(&end, i)| end == 4 * i));
        assert_eq!(self.arrays["Cells.types"], vec![10; seen.tets.len()]);
        seen
    }
}

/// The numbers of a NumPy file, whose head must tell this type and inner shape.
fn npy(path: &Path, kind: &str, inner: &str) -> Outcome<Vec<u8>> {
    let bytes = std::fs::read(path)?;
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let head = std::str::from_utf8(&bytes[10..start])?.to_owned();
    assert!(bytes.starts_with(b"\x93NUMPY\x01\x00") && start % 64 == 0 && head.ends_with('\n'));
    assert!(head.contains(&format!("'descr': {kind},")), "{head}");
    let rows = head.split("'shape': (").nth(1).and_then(|s| s.split(',').next());
    let rows: usize = rows.ok_or("a shape")?.parse()?;
    assert!(head.contains(&format!("({rows},{inner})")), "{head}");
    let width: usize = kind[3..4].parse()?;
    let numbers = inner.trim().parse().unwrap_or(1);
    assert_eq!(bytes.len() - start, rows * width * numbers);
    Ok(bytes[start..].to_vec())
}

fn seen_in_npy(stem: &Path) -> Outcome<Seen> {
    let file = |name: &str| format!("{}_{name}.npy", stem.display()).into();
    let load = |name: &str, kind, inner| -> Outcome<Vec<u8>> {
        let path: std::path::PathBuf = file(name);
        npy(&path, kind, inner)
    };
    let numbers = |bytes: Vec<u8>| -> Vec<u32> {
        let words = bytes.chunks(4);
        words.map(|c| u32::from_le_bytes(c.try_into().expect("four"))).collect()
    };
    let points = load("points", "'<f8'", " 3")?;
    let doubles = points.chunks(8);
    let x: Vec<f64> = doubles.map(|c| f64::from_le_bytes(c.try_into().expect("eight"))).collect();
    Ok(Seen {
        points: x.chunks(3).map(|p| [p[0], p[1], p[2]]).collect(),
        tets: numbers(load("tets", "'<i4'", " 4")?)
            .chunks(4)
            .map(|t| [0, 1, 2, 3].map(|i| t[i] as usize))
            .collect(),
        regions: numbers(load("region", "'<u4'", "")?),
    })
}

/// The numbers of a MEDIT text file after a keyword.
fn medit(path: &Path, keyword: &str) -> Outcome<Vec<f64>> {
    let text = std::fs::read_to_string(path)?;
    let section = text.split(&format!("\n{keyword}\n")).nth(1);
    let mut words = section.ok_or("a section")?.split_whitespace();
    let _count = words.next();
    Ok(words.map_while(|w| w.parse().ok()).collect())
}

fn seen_in_medit(path: &Path) -> Outcome<Seen> {
    let mut seen = Seen::default();
    for v in medit(path, "Vertices")?.chunks(4) {
        seen.points.push([v[0], v[1], v[2]]);
    }
    for t in medit(path, "Tetrahedra")?.chunks(5) {
        seen.tets.push([0, 1, 2, 3].map(|i| t[i] as usize - 1));
        seen.regions.push(t[4] as u32);
    }
    Ok(seen)
}

fn quiet(_: u64, _: u64) {}

/// Cubes cut into six tetrahedra each, `n` a side, in two sub-domains and two regions, labels by side.
fn cubes(path: &Path, n: u32) -> Outcome {
    let mut catalog = Catalog::create(path, &Job::default())?;
    let scale = 0.1; // no coordinate but zero is short in binary
    let corner = |i: u32, j: u32, k: u32| (k * (n + 1) + j) * (n + 1) + i;
    let place = |g: u32| [g % (n + 1), g / (n + 1) % (n + 1), g / (n + 1) / (n + 1)];
    let half = n / 2;
    let mut parts = Vec::new();
    for rank in 0..2 {
        let id = SubdomainId::new(rank).ok_or("a rank")?;
        let mut writer = SealedWriter::create(catalog.file_path(rank, 1), id, 1, 4 << 20)?;
        let mut local = BTreeMap::new();
        let keep = |x: u32| if rank == 0 { x <= half } else { x >= half };
        // Backwards, so that shared vertices stand at different places in the two parts.
        let mut all: Vec<u32> = (0..(n + 1).pow(3)).filter(|&g| keep(place(g)[0])).collect();
        if rank == 1 {
            all.reverse();
        }
        for g in all {
            let p = place(g);
            let (owner, index) = if p.iter().any(|&x| x == 0 || x == n) {
                (Owner::Surface, g)
            } else if p[0] == half {
                (Owner::Cut(1), g)
            } else {
                (Owner::Subdomain(id), local.len() as u32)
            };
            writer.push_vertex(SealedVertex {
                point: p.map(|x| f64::from(x) * scale),
                h: 0.1,
                tag: tag::FREE,
                id: VertexId { owner, index }.number(),
            })?;
            local.insert(g, local.len() as u32);
        }
        let mut tets = Vec::new();
        for g in 0..(n + 1).pow(3) {
            let [i, j, k] = place(g);
            let mine = if rank == 0 { i < half } else { i >= half };
            if i == n || j == n || k == n || !mine {
                continue;
            }
            for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
                let mut at = [i, j, k];
                let mut path = [corner(i, j, k); 4];
                for (step, axis) in (1..).zip(order) {
                    at[axis] += 1;
                    path[step] = corner(at[0], at[1], at[2]);
                }
                let odd = (order[0] + 1) % 3 != order[1];
                if odd {
                    path.swap(2, 3);
                }
                tets.push((path, 1 + u32::from(k * 2 >= n)));
            }
        }
        let numbered = |&(nodes, region): &([u32; 4], u32)| (nodes.map(|g| local[&g]), region);
        writer.push_all_tets(tets.iter().map(numbered))?;
        push_hull(&mut writer, &tets, &local, rank, half, n, place)?;
        parts.push(writer.finish()?);
    }
    catalog.commit(|step| {
        for part in &parts {
            step.list_file(part.row.rank, 1);
            step.set_subdomain(&part.row);
        }
        step.set_labels(&vec!["low \"side\"".to_owned(), "other".to_owned()]);
        step.set_state(StoreState::Sealed);
        Ok(())
    })?;
    Ok(catalog.close()?)
}

fn push_hull(
    writer: &mut SealedWriter,
    tets: &[([u32; 4], u32)],
    local: &BTreeMap<u32, u32>,
    rank: u32,
    half: u32,
    n: u32,
    place: impl Fn(u32) -> [u32; 3],
) -> Outcome {
    for (t, &(nodes, region)) in (0u32..).zip(tets) {
        let sealed = SealedTet { nodes, region };
        for corners in FACES {
            let face = corners.map(|c| sealed.nodes[c]);
            let on = |axis: usize, x: u32| face.iter().all(|&g| place(g)[axis] == x);
            let vertices = face.map(|g| local[&g]);
            let ends = (0..3).any(|axis| on(axis, 0) || on(axis, n));
            if ends {
                // The input's number: any that does not depend on the sub-domain.
                let mut sorted = face;
                sorted.sort_unstable();
                let triangle = sorted.iter().fold(0, |a, &g| a * 10_000 + u64::from(g));
                writer.push_facet(SealedFacet {
                    vertices,
                    label: u32::from(!on(2, 0)),
                    triangle,
                    regions: [0, region],
                    tets: [NO_TET, t],
                })?;
            } else if on(0, half) {
                // The same number on both sides, another for each face.
                let mut sorted = face.map(|g| place(g)[1] * (n + 1) + place(g)[2]);
                sorted.sort_unstable();
                let index = sorted.iter().fold(0, |a, p| a * (n + 1).pow(2) + p);
                writer.push_interface_face(InterfaceFace {
                    vertices,
                    cut: 1,
                    index,
                    other: 1 - rank,
                    tet: t,
                })?;
            }
        }
    }
    Ok(())
}

#[test]
fn two_subdomains_become_one_mesh_in_every_format() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    two_subdomains(&path)?;
    let mut store = Catalog::open(&path)?;
    for name in ["a.vtu", "a.mesh", "a.meshb", "a.msh", "a.inp"] {
        let out = dir.path().join(name);
        std::fs::write(&out, b"what was there before")?;
        let report = export(&mut store, &out, &ExportSelection::default(), 1 << 20, &quiet)?;
        // Gmsh's file has the face between the two besides.
        let triangles = if name == "a.msh" { 7 } else { 6 };
        let found = (report.vertices, report.tets, report.triangles);
        assert_eq!(found, (5, 2, triangles));
        for (file, bytes) in report.files {
            assert_eq!(std::fs::metadata(file)?.len(), bytes);
        }
    }
    assert_eq!(std::fs::read_dir(dir.path())?.count(), 7, "five files, the boundary and the store");
    let seen = Vtu::read(&dir.path().join("a.vtu"))?.seen();
    assert_eq!((seen.points.len(), seen.volume()), (5, 0.5));
    assert_eq!(seen, seen_in_medit(&dir.path().join("a.mesh"))?);
    let boundary = Vtu::read(&dir.path().join("a_boundary.vtu"))?;
    let ids = boundary.numbers("CellData.input_id", i64::from_le_bytes);
    assert_eq!(ids, [0, 1, 2, 3, 4, 5]);
    let fronts = boundary.numbers("CellData.region_front", u32::from_le_bytes);
    assert_eq!(fronts, [0; 6]);
    let inp = std::fs::read_to_string(dir.path().join("a.inp"))?;
    assert!(inp.contains("*SURFACE, TYPE=ELEMENT, NAME=label_0\n1,S1\n1,S2\n1,S4\n2,S"), "{inp}");
    assert!(inp.contains("*NSET, NSET=label_0\n1,2,3,4,5\n"), "{inp}");
    Ok(())
}

#[test]
fn the_cards_of_nastran_and_the_names_of_exodus_are_in_place() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    two_subdomains(&path)?;
    let mut store = Catalog::open(&path)?;
    let mut written = |name: &str| -> Outcome<Vec<u8>> {
        let out = dir.path().join(name);
        export(&mut store, &out, &ExportSelection::default(), 1 << 20, &quiet)?;
        Ok(std::fs::read(out)?)
    };
    let deck = String::from_utf8(written("a.bdf")?)?;
    let n_cards = |card: &str| deck.lines().filter(|line| line.starts_with(card)).count();
    let cards =
        ["GRID*   ", "*       ", "CTETRA  ", "CTRIA3  ", "PSOLID  ", "PSHELL  ", "$ digest "];
    assert_eq!(cards.map(n_cards), [5, 5, 2, 6, 1, 1, 1]);
    assert!(deck.lines().all(|line| line.len() <= 80), "{deck}");
    assert!(deck.contains("GRID*   1                               0."), "{deck}");
    assert!(
        deck.contains("\nCTRIA3  3       2       "),
        "triangles follow, with the label's property: {deck}"
    );
    let exodus = written("a.exo")?;
    assert!(exodus.starts_with(b"CDF\x02"));
    let has = |text: &[u8]| exodus.windows(text.len()).any(|window| window == text);
    for text in ["eb_names", "ss_names", "connect1", "elem_ss1", "vals_elem_var2eb1", "digest "] {
        assert!(has(text.as_bytes()), "{text}");
    }
    assert!(has(b"label_0\0\0") && has(b"region_1\0\0") && has(b"quality\0\0"));
    assert_eq!(exodus.len() % 4, 0);
    Ok(())
}

#[test]
fn shared_vertices_are_one_and_the_boundary_is_whole() -> Outcome {
    let dir = tempfile::tempdir()?;
    let (n, path) = (6, dir.path().join("cubes.tetdb"));
    cubes(&path, n)?;
    let mut store = Catalog::open(&path)?;
    let out = dir.path().join("c.vtu");
    let report = export(&mut store, &out, &ExportSelection::default(), 1 << 20, &quiet)?;
    let counts = [(n + 1).pow(3), 6 * n.pow(3), 12 * n * n].map(u64::from);
    assert_eq!([report.vertices, report.tets, report.triangles], counts);
    let vtu = Vtu::read(&out)?;
    let seen = vtu.seen();
    let side = f64::from(n) * 0.1;
    assert!((seen.volume() - side.powi(3)).abs() < 1e-12);
    let mut points = seen.points.clone();
    points.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
    points.dedup();
    assert_eq!(points.len(), seen.points.len(), "no point twice");
    assert!(seen.points.iter().flatten().any(|x| *x == 0.1 * 3.0));
    let qualities = vtu.numbers("CellData.quality", f64::from_le_bytes);
    assert!(qualities.iter().all(|q| (1.0..3.0).contains(q)));
    // The cubes' six tetrahedra have faces on the surface where the cube has, and there the surface forces a part of it.
    let excesses = vtu.numbers("CellData.excess", f64::from_le_bytes);
    let pairs = || excesses.iter().zip(&qualities);
    assert!(pairs().all(|(e, q)| (1.0..=*q).contains(e)));
    assert!(pairs().any(|(e, q)| e == q) && pairs().any(|(e, q)| e < q));
    let ids = vtu.numbers("CellData.global_id", u64::from_le_bytes);
    assert!(ids.windows(2).all(|w| w[0] < w[1]));
    assert_eq!(ids[ids.len() / 2], 1 << 29);
    let ranks = vtu.numbers("CellData.subdomain", u32::from_le_bytes);
    assert_eq!(ranks.iter().sum::<u32>() as usize * 2, ranks.len());
    let report = export(
        &mut store,
        &dir.path().join("c.npy"),
        &ExportSelection::default(),
        1 << 20,
        &quiet,
    )?;
    assert_eq!(report.files.len(), 10);
    let arrays = seen_in_npy(&dir.path().join("c"))?;
    assert_eq!(arrays, seen);
    let ids_too = npy(&dir.path().join("c_global_id.npy"), "'<i8'", "")?;
    assert_eq!(ids_too, vtu.arrays["CellData.global_id"]);
    let triangles = npy(&dir.path().join("c_triangles.npy"), "'<i4'", " 3")?;
    assert_eq!(triangles.len() as u64, 12 * report.triangles);
    let text = dir.path().join("c.mesh");
    export(&mut store, &text, &ExportSelection::default(), 1 << 20, &quiet)?;
    assert_eq!(seen_in_medit(&text)?.canonical(), seen.canonical());
    Ok(())
}

#[test]
fn boundaries_read_back_as_the_surface() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("cubes.tetdb");
    cubes(&path, 4)?;
    let mut store = Catalog::open(&path)?;
    let triangles = |s: &Surface| {
        let corners = |t: u32| s.corners(t).map(|p| p.to_array().map(f64::to_bits));
        (0..s.n_triangles() as u32).map(corners).collect::<Vec<_>>()
    };
    let boundary = dir.path().join("b.vtu");
    export(&mut store, &boundary, &ExportSelection::default(), 1 << 20, &quiet)?;
    let vtu = Vtu::read(&dir.path().join("b_boundary.vtu"))?;
    let points = vtu.points();
    let nodes = vtu.numbers("Cells.connectivity", i32::from_le_bytes);
    let labels = vtu.numbers("CellData.label", u32::from_le_bytes);
    let expected: Vec<_> = nodes
        .chunks(3)
        .map(|t| [0, 1, 2].map(|i| points[t[i] as usize].map(f64::to_bits)))
        .collect();
    assert!(vtu.head.contains("111 116 104 101 114 0 "), "other");
    let whole = Vtu::read(&boundary)?.points();
    let place = vtu.numbers("PointData.mesh_vertex", i64::from_le_bytes);
    assert!(place.iter().zip(&points).all(|(&v, p)| whole[v as usize] == *p));
    for (name, format) in [("b.mesh", None), ("b.meshb", None), ("b.msh", Some(MeshFormat::Gmsh22))]
    {
        let out = dir.path().join(name);
        let selection = ExportSelection { format, ..ExportSelection::default() };
        export(&mut store, &out, &selection, 1 << 20, &quiet)?;
        let surface = read_surface(&[out], 1 << 30)?;
        assert_eq!(triangles(&surface), expected, "{name}");
        let runs = |l: &[u32]| l.windows(2).map(|w| w[0] == w[1]).collect::<Vec<_>>();
        assert_eq!(runs(&surface.labels), runs(&labels), "{name}");
        if name == "b.msh" {
            let mut names = surface.label_names;
            names.sort();
            assert_eq!(names, ["low 'side'", "other"]);
        }
    }
    Ok(())
}

#[test]
fn files_do_not_depend_on_the_memory() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("cubes.tetdb");
    cubes(&path, 20)?;
    let mut store = Catalog::open(&path)?;
    let names = [
        "m.vtu", "m.meshb", "m.inp", "m.vtkhdf", "m.msh", "m.foam", "m.mfem", "m.su2", "m.exo",
        "m.xdmf", "m.bdf",
    ];
    for (name, pieces) in names.iter().flat_map(|n| [(n, false), (n, true)]) {
        let selection = ExportSelection { pieces, ..ExportSelection::default() };
        let mut files = Vec::new();
        for memory in [1 << 16, 64 << 20] {
            let report = export(&mut store, &dir.path().join(name), &selection, memory, &quiet)?;
            let read = report.files.iter().map(|(file, _)| std::fs::read(file));
            files.push(read.collect::<std::io::Result<Vec<_>>>()?);
        }
        assert!(files[0] == files[1], "{name}, pieces: {pieces}");
    }
    Ok(())
}

#[test]
fn a_surface_read_from_partitions_has_all_triangles_and_labels() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("cubes.tetdb");
    cubes(&path, 4)?;
    let mut store = Catalog::open(&path)?;
    let mut seen = Vec::new();
    for (format, ascii) in
        [(MeshFormat::Gmsh22, false), (MeshFormat::Gmsh, false), (MeshFormat::Gmsh, true)]
    {
        let selection = ExportSelection {
            format: Some(format),
            ascii,
            ghosts: format == MeshFormat::Gmsh,
            ..ExportSelection::default()
        };
        let out = dir.path().join("s.msh");
        export(&mut store, &out, &selection, 1 << 20, &quiet)?;
        let surface = read_surface(&[out], 1 << 30)?;
        let mut triangles: Vec<_> = (0..surface.n_triangles() as u32)
            .map(|t| {
                let corners = surface.corners(t).map(|p| p.to_array().map(f64::to_bits));
                let label = surface.labels[t as usize] as usize;
                (corners, surface.label_names[label].clone())
            })
            .collect();
        triangles.sort_unstable();
        seen.push(triangles);
    }
    assert!(seen[0] == seen[1] && seen[1] == seen[2]);
    Ok(())
}

#[test]
fn pieces_are_the_same_written_together_or_alone() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("cubes.tetdb");
    cubes(&path, 6)?;
    let mut store = Catalog::open(&path)?;
    for name in ["p.foam", "p.msh", "p.vtu"] {
        let mut written = BTreeMap::new();
        for subdomains in [vec![], vec![0], vec![1]] {
            let selection = ExportSelection {
                subdomains: subdomains.into_iter().collect(),
                pieces: true,
                ..ExportSelection::default()
            };
            let out = dir.path().join(name);
            let report = export(&mut store, &out, &selection, 1 << 20, &quiet)?;
            for (file, _) in report.files {
                let bytes = std::fs::read(&file)?;
                let first = written.entry(file.clone()).or_insert(bytes.clone());
                assert!(*first == bytes, "{}", file.display());
            }
        }
    }
    Ok(())
}

/// One of two writers in one process: ends of what the first tells, and of what the second says.
struct OneOfTwo {
    number: u32,
    file: (Sender<PathBuf>, Receiver<PathBuf>),
    done: (Sender<bool>, Receiver<bool>),
}

impl Writers for OneOfTwo {
    fn share(&self) -> Share {
        Share { number: self.number, of: 2 }
    }
    fn announce(&self, file: &Path) {
        self.file.0.send(file.to_owned()).expect("a receiver");
    }
    fn hear(&self) -> Option<PathBuf> {
        self.file.1.recv().ok()
    }
    fn say(&self, done: std::result::Result<(), RemoteFailure>) {
        self.done.0.send(done.is_ok()).expect("a receiver");
    }
    fn wait(&self) -> std::result::Result<(), RemoteFailure> {
        assert!(self.done.1.recv().expect("a sender"));
        Ok(())
    }
}

#[test]
fn partitions_by_several_writers_are_those_of_one() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("cubes.tetdb");
    cubes(&path, 12)?;
    let out = |name: &str| dir.path().join(name);
    let selection = ExportSelection::default();
    assert!(selection.is_shared_file(MeshFormat::VtkHdf));
    let mut store = Catalog::open(&path)?;
    let alone = out("alone.vtkhdf");
    let one = export(&mut store, &alone, &selection, 1 << 20, &quiet)?;
    let (to_second, told) = channel();
    let (to_first, said) = channel();
    let writers = [
        (1, (to_second, channel().1), (channel().0, said)),
        (2, (channel().0, told), (to_first, channel().1)),
    ];
    let export_part = |(number, file, done)| {
        let writer = OneOfTwo { number, file, done };
        let mut store = Catalog::open(&path).expect("a store");
        let what = (&out("shared.vtkhdf") as &Path, &selection);
        export_with(&mut store, what, 1 << 20, &quiet, Some(&writer)).expect("a file")
    };
    let [first, second] = std::thread::scope(|threads| {
        let both = writers.map(|writer| threads.spawn(|| export_part(writer)));
        both.map(|thread| thread.join().expect("no panic"))
    });
    assert_eq!((first.tets, first.vertices), (one.tets, one.vertices));
    assert_eq!((second.tets, second.files.len()), (0, 0));
    assert_eq!(first.files.len(), one.files.len());
    for ((own, _), (other, _)) in one.files.iter().zip(&first.files) {
        assert!(std::fs::read(own)? == std::fs::read(other)?, "{own:?}");
    }
    Ok(())
}

#[test]
fn what_a_format_cannot_hold_is_refused() -> Outcome {
    let dir = tempfile::tempdir()?;
    let of = |name: &str, selection: ExportSelection| {
        let refused = check(&dir.path().join(name), &selection);
        refused.err().map(|error| error.code())
    };
    let text = || ExportSelection { ascii: true, ..ExportSelection::default() };
    let ghosts = |pieces| ExportSelection { ghosts: true, pieces, ..ExportSelection::default() };
    assert_eq!(of("a.vtu", text()), Some(Code::Usage));
    assert_eq!(of("a.msh", text()), None);
    assert_eq!(of("a.foam", ghosts(false)), Some(Code::Usage));
    assert_eq!(of("a.msh", ghosts(true)), None);
    assert_eq!(of("a.mfem", ghosts(false)), Some(Code::Usage));
    let vtu = ExportSelection { format: Some(MeshFormat::Vtu), ..ExportSelection::default() };
    let to_stdout = check(Path::new("-"), &vtu);
    assert_eq!(to_stdout.err().ok_or("an error")?.code(), "usage");
    Ok(())
}

#[test]
fn progress_ends_at_its_total() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    two_subdomains(&path)?;
    for name in ["p.vtu", "p.msh", "p.foam", "p.ele", "p.mfem", "p.su2", "p.exo", "p.xdmf", "p.bdf"]
    {
        let progress = std::cell::RefCell::new(Vec::new());
        let report = |done, total| progress.borrow_mut().push((done, total));
        export(
            &mut Catalog::open(&path)?,
            &dir.path().join(name),
            &ExportSelection::default(),
            1 << 20,
            &report,
        )?;
        let progress = progress.into_inner();
        let (done, total) = progress.last().copied().ok_or("no progress")?;
        assert!(done == total && progress.iter().all(|t| t.0 <= t.1 && t.1 == total));
    }
    Ok(())
}

#[test]
fn what_cannot_be_written_leaves_nothing() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    two_subdomains(&path)?;
    let mut store = Catalog::open(&path)?;
    let mut code = |name: &str| {
        let error = export(
            &mut store,
            &dir.path().join(name),
            &ExportSelection::default(),
            1 << 20,
            &quiet,
        );
        error.map(|_| "written").unwrap_or_else(|e| {
            assert!(!e.help().is_empty() && e.to_string().contains(name));
            e.code().as_str()
        })
    };
    assert_eq!(code("a.xyz"), "unknown-format");
    assert_eq!(code("nowhere/a.vtu"), "io");
    std::fs::create_dir(dir.path().join("folder.vtu"))?;
    assert_eq!(code("folder.vtu"), "io");
    std::fs::remove_file(path.join("subdomain-00001-g1.redb"))?;
    let error =
        export(&mut store, &dir.path().join("a.vtu"), &ExportSelection::default(), 1 << 20, &quiet);
    let error = error.err().ok_or("an error")?;
    assert_eq!(error.code(), "damaged");
    assert_eq!(std::fs::read_dir(dir.path())?.count(), 2, "store and folder");
    let mut outputs = output_files::OutputFiles::new(&dir.path().join("huge.vtu"))?;
    if cfg!(unix) {
        let error = outputs.create(&dir.path().join("huge.vtu"), 1 << 60);
        assert_eq!(error.err().ok_or("an error")?.code(), "disk-full");
    }
    Ok(())
}

fn tetrahedron() -> Outcome<Surface> {
    let mut builder = SurfaceBuilder::new();
    builder.begin_file("a");
    let labels = [builder.label("first one"), builder.label("second")];
    for p in [[0.1, 0., 0.], [1. / 3., 1e-7, 0.], [0., 1e20, 2.], [0.7, 0.2, -1e-30]] {
        builder.vertex(Point::from_array(p))?;
    }
    for (i, t) in [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]].into_iter().enumerate() {
        builder.triangle(t, labels[usize::from(i >= 2)])?;
    }
    builder.end_file()?;
    Ok(builder.finish())
}

#[test]
fn surfaces_read_back_bit_for_bit() -> Outcome {
    let dir = tempfile::tempdir()?;
    let exact = tetrahedron()?;
    for name in ["s.stl", "s.off", "s.obj", "s.ply"] {
        let out = dir.path().join(name);
        let report = surface(&exact, &out)?;
        let back = read_surface(std::slice::from_ref(&out), 1 << 30)?;
        assert_eq!(back.points, exact.points, "{name}");
        assert_eq!(back.triangles, exact.triangles, "{name}");
        assert_eq!(report.bytes, std::fs::metadata(&out)?.len());
        assert_eq!(report.labels_kept, name != "s.off");
        if name == "s.stl" || name == "s.obj" {
            assert_eq!(back.labels, exact.labels, "{name}");
            assert_eq!(back.label_names, exact.label_names, "{name}");
        }
    }
    let error = surface(&exact, &dir.path().join("s.stlb"));
    assert_eq!(error.err().ok_or("an error")?.code(), "lossy-format");
    let mut rounded = exact;
    for p in &mut rounded.points {
        *p = p.as_vec3().as_dvec3();
    }
    let out = dir.path().join("s.stlb");
    surface(&rounded, &out)?;
    assert_eq!(read_surface(&[out], 1 << 30)?.points, rounded.points);
    Ok(())
}
