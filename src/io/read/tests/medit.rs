//! MEDIT, as text and binary.

use super::*;

pub(super) const MEDIT: &str = "MeshVersionFormatted 2\nDimension\n3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n\
    Edges 1\n1 2 5\nTriangles\n4\n2 3 4 7\n1 4 3 7\n1 2 4 9\n1 3 2 9\nTetrahedra 1\n1 2 3 4 1\nEnd\n";

#[test]
fn medit_text() {
    let surface = read_tetrahedron(Format::Medit, MEDIT);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["7".into(), "9".into()], vec![0, 0, 1, 1])
    );
    assert_eq!(surface.notes[1].kind, NoteKind::SkippedElements { what: "tetrahedra", n: 1 });
    let (head, rest) = MEDIT.split_at(MEDIT.find("Vertices").unwrap());
    let (vertices, rest) = rest.split_at(rest.find("Edges").unwrap());
    let late = format!("{head}{}{vertices}End\n", rest.replace("End\n", ""));
    assert_eq!(read_tetrahedron(Format::Medit, &late).seeds.len(), 1);
    let (code, _) = refuse(Format::Medit, late.replacen("2 3 4 7", "2 3 5 7", 1));
    assert_eq!(code, "index-out-of-range");
    let bad = |from: &str, to: &str| refuse(Format::Medit, MEDIT.replacen(from, to, 1));
    assert_eq!(bad("2 3 4 7", "2 3 5 7"), ("index-out-of-range", Spot::Line(13)));
    assert_eq!(bad("2 3 4 7", "2 3 0 7"), ("index-out-of-range", Spot::Line(13)));
    assert_eq!(bad("Vertices 4", "Vertices 2000000000"), ("count-mismatch", Spot::Line(4)));
    assert_eq!(bad("Vertices 4", "Vertices -4"), ("count-mismatch", Spot::Line(4)));
    assert_eq!(bad("Dimension\n3", "Dimension\n2").0, "unsupported-content");
    assert_eq!(bad("0 1 0 0", "0 nan 0 0"), ("not-a-number", Spot::Line(7)));
}

pub(super) fn meshb(version: i32, big: bool) -> Vec<u8> {
    let mut out = Vec::new();
    macro_rules! put {
        ($value:expr) => {
            if big { out.extend($value.to_be_bytes()) } else { out.extend($value.to_le_bytes()) }
        };
    }
    macro_rules! sized {
        ($long:expr, $value:expr) => {
            if $long { put!($value as i64) } else { put!($value as i32) }
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
        let next = if big { (at as i64).to_be_bytes() } else { (at as i64).to_le_bytes() };
        out.extend(if big { keyword.to_be_bytes() } else { keyword.to_le_bytes() });
        match (long_position, big) {
            (true, _) => out.extend(next),
            (false, true) => out.extend(&next[4..]),
            (false, false) => out.extend(&next[..4]),
        }
    };
    section(&mut out, 3, 4);
    put!(3i32);
    section(&mut out, 199, 3); // a section no one knows
    out.extend([1, 2, 3]);
    section(&mut out, 4, int + 4 * (3 * real + int));
    sized!(long_int, 4);
    for p in POINTS {
        for x in p {
            if version == 1 { put!(x as f32) } else { put!(x) }
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
            assert_eq!(read_tetrahedron(Format::MeditBinary, &whole).label_names, ["5"]);
            let code = refuse(Format::MeditBinary, &whole[..whole.len() - 40]).0;
            assert!(["truncated-file", "count-mismatch"].contains(&code), "{code}");
        }
    }
    assert_eq!(refuse(Format::MeditBinary, "hello world").0, "unexpected-text");
    assert_eq!(refuse(Format::MeditBinary, [1, 0, 0, 0, 9, 0, 0, 0]).0, "unsupported-content");
}
