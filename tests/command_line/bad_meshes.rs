//! `import` of meshes that are none, and of files that are damaged.
//!
//! Why: a mesh that overlaps or does not conform gives wrong answers later, and a damaged file must not be taken for a smaller one.
//! How: one fault for each file, over the formats; code, words and place of the error, and nothing left on disk.

use super::place::Place;

const POINTS: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n";
/// Two tetrahedra on one another.
const TWO: &str = "1 2 3 4 1\n1 3 2 5 1\n";
const VTU: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n\
    <Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">\n<CellData><DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">1 2</DataArray></CellData>\n\
    <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1 0 0 -1</DataArray></Points>\n\
    <Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 2 1 4</DataArray>\n\
    <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 8</DataArray>\n\
    <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10</DataArray></Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
const GMSH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n$EndNodes\n\
    $Elements\n2\n1 4 2 1 1 1 2 3 4\n2 4 2 1 1 1 3 2 5\n$EndElements\n";
const NODE: &str = "5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n";
const ELE: &str = "2 4 1\n1 1 2 3 4 1\n2 1 3 2 5 2\n";
const ABAQUS: &str =
    "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n";

fn medit(points: &str, tets: &str) -> String {
    let vertices: String = points.lines().map(|line| format!("{line} 0\n")).collect();
    let n = [points, tets].map(|text| text.lines().count());
    format!(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n{vertices}Tetrahedra\n{}\n{tets}End\n",
        n[0], n[1]
    )
}

fn npy(kind: &str, shape: &str, numbers: &[i32]) -> Vec<u8> {
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape})}}\n");
    let length = (head.len() as u16).to_le_bytes();
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    [b"\x93NUMPY\x01\x00", &length[..], head.as_bytes(), &bytes].concat()
}

/// Imports the first file; expects an error of this code with these words at this place, and no other file afterwards.
fn refused(files: &[(&str, Vec<u8>)], code: &str, words: &str, at: &str) {
    let place = Place::new();
    files.iter().for_each(|(name, bytes)| place.write(name, bytes));
    let done = place.run_line(&format!("import {} --json", files[0].0));
    let error = done.error();
    assert_eq!((done.exit(), &error["code"]), (Some(3), &code.into()), "{words}: {error}");
    assert!(error["message"].to_string().contains(words), "{words}: {error}");
    assert!(error["where"].to_string().contains(at), "{at}: {error}");
    assert!(error["help"].is_string(), "{error}");
    assert_eq!(place.names().len(), files.len(), "{words}: {:?}", place.names());
}

/// Tetrahedra that are positive and whose faces match, and that are no mesh.
#[test]
fn tetrahedra_that_overlap_or_do_not_conform() {
    let on_edge = "0 0 0\n2 0 0\n0 1 0\n0 0 1\n1 0 0\n0 0 -1\n";
    let in_face = "0 0 0\n3 0 0\n0 3 0\n0 0 1\n1 1 0\n0 0 -1\n";
    let in_plane = "0 0 0\n3 0 0\n0 3 0\n0 0 1\n1 1 0\n2 0.5 0\n0.5 2 0\n1 1 -1\n";
    let other = |p: &str| format!("0 0 0\n9 0 0\n0 9 0\n0 0 9\n{p}\n2 1 1\n1 2 1\n1 1 2\n");
    for (points, tets, words, at) in [
        (
            on_edge,
            "1 2 3 4 1\n1 3 5 6 1\n5 3 2 6 1\n",
            "T-junction",
            "tetrahedra 1 and 2 at (1, 0, 0)",
        ),
        (
            in_face,
            "1 2 3 4 1\n1 3 5 6 1\n3 2 5 6 1\n2 1 5 6 1\n",
            "in one plane",
            "tetrahedra 1 and 2 at (1, 1, 0)",
        ),
        (in_plane, "1 2 3 4 1\n5 7 6 8 1\n", "T-junction", "tetrahedra 1 and 2"),
        (&other("1 1 -1"), "1 2 3 4 1\n5 6 7 8 1\n", "they cross", "tetrahedra 1 and 2"),
        (&other("1 1 1"), "1 2 3 4 1\n5 6 7 8 1\n", "overlap", "tetrahedron 1"),
    ] {
        refused(&[("a.mesh", medit(points, tets).into())], "bad-mesh", words, at);
    }
    // Apart, or in shared corners and edges alone.
    for points in [
        other("10 10 10")
            .replace("2 1 1", "11 10 10")
            .replace("1 2 1", "10 11 10")
            .replace("1 1 2", "10 10 11"),
        other("9 0 0")
            .replace("2 1 1", "12 0 0")
            .replace("1 2 1", "9 2 0")
            .replace("1 1 2", "9 0 2"),
    ] {
        let place = Place::new();
        place.write("a.mesh", medit(&points, "1 2 3 4 1\n5 6 7 8 1\n"));
        place.run_line("import a.mesh").succeeds();
        place.run_line("resaturate a.tetdb --subdomain 0 --refine-by 0.5").succeeds();
        place.run_line("verify a.tetdb --full").succeeds();
    }
}

/// A third tetrahedron at a face is found also when its first two were matched long before.
#[test]
fn a_third_tetrahedron_far_behind_in_the_file() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.05 -o a.tetdb --no-verify").succeeds();
    place.run_line("export a.tetdb a.mesh").succeeds();
    let text = std::fs::read_to_string(place.path("a.mesh")).expect("a text");
    let (head, tets) = text.split_once("Tetrahedra\n").expect("the section");
    let (n, tets) = tets.split_once('\n').expect("a number");
    let n: u32 = n.trim().parse().expect("a number");
    assert!(n > 1 << 16, "several batches");
    let n_vertices = head.split_once("Vertices\n").and_then(|(_, rest)| rest.lines().next());
    let n_vertices: u32 = n_vertices.and_then(|n| n.trim().parse().ok()).expect("a number");
    let first: Vec<&str> = tets.lines().next().expect("a tetrahedron").split(' ').collect();
    // Its fourth corner is a new one far away, on the side of the fourth corner of the first.
    let (_, vertices) = head.split_once("Vertices\n").expect("the section");
    let point = |k: usize| -> Vec<f64> {
        let number: usize = first[k].parse().expect("a number");
        let line = vertices.lines().nth(number).expect("a vertex");
        line.split(' ').take(3).map(|x| x.parse().expect("a number")).collect()
    };
    let (a, d) = (point(0), point(3));
    let middle: Vec<String> = (0..3).map(|i| (a[i] + 0.9 * (d[i] - a[i])).to_string()).collect();
    let head = head.replacen(
        &format!("Vertices\n{n_vertices}\n"),
        &format!("Vertices\n{}\n{} 0\n", n_vertices + 1, middle.join(" ")),
        1,
    );
    let moved = |line: &str| {
        let numbers: Vec<u32> = line.split(' ').map(|n| n.parse().expect("a number")).collect();
        let [corners @ .., region] = &numbers[..] else { panic!("no numbers") };
        let corners: Vec<String> = corners.iter().map(|v| (v + 1).to_string()).collect();
        format!("{} {region}\n", corners.join(" "))
    };
    let lines: String = tets.lines().take(n as usize).map(moved).collect();
    let third: Vec<u32> =
        first[..3].iter().map(|v| v.parse::<u32>().expect("a number") + 1).collect();
    let bad = format!(
        "{head}Tetrahedra\n{}\n{lines}{} {} {} 1 1\nEnd\n",
        n + 1,
        third[0],
        third[1],
        third[2]
    );
    // Triangles of the file name vertices by their old numbers.
    let bad = match bad.split_once("Triangles\n") {
        Some((before, rest)) => format!(
            "{before}Tetrahedra\n{}",
            rest.split_once("Tetrahedra\n").expect("the section").1
        ),
        None => bad,
    };
    refused(&[("a.mesh", bad.into())], "bad-mesh", "", "tetrahed");
}

#[test]
fn damaged_files() {
    let good = medit(POINTS, TWO);
    let medit_cases = [
        (good.replace("0 0 -1", "0 0 nan"), "not-a-number", "`nan`", "line 9"),
        (good.replace("0 0 -1", "0 0 inf"), "not-a-number", "`inf`", "line 9"),
        (good.replace("0 0 -1", "0 0 1e40"), "coordinate-range", "1e40", "line 9"),
        (good.replace("0 0 -1", "0 0 one"), "not-a-number", "`one`", "line 9"),
        (good.replace("2 5 1", "2 0 1"), "index-out-of-range", "vertex number 0", "line 13"),
        (good.replace("2 5 1", "2 6 1"), "index-out-of-range", "vertex number 6", "line 13"),
        (
            good.replace("Tetrahedra\n2", "Tetrahedra\n200000000"),
            "count-mismatch",
            "200000000",
            "line 11",
        ),
        (
            good.replace("Tetrahedra\n2", "Tetrahedra\n-2"),
            "count-mismatch",
            "-2 declared",
            "line 11",
        ),
        (good.replace("Tetrahedra\n2", "Tetrahedra\n3"), "count-mismatch", "3 declared", "line 11"),
        (good.replace("2 5 1\nEnd\n", "2"), "count-mismatch", "2 declared", ""),
        (
            good.replace("Dimension 3", "Dimension 2"),
            "unsupported-content",
            "dimension 2",
            "line 2",
        ),
        (
            good.replace("End", "Hexahedra\n1\n1 2 3 4 5 1 2 3 0\nEnd"),
            "unsupported-content",
            "hexahedra",
            "line 15",
        ),
        (String::new(), "truncated-file", "ends too early", "line 1"),
    ];
    for (text, code, words, at) in medit_cases {
        refused(&[("a.mesh", text.into())], code, words, at);
    }
    for (old, new, code, words, at) in [
        ("0 0 -1<", "0 0 -1 7<", "unexpected-text", "more numbers", "byte 308"),
        ("0 0 -1<", "0 0<", "truncated-file", "a coordinate", "byte"),
        ("2 1 4<", "2 1 4 4<", "unexpected-text", "more numbers", "byte 426"),
        ("2 1 4<", "2 1<", "truncated-file", "vertices of cells", "byte"),
        (">1 2<", ">1 2 3<", "unexpected-text", "more numbers", "byte 209"),
        (">1 2<", ">1<", "truncated-file", "region of a cell", "byte"),
        ("10 10<", "10 10 10<", "unexpected-text", "more numbers", "byte"),
        ("4 8<", "8 4<", "unsupported-content", "8 vertices", "byte"),
        ("2 1 4<", "2 1 -1<", "index-out-of-range", "vertex number -1", "byte"),
        ("2 1 4<", "2 1 5<", "index-out-of-range", "vertex number 5", "byte"),
        ("10 10<", "10 12<", "unsupported-content", "type 12", "byte"),
        ("0 0 -1<", "0 0 nan<", "not-a-number", "finite", "byte"),
        ("Name=\"types\"", "Name=\"kinds\"", "unexpected-text", "types of cells", "a.vtu"),
        ("Components=\"3\"", "Components=\"2\"", "unexpected-text", "three coordinates", "byte"),
        ("\"UnstructuredGrid\" b", "\"ImageData\" b", "unsupported-content", "ImageData", "byte"),
    ] {
        let text = VTU.replacen(old, new, 1);
        assert_ne!(text, VTU, "{old}");
        refused(&[("a.vtu", text.into())], code, words, at);
    }
    for (old, new, code, words, at) in [
        ("3 2 5\n", "3 2 9\n", "index-out-of-range", "vertex number 9", "line"),
        ("\n3 0 1 0", "\n2 0 1 0", "unexpected-text", "node 2 a second time", "line"),
        ("2 4 2 1 1 1 3 2 5", "2 6 2 1 1 1 3 2 5 1 2", "unsupported-content", "6 corners", "line"),
        ("$Nodes\n5", "$Nodes\n500", "count-mismatch", "500 declared", "line 5"),
        ("2.2 0 8", "9.9 0 8", "unsupported-content", "9.9", "line 2"),
    ] {
        refused(&[("a.msh", GMSH.replacen(old, new, 1).into())], code, words, at);
    }
    let (node, ele): (Vec<u8>, Vec<u8>) = (NODE.into(), ELE.into());
    refused(&[("a.ele", ele.clone())], "unreadable-file", "cannot be read", "a.node");
    let files = [("a.ele", ELE.replace("2 5 2", "2 6 2").into()), ("a.node", node.clone())];
    refused(&files, "index-out-of-range", "vertex number 6", "line 3");
    let files = [("a.ele", ele), ("a.node", NODE.replace("5 3", "6 3").into())];
    refused(&files, "count-mismatch", "6 declared", "a.node");
    let files = [("a.ele", ELE.replace("2 4 1", "2 5 1").into()), ("a.node", node)];
    refused(&files, "unsupported-content", "5 nodes", "line");
    for (old, new, code, words) in [
        ("3, 4\n", "3, 7\n", "index-out-of-range", "vertex number 7"),
        ("C3D4", "C3D8", "unsupported-content", "C3D8"),
        ("2, 3, 4\n", "2, 3\n", "unsupported-content", "3 nodes"),
    ] {
        refused(&[("a.inp", ABAQUS.replacen(old, new, 1).into())], code, words, "line 7");
    }
    let corners = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1];
    let points = || ("a_points.npy", npy("<i4", "4, 3", &corners));
    for (shape, numbers, code, words) in [
        ("1, 4", &[0, 1, 2, 4][..], "index-out-of-range", "vertex number 4"),
        ("2, 4", &[0, 1, 2, 3], "truncated-file", "ends too early"),
        ("1, 4", &[0, 1, 2, 3, 0], "unexpected-text", "more numbers"),
        ("4,", &[0, 1, 2, 3], "unexpected-text", "rows of 4 numbers"),
    ] {
        let tets = ("a_tets.npy", npy("<i4", shape, numbers));
        refused(&[tets, points()], code, words, "a_tets.npy");
    }
    let tets = ("a_tets.npy", npy("<i4", "1, 4", &[0, 1, 2, 3]));
    let region = ("a_region.npy", npy("<i4", "2,", &[1, 2]));
    refused(&[tets, points(), region], "count-mismatch", "2 declared", "a_region.npy");
    refused(&[("a.xyz", b"mesh".into())], "unknown-format", "not known", "a.xyz");
    refused(&[("a.vtkhdf", b"mesh".into())], "unexpected-text", "an HDF5 file", "a.vtkhdf");
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.3 -o a.tetdb --no-verify").succeeds();
    place.run_line("export a.tetdb a.vtkhdf").succeeds();
    let bytes = std::fs::read(place.path("a.vtkhdf")).expect("a file");
    for n in [bytes.len() / 4, bytes.len() / 2, bytes.len() - 1000] {
        let cut = ("a.vtkhdf", bytes[..n].to_vec());
        refused(&[cut], "unexpected-text", "unexpected end of data", "a.vtkhdf");
    }
}
