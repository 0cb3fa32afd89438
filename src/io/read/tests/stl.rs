//! STL, as text and binary.

use super::*;

pub(super) fn stl_text(end: &str) -> String {
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

pub(super) fn stl_binary(header: &[u8]) -> Vec<u8> {
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
    assert!(matches!(surface.notes[0].kind, NoteKind::MissingEndsolid { .. }));
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
    assert_eq!(refuse(Format::Stl, &whole[..200]), ("truncated-file", Spot::Byte(200)));
    assert_eq!(refuse(Format::Stl, &whole[..60]), ("truncated-file", Spot::Byte(0)));
    let mut huge = whole.clone();
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_eq!(refuse(Format::Stl, &huge).0, "truncated-file");
    let mut few = whole.clone();
    few[80] = 3;
    assert_eq!(refuse(Format::Stl, &few), ("count-mismatch", Spot::Byte(80)));
    let mut nan = whole.clone();
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(refuse(Format::Stl, &nan).0, "not-a-number");
    assert_eq!(refuse(Format::Stl, &whole[..80]).0, "truncated-file");
    let mut none = whole[..84].to_vec();
    none[80] = 0;
    assert_eq!(refuse(Format::Stl, &none), ("empty-surface", Spot::File));
    assert_eq!(refuse(Format::Stl, ""), ("empty-surface", Spot::File));
    let text = stl_text("endsolid");
    assert_eq!(refuse(Format::Stl, &text[..text.len() - 40]).0, "truncated-file");
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

#[test]
fn bytes_behind_the_triangles_are_noted() {
    for n in [1, 7, 137] {
        let bytes = [stl_binary(b"by a scanner"), vec![b' '; n]].concat();
        let surface = read_tetrahedron(Format::Stl, bytes);
        assert_eq!(surface.notes[0].kind, NoteKind::TrailingBytes { n: n as u64 });
    }
    // Whole records behind the declared ones contradict the number.
    let bytes = [stl_binary(b"by a scanner"), vec![0; 100]].concat();
    assert_eq!(refuse(Format::Stl, bytes).0, "count-mismatch");
}
