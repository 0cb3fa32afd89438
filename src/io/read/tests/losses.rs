//! Readers take, note or refuse the content of a file beside its faces.

use super::*;

/// Reads a tetrahedron whose notes have these words; none where there are no words.
fn noted(format: Format, bytes: impl AsRef<[u8]>, words: &[&str]) -> Surface {
    let surface = read_tetrahedron(format, bytes);
    let notes: Vec<String> = surface.notes.iter().map(ToString::to_string).collect();
    assert_eq!(notes.is_empty(), words.is_empty(), "{notes:?}");
    assert!(words.iter().all(|w| notes.iter().any(|n| n.contains(w))), "{words:?}: {notes:?}");
    surface
}

#[test]
fn names_outside_utf8_stay_two_labels() {
    let obj = indexed(|v| (v + 1).to_string(), "v ", "f ", "");
    let mut latin = obj.into_bytes();
    let faces = latin.windows(2).position(|w| w == b"f ").unwrap();
    latin.splice(faces..faces, *b"g Wand \xe4\n");
    let last = latin.windows(3).rposition(|w| w == b"\nf ").unwrap() + 1;
    latin.splice(last..last, *b"g Wand \xf6\n");
    assert_eq!(read_tetrahedron(Format::Obj, &latin).label_names, ["Wand ä", "Wand ö"]);
    let stl = stl_text("endsolid").into_bytes();
    let rest = &stl[stl.iter().position(|&b| b == b'\n').unwrap()..];
    let two = [b"solid \xe9", rest, b"\nsolid \xe8", rest].concat();
    assert_eq!(read(Format::Stl, two).unwrap().label_names, ["é", "è"]);
    let node = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*ELEMENT,TYPE=S3,ELSET=_\n1,1,2,3\n*ELEMENT,TYPE=S3,ELSET=|\n2,1,3,2\n";
    let bytes = node.bytes().map(|b| match b {
        b'_' => 0x84,
        b'|' => 0x94,
        b => b,
    });
    let surface = read(Format::Abaqus, bytes.collect::<Vec<u8>>()).unwrap();
    assert_eq!(surface.label_names.len(), 2);
}

#[test]
fn elements_beside_faces_are_noted() {
    let text = String::from_utf8(ply("ascii")).unwrap();
    let head = |element: &str| text.replace("end_header", &format!("{element}\nend_header"));
    noted(Format::Ply, &text, &[]);
    let edges = head("element edge 2\nproperty int vertex1\nproperty int vertex2") + "0 1\n1 2\n";
    noted(Format::Ply, edges, &["2 edges"]);
    noted(
        Format::Ply,
        head("element polygon 1\nproperty list uchar int v") + "3 0 1 2\n",
        &["1 record of the element `polygon` was left out"],
    );
    noted(Format::Ply, head("element edge 0\nproperty int vertex1"), &[]);
    noted(Format::Medit, MEDIT, &["1 of the edges", "1 of the tetrahedra"]);
    noted(Format::Gmsh, MSH2, &["1 of the lines and points", "1 of the solid elements"]);
    let obj = indexed(|v| (v + 1).to_string(), "v ", "f ", "");
    noted(Format::Obj, format!("mtllib a\ns 1\nvn 0 0 1\n{obj}"), &[]);
    noted(
        Format::Obj,
        obj.clone() + "F 1 2 3\ncall other.obj\n",
        &["2 lines of no known kind were left out, the first one `F` in line 9"],
    );
}

#[test]
fn what_follows_the_declared_content_is_noted() {
    let off = "OFF\n4 4 0\n".to_owned() + &off_body();
    noted(Format::Off, format!("{off}# end\n\n"), &[]);
    noted(Format::Off, format!("{off}3 0 1 2\n"), &["8 bytes behind"]);
    for format in ["ascii", "binary_little_endian"] {
        noted(Format::Ply, ply(format), &[]);
        noted(Format::Ply, [&ply(format)[..], b"3 0 1 2"].concat(), &["7 bytes behind"]);
    }
    let smesh =
        "4 3\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 0\n3 1 2 3\n3 0 3 2\n3 0 1 3\n3 0 2 1\n0\n0\n";
    noted(Format::TetgenSmesh, smesh, &[]);
    noted(Format::TetgenSmesh, smesh.to_owned() + "3 0 1 2\n", &["behind"]);
}

#[test]
fn materials_inside_an_object_are_noted() {
    let obj = indexed(|v| (v + 1).to_string(), "v ", "f ", "");
    let cut = obj.find("f ").unwrap();
    let last = obj.rfind("f ").unwrap();
    let named =
        |a: &str, b: &str| format!("{}{a}{}{b}{}", &obj[..cut], &obj[cut..last], &obj[last..]);
    let surface = noted(Format::Obj, named("o body\nusemtl a\n", "usemtl b\n"), &["label `body`"]);
    assert_eq!(surface.label_names, ["body"]);
    noted(Format::Obj, named("usemtl a\n", "usemtl b\n"), &[]);
    noted(Format::Obj, named("g a\nusemtl m\n", "g b\nusemtl n\n"), &[]);
    noted(Format::Obj, named("o a\ng x\n", "o b\ng x\n"), &["label `x`"]);
}

#[test]
fn curved_faces_of_medit_are_refused_and_curved_cells_noted() {
    for (keyword, n) in [("TrianglesP3", 10), ("QuadrilateralsQ2", 9), ("QuadrilateralsQ4", 25)] {
        let curved = format!("{keyword}\n1\n{}0\nEnd", "1 ".repeat(n));
        assert_eq!(refuse(Format::Medit, MEDIT.replace("End", &curved)).0, "unsupported-content");
    }
    let cells = format!("HexahedraQ2\n1\n{}0\nTrianglesP2Ordering\n1\n0 0 0\nEnd", "1 ".repeat(27));
    noted(
        Format::Medit,
        MEDIT.replace("End", &cells),
        &["1 of the edges", "1 of the tetrahedra", "1 of the hexahedra"],
    );
    let mut binary = meshb(2, false);
    binary.truncate(binary.len() - 8);
    for (number, is_good) in [(13i32, true), (27, false), (88, false), (90, false), (91, false)] {
        let mut file = binary.clone();
        let end = file.len() as i32 + 12 + 44;
        [number, end, 1].iter().chain(&[1; 11]).for_each(|x| file.extend(x.to_le_bytes()));
        [54i32, 0].iter().for_each(|x| file.extend(x.to_le_bytes()));
        assert_eq!(read(Format::MeditBinary, &file).is_ok(), is_good, "{number}");
    }
}

#[test]
fn abaqus_solid_shells_late_nodes_and_files_of_their_own() {
    let nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n";
    let faces = "*ELEMENT, TYPE=S3,\n ELSET=skin\n1,2,3,4\n2,1,4,3\n3,1,2,4\n4,1,3,2\n";
    let solid = "*ELEMENT, TYPE=SC6R\n5,1,2,3,1,2,4\n*ELEMENT, TYPE=C3D4\n6,1,2,3,4\n";
    for text in [[nodes, faces, solid], [solid, faces, nodes]] {
        assert_eq!(noted(Format::Abaqus, text.concat(), &["2 solid"]).label_names, ["skin"]);
    }
    noted(Format::Abaqus, format!("*HEADING\nx\n {nodes}{faces}"), &[]);
    let input = "*ELEMENT, TYPE=S3, INPUT=other.inp\n";
    let (code, spot) = refuse(Format::Abaqus, [nodes, faces, input].concat());
    assert_eq!((code, spot), ("unsupported-content", Spot::Line(12)));
}

#[test]
fn nastran_tabs_indents_and_shear_panels() {
    let tabs = "GRID\t1\t\t0.\t0.\t0.\nGRID\t2\t\t1.\t0.\t0.\nGRID\t3\t\t0.\t1.\t0.\nGRID\t4\t\t0.\t0.\t1.\n\
        CTRIA3\t1\t5\t2\t3\t4\nCTRIA3\t2\t5\t1\t4\t3\nCTRIA3\t3\t5\t1\t2\t4\nCTRIA3\t4\t5\t1\t3\t2\n";
    assert_eq!(noted(Format::Nastran, tabs, &[]).label_names, ["5"]);
    noted(Format::Nastran, tabs.replace("CTRIA3\t4", " CTRIA3\t4"), &[]);
    noted(Format::Nastran, format!("{tabs}CTUBE,7,1,1,2\nCGAP,8,1,1,2\n"), &["2 beams"]);
    noted(Format::Nastran, format!("{tabs}CPENTA\t9\t6\t1\t2\t3\t1\t2\t4\n"), &["1 of the solid"]);
    let panel = format!("{tabs}GRID,5,,1.,1.,0.\nCSHEAR,7,1,1,2,5,3\n");
    assert_eq!(read(Format::Nastran, panel).unwrap().n_triangles(), 6);
    // The end of a full field is a tab stop itself.
    let full = tabs.replace("\t1.\t0.", "\t1.000000\t0.");
    assert_eq!(refuse(Format::Nastran, full), ("unsupported-content", Spot::Line(2)));
    let moved = refuse(Format::Nastran, format!("GRDSET,,7\n{tabs}"));
    assert_eq!(moved, ("unsupported-content", Spot::Line(1)));
}

#[test]
fn unv_groups_of_all_versions() {
    let nodes = "-1\n2411\n1 1 1 1\n0 0 0\n2 1 1 1\n1 0 0\n3 1 1 1\n0 1 0\n4 1 1 1\n0 0 1\n-1\n";
    let faces = [[2, 3, 4], [1, 4, 3], [1, 2, 4], [1, 3, 2]].iter().enumerate();
    let faces = faces.map(|(k, [a, b, c])| format!("{} 91 1 1 7 3\n{a} {b} {c}\n", k + 1));
    let mesh = format!("{nodes}-1\n2412\n{}-1\n", faces.collect::<String>());
    let group = |kind: &str, rows: &str| format!("{mesh}-1\n{kind}\n{rows}-1\n");
    let pairs = "1 0 0 0 0 0 0 3\nlow\n8 1 8 2\n8 3\n2 0 0 0 0 0 0 1\nhigh\n8 4\n";
    let fours = "1 0 0 0 0 0 0 3\nlow\n8 1 0 0 8 2 0 0\n8 3 0 0\n2 0 0 0 0 0 0 1\nhigh\n8 4 0 0\n";
    for (kind, rows) in
        [("2429", pairs), ("2430", pairs), ("2432", pairs), ("2435", fours), ("2467", fours)]
    {
        let surface = noted(Format::Unv, group(kind, rows), &[]);
        assert_eq!(surface.label_names, ["low", "high"]);
        assert_eq!(surface.labels, [0, 0, 0, 1], "{kind}");
    }
    // A rod may have a line for its orientation.
    for rod in ["9 11 1 1 7 2\n0 1 1\n1 2\n", "9 11 1 1 7 2\n1 2\n", "9 21 1 1 7 2\n0 1 1\n1 2\n"] {
        let with_rod = mesh.replace("1 91 1", &format!("{rod}1 91 1"));
        noted(Format::Unv, with_rod, &["1 of the beams"]);
    }
    let both = noted(Format::Unv, group("2432", &pairs.replace("8 4", "8 3")), &[]);
    assert_eq!(both.label_names, ["low", "high", "low+high", "part"]);
    assert_eq!(
        refuse(Format::Unv, group("2467", &fours.replace("\n8 3 0 0", ""))).0,
        "unexpected-text"
    );
    assert_eq!(refuse(Format::Unv, group("780", "1\n")).0, "unsupported-content");
}

#[test]
fn vtk_fields_values_and_counts() {
    let points = POINTS.map(|p| p.map(|x| x.to_string()).join(" ")).join("\n");
    let faces = FACES.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).concat();
    let head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n";
    let field = "FIELD FieldData 2\nTIME 1 1 double\n0.5\nsteps 2 2 int\n1 2\n3 4\n";
    let body = format!("POINTS 4 double\n{points}\nPOLYGONS 4 16\n{faces}");
    let scalars = "CELL_DATA 4\nSCALARS region int 1\nLOOKUP_TABLE default\n1 1 2 2\n";
    noted(Format::Vtk, format!("{head}{field}{body}"), &[]);
    noted(Format::Vtk, format!("{head}{body}POINT_DATA 4\nSCALARS a int 1\n"), &[]);
    noted(Format::Vtk, format!("{head}{body}{scalars}"), &["values at cells"]);
    noted(
        Format::Vtk,
        format!("{head}{body}POINT_DATA 4\nSCALARS a int 1\n{scalars}"),
        &["values at cells"],
    );
    let grid = format!("{head}{body}").replace("POLYDATA", "UNSTRUCTURED_GRID");
    let cells = "CELLS 1 4\n3 0 1 2\n";
    assert_eq!(refuse(Format::Vtk, grid + cells).0, "truncated-file");
    let xml = |offsets: &str, types: &str, data: &str| {
        let corners = FACES.as_flattened().iter().map(|v| format!("{v} ")).collect::<String>();
        let array = |name: &str, kind: &str, text: &str| {
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\" NumberOfComponents=\"1\">{text}</DataArray>"
            )
        };
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><Piece>{data}<Points>{}</Points><Cells>{}{}{}</Cells></Piece></VTKFile>",
            array("p", "Float64", &points),
            array("connectivity", "Int32", &corners),
            array("offsets", "Int32", offsets),
            array("types", "UInt8", types)
        )
    };
    noted(Format::VtkXml, xml("3 6 9 12", "5 5 5 5", ""), &[]);
    let region = "<CellData><DataArray type=\"Int32\" Name=\"r\" format=\"ascii\">1 1 2 2</DataArray></CellData>";
    noted(Format::VtkXml, xml("3 6 9 12", "5 5 5 5", region), &["values at cells"]);
    for (offsets, types) in [("3 6 9 12", "5 5 5"), ("3 6 9", "5 5 5"), ("3 6 9 12", "")] {
        assert_eq!(refuse(Format::VtkXml, xml(offsets, types, "")).0, "count-mismatch");
    }
}
