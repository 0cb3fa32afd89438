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
    assert_eq!(bad("2.2 0", "3.0 0").0, "unsupported-content");
    assert_eq!(bad("2 2 2 3 1", "2 99 2 3 1").0, "unsupported-content");
    let curved = MSH2.replace("2 2 2 3 1 12 13 24", "2 9 2 3 1 12 13 24 11 11 11");
    let surface = read_tetrahedron(Format::Gmsh, curved);
    assert!(surface.notes.iter().any(|n| n.kind == NoteKind::CurvedFaces { n: 1 }));
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

/// Two boxes side by side with a wall, of 2 x 1 x 1 cubes, each cube six tetrahedra around its middle or without one; `names` are their
/// groups. With `apart`, there is a gap instead of the wall.
fn two_boxes(names: [i64; 2], with_middles: bool, apart: bool) -> String {
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let shift = if apart { 1.5 } else { 1.0 };
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    for (b, group) in (0..2).zip(names) {
        let first = 9 * b + 1;
        for c in 0..8 {
            let [x, y, z] = [c & 1, c >> 1 & 1, c >> 2].map(|bit| bit as f64);
            nodes.push([x + shift * b as f64, y, z]);
        }
        nodes.push([0.5 + shift * b as f64, 0.5, 0.5]);
        for (k, side) in sides.iter().enumerate() {
            let [p, q, r, s] = side.map(|c: i64| c + first);
            for t in [[p, q, r], [p, r, s]] {
                // The wall is given once.
                if apart || (b, k) != (1, 4) {
                    elements.push(format!("2 2 {} 1 {} {} {}", 9, t[0], t[1], t[2]));
                }
                if with_middles {
                    elements.push(format!(
                        "4 2 {group} 1 {} {} {} {}",
                        t[0],
                        t[1],
                        t[2],
                        first + 8
                    ));
                }
            }
        }
        if !with_middles {
            let hex = [0, 1, 3, 2, 4, 5, 7, 6].map(|c| (c + first).to_string());
            elements.push(format!("5 2 {group} 1 {}", hex.join(" ")));
        }
    }
    let nodes: String =
        (1..).zip(&nodes).map(|(i, [x, y, z])| format!("{i} {x} {y} {z}\n")).collect();
    let n = elements.len();
    let elements: String = (1..).zip(elements).map(|(i, e)| format!("{i} {e}\n")).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 \"rock\"\n3 2 \"salt\"\n$EndPhysicalNames\n\
         $Nodes\n18\n{nodes}$EndNodes\n$Elements\n{n}\n{elements}$EndElements\n"
    )
}

#[test]
fn each_connected_part_of_the_solids_is_a_region() {
    use tetdb_base::surface::SeedKind;
    let regions = |names: [i64; 2], with_middles: bool, apart: bool| {
        let surface = read(Format::Gmsh, two_boxes(names, with_middles, apart)).expect("boxes");
        let seed = |seed: &tetdb_base::surface::Seed| {
            let SeedKind::Region(name) = &seed.kind else { panic!("no hole") };
            (seed.point.x > 1.0, name.clone().unwrap_or_default())
        };
        surface.seeds.iter().map(seed).collect::<Vec<_>>()
    };
    let both = |a: &str, b: &str| vec![(false, a.to_owned()), (true, b.to_owned())];
    for (with_middles, apart) in [(true, true), (true, false), (false, true), (false, false)] {
        assert_eq!(regions([1, 2], with_middles, apart), both("rock", "salt"));
        // Parts that no triangles connect count each, with one name or without.
        assert_eq!(regions([1, 1], with_middles, apart), both("rock", "rock"));
        assert_eq!(regions([0, 2], with_middles, apart), both("", "salt"));
        assert_eq!(regions([7, 0], with_middles, apart), both("volume_7", ""));
        assert_eq!(regions([0, 0], with_middles, apart), []);
    }
    // Two groups in one part: it has no name.
    let text = two_boxes([1, 1], true, true).replacen("4 2 1 1", "4 2 2 1", 1);
    let surface = read(Format::Gmsh, text).expect("boxes");
    assert!(surface.notes.iter().any(|n| n.kind == NoteKind::MixedRegions { n: 1 }));
    assert_eq!(surface.seeds[0].kind, SeedKind::Region(None));
}

#[test]
fn old_versions_are_read() {
    let v1 = "$NOD\n4\n11 0 0 0\n12 1 0 0\n13 0 1 0\n24 0 0 1\n$ENDNOD\n$ELM\n5\n1 2 3 1 3 12 13 24\n\
        2 2 3 1 3 11 24 13\n3 2 4 1 3 11 12 24\n4 2 4 1 3 11 13 12\n5 4 9 1 4 11 12 13 24\n$ENDELM\n";
    let surface = read_tetrahedron(Format::Gmsh, v1);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["3".into(), "4".into()], vec![0, 0, 1, 1])
    );
    assert_eq!(surface.seeds.len(), 1);
    let bad = v1.replace("2 2 3 1 3 11 24 13", "2 2 3 1 4 11 24 13");
    assert_eq!(refuse(Format::Gmsh, bad), ("unexpected-text", Spot::Line(11)));
    assert_eq!(refuse(Format::Gmsh, v1.replace("$ENDNOD", "$EndNodes")).0, "unexpected-text");
    let v40 = MSH4
        .replace("4.1 0 8", "4 0 8")
        .replace("1 0 0 0 0\n1 0 0 0 1 1 1 1 3 0", "1 0 0 0 0 0 0 0\n1 0 0 0 1 1 1 1 3 0")
        .replace("$Nodes\n2 4 1 4\n0 1 0 1\n1\n0 0 0\n2 1 1 3\n2\n3\n4\n1 0 0 0.5 0.5\n0 1 0 0.5 0.5\n0 0 1 0.5 0.5",
            "$Nodes\n2 4\n1 0 0 1\n1 0 0 0\n1 2 1 3\n2 1 0 0 0.5 0.5\n3 0 1 0 0.5 0.5\n4 0 0 1 0.5 0.5")
        .replace("$Elements\n3 5 1 5\n2 1 2 2", "$Elements\n3 5\n1 2 2 2")
        .replace("3 1 4 1\n5", "1 3 4 1\n5");
    let surface = read_tetrahedron(Format::Gmsh, v40);
    assert_eq!(surface.label_names, ["outer wall", "part"]);
    let nodes = "$Nodes\n4\n11 0 0 0\n12 1 0 0\n13 0 1 0\n24 0 0 1\n$EndNodes";
    let parametric = "$ParametricNodes\n4\n11 0 0 0 0 1\n12 1 0 0 1 2 0.5\n13 0 1 0 2 1 0.5 7\n24 0 0 1 3 1\n$EndParametricNodes";
    read_tetrahedron(Format::Gmsh, MSH2.replace(nodes, parametric));
}
