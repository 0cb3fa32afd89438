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
        "{points}4 1\n1 0 5\n3 1 2 3\n1\n3 0 3 2\n1 0 6\n3 0 1\n3\n2 0\n3 0 2 1\n2 0 1\n1\n1 5 5 5\n"
    );
    let surface = read_tetrahedron(Format::TetgenPoly, &poly);
    assert_eq!(surface.labels, [0, 1, 2, 1]);
    assert_eq!(surface.notes[0].kind, NoteKind::CutFacets { n: 1 });
    assert_eq!(surface.notes[1].kind, NoteKind::Edges { n: 1 });
    assert_eq!(
        surface.notes[1].to_string(),
        "folder/part.x: 1 polygon of two corners is an edge, embedded where the surface is meshed"
    );
    // Of the unused vertices, the end of an edge is none.
    let more = poly
        .replace("4 3 0 0\n", "6 3 0 0\n")
        .replace("3 0 0 1\n", "3 0 0 1\n4 .1 .1 .1\n5 .2 .1 .1\n");
    let edge = more.replace("2 0 1\n", "2 0 4\n");
    let unused =
        |text: &str| read(Format::TetgenPoly, text).unwrap().notes.last().unwrap().to_string();
    assert!(unused(&more).ends_with("2 vertices belong to no triangle and were left out"));
    assert!(unused(&edge).ends_with("1 vertex belongs to no triangle and was left out"));
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

/// A box with a tunnel of `sides` sides along z: points, and the facets at its ends with `end` behind their polygons.
fn tunnel(sides: usize, holes: &str, extra: &str) -> String {
    let mut points = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    points.extend((0..sides).map(|k| {
        let (y, x) = (std::f64::consts::TAU * k as f64 / sides as f64).sin_cos();
        [2.0 + x, 2.0 + y]
    }));
    let n = points.len();
    let mut text = format!("{} 3 0 0\n", 2 * n);
    for (v, [x, y]) in points.iter().chain(&points).enumerate() {
        text += &format!("{} {x} {y} {}\n", v + 1, if v < n { 0 } else { 3 });
    }
    let round = |from: usize, to: usize| (from..to).map(|v| format!(" {v}")).collect::<String>();
    let quads = |from: usize, to: usize| -> String {
        let next = |v: usize| if v + 1 == to { from } else { v + 1 };
        (from..to)
            .map(|v| format!("1 0 2\n4 {v} {} {} {}\n", next(v), next(v) + n, v + n))
            .collect()
    };
    text += &format!("{} 1\n", 2 + n);
    for (low, z) in [(1, 0), (n + 1, 3)] {
        let (outer, inner) = (round(low, low + 4), round(low + 4, low + n));
        text += &format!("{holes} 1\n4{outer}\n{sides}{inner}\n{extra}1 2 2 {z}\n");
    }
    text + &quads(1, 5) + &quads(5, n + 1) + "0\n0\n"
}

#[test]
fn facets_with_holes_are_cut_as_a_whole() {
    for sides in [3, 4, 7, 30] {
        let surface = read(Format::TetgenPoly, tunnel(sides, "2 1", "")).expect("a tunnel");
        assert!(tetdb_base::surface::validate(&surface).accept().is_ok());
        assert_eq!(surface.n_triangles(), 2 * (sides + 4) + 2 * (sides + 4));
        assert!(surface.notes.iter().any(|n| n.kind == NoteKind::CutFacets { n: 2 }));
    }
    // A hole point in the frame instead takes the frame away; one outside of the facet is refused with its line.
    let text = tunnel(4, "2 1", "").replace("1 2 2 3\n", "1 9 9 3\n");
    assert_eq!(refuse(Format::TetgenPoly, text), ("unexpected-text", Spot::Line(23)));
    // Polygons that cross each other.
    let crossed = tunnel(4, "3 1", "4 1 2 7 8\n");
    assert_eq!(refuse(Format::TetgenPoly, crossed), ("self-intersection", Spot::Line(19)));
    // A polygon of one corner is a vertex of the facet, one of two an edge of it.
    let text = tunnel(4, "4 1", "2 2 5\n1 3\n");
    let text = text.replacen("2 2 5\n1 3\n1 2 2 3", "2 10 13\n1 11\n1 2 2 3", 1);
    let surface = read(Format::TetgenPoly, text).expect("edges in a facet");
    assert!(tetdb_base::surface::validate(&surface).accept().is_ok());
    assert!(surface.notes.iter().any(|n| n.kind == NoteKind::Edges { n: 2 }));
}

#[test]
fn regions_ask_for_lengths() {
    let poly = |regions: &str| {
        format!(
            "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 0\n1\n3 1 2 3\n1\n3 0 3 2\n1\n3 0 1 3\n1\n3 0 2 1\n0\n{regions}"
        )
    };
    for (regions, expected) in [
        ("1\n1 .1 .1 .1 7 0.001\n", Some(("attribute_7", 0.001))),
        ("2\n1 .1 .1 .1 7 -1\n2 .1 .1 .2 8 2e-6\n", Some(("attribute_8", 2e-6))),
        ("2\n1 .1 .1 .1 3 0.5\n2 .1 .1 .2 3 0.5 # twice\n", Some(("attribute_3", 0.5))),
        ("1\n1 .1 .1 .1 7\n", None),
    ] {
        let surface = read(Format::TetgenPoly, poly(regions)).expect(regions);
        assert!(surface.fills_rest);
        // A regular tetrahedron of edge h has the volume h^3 / (6 sqrt 2).
        let found =
            surface.region_sizes.first().map(|(name, h)| (name.as_str(), h.powi(3) / 72f64.sqrt()));
        assert_eq!(found.map(|f| f.0), expected.map(|e| e.0));
        if let (Some((_, found)), Some((_, volume))) = (found, expected) {
            assert!((found / volume - 1.0).abs() < 1e-12);
        }
    }
    let two = poly("2\n1 .1 .1 .1 3 0.5\n2 .1 .1 .2 3 0.25\n");
    assert_eq!(refuse(Format::TetgenPoly, two), ("unsupported-content", Spot::Line(18)));
    assert_eq!(refuse(Format::TetgenPoly, poly("1\n1 .1 .1 .1 3 small\n")).0, "not-a-number");
    assert_eq!(refuse(Format::TetgenPoly, poly("1\n1 .1 .1 .1 3 nan\n")).0, "unexpected-text");
}
