//! Every format on small made inputs: the good, the odd and the bad.

use super::*;
use crate::geom::Point;
use crate::surface::NoteKind;

const POINTS: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

fn read(format: Format, bytes: impl AsRef<[u8]>) -> Result<Surface> {
    read_memory(format, "folder/part.x", bytes.as_ref())
}

/// Reads a tetrahedron and checks its points and triangles.
fn read_tetrahedron(format: Format, bytes: impl AsRef<[u8]>) -> Surface {
    let surface = read(format, bytes).unwrap_or_else(|e| panic!("{format:?}: {}: {e}", e.place()));
    assert_eq!((surface.n_vertices(), surface.n_triangles()), (4, 4));
    for (t, face) in FACES.iter().enumerate() {
        assert_eq!(
            surface.corners(t as u32),
            face.map(|v| Point::from_array(POINTS[v]))
        );
    }
    surface
}

/// The code and spot of the error that must come.
fn refuse(format: Format, bytes: impl AsRef<[u8]>) -> (&'static str, Spot) {
    let error = read(format, bytes).expect_err("the file is bad");
    assert!(!error.help().is_empty() && !error.to_string().is_empty());
    (error.code(), error.place().spot)
}

fn stl_text(end: &str) -> String {
    let mut text = "solid first part\r\n".to_owned();
    for face in FACES {
        text += "  facet normal 0 0 nan\r\n    outer loop\r\n";
        for v in face {
            let [x, y, z] = POINTS[v];
            text += &format!("      vertex {x:e} {y} -{z}\r\n")
                .replace("-1", "1")
                .replace("-0", "-0.0");
        }
        text += "    endloop\r\n  endfacet\r\n";
    }
    text + end
}

fn stl_binary(header: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0u8; 80];
    bytes[..header.len()].copy_from_slice(header);
    bytes.extend(4u32.to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]);
        for v in face {
            for x in POINTS[v] {
                bytes.extend((x as f32).to_le_bytes());
            }
        }
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_of_both_kinds() {
    let surface = read_tetrahedron(Format::Stl, stl_text("endsolid first part"));
    assert_eq!(surface.label_names, ["first part"]);
    assert!(surface.notes.is_empty());
    let surface = read_tetrahedron(Format::Stl, stl_text(""));
    assert!(matches!(
        surface.notes[0].kind,
        NoteKind::MissingEndsolid { .. }
    ));
    for header in [&b""[..], b"solid cube", b"solid cube facet normal"] {
        let surface = read_tetrahedron(Format::Stl, stl_binary(header));
        assert_eq!(surface.label_names, ["part"]);
    }
}

#[test]
fn several_solids_are_several_labels() {
    let two = stl_text("endsolid\n") + &stl_text("endsolid").replace("first part", "second");
    let surface = read(Format::Stl, two).unwrap();
    assert_eq!(surface.label_names, ["first part", "second"]);
    assert_eq!(surface.labels, [0, 0, 0, 0, 1, 1, 1, 1]);
    assert_eq!(surface.n_vertices(), 4);
}

#[test]
fn bad_stl() {
    let whole = stl_binary(b"solid");
    assert_eq!(
        refuse(Format::Stl, &whole[..200]),
        ("truncated-file", Spot::Byte(200))
    );
    assert_eq!(
        refuse(Format::Stl, &whole[..60]),
        ("truncated-file", Spot::Byte(0))
    );
    let mut huge = whole.clone();
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_eq!(refuse(Format::Stl, &huge).0, "truncated-file");
    let mut few = whole.clone();
    few[80] = 3;
    assert_eq!(
        refuse(Format::Stl, &few),
        ("count-mismatch", Spot::Byte(80))
    );
    let mut nan = whole.clone();
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(refuse(Format::Stl, &nan).0, "not-a-number");
    assert_eq!(refuse(Format::Stl, &whole[..80]).0, "truncated-file");
    let mut none = whole[..84].to_vec();
    none[80] = 0;
    assert_eq!(refuse(Format::Stl, &none), ("empty-surface", Spot::Whole));
    assert_eq!(refuse(Format::Stl, ""), ("empty-surface", Spot::Whole));
    let text = stl_text("endsolid");
    assert_eq!(
        refuse(Format::Stl, &text[..text.len() - 40]).0,
        "truncated-file"
    );
    let nan = text.replacen("vertex 1e0", "vertex nan", 1);
    assert_eq!(refuse(Format::Stl, nan), ("not-a-number", Spot::Line(4)));
    assert_eq!(
        refuse(Format::Stl, text.replacen("endloop", "vertex", 1)),
        ("unexpected-text", Spot::Line(7))
    );
    assert_eq!(
        refuse(Format::Stl, text.replacen("vertex 1e0", "vertex 1e300", 1)).0,
        "coordinate-range"
    );
}

fn indexed(corner: impl Fn(usize) -> String, vertex: &str, face: &str, end: &str) -> String {
    let mut text = String::new();
    for [x, y, z] in POINTS {
        text += &format!("{vertex}{x} {y} {z}{end}\n");
    }
    for f in FACES {
        let corners: Vec<String> = f.iter().map(|&v| corner(v)).collect();
        text += &format!("{face}{}{end}\n", corners.join(" "));
    }
    text
}

fn off_body() -> String {
    indexed(|v| v.to_string(), "", "3 ", "")
}

#[test]
fn off_good_and_bad() {
    let surface = read_tetrahedron(
        Format::Off,
        "# note\nOFF\n4 4 6\n\n".to_owned() + &off_body(),
    );
    assert_eq!(surface.label_names, ["part"]);
    read_tetrahedron(
        Format::Off,
        "OFF 4 4 6\r\n".to_owned() + &off_body().replace('\n', " # c\r\n"),
    );
    read_tetrahedron(
        Format::Off,
        "OFF 4 4 6".to_owned() + "\n" + off_body().trim_end(),
    );
    let bad = |counts: &str, body: &str| refuse(Format::Off, format!("OFF\n{counts}\n{body}"));
    assert_eq!(
        bad("4 9 0", &off_body()),
        ("count-mismatch", Spot::Line(11))
    );
    assert_eq!(
        bad("2000000000 4 0", &off_body()),
        ("count-mismatch", Spot::Line(2))
    );
    assert_eq!(
        bad("-4 4 0", &off_body()),
        ("count-mismatch", Spot::Line(2))
    );
    assert_eq!(
        bad("4 -4 0", &off_body()),
        ("count-mismatch", Spot::Line(2))
    );
    assert_eq!(
        bad("4 4 0", &off_body().replace("3 1 2 3", "3 1 2 4")),
        ("index-out-of-range", Spot::Line(7))
    );
    assert_eq!(
        bad("4 4 0", &off_body().replace("3 1 2 3", "3 1 2 -1")).0,
        "index-out-of-range"
    );
    assert_eq!(
        bad("4 4 0", &off_body().replace("3 1 2 3", "2 1 2")).0,
        "unexpected-text"
    );
    assert_eq!(
        bad("4 4 0", &off_body().replacen("1 0 0", "1 X0 0", 1)),
        ("not-a-number", Spot::Line(4))
    );
    assert_eq!(
        bad("4 4 0", &off_body().replacen("1 0 0", "1 inf 0", 1)),
        ("not-a-number", Spot::Line(4))
    );
    assert_eq!(bad("4 0 0", ""), ("count-mismatch", Spot::Line(2)));
    assert_eq!(
        refuse(Format::Off, "OFF\n0 0 0\n"),
        ("empty-surface", Spot::Whole)
    );
    assert_eq!(
        refuse(Format::Off, "hello"),
        ("unexpected-text", Spot::Line(1))
    );
}

#[test]
fn polygons_are_fans_and_equal_points_are_one() {
    let text = "OFF\n6 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n-0 0 0\n7 7 7\n5 4 1 2 3 0\n";
    let surface = read(Format::Off, text).unwrap();
    assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 0]]);
    assert_eq!(surface.n_vertices(), 4);
    let kinds: Vec<&NoteKind> = surface.notes.iter().map(|n| &n.kind).collect();
    let (welded, fanned) = (
        NoteKind::WeldedVertices { n: 1 },
        NoteKind::FannedPolygons { n: 1 },
    );
    assert_eq!(
        kinds,
        [&welded, &fanned, &NoteKind::UnusedVertices { n: 1 }]
    );
}

#[test]
fn obj_good_and_bad() {
    let body = indexed(|v| format!("{}//7", v + 1), "v ", "f ", "");
    assert_eq!(read_tetrahedron(Format::Obj, &body).label_names, ["part"]);
    read_tetrahedron(
        Format::Obj,
        indexed(|v| format!("{}", v as i64 - 4), "  v ", "f ", "\r"),
    );
    // Faces before their vertices, and a line that goes on.
    let (vertices, faces) = body.split_at(body.find('f').unwrap());
    read_tetrahedron(
        Format::Obj,
        format!("vt 0 0\n{}{vertices}", faces.replace(" 3//7", " \\\n 3")),
    );
    let named = faces
        .replacen("f ", "o box\nusemtl red\nf ", 1)
        .replacen("f 1", "g lid\nf 1", 1);
    let surface = read_tetrahedron(Format::Obj, format!("{vertices}{named}"));
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["box".into(), "lid".into()], vec![0, 1, 1, 1])
    );
    let bad = |from: &str, to: &str| refuse(Format::Obj, body.replacen(from, to, 1));
    assert_eq!(
        bad("f 2//7", "f 0//7"),
        ("index-out-of-range", Spot::Line(5))
    );
    assert_eq!(
        bad("f 2//7", "f 5//7"),
        ("index-out-of-range", Spot::Line(5))
    );
    assert_eq!(bad("f 2//7", "f -5"), ("index-out-of-range", Spot::Line(5)));
    assert_eq!(bad("f 2//7", "f x"), ("not-a-number", Spot::Line(5)));
    assert_eq!(
        bad("f 2//7 3//7", "f 2//7"),
        ("unexpected-text", Spot::Line(5))
    );
    assert_eq!(bad("v 1 0", "v nan 0"), ("not-a-number", Spot::Line(2)));
    assert_eq!(bad("v 1 0 0", "v 1 0"), ("unexpected-text", Spot::Line(2)));
    assert_eq!(
        refuse(Format::Obj, vertices),
        ("empty-surface", Spot::Whole)
    );
}

fn ply(format: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment made\nelement vertex 4\nproperty float x\nproperty uchar red\n\
         property double y\nproperty short z\nelement face 4\nproperty list uchar int vertex_indices\n\
         property list uchar float extra\nend_header\n"
    );
    let mut out = header.into_bytes();
    let big = format.ends_with("big_endian");
    macro_rules! put {
        ($value:expr) => {
            if big {
                out.extend($value.to_be_bytes())
            } else {
                out.extend($value.to_le_bytes())
            }
        };
    }
    if format == "ascii" {
        let body = indexed(|v| v.to_string(), "", "3 ", " 1 0.5").replace("0 0 0 1", "0 9 0 0 1");
        let vertices = POINTS.iter().map(|[x, y, z]| format!("{x} 9 {y} {z}\n"));
        let faces = body
            .lines()
            .filter(|l| l.starts_with("3 "))
            .map(|l| format!("{l}\n"));
        out.extend(vertices.chain(faces).collect::<String>().bytes());
        return out;
    }
    for [x, y, z] in POINTS {
        put!(x as f32);
        out.push(9);
        put!(y);
        put!(z as i16);
    }
    for face in FACES {
        out.push(3);
        for v in face {
            put!(v as i32);
        }
        out.push(1);
        put!(0.5f32);
    }
    out
}

#[test]
fn ply_good_and_bad() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let whole = ply(format);
        read_tetrahedron(Format::Ply, &whole);
        let short = &whole[..whole.len() - 9];
        let code = refuse(Format::Ply, short).0;
        assert!(
            ["truncated-file", "count-mismatch"].contains(&code),
            "{format} {code}"
        );
        let text = String::from_utf8_lossy(&whole).into_owned();
        if format == "ascii" {
            read_tetrahedron(Format::Ply, text.replace('\n', "\r\n"));
            let many = text.replace("vertex 4", "vertex 2000000000");
            assert_eq!(refuse(Format::Ply, many), ("count-mismatch", Spot::Line(4)));
            let negative = text.replace("face 4", "face -4");
            assert_eq!(
                refuse(Format::Ply, negative),
                ("count-mismatch", Spot::Line(9))
            );
            assert_eq!(
                refuse(Format::Ply, text.replace("face 4", "face 5")),
                ("count-mismatch", Spot::Line(21))
            );
            assert_eq!(
                refuse(Format::Ply, text.replace("3 1 2 3", "3 1 2 4")),
                ("index-out-of-range", Spot::Line(17))
            );
            assert_eq!(
                refuse(Format::Ply, text.replace("1 9 0 0", "1 9 nan 0")).0,
                "not-a-number"
            );
            assert_eq!(
                refuse(Format::Ply, text.replace("double y", "double w")).0,
                "unexpected-text"
            );
        }
    }
}

const MEDIT: &str = "MeshVersionFormatted 2\nDimension\n3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n\
    Edges 1\n1 2 5\nTriangles\n4\n2 3 4 7\n1 4 3 7\n1 2 4 9\n1 3 2 9\nTetrahedra 1\n1 2 3 4 1\nEnd\n";

#[test]
fn medit_text() {
    let surface = read_tetrahedron(Format::Medit, MEDIT);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["7".into(), "9".into()], vec![0, 0, 1, 1])
    );
    assert_eq!(
        surface.notes[0].kind,
        NoteKind::SkippedElements {
            what: "tetrahedra",
            n: 1
        }
    );
    let bad = |from: &str, to: &str| refuse(Format::Medit, MEDIT.replacen(from, to, 1));
    assert_eq!(
        bad("2 3 4 7", "2 3 5 7"),
        ("index-out-of-range", Spot::Line(13))
    );
    assert_eq!(
        bad("2 3 4 7", "2 3 0 7"),
        ("index-out-of-range", Spot::Line(13))
    );
    assert_eq!(
        bad("Vertices 4", "Vertices 2000000000"),
        ("count-mismatch", Spot::Line(4))
    );
    assert_eq!(
        bad("Vertices 4", "Vertices -4"),
        ("count-mismatch", Spot::Line(4))
    );
    assert_eq!(bad("Dimension\n3", "Dimension\n2").0, "unsupported-content");
    assert_eq!(bad("0 1 0 0", "0 nan 0 0"), ("not-a-number", Spot::Line(7)));
}

fn meshb(version: i32, big: bool) -> Vec<u8> {
    let mut out = Vec::new();
    macro_rules! put {
        ($value:expr) => {
            if big {
                out.extend($value.to_be_bytes())
            } else {
                out.extend($value.to_le_bytes())
            }
        };
    }
    macro_rules! sized {
        ($long:expr, $value:expr) => {
            if $long {
                put!($value as i64)
            } else {
                put!($value as i32)
            }
        };
    }
    let (long_position, long_int) = (version >= 3, version >= 4);
    put!(1i32);
    put!(version);
    let int = if long_int { 8 } else { 4 };
    let position = if long_position { 8 } else { 4 };
    let real = if version == 1 { 4 } else { 8 };
    let mut at = 8;
    let mut section = |out: &mut Vec<u8>, keyword: i32, bytes: usize| {
        at += 4 + position + bytes;
        let next = if big {
            (at as i64).to_be_bytes()
        } else {
            (at as i64).to_le_bytes()
        };
        out.extend(if big {
            keyword.to_be_bytes()
        } else {
            keyword.to_le_bytes()
        });
        match (long_position, big) {
            (true, _) => out.extend(next),
            (false, true) => out.extend(&next[4..]),
            (false, false) => out.extend(&next[..4]),
        }
    };
    section(&mut out, 3, 4);
    put!(3i32);
    section(&mut out, 99, 3); // a section no one knows
    out.extend([1, 2, 3]);
    section(&mut out, 4, int + 4 * (3 * real + int));
    sized!(long_int, 4);
    for p in POINTS {
        for x in p {
            if version == 1 {
                put!(x as f32)
            } else {
                put!(x)
            }
        }
        sized!(long_int, 0);
    }
    section(&mut out, 6, int + 4 * 4 * int);
    sized!(long_int, 4);
    for face in FACES {
        for v in face {
            sized!(long_int, v + 1);
        }
        sized!(long_int, 5);
    }
    section(&mut out, 54, 0);
    out
}

#[test]
fn medit_binary() {
    for version in 1..=4 {
        for big in [false, true] {
            let whole = meshb(version, big);
            assert_eq!(
                read_tetrahedron(Format::MeditBinary, &whole).label_names,
                ["5"]
            );
            let code = refuse(Format::MeditBinary, &whole[..whole.len() - 40]).0;
            assert!(
                ["truncated-file", "count-mismatch"].contains(&code),
                "{code}"
            );
        }
    }
    assert_eq!(
        refuse(Format::MeditBinary, "hello world").0,
        "unexpected-text"
    );
    assert_eq!(
        refuse(Format::MeditBinary, [1, 0, 0, 0, 9, 0, 0, 0]).0,
        "unsupported-content"
    );
}

const MSH2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 3 \"rim\"\n2 3 \"outer wall\"\n$EndPhysicalNames\n\
    $Nodes\n4\n11 0 0 0\n12 1 0 0\n13 0 1 0\n24 0 0 1\n$EndNodes\n$Foo\n1 2 x\n$EndFoo\n\
    $Elements\n6\n1 15 2 0 1 11\n2 2 2 3 1 12 13 24\n3 2 2 3 1 11 24 13\n4 2 2 4 1 11 12 24\n5 2 2 0 1 11 13 12\n6 4 2 0 1 11 12 13 24\n$EndElements\n";

const MSH4: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 3 \"outer wall\"\n$EndPhysicalNames\n\
    $Entities\n1 0 2 1\n1 0 0 0 0\n1 0 0 0 1 1 1 1 3 0\n2 0 0 0 1 1 1 0 0\n1 0 0 0 1 1 1 0 1 1\n$EndEntities\n\
    $Nodes\n2 4 1 4\n0 1 0 1\n1\n0 0 0\n2 1 1 3\n2\n3\n4\n1 0 0 0.5 0.5\n0 1 0 0.5 0.5\n0 0 1 0.5 0.5\n$EndNodes\n\
    $Elements\n3 5 1 5\n2 1 2 2\n1 2 3 4\n2 1 4 3\n2 2 2 2\n3 1 2 4\n4 1 3 2\n3 1 4 1\n5 1 2 3 4\n$EndElements\n";

#[test]
fn gmsh_text() {
    let surface = read_tetrahedron(Format::Gmsh, MSH2);
    assert_eq!(
        (surface.label_names, surface.labels),
        (
            vec!["outer wall".into(), "4".into(), "part".into()],
            vec![0, 0, 1, 2]
        )
    );
    assert_eq!(
        surface.notes[0].kind,
        NoteKind::SkippedElements {
            what: "solid elements",
            n: 1
        }
    );
    let surface = read_tetrahedron(Format::Gmsh, MSH4);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["outer wall".into(), "part".into()], vec![0, 0, 1, 1])
    );
    for text in [MSH2, MSH4] {
        read_tetrahedron(Format::Gmsh, text.replace('\n', "\r\n"));
        let bad = |from: &str, to: &str| refuse(Format::Gmsh, text.replacen(from, to, 1)).0;
        assert_eq!(bad("0 0 1", "0 0 nan"), "not-a-number");
        assert_eq!(bad("$EndElements\n", ""), "truncated-file");
    }
    let bad = |from: &str, to: &str| refuse(Format::Gmsh, MSH2.replacen(from, to, 1));
    assert_eq!(
        bad("12 13 24\n", "12 13 25\n"),
        ("index-out-of-range", Spot::Line(22))
    );
    assert_eq!(
        bad("$Nodes\n4", "$Nodes\n2000000000"),
        ("count-mismatch", Spot::Line(10))
    );
    assert_eq!(
        bad("$Elements\n6", "$Elements\n7"),
        ("count-mismatch", Spot::Line(27))
    );
    assert_eq!(bad("12 1 0 0", "11 1 0 0").0, "unexpected-text");
    assert_eq!(bad("2.2 0", "4.0 0").0, "unsupported-content");
    assert_eq!(bad("2 2 2 3 1", "2 9 2 3 1").0, "unsupported-content");
}

#[test]
fn gmsh_binary() {
    for big in [false, true] {
        for version in ["2.2", "4.1"] {
            let mut out = Vec::new();
            macro_rules! put {
                ($($value:expr),*) => {
                    $(if big { out.extend($value.to_be_bytes()) } else { out.extend($value.to_le_bytes()) })*
                };
            }
            out.extend(format!("$MeshFormat\n{version} 1 8\n").bytes());
            put!(1i32);
            out.extend(b"\n$EndMeshFormat\n$Comment\n\x00\xff$$End\n$EndComment\n$Nodes\n");
            if version == "2.2" {
                out.extend(b"4\n");
                for (i, [x, y, z]) in (1i32..).zip(POINTS) {
                    put!(i, x, y, z);
                }
                out.extend(b"\n$EndNodes\n$Elements\n4\n");
                put!(2i32, 4i32, 2i32);
                for face in FACES {
                    put!(
                        7i32,
                        3i32,
                        1i32,
                        face[0] as i32 + 1,
                        face[1] as i32 + 1,
                        face[2] as i32 + 1
                    );
                }
            } else {
                put!(
                    1u64, 4u64, 1u64, 4u64, 2i32, 1i32, 0i32, 4u64, 1u64, 2u64, 3u64, 4u64
                );
                for [x, y, z] in POINTS {
                    put!(x, y, z);
                }
                out.extend(b"\n$EndNodes\n$Elements\n");
                put!(1u64, 4u64, 1u64, 4u64, 2i32, 1i32, 2i32, 4u64);
                for face in FACES {
                    put!(
                        7u64,
                        face[0] as u64 + 1,
                        face[1] as u64 + 1,
                        face[2] as u64 + 1
                    );
                }
            }
            out.extend(b"\n$EndElements\n");
            read_tetrahedron(Format::Gmsh, &out);
            assert!(matches!(
                refuse(Format::Gmsh, &out[..out.len() - 60]),
                ("truncated-file" | "count-mismatch", Spot::Byte(_))
            ));
        }
    }
}

#[test]
fn tetgen_layouts() {
    let points = "# points\n4 3 0 0\n0 0 0 0\n1 1 0 0 # x\n2 0 1 0\n3 0 0 1\n";
    let smesh = format!("{points}4 1\n3 1 2 3 5\n3 0 3 2 5\n3  0 1 3\n3 0 2 1 0\n0\n0\n");
    let surface = read_tetrahedron(Format::TetgenSmesh, &smesh);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["5".into(), "part".into()], vec![0, 0, 1, 1])
    );
    let poly = format!(
        "{points}4 1\n1 0 5\n3 1 2 3\n1\n3 0 3 2\n1 0 6\n3 0 1\n3\n1 1\n3 0 2 1\n1 .2 .2 0\n1\n1 5 5 5\n"
    );
    let surface = read_tetrahedron(Format::TetgenPoly, &poly);
    assert_eq!(surface.labels, [0, 1, 2, 1]);
    assert_eq!(surface.notes[0].kind, NoteKind::SplitFacets { n: 1 });
    assert_eq!(
        refuse(Format::TetgenSmesh, smesh.replace("3 1 2 3 5", "3 1 2 4 5")),
        ("index-out-of-range", Spot::Line(8))
    );
    assert_eq!(
        refuse(Format::TetgenSmesh, smesh.replace("4 1\n", "9 1\n")),
        ("unsupported-content", Spot::Line(12))
    );
    assert_eq!(
        refuse(Format::TetgenSmesh, "0 3\n4 1\n").0,
        "unsupported-content"
    );
    assert_eq!(
        refuse(Format::TetgenSmesh, smesh.replace("2 0 1 0\n", "5 0 1 0\n")),
        ("unexpected-text", Spot::Line(5))
    );
    let folder = tempfile::tempdir().unwrap();
    let (node, file) = (folder.path().join("a.node"), folder.path().join("a.smesh"));
    std::fs::write(&node, points).unwrap();
    std::fs::write(&file, smesh.replace(points, "0 3 0 0\n")).unwrap();
    assert_eq!(read_surface(&[file]).unwrap().n_vertices(), 4);
}

#[test]
fn files_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("a.stl"), stl_binary(b"")).unwrap();
    std::fs::write(
        path("b.OBJ"),
        indexed(|v| format!("{}", v + 1), "v 2", "f ", "").replace("f ", "g top\nf "),
    )
    .unwrap();
    std::fs::write(path("c"), "OFF 4 4 0\n".to_owned() + &off_body()).unwrap();
    std::fs::write(path("d"), "what is this").unwrap();
    let surface = read_surface(&[path("a.stl"), path("b.OBJ")]).unwrap();
    assert_eq!(surface.label_names, ["a", "b:top"]);
    assert_eq!((surface.n_triangles(), surface.n_vertices()), (8, 8));
    assert_eq!(
        surface.source(5).map(|(f, t)| (f.ends_with("b.OBJ"), t)),
        Some((true, 1))
    );
    assert_eq!(read_surface(&[path("c")]).unwrap().n_triangles(), 4);
    let twice = read_surface(&[path("a.stl"), path("a.stl")]).unwrap();
    assert_eq!(twice.label_names, ["a", "a~2"]);
    let code = |name: &str| read_surface(&[path(name)]).unwrap_err().code();
    assert_eq!(
        [code("d"), code("none.stl"), code("")],
        ["unknown-format", "unreadable-file", "unreadable-file"]
    );
}

#[test]
fn any_cut_of_a_good_file_is_refused_or_read_without_panic() {
    let files: [(Format, Vec<u8>); 8] = [
        (Format::Stl, stl_text("endsolid").into_bytes()),
        (Format::Stl, stl_binary(b"solid")),
        (Format::Ply, ply("binary_big_endian")),
        (Format::Ply, ply("ascii")),
        (Format::Medit, MEDIT.as_bytes().to_vec()),
        (Format::MeditBinary, meshb(2, false)),
        (Format::Gmsh, MSH2.as_bytes().to_vec()),
        (Format::Gmsh, MSH4.as_bytes().to_vec()),
    ];
    for (format, whole) in files {
        for n in 0..whole.len() {
            let _ = read(format, &whole[..n]);
            let mut changed = whole.clone();
            for value in [0, b'-', b'9', b' ', 0xff] {
                changed[n] = value;
                let _ = read(format, &changed);
            }
        }
    }
}
