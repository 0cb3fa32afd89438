//! OFF and OBJ: corners are indices.

use super::*;

pub(super) fn indexed(
    corner: impl Fn(usize) -> String,
    vertex: &str,
    face: &str,
    end: &str,
) -> String {
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

pub(super) fn off_body() -> String {
    indexed(|v| v.to_string(), "", "3 ", "")
}

#[test]
fn off_good_and_bad() {
    let surface = read_tetrahedron(Format::Off, "# note\nOFF\n4 4 6\n\n".to_owned() + &off_body());
    assert_eq!(surface.label_names, ["part"]);
    read_tetrahedron(
        Format::Off,
        "OFF 4 4 6\r\n".to_owned() + &off_body().replace('\n', " # c\r\n"),
    );
    read_tetrahedron(Format::Off, "OFF 4 4 6".to_owned() + "\n" + off_body().trim_end());
    let bad = |counts: &str, body: &str| refuse(Format::Off, format!("OFF\n{counts}\n{body}"));
    assert_eq!(bad("4 9 0", &off_body()), ("count-mismatch", Spot::Line(11)));
    assert_eq!(bad("2000000000 4 0", &off_body()), ("count-mismatch", Spot::Line(2)));
    assert_eq!(bad("-4 4 0", &off_body()), ("count-mismatch", Spot::Line(2)));
    assert_eq!(bad("4 -4 0", &off_body()), ("count-mismatch", Spot::Line(2)));
    assert_eq!(
        bad("4 4 0", &off_body().replace("3 1 2 3", "3 1 2 4")),
        ("index-out-of-range", Spot::Line(7))
    );
    assert_eq!(bad("4 4 0", &off_body().replace("3 1 2 3", "3 1 2 -1")).0, "index-out-of-range");
    assert_eq!(bad("4 4 0", &off_body().replace("3 1 2 3", "2 1 2")).0, "unexpected-text");
    assert_eq!(
        bad("4 4 0", &off_body().replacen("1 0 0", "1 X0 0", 1)),
        ("not-a-number", Spot::Line(4))
    );
    assert_eq!(
        bad("4 4 0", &off_body().replacen("1 0 0", "1 inf 0", 1)),
        ("not-a-number", Spot::Line(4))
    );
    assert_eq!(bad("4 0 0", ""), ("count-mismatch", Spot::Line(2)));
    assert_eq!(refuse(Format::Off, "OFF\n0 0 0\n"), ("empty-surface", Spot::File));
    assert_eq!(refuse(Format::Off, "hello"), ("unexpected-text", Spot::Line(1)));
}

#[test]
fn polygons_are_fans_and_equal_points_are_one() {
    let text = "OFF\n6 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n-0 0 0\n7 7 7\n4 4 1 2 3\n";
    let surface = read(Format::Off, text).unwrap();
    assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(surface.n_vertices(), 4);
    let kinds: Vec<&NoteKind> = surface.notes.iter().map(|n| &n.kind).collect();
    let (welded, fanned) = (NoteKind::WeldedVertices { n: 1 }, NoteKind::FannedPolygons { n: 1 });
    assert_eq!(kinds, [&welded, &fanned, &NoteKind::UnusedVertices { n: 1 }]);
}

#[test]
fn obj_good_and_bad() {
    let body = indexed(|v| format!("{}//7", v + 1), "v ", "f ", "");
    assert_eq!(read_tetrahedron(Format::Obj, &body).label_names, ["part"]);
    read_tetrahedron(Format::Obj, indexed(|v| format!("{}", v as i64 - 4), "  v ", "f ", "\r"));
    // Faces before their vertices, and a line that goes on.
    let (vertices, faces) = body.split_at(body.find('f').unwrap());
    read_tetrahedron(
        Format::Obj,
        format!("vt 0 0\n{}{vertices}", faces.replace(" 3//7", " \\\n 3")),
    );
    let noted = body.replace("//7\n", "//7 # x 9\n").replace("0\n", "0 # 7\n");
    read_tetrahedron(Format::Obj, noted.replacen("f 1", "f 1# ", 0));
    let named = faces.replacen("f ", "o box\nusemtl red\nf ", 1).replacen("f 1", "g lid\nf 1", 1);
    let surface = read_tetrahedron(Format::Obj, format!("{vertices}{named}"));
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["box".into(), "lid".into()], vec![0, 1, 1, 1])
    );
    let bad = |from: &str, to: &str| refuse(Format::Obj, body.replacen(from, to, 1));
    assert_eq!(bad("f 2//7", "f 0//7"), ("index-out-of-range", Spot::Line(5)));
    assert_eq!(bad("f 2//7", "f 5//7"), ("index-out-of-range", Spot::Line(5)));
    assert_eq!(bad("f 2//7", "f -5"), ("index-out-of-range", Spot::Line(5)));
    assert_eq!(bad("f 2//7", "f x"), ("not-a-number", Spot::Line(5)));
    assert_eq!(bad("f 2//7 3//7", "f 2//7"), ("unexpected-text", Spot::Line(5)));
    assert_eq!(bad("v 1 0", "v nan 0"), ("not-a-number", Spot::Line(2)));
    assert_eq!(bad("v 1 0 0", "v 1 0"), ("unexpected-text", Spot::Line(2)));
    assert_eq!(refuse(Format::Obj, vertices), ("empty-surface", Spot::File));
}

#[test]
fn polygons_with_dents_are_cut_in_every_format_and_bad_ones_have_a_line() {
    // A prism over an L, a corner in line in its long side.
    let base = [[0, 0], [2, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]];
    let at = |v: usize| [base[v % 7][0], base[v % 7][1], (v / 7) as i32];
    let mut faces: Vec<Vec<usize>> = vec![(0..7).rev().collect(), (7..14).collect()];
    faces.extend((0..7).map(|k| vec![k, (k + 1) % 7, (k + 1) % 7 + 7, k + 7]));
    let row = |list: &[usize], from: usize| {
        list.iter().map(|v| (v + from).to_string()).collect::<Vec<_>>().join(" ")
    };
    let points: Vec<String> = (0..14).map(|v| at(v).map(|x| x.to_string()).join(" ")).collect();
    let lines = |from: usize, count: bool| -> String {
        let line = |f: &Vec<usize>| match count {
            true => format!("{} {}\n", f.len(), row(f, from)),
            false => format!("f {}\n", row(f, from)),
        };
        faces.iter().map(line).collect()
    };
    let vertices: String = points.iter().map(|p| format!("v {p}\n")).collect();
    let list = points.join("\n");
    let numbered: String = (0..14).map(|v| format!("{} {}\n", v + 1, points[v])).collect();
    let poly: String = faces.iter().map(|f| format!("1\n{} {}\n", f.len(), row(f, 1))).collect();
    let files = [
        (Format::Obj, format!("{vertices}{}", lines(1, false))),
        (Format::Obj, format!("{}{vertices}", lines(1, false))),
        (Format::Off, format!("OFF\n14 9 0\n{list}\n{}", lines(0, true))),
        (
            Format::Ply,
            format!(
                "ply\nformat ascii 1.0\nelement vertex 14\nproperty double x\nproperty double y\nproperty double z\n\
                 element face 9\nproperty list uchar int vertex_indices\nend_header\n{list}\n{}",
                lines(0, true)
            ),
        ),
        (Format::TetgenPoly, format!("14 3\n{numbered}9 0\n{poly}0\n0\n")),
        (Format::TetgenSmesh, format!("14 3\n{numbered}9 0\n{}0\n0\n", lines(1, true))),
    ];
    for (format, text) in files {
        let surface = read(format, &text).unwrap_or_else(|e| panic!("{format:?}: {e}"));
        assert_eq!(surface.n_triangles(), 2 * 5 + 7 * 2, "{format:?}");
        assert!(tetdb_base::surface::validate(&surface).accept().is_ok(), "{format:?}");
        let is_cut = |kind| surface.notes.iter().any(|n| n.kind == kind);
        assert!(is_cut(NoteKind::CutPolygons { n: 2 }), "{format:?}: {:?}", surface.notes);
        assert!(is_cut(NoteKind::FannedPolygons { n: 7 }), "{format:?}");
    }
    for (face, code) in [
        ("f 1 3 4 2", "self-intersection"),
        ("f 1 2 3 2", "degenerate-triangle"),
        ("f 1 4 2 3", "self-intersection"),
    ] {
        let text = format!("{vertices}f 1 2 9\n{face}\n");
        assert_eq!(refuse(Format::Obj, &text), (code, Spot::Line(16)), "{face}");
    }
}

#[test]
fn corners_that_repeat_the_one_before_are_left_out() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\n";
    for (face, triangles, n) in [
        ("f 1 2 3 3", vec![[0, 1, 2]], 1),
        ("f 1 2 3 5", vec![[0, 1, 2]], 1),
        ("f 1 2 3 1", vec![[1, 2, 0]], 1),
        ("f 1 1 2 3 5 4", vec![[0, 1, 2], [0, 2, 3]], 1),
        ("f 1 2 2 1", vec![[0, 1, 1], [0, 1, 0]], 0),
    ] {
        let surface = read(Format::Obj, format!("{vertices}f 1 2 6\n{face}\n")).unwrap();
        let verts = |t: &[u32; 3]| t.map(|v| surface.points[v as usize]);
        let found: Vec<_> = surface.triangles[1..].iter().map(verts).collect();
        let place = |v: u32| [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]][v as usize];
        let point = |v: u32| tetdb_base::geom::Point::from_array(place(v).map(f64::from));
        let expected: Vec<_> = triangles.iter().map(|t| t.map(point)).collect();
        assert_eq!(found, expected, "{face}");
        let noted = |n: &tetdb_base::surface::Note| n.kind == NoteKind::RepeatedCorners { n: 1 };
        assert_eq!(surface.notes.iter().filter(|n| noted(n)).count(), n, "{face}");
    }
}
