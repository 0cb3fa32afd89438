//! Unusual files are meshed; bad files are refused with a place.
//!
//! Why: surfaces come from many programs, and a file that is read wrongly silently gives a wrong mesh.
//! How: cubes are written in every unusual way known. `mesh` must fill the right volume, or name the right line, byte or triangle and
//! leave no store. The readers have unit tests for each error; here the program runs.

use super::place::Place;

pub type Point = [f64; 3];
pub type Triangles = Vec<[Point; 3]>;

/// Corners of the unit cube as bits x, y, z; two triangles for each side, seen from outside.
const CUBE: [[usize; 3]; 12] = [
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
];
/// The same sides as quadrilaterals, seen from outside.
const SIDES: [[usize; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

fn corner(i: usize) -> Point {
    [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f64)
}

fn cube(map: impl Fn(Point) -> Point) -> Triangles {
    CUBE.iter().map(|t| t.map(|i| map(corner(i)))).collect()
}

/// The unit cube, translated.
pub fn cube_at(x: f64, y: f64, z: f64) -> Triangles {
    cube(|p| [p[0] + x, p[1] + y, p[2] + z])
}

/// Joins two surfaces.
fn both(mut a: Triangles, b: Triangles) -> Triangles {
    a.extend(b);
    a
}

/// OFF with three vertices for each triangle; the reader must weld them.
pub fn off(triangles: &[[Point; 3]]) -> String {
    let mut text = format!("OFF\n{} {} 0\n", 3 * triangles.len(), triangles.len());
    for [x, y, z] in triangles.iter().flatten() {
        text += &format!("{x:e} {y:e} {z:e}\n");
    }
    for t in 0..triangles.len() {
        text += &format!("3 {} {} {}\n", 3 * t, 3 * t + 1, 3 * t + 2);
    }
    text
}

fn stl(triangles: &[[Point; 3]]) -> String {
    let mut text = "solid cube\n".to_owned();
    for corners in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in corners {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid cube\n"
}

fn stl_binary(header: &[u8], triangles: &[[Point; 3]]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes[..header.len()].copy_from_slice(header);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        bytes.extend([0; 12]);
        for x in corners.as_flattened() {
            bytes.extend((*x as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// OBJ with faces that count back from the last vertex.
fn obj_negative() -> String {
    let mut text: String =
        (0..8).map(|i| format!("v {}\n", corner(i).map(|x| x.to_string()).join(" "))).collect();
    for t in CUBE {
        text += &format!("f {}\n", t.map(|i| (i as i64 - 8).to_string()).join(" "));
    }
    text
}

fn off_polygons() -> String {
    let mut text = "OFF\n8 6 12\n".to_owned();
    for i in 0..8 {
        text += &format!("{}\n", corner(i).map(|x| x.to_string()).join(" "));
    }
    for side in SIDES {
        text += &format!("4 {}\n", side.map(|i| i.to_string()).join(" "));
    }
    text
}

/// PLY in big-endian, with colors and normals between the coordinates, and an element before the faces.
fn ply_big_endian() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_big_endian 1.0\nobj_info odd\nelement vertex 8\nproperty uchar red\nproperty float x\n\
        property float nx\nproperty double y\nproperty float z\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n\
        element face 12\nproperty list uchar short colors\nproperty list uchar uint vertex_index\nproperty float quality\nend_header\n"
        .to_vec();
    for i in 0..8 {
        let [x, y, z] = corner(i);
        bytes.push(200);
        bytes.extend((x as f32).to_be_bytes());
        bytes.extend(7f32.to_be_bytes());
        bytes.extend(y.to_be_bytes());
        bytes.extend((z as f32).to_be_bytes());
    }
    bytes.extend([0, 0, 0, 1, 0, 0, 0, 2]);
    for t in CUBE {
        bytes.extend([2, 0, 9, 0, 9, 3]);
        for v in t {
            bytes.extend((v as u32).to_be_bytes());
        }
        bytes.extend(0.5f32.to_be_bytes());
    }
    bytes
}

/// A file that must be meshed.
struct Good {
    name: &'static str,
    bytes: Vec<u8>,
    /// Volumes of all filled regions, in order of size.
    volumes: Vec<f64>,
    /// Text that a note must contain.
    note: &'static str,
}

fn good(name: &'static str, bytes: impl Into<Vec<u8>>) -> Good {
    Good { name, bytes: bytes.into(), volumes: vec![1.0], note: "" }
}

/// A file that must be meshed, with a note.
fn noted(name: &'static str, bytes: impl Into<Vec<u8>>, note: &'static str) -> Good {
    Good { note, ..good(name, bytes) }
}

/// Two cubes of volume one.
fn pair(name: &'static str, triangles: Triangles, note: &'static str) -> Good {
    Good { volumes: vec![1.0, 1.0], ..noted(name, off(&triangles), note) }
}

/// A cube with this edge length.
fn sized(name: &'static str, edge: f64, away: f64) -> Good {
    let map = |p: Point| p.map(|x| x * edge + away);
    // The volume that the rounded coordinates enclose.
    let edge = edge + away - away;
    Good { volumes: vec![edge * edge * edge], ..good(name, off(&cube(map))) }
}

fn meshed(case: &Good) {
    let place = Place::new();
    place.write(case.name, &case.bytes);
    let done = place.run(&["mesh", case.name, "-o", "x.tetdb", "--json"]).succeeds();
    let stderr = done.stderr();
    assert!(stderr.contains(case.note), "{}: no note says {:?}: {stderr}", case.name, case.note);
    let answer = done.json();
    assert_eq!(answer["state"], "verified", "{}: {answer}", case.name);
    let mut volumes: Vec<f64> = answer["regions"]
        .as_array()
        .expect("a list of regions")
        .iter()
        .filter(|r| r["filled"] == true)
        .map(|r| r["volume"].as_f64().expect("a volume"))
        .collect();
    volumes.sort_by(f64::total_cmp);
    assert_eq!(volumes.len(), case.volumes.len(), "{}: {answer}", case.name);
    for (found, expected) in volumes.iter().zip(&case.volumes) {
        let off = (found - expected).abs() / expected;
        assert!(off < 1e-9, "{}: volume {found:e}, expected {expected:e}", case.name);
    }
}

#[test]
fn odd_files_are_meshed() {
    let whole = stl(&cube_at(0.0, 0.0, 0.0));
    let mut inverted = cube_at(0.0, 0.0, 0.0);
    inverted[5].swap(0, 1);
    let shell = cube_at(0.0, 0.0, 0.0);
    for case in [
        good("crlf.stl", whole.replace('\n', "\r\n")),
        good("crlf.obj", obj_negative().replace('\n', "\r\n")),
        noted("noend.stl", whole.replace("endsolid cube\n", ""), "without `endsolid`"),
        good("solid.stl", stl_binary(b"solid facet normal", &shell)),
        good("zeros.stl", stl_binary(b"", &shell)),
        good("negative.obj", obj_negative()),
        noted("polygons.off", off_polygons(), "6 polygons were cut"),
        good("big.ply", ply_big_endian()),
        noted("inverted.off", off(&inverted), "1 triangle was turned"),
        noted("welded.off", off(&shell), "28 vertices repeat"),
    ] {
        meshed(&case);
    }
}

#[test]
fn cubes_that_touch_as_they_may_are_meshed() {
    let first = || cube_at(0.0, 0.0, 0.0);
    for case in [
        pair("side.off", both(first(), cube_at(1.0, 0.0, 0.0)), ""),
        pair("edge.off", both(first(), cube_at(1.0, 1.0, 0.0)), ""),
        pair("vertex.off", both(first(), cube_at(1.0, 1.0, 1.0)), ""),
    ] {
        meshed(&case);
    }
}

#[test]
fn very_small_and_very_large_cubes_are_meshed() {
    for case in [
        sized("small.off", 1e-23, 0.0),
        sized("large.off", 1e29, 0.0),
        sized("away.off", 1e-9, 1.0),
    ] {
        meshed(&case);
    }
}

/// Checks that a file is refused: content, code, and the place or its beginning.
fn refused(name: &str, bytes: impl AsRef<[u8]>, word: &str, place_found: &str) {
    let place = Place::new();
    place.write(name, bytes);
    let names = place.names();
    let done = place.run(&["mesh", name, "-o", "x.tetdb", "--json"]);
    let error = done.error();
    assert_eq!((done.exit(), error["code"].as_str()), (Some(3), Some(word)), "{name}: {error}");
    let at = error["where"].as_str().unwrap_or_default();
    assert!(at.starts_with(place_found), "{name}: at {at:?}, expected {place_found:?}");
    assert_eq!(place.names(), names, "{name} left something behind");
    // `check` reports the same.
    let done = place.run(&["check", name, "--json"]);
    let said = if done.stdout().is_empty() {
        done.error()["code"].clone()
    } else {
        done.json()["defects"][0]["code"].clone()
    };
    assert_eq!((done.exit(), said.as_str()), (Some(3), Some(word)), "check {name}");
}

#[test]
fn broken_files_are_refused_with_their_place() {
    let shell = cube_at(0.0, 0.0, 0.0);
    let binary = stl_binary(b"solid", &shell);
    refused("cut.stl", &binary[..400], "truncated-file", "cut.stl, byte 400");
    let mut huge = binary.clone();
    huge[80..84].fill(0xff);
    refused("huge.stl", huge, "truncated-file", "huge.stl, byte 684");
    let mut nan = binary;
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    refused("nan.stl", nan, "not-a-number", "nan.stl, byte ");
    let text = obj_negative();
    let bad = |from: &str, to: &str, word: &str, at: &str| {
        assert!(text.contains(from));
        refused("a.obj", text.replacen(from, to, 1), word, at);
    };
    bad("v 1 0 1", "v 1 NaN 1", "not-a-number", "a.obj, line 6");
    bad("f -8 -6", "f 0 -6", "index-out-of-range", "a.obj, line 9");
    bad("f -8 -6", "f -9 -6", "index-out-of-range", "a.obj, line 9");
    bad("f -8 -6", "f 9 -6", "index-out-of-range", "a.obj, line 9");
    let text = off_polygons();
    let bad = |from: &str, to: &str, word: &str, at: &str| {
        assert!(text.contains(from));
        refused("a.off", text.replacen(from, to, 1), word, at);
    };
    bad("8 6 12", "-8 6 12", "count-mismatch", "a.off, line 2");
    bad("8 6 12", "8 -6 12", "count-mismatch", "a.off, line 2");
    bad("8 6 12", "2000000000 6 12", "count-mismatch", "a.off, line 2");
    bad("8 6 12", "8 7 12", "count-mismatch", "a.off, line 1");
    bad("4 1 3 7 5", "4 1 3 7 8", "index-out-of-range", "a.off, line 16");
    let ply = String::from_utf8_lossy(&ply_big_endian()).replace("vertex 8", "vertex -8");
    refused("a.ply", ply, "count-mismatch", "a.ply, line 4");
}

#[test]
fn surfaces_that_bound_nothing_are_refused_with_their_place() {
    let first = || cube_at(0.0, 0.0, 0.0);
    let repeated = both(first(), vec![first()[7]]);
    refused("twice.off", off(&repeated), "duplicate-triangle", "triangles 7 and 12 near (");
    // The diagonal of one side is divided in one of its two triangles only.
    let mut junction = first();
    let [a, b, c] = junction[0];
    let middle = [0, 1, 2].map(|i| (a[i] + c[i]) / 2.0);
    junction[0] = [a, b, middle];
    junction.push([middle, b, c]);
    refused("junction.off", off(&junction), "open-surface", "triangle ");
    for (name, second) in [
        ("crossing.off", cube_at(0.3, 0.4, 0.5)),
        ("overlap.off", cube_at(1.0, 0.25, 0.25)),
        // Both cubes have the same corners on the shared side, but different diagonals.
        ("unlike.off", cube(|p| [1.0 + p[0], 1.0 - p[1], p[2]])),
    ] {
        refused(name, off(&both(first(), second)), "self-intersection", "triangles ");
    }
}

#[test]
fn coordinates_beyond_the_exact_range_are_refused() {
    for (name, edge, at) in
        [("tiny.off", 1e-30, "tiny.off"), ("giant.off", 1e31, "giant.off, line ")]
    {
        let triangles = cube(|p| p.map(|x| x * edge));
        refused(name, off(&triangles), "coordinate-range", at);
    }
}
