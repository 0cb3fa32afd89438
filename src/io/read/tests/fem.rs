//! Files of finite elements: Abaqus, Nastran, I-DEAS.

use super::*;

fn refused(format: Format, text: &str, changes: &[(&str, &str, &str, u64)]) {
    for (from, to, code, line) in changes {
        assert!(text.contains(from), "{from}");
        assert_eq!(refuse(format, text.replacen(from, to, 1)), (*code, Spot::Line(*line)), "{to}");
    }
}

const ABAQUS: &str = "*HEADING\nplate, 7\n** a remark\n*NODE, NSET=all\n10, 0., 0., 0.\n20, 1.D0, 0.\n30, 0., 1., 0.\n40, 0, 0, 1\n\
    *Element, type=S3R, elset=top\n1, 20, 30, 40\n2, 10, 40, 30\n*ELEMENT, TYPE=STRI65, ELSET=rest\n3, 10, 20, 40, 10,\n10, 10\n\
    4, 10, 30, 20, 10, 10, 10\n*ELEMENT, TYPE=C3D4, ELSET=steel\n9, 10, 20, 30, 40\n*ELEMENT, TYPE=B31\n11, 10, 20\n*ELSET, ELSET=x\n1, 2\n";

#[test]
fn abaqus() {
    let surface = read_tetrahedron(Format::Abaqus, ABAQUS);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["top".into(), "x".into(), "top+x".into(), "rest".into()], vec![2, 2, 3, 3])
    );
    assert_eq!((surface.notes.len(), surface.seeds.len()), (4, 1));
    let two = ABAQUS.replace("*NODE,", "*PART, NAME=a\n*NODE,");
    let two = two.clone()
        + "*PART, NAME=b\n"
        + &two[two.find("*NODE").unwrap()..].replace("0, 0, 1\n", "0, 0, 2\n");
    assert_eq!(read(Format::Abaqus, two).unwrap().n_triangles(), 8);
    refused(
        Format::Abaqus,
        ABAQUS,
        &[
            ("2, 10, 40, 30", "2, 10, 40, 31", "unexpected-text", 11),
            ("2, 10, 40, 30", "2, 10, 40", "unexpected-text", 11),
            ("30, 0., 1., 0.", "30, 0., l., 0.", "not-a-number", 7),
            ("30, 0., 1., 0.", "20, 0., 1., 0.", "unexpected-text", 7),
            ("S3R", "XYZ3", "unsupported-content", 10),
            ("*HEADING", "*INCLUDE, INPUT=b.inp", "unsupported-content", 1),
            ("*ELSET, ELSET=x\n1, 2", "*INSTANCE, PART=a\n1., 0., 0.", "unsupported-content", 21),
        ],
    );
}

#[test]
fn nastran_in_all_field_formats() {
    let small = "$ by hand\nSOL 101\nCEND\nBEGIN BULK\n\
        GRID          10              0.      0.      0.\nGRID          20              1.      0.      0.\n\
        GRID          30              0.    1.+0      0.\nGRID          40              0.      0.   10.-1\n\
        CTRIA3         1       5      20      30      40\nCTRIA3         2       5      10      40      30\n\
        CTRIA6         3       6      10      20      40      10      10      10\n\
        CQUAD4         4       6      10      30      20      10\nENDDATA\nGRID\n";
    let small = small.replace(
        "CQUAD4         4       6      10      30      20      10",
        "CTRIAR         4       6      10      30      20",
    );
    let free = "GRID,10,,0.,0.,0.\nGRID,20,0,1.0E0,0.,\nGRID,30,,,1.\nGRID,40,,0.,0.,1.,\nCTRIA3,1,5,20,30,40\nCTRIA3,2,5,10,40,30\n\
        CTRIA3,3,6,10,20,40\nCTRIA3,4,6,10,30,20\nCTETRA,9,7,10,20,30,40\nCBAR,11,1,10,20\n";
    let large = "GRID*                 10                              0.              0.\n*                     0.\n\
        GRID*                 20                              1.              0.\n*                     0.\n\
        GRID*                 30                              0.              1.*A\n*A                    0.\n\
        GRID*                 40                              0.              0.\n*                     1.\n\
        CTRIA3,1,5,20,30,40\nCTRIA3,2,5,10,40,30\nCTRIA3,3,6,10,20,40\nCTRIA3,4,6,10,30,20\n";
    for text in [&small[..], free, large] {
        let surface = read_tetrahedron(Format::Nastran, text);
        assert_eq!(
            (surface.label_names, surface.labels),
            (vec!["5".into(), "6".into()], vec![0, 0, 1, 1])
        );
    }
    assert_eq!(read_tetrahedron(Format::Nastran, free).seeds.len(), 1);
    refused(
        Format::Nastran,
        free,
        &[
            ("GRID,20,0", "GRID,20,3", "unsupported-content", 2),
            ("GRID,30,,,1.", "GRID,30,,,one", "not-a-number", 3),
            ("CTRIA3,2,5,10,40,30", "CTRIA3,2,5,10,40,31", "unexpected-text", 6),
            ("CTRIA3,2,5,10,40,30", "CTRIA3,2,5,10,40", "unexpected-text", 6),
            ("CTRIA3,2,5", "CTRIAX,2,5", "unsupported-content", 6),
        ],
    );
}

#[test]
fn universal_files() {
    let text = "    -1\n   164\n         1SI\n    -1\n    -1\n  2411\n\
        10 1 1 11\n 0.0D+00 0.0D+00 0.0D+00\n20 1 1 11\n 1.0D+00 0.0D+00 0.0D+00\n\
        30 1 1 11\n 0.0 1.0 0.0\n40 1 1 11\n 0.0 0.0 1.0\n    -1\n    -1\n  2412\n\
        1 91 1 1 7 3\n 20 30 40\n2 91 1 1 7 3\n 10 40 30\n3 92 1 1 7 6\n 10 10 20 20 40 40\n4 91 1 1 7 3\n 10 30 20\n\
        5 111 1 1 7 4\n 10 20 30 40\n6 21 1 1 7 2\n 0 1 1\n 10 20\n    -1\n    -1\n  2467\n\
        1 0 0 0 0 0 0 3\nlid\n 8 1 0 0 8 2 0 0\n 8 5 0 0\n    -1\n";
    let surface = read_tetrahedron(Format::Unv, text);
    assert_eq!(
        (surface.label_names, surface.labels),
        (vec!["lid".into(), "part".into()], vec![0, 0, 1, 1])
    );
    assert_eq!(surface.seeds.len(), 1);
    refused(
        Format::Unv,
        text,
        &[
            (" 10 40 30\n", " 10 40 31\n", "unexpected-text", 20),
            ("2 91 1 1 7 3", "2 99 1 1 7 3", "unsupported-content", 20),
            (" 0.0 1.0 0.0", " 0.0 1.0", "unexpected-text", 12),
            ("    -1\n   164", "   164", "unexpected-text", 1),
        ],
    );
    let turned = format!(
        "    -1\n  2420\n1\nunits\n1 0 8\n 0. 1. 0.\n -1. 0. 0.\n 0. 0. 1.\n 0. 0. 0.\n    -1\n{text}"
    );
    assert_eq!(refuse(Format::Unv, turned).0, "unsupported-content");
    for format in [Format::Unv, Format::Nastran, Format::Abaqus] {
        for (from, n) in [(text, text.len()), (ABAQUS, ABAQUS.len())] {
            (0..n).for_each(|n| drop(read(format, &from[..n])));
        }
    }
}
