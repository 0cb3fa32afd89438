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
    let text = "OFF\n6 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n-0 0 0\n7 7 7\n5 4 1 2 3 0\n";
    let surface = read(Format::Off, text).unwrap();
    assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 0]]);
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
