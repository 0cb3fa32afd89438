//! Faces in several groups.

use super::gmsh::{MSH2, MSH4};
use super::*;

/// Checks the names of the groups of each triangle, and what the notes say.
fn check(format: Format, text: &str, groups: [&[&str]; 4], notes: &[&str]) {
    let surface = read_tetrahedron(format, text);
    for (t, expected) in groups.into_iter().enumerate() {
        let members = surface.label_members(&surface.labels[t]).iter();
        let names: Vec<&str> = members.map(|&m| surface.label_names[m as usize].as_str()).collect();
        assert_eq!(names, expected, "triangle {t} of {text}");
    }
    let said: Vec<String> = surface.notes.iter().map(ToString::to_string).collect();
    for note in notes {
        assert!(said.iter().any(|n| n.contains(note)), "{note}: {said:?}");
    }
    assert!(notes.is_empty() != said.iter().any(|n| n.contains("groups") || n.contains("sets")));
}

#[test]
fn gmsh_2_lists_an_element_once_for_each_group() {
    let wall: &[&str] = &["outer wall"];
    let more = |n: usize, from: &str, to: &str| {
        MSH2.replace("$Elements\n6", &format!("$Elements\n{n}")).replacen(from, to, 1)
    };
    let one_behind_the_other =
        more(7, "2 2 2 3 1 12 13 24\n", "2 2 2 3 1 12 13 24\n7 2 2 4 1 12 13 24\n");
    check(
        Format::Gmsh,
        &one_behind_the_other,
        [&["outer wall", "4"], wall, &["4"], &["part"]],
        &[],
    );
    // Group by group, with another corner first, and three groups of one element.
    let end = "$EndElements";
    let at_end =
        more(9, end, "7 2 2 9 1 11 24 13\n8 2 2 7 1 24 13 11\n9 2 2 9 1 11 13 12\n$EndElements");
    check(Format::Gmsh, &at_end, [wall, &["outer wall", "9", "7"], &["4"], &["part", "9"]], &[]);
    // The same group twice stays for validation.
    let twice = more(7, end, "7 2 2 3 1 12 13 24\n$EndElements");
    assert_eq!(read(Format::Gmsh, twice).unwrap().n_triangles(), 5);
    // Volumes in two groups have the name of the first.
    let solids = more(7, end, "7 4 2 8 1 11 12 13 24\n$EndElements");
    let solids = solids.replace("6 4 2 0 1", "6 4 2 5 1");
    check(
        Format::Gmsh,
        &solids,
        [wall, wall, &["4"], &["part"]],
        &["volumes of the groups volume_8"],
    );
    let v1 = "$NOD\n4\n11 0 0 0\n12 1 0 0\n13 0 1 0\n24 0 0 1\n$ENDNOD\n$ELM\n6\n1 2 3 1 3 12 13 24\n\
        2 2 3 1 3 11 24 13\n3 2 4 1 3 11 12 24\n4 2 4 1 3 11 13 12\n5 2 5 1 3 12 13 24\n6 2 5 1 3 11 12 24\n$ENDELM\n";
    check(Format::Gmsh, v1, [&["3", "5"], &["3"], &["4", "5"], &["4"]], &[]);
}

#[test]
fn gmsh_4_gives_an_entity_several_groups() {
    let both = MSH4.replace("1 0 0 0 1 1 1 1 3 0", "1 0 0 0 1 1 1 2 3 -7 0");
    let two: &[&str] = &["outer wall", "7"];
    check(Format::Gmsh, &both, [two, two, &["part"], &["part"]], &[]);
    let other_order = both
        .replace("2 0 0 0 1 1 1 0 0", "2 0 0 0 1 1 1 3 7 3 8 0")
        .replace("2 3 \"outer wall\"", "2 3 \"a+b\"");
    check(
        Format::Gmsh,
        &other_order,
        [&["a+b", "7"], &["a+b", "7"], &["a+b", "7", "8"], &["a+b", "7", "8"]],
        &[],
    );
    let volumes = MSH4.replace("1 0 0 0 1 1 1 0 1 1\n$EndE", "1 0 0 0 1 1 1 2 5 6 1 1\n$EndE");
    let wall: &[&str] = &["outer wall"];
    check(Format::Gmsh, &volumes, [wall, wall, &["part"], &["part"]], &["groups volume_6 belong"]);
}

#[test]
fn element_sets_of_abaqus_overlap() {
    let head = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n";
    let flat = format!(
        "{head}*ELEMENT, TYPE=S3, ELSET=Shell\n11, 2, 3, 4\n12, 1, 4, 3\n*ELEMENT, TYPE=S3\n13, 1, 2, 4\n14, 1, 3, 2\n"
    );
    let sets = "*ELSET, ELSET=In\n12, 13,\n*ELSET, ELSET=all, GENERATE\n11, 13, 2\n*ELSET, ELSET=wet\nshell, in\n";
    check(
        Format::Abaqus,
        &format!("{flat}{sets}"),
        [&["Shell", "all", "wet"], &["Shell", "wet", "In"], &["all", "wet", "In"], &["part"]],
        &[],
    );
    let odd = "*ELSET, ELSET=odd\n11, 99, nobody\n*ELSET, ELSET=_Picked, INTERNAL\n11\n*NSET, NSET=n\n1\n";
    check(
        Format::Abaqus,
        &format!("{flat}{odd}"),
        [&["Shell", "odd"], &["Shell"], &["part"], &["part"]],
        &["2 node sets, surfaces and internal element sets", "1 element sets have", "1 members of"],
    );
    let parts = format!(
        "*PART, NAME=P\n{}*ELSET, ELSET=In\n12\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=P-1, PART=P\n*END INSTANCE\n\
        *ELSET, ELSET=top, INSTANCE=P-1\n 11, 13\n*ELSET, ELSET=most\nP-1.In, top, P-1.14\n*END ASSEMBLY\n",
        flat
    );
    check(
        Format::Abaqus,
        &parts,
        [&["Shell", "top", "most"], &["Shell", "most", "In"], &["top", "most"], &["most"]],
        &[],
    );
    let bad = |lines: &str| refuse(Format::Abaqus, format!("{flat}{lines}")).0;
    assert_eq!(bad("*ELSET, ELSET=a, GENERATE\n3, 2\n"), "unexpected-text");
    assert_eq!(bad("*ELSET, ELSET=a, GENERATE\n1, x\n"), "unexpected-text");
    let wide = format!("*ELSET, ELSET=a, GENERATE\n{}, {}\n", i64::MIN, i64::MAX);
    assert_eq!(read(Format::Abaqus, format!("{flat}{wide}")).unwrap().n_triangles(), 4);
}

#[test]
fn groups_of_ideas_overlap_and_may_hold_nodes() {
    let head = "    -1\n  2411\n10 1 1 11\n 0. 0. 0.\n20 1 1 11\n 1. 0. 0.\n30 1 1 11\n 0. 1. 0.\n40 1 1 11\n 0. 0. 1.\n    -1\n\
        \x20   -1\n  2412\n1 91 1 1 7 3\n 20 30 40\n2 91 1 1 7 3\n 10 40 30\n3 91 1 1 7 3\n 10 20 40\n4 91 1 1 7 3\n 10 30 20\n\
        5 111 1 1 7 4\n 10 20 30 40\n    -1\n";
    let with = |groups: &str| format!("{head}    -1\n  2467\n{groups}    -1\n");
    let lid = "1 0 0 0 0 0 0 2\nlid\n 8 1 0 0 8 2 0 0\n";
    let inlet = "2 0 0 0 0 0 0 2\nin\n 8 2 0 0 8 3 0 0\n";
    let groups = with(&format!("{lid}{inlet}"));
    check(Format::Unv, &groups, [&["lid"], &["lid", "in"], &["in"], &["part"]], &[]);
    let nodes = with(&format!("{inlet}3 0 0 0 0 0 0 3\npins\n 7 10 0 0 7 20 0 0\n 8 4 0 0\n"));
    check(
        Format::Unv,
        &nodes,
        [&["part"], &["in"], &["in"], &["pins"]],
        &["2 entries of groups that are no elements"],
    );
    let solid = with("1 0 0 0 0 0 0 1\nrock\n 8 5 0 0\n2 0 0 0 0 0 0 2\nwet\n 8 5 0 0 8 1 0 0\n");
    check(
        Format::Unv,
        &solid,
        [&["wet"], &["part"], &["part"], &["part"]],
        &["volumes of the groups wet belong"],
    );
}

#[test]
fn sets_of_nastran_and_regions_of_ply_are_noted() {
    let deck = "SET 3 = 1 THRU 2\nBEGIN BULK\nGRID,10,,0.,0.,0.\nGRID,20,,1.,0.,0.\nGRID,30,,0.,1.,0.\nGRID,40,,0.,0.,1.\n\
        CTRIA3,1,5,20,30,40\nCTRIA3,2,5,10,40,30\nCTRIA3,3,6,10,20,40\nCTRIA3,4,6,10,30,20\nSET1,7,1,2\n";
    check(Format::Nastran, deck, [&["5"], &["5"], &["6"], &["6"]], &["2 sets (SET, SET1, SET3)"]);
    let ply = |property: &str, value: &str| {
        let faces = FACES.map(|[a, b, c]| format!("3 {a} {b} {c} {value}\n")).concat();
        let points = POINTS.map(|[x, y, z]| format!("{x} {y} {z}\n")).concat();
        format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n\
            property list uchar int vertex_indices\n{property}end_header\n{points}{faces}"
        )
    };
    for (property, value, is_noted) in [
        ("property int region\n", "7", true),
        ("property uchar red\nproperty int label\nproperty float q\n", "9 1 0.5", true),
        ("property uchar red\nproperty float q\n", "9 0.5", false),
    ] {
        let surface = read_tetrahedron(Format::Ply, ply(property, value));
        let said = surface.notes.iter().any(|n| n.to_string().contains("may name regions"));
        assert_eq!(said, is_noted, "{property}: {:?}", surface.notes);
    }
}

#[test]
fn comments_of_obj_declare_labels_for_several_groups() {
    let points = POINTS.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    let face =
        |t: usize| format!("f {} {} {}\n", FACES[t][0] + 1, FACES[t][1] + 1, FACES[t][2] + 1);
    let names = "# tetdb label a b\n# tetdb label in\n# tetdb label o\n# tetdb labels 0 1 = a b+in\n# tetdb labels 1 2 = in+o\n";
    let text = format!(
        "{names}{points}g a b+in\n{}g o\n{}g in+o\n{}g a b+in\n{}",
        face(0),
        face(1),
        face(2),
        face(3)
    );
    check(Format::Obj, &text, [&["a b", "in"], &["o"], &["in", "o"], &["a b", "in"]], &[]);
    let numbers = text.replace("labels 1 2 =", "labels 9 x =");
    check(Format::Obj, &numbers, [&["a b", "in"], &["o"], &["in+o"], &["a b", "in"]], &[]);
    check(
        Format::Obj,
        &text.replace(names, ""),
        [&["a b+in"], &["o"], &["in+o"], &["a b+in"]],
        &[],
    );
}
