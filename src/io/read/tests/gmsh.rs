//! Gmsh 2.2 and 4.1, as text and binary.

use super::*;

pub(super) const MSH2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 3 \"rim\"\n2 3 \"outer wall\"\n$EndPhysicalNames\n\
    $Nodes\n4\n11 0 0 0\n12 1 0 0\n13 0 1 0\n24 0 0 1\n$EndNodes\n$Foo\n1 2 x\n$EndFoo\n\
    $Elements\n6\n1 15 2 0 1 11\n2 2 2 3 1 12 13 24\n3 2 2 3 1 11 24 13\n4 2 2 4 1 11 12 24\n5 2 2 0 1 11 13 12\n6 4 2 0 1 11 12 13 24\n$EndElements\n";

pub(super) const MSH4: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 3 \"outer wall\"\n$EndPhysicalNames\n\
    $Entities\n1 0 2 1\n1 0 0 0 0\n1 0 0 0 1 1 1 1 3 0\n2 0 0 0 1 1 1 0 0\n1 0 0 0 1 1 1 0 1 1\n$EndEntities\n\
    $Nodes\n2 4 1 4\n0 1 0 1\n1\n0 0 0\n2 1 1 3\n2\n3\n4\n1 0 0 0.5 0.5\n0 1 0 0.5 0.5\n0 0 1 0.5 0.5\n$EndNodes\n\
    $Elements\n3 5 1 5\n2 1 2 2\n1 2 3 4\n2 1 4 3\n2 2 2 2\n3 1 2 4\n4 1 3 2\n3 1 4 1\n5 1 2 3 4\n$EndElements\n";

#[test]
fn gmsh_text() {
    let surface = read_tetrahedron(Format::Gmsh, MSH2);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["outer wall".into(), "4".into(), "part".into()], vec![0, 0, 1, 2])
    );
    assert_eq!(surface.notes[0].kind, NoteKind::SkippedElements { what: "solid elements", n: 1 });
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
    assert_eq!(bad("12 13 24\n", "12 13 25\n"), ("index-out-of-range", Spot::Line(22)));
    assert_eq!(bad("$Nodes\n4", "$Nodes\n2000000000"), ("count-mismatch", Spot::Line(10)));
    assert_eq!(bad("$Elements\n6", "$Elements\n7"), ("count-mismatch", Spot::Line(27)));
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
                put!(1u64, 4u64, 1u64, 4u64, 2i32, 1i32, 0i32, 4u64, 1u64, 2u64, 3u64, 4u64);
                for [x, y, z] in POINTS {
                    put!(x, y, z);
                }
                out.extend(b"\n$EndNodes\n$Elements\n");
                put!(1u64, 4u64, 1u64, 4u64, 2i32, 1i32, 2i32, 4u64);
                for face in FACES {
                    put!(7u64, face[0] as u64 + 1, face[1] as u64 + 1, face[2] as u64 + 1);
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
