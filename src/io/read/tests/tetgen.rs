//! TetGen's .poly and .smesh.

use super::*;

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
    assert_eq!(refuse(Format::TetgenSmesh, "0 3\n4 1\n").0, "unsupported-content");
    assert_eq!(
        refuse(Format::TetgenSmesh, smesh.replace("2 0 1 0\n", "5 0 1 0\n")),
        ("unexpected-text", Spot::Line(5))
    );
    let folder = tempfile::tempdir().unwrap();
    let (node, file) = (folder.path().join("a.node"), folder.path().join("a.smesh"));
    std::fs::write(&node, points).unwrap();
    std::fs::write(&file, smesh.replace(points, "0 3 0 0\n")).unwrap();
    assert_eq!(read_surface(&[file], 1 << 22).unwrap().n_vertices(), 4);
}
