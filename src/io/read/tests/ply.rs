//! PLY.

use super::*;

pub(super) fn ply(format: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment made\nelement vertex 4\nproperty float x\nproperty uchar red\n\
         property double y\nproperty short z\nelement face 4\nproperty list uchar int vertex_indices\n\
         property list uchar float extra\nend_header\n"
    );
    let mut out = header.into_bytes();
    let big = format.ends_with("big_endian");
    macro_rules! put {
        ($value:expr) => {
            if big { out.extend($value.to_be_bytes()) } else { out.extend($value.to_le_bytes()) }
        };
    }
    if format == "ascii" {
        let body = indexed(|v| v.to_string(), "", "3 ", " 1 0.5").replace("0 0 0 1", "0 9 0 0 1");
        let vertices = POINTS.iter().map(|[x, y, z]| format!("{x} 9 {y} {z}\n"));
        let faces = body.lines().filter(|l| l.starts_with("3 ")).map(|l| format!("{l}\n"));
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
        assert!(["truncated-file", "count-mismatch"].contains(&code), "{format} {code}");
        let text = String::from_utf8_lossy(&whole).into_owned();
        if format == "ascii" {
            read_tetrahedron(Format::Ply, text.replace('\n', "\r\n"));
            let many = text.replace("vertex 4", "vertex 2000000000");
            assert_eq!(refuse(Format::Ply, many), ("count-mismatch", Spot::Line(4)));
            let negative = text.replace("face 4", "face -4");
            assert_eq!(refuse(Format::Ply, negative), ("count-mismatch", Spot::Line(9)));
            assert_eq!(
                refuse(Format::Ply, text.replace("face 4", "face 5")),
                ("count-mismatch", Spot::Line(21))
            );
            assert_eq!(
                refuse(Format::Ply, text.replace("3 1 2 3", "3 1 2 4")),
                ("index-out-of-range", Spot::Line(17))
            );
            assert_eq!(refuse(Format::Ply, text.replace("1 9 0 0", "1 9 nan 0")).0, "not-a-number");
            assert_eq!(
                refuse(Format::Ply, text.replace("double y", "double w")).0,
                "unexpected-text"
            );
        }
    }
}
