//! One mesh in every format; files that are refused, with the place.

use std::path::Path;

use super::{MeshFields, RawMesh, Result, read_tets};
use crate::read::ReadError;
use tetdb_base::storage::ScratchSpace;

/// Two tetrahedra on one another, each with a region of its own, and a labelled triangle.
const MEDIT: &str = "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 -1 0\n\
    Triangles\n1\n1 2 4 9\nEdges\n1\n1 2 1\nTetrahedra\n2\n1 2 3 4 1\n1 3 2 5 2\nEnd\n";
const GMSH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 9 \"wall\"\n3 2 \"rock\"\n$EndPhysicalNames\n\
    $Nodes\n5\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n50 0 0 -1\n$EndNodes\n\
    $Elements\n4\n1 1 2 0 1 10 20\n2 2 2 9 1 10 20 40\n3 4 5 1 1 2 7 8 10 20 30 40\n4 4 4 2 1 1 7 10 30 20 50\n$EndElements\n";
const GMSH4: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 9 \"wall\"\n$EndPhysicalNames\n\
    $Entities\n0 0 1 2\n1 0 0 0 1 1 1 1 9 0\n1 0 0 0 1 1 1 1 1 0\n2 0 0 0 1 1 1 1 2 0\n$EndEntities\n\
    $Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n$EndNodes\n\
    $Elements\n3 3 1 3\n2 1 2 1\n1 1 2 4\n3 1 4 1\n2 1 2 3 4\n3 2 4 1\n3 1 3 2 5\n$EndElements\n";
const NODE: &str = "5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n";
const ELE: &str = "2 4 1 # two\n1 1 2 3 4 1\n2 1 3 2 5 2.0\n";
const FACE: &str = "1 1\n1 1 2 4 9\n";
const ABAQUS: &str = "*HEADING\ntwo\n*NODE, NSET=all\n1, 0, 0, 0\n2, 1.\n3, 0., 1.\n7, 0, 0, 1D0\n5, 0, 0, -1\n\
    *ELEMENT, TYPE=C3D4, ELSET=all\n1, 1, 2, 3, 7\n2, 1, 3,\n 2, 5\n*ELSET, ELSET=region_1\n1\n*ELSET, ELSET=rock, GENERATE\n2, 2, 1\n\
    *SURFACE, TYPE=ELEMENT, NAME=wall\n1, S2\n";
const VTU: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n\
    <Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">\n<CellData><DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">1 2 9</DataArray>\n\
    <DataArray type=\"Int32\" Name=\"part\" format=\"ascii\">4 3 0</DataArray></CellData>\n\
    <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1\n 0 0 -1</DataArray></Points>\n\
    <Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 2 1 4 0 1 3</DataArray>\n\
    <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 8 11</DataArray>\n\
    <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10 5</DataArray></Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";

/// Sets as Abaqus/CAE writes them: a set for each side of a surface, and sets of sets.
const ABAQUS_SETS: &str = "*NODE\n1, 0, 0, 0\n2, 1.\n3, 0., 1.\n4, 0, 0, 1\n5, 0, 0, -1\n\
    *ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n2, 1, 3, 2, 5\n*ELSET, ELSET=_wall_S2, INTERNAL\n1\n\
    *ELSET, ELSET=Low\n1\n*ELSET, ELSET=region_1\nlow\n*ELSET, ELSET=region_2, GENERATE\n2, 2, 1\n\
    *SURFACE, TYPE=ELEMENT, NAME=wall\n_WALL_S2, S2\n";

fn read_with(files: &[(&str, &[u8])], fields: MeshFields) -> Result<RawMesh> {
    let dir = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        std::fs::write(dir.path().join(name), bytes).expect("the folder takes files");
    }
    let mut mesh = RawMesh::new(ScratchSpace::new(1 << 22, dir.path()));
    read_tets(&dir.path().join(files[0].0), fields, &mut mesh)?;
    Ok(mesh)
}

fn read(name: &str, text: &str) -> Result<RawMesh> {
    read_with(&[(name, text.as_bytes())], MeshFields::default())
}

/// Corners, number of the region, and number of the part of each tetrahedron.
fn tets(mesh: &mut RawMesh) -> Vec<([u32; 4], i64, i64)> {
    let number = |groups: &super::Groups, g: u32| groups.list.get(g as usize).map_or(0, |g| g.0);
    (0..mesh.tets.len())
        .map(|t| {
            let [a, b, c, d, region, part] = mesh.tets.get(t);
            ([a, b, c, d], number(&mesh.regions, region), number(&mesh.parts, part))
        })
        .collect()
}

fn check(mesh: Result<RawMesh>, label: (i64, &str), parts: [i64; 2]) {
    let mut mesh = mesh.expect("it can be read");
    let expected: Vec<[f64; 3]> =
        vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0., 0., -1.]];
    let points: Vec<_> = (0..mesh.points.len()).map(|i| mesh.points.get(i)).collect();
    assert_eq!(points, expected);
    let found = tets(&mut mesh);
    assert_eq!(found[0], ([0, 1, 2, 3], 1, parts[0]));
    assert_eq!((found[1].0, found[1].2), ([0, 2, 1, 4], parts[1]));
    assert_eq!(found.len(), 2);
    assert_eq!(mesh.triangles.len(), 1);
    let [a, b, c, of] = mesh.triangles.get(0);
    let mut corners = [a, b, c];
    corners.sort_unstable();
    assert_eq!(corners, [0, 1, 3]);
    assert_eq!(mesh.labels.list[of as usize], (label.0, label.1.to_owned()));
}

#[test]
fn one_mesh_is_the_same_in_every_format() {
    check(read("a.mesh", MEDIT), (9, ""), [0; 2]);
    check(read("a.msh", GMSH), (9, "wall"), [0; 2]);
    check(read("a.msh", GMSH4), (9, "wall"), [0; 2]);
    check(read("a.inp", ABAQUS), (1 << 40, "wall"), [0; 2]);
    let tetgen =
        [("a.ele", ELE), ("a.node", NODE), ("a.face", FACE)].map(|(n, t)| (n, t.as_bytes()));
    check(read_with(&tetgen, MeshFields::default()), (9, ""), [0; 2]);
    check(read("a.vtu", VTU), (9, ""), [0; 2]);
    let fields = MeshFields { part: Some("part"), region: Some("region"), values: None };
    check(read_with(&[("a.vtu", VTU.as_bytes())], fields), (9, ""), [4, 3]);
    let fields = MeshFields { part: Some("partition"), region: None, values: None };
    check(read_with(&[("a.msh", GMSH.as_bytes())], fields), (9, "wall"), [7, 7]);
    let twice = ABAQUS.replacen(
        "*ELSET",
        "*NODE\n90, 5, 5, 5\n*ELEMENT, TYPE=C3D4, ELSET=all\n70, 90, 2, 3, 7\n*ELSET",
        1,
    );
    let mut twice = read("a.inp", &twice).expect("it can be read");
    assert_eq!((twice.tets.len(), twice.tets.get(2)[0]), (3, 5));
    // A range may be as wide as numbers are.
    let wide = ABAQUS.replacen("2, 2, 1", "-9000000000000000000, 9000000000000000000, 2", 1);
    let mut wide = read("a.inp", &wide).expect("it can be read");
    assert_eq!(tets(&mut wide)[1].1, (1 << 40) + 2);
    let mut sets = read(
        "a.inp",
        &ABAQUS_SETS.replacen("*ELSET, ELSET=Low\n", "*ELSET, ELSET=Low, INTERNAL\n", 1),
    );
    assert!(sets.as_ref().is_ok_and(|mesh| mesh.notes.is_empty()));
    check(sets, (1 << 40, "wall"), [0; 2]);
    // The first set that takes an element has it.
    sets = read("a.inp", ABAQUS_SETS);
    let notes = sets.map(|mesh| mesh.notes.join("; ")).unwrap_or_default();
    assert!(notes.starts_with("1 member of a set or surface"), "{notes}");
    let named = read("a.inp", ABAQUS).expect("it can be read");
    assert!(named.regions.list.iter().any(|group| group.1 == "rock"));
    assert_eq!(read("a.mesh", MEDIT).expect("as above").notes, ["1 line or point was left out"]);
}

#[test]
fn what_a_gmsh_file_has_too_much_or_too_little_of_is_told() {
    let fields = MeshFields { part: Some("partition"), region: None, values: None };
    let mesh = read_with(&[("a.msh", GMSH4.as_bytes())], fields).expect("it can be read");
    assert!(mesh.parts.list.is_empty());
    assert_eq!(mesh.notes, ["the file has no partitions; planes divide the mesh"]);
    let two = GMSH4.replacen("1 1 1 1 1 0\n", "1 1 1 2 1 2 0\n", 1);
    let mesh = read("a.msh", &two).expect("it can be read");
    assert_eq!(mesh.notes, ["1 tetrahedron is listed for several groups and belongs to the first"]);
}

#[test]
fn second_order_tetrahedra_are_taken_by_their_corners() {
    let more = "0.5 0 0 0\n".repeat(6);
    let text = MEDIT
        .replace("Vertices\n5\n", "Vertices\n11\n")
        .replace("-1 0\n", &format!("-1 0\n{more}"));
    let text = text.split("Tetrahedra\n").next().expect("a head").to_owned()
        + "TetrahedraP2\n1\n1 2 3 4 6 7 8 9 10 11 5\nEnd\n";
    let mut mesh = read("a.mesh", &text).expect("it can be read");
    assert_eq!(tets(&mut mesh), [([0, 1, 2, 3], 5, 0)]);
    assert!(mesh.notes.iter().any(|note| note.contains("only the corners")), "{:?}", mesh.notes);
    let text =
        ABAQUS.replace("C3D4", "C3D10").replace("1, 1, 2, 3, 7\n", "1, 1,2,3,7,1,1,1,1,1,1\n");
    let text = text.replace("2, 1, 3,\n 2, 5\n", "2, 1,3,2,5,1,1,1,1,1,1\n");
    assert_eq!(read("a.inp", &text).expect("it can be read").tets.len(), 2);
}

fn refused(name: &str, text: &str) -> ReadError {
    match read(name, text) {
        Ok(_) => panic!("{name} is read: {text}"),
        Err(error) => error,
    }
}

/// Each has a code, and a line, a byte or the file.
#[test]
fn broken_files_are_refused_with_their_places() {
    let medit = |from: &str, to: &str| ("a.mesh", MEDIT.replacen(from, to, 1));
    let gmsh = |from: &str, to: &str| ("a.msh", GMSH.replacen(from, to, 1));
    let gmsh4 = |from: &str, to: &str| ("a.msh", GMSH4.replacen(from, to, 1));
    let abaqus = |from: &str, to: &str| ("a.inp", ABAQUS.replacen(from, to, 1));
    let vtu = |from: &str, to: &str| ("a.vtu", VTU.replacen(from, to, 1));
    let mut wrong = Vec::new();
    for ((name, text), code, place) in [
        (medit("1 2 3 4 1", "1 2 3 6 1"), "index-out-of-range", "line 18"),
        (medit("1 2 3 4 1", "0 2 3 4 1"), "index-out-of-range", "line 18"),
        (medit("1 2 3 4 1", "1 2 3 x 1"), "not-a-number", "line 18"),
        (medit("Tetrahedra\n2", "Tetrahedra\n3"), "count-mismatch", "line 17"),
        (medit("Tetrahedra\n2", "Tetrahedra\n900000"), "count-mismatch", "line 17"),
        (medit("Dimension 3", "Dimension 2"), "unsupported-content", "line 2"),
        (
            medit("Tetrahedra\n2", "Hexahedra\n1\n1 2 3 4 5 1 2 3 1\nTetrahedra\n2"),
            "unsupported-content",
            "line",
        ),
        (medit("1 0 0 0\n", "nan 0 0 0\n"), "not-a-number", "line 6"),
        (medit("1 0 0 0\n", "1e300 0 0 0\n"), "coordinate-range", "line 6"),
        (gmsh("10 20 30 40\n", "10 20 30 41\n"), "index-out-of-range", "line 21"),
        (gmsh("20 1 0 0", "10 1 0 0"), "unexpected-text", "line"),
        (gmsh("20 1 0 0", "20000000000 1 0 0"), "unsupported-content", "line"),
        (gmsh("3 4 5 1", "3 5 5 1"), "unsupported-content", "line"),
        (gmsh("2 2 2 9 1 10 20 40", "2 3 2 9 1 10 20 40 30"), "unsupported-content", "line 20"),
        (gmsh("$Elements\n4", "$Elements\n9"), "count-mismatch", "line"),
        (gmsh("2.2 0 8", "3.0 0 8"), "unsupported-content", "line 2"),
        (gmsh4("3 1 3 2 5", "3 1 3 2 6"), "index-out-of-range", "line"),
        (gmsh4("$Elements\n3 3", "$Elements\n3 4"), "count-mismatch", "line"),
        (abaqus("1, 1, 2, 3, 7", "1, 1, 2, 3, 6"), "index-out-of-range", "line 10"),
        (abaqus("TYPE=C3D4", "TYPE=C3D8"), "unsupported-content", "line"),
        (abaqus("*NODE", "*NODE, SYSTEM=C"), "unsupported-content", "line"),
        (abaqus("1, 1, 2, 3, 7", "1, 1, 2, 3"), "unsupported-content", "line 10"),
        (abaqus("7, 0, 0, 1D0", "7, 0, 0, one"), "not-a-number", "line 7"),
        // Each line doubles a set.
        (
            abaqus("2, 2, 1", &format!("2, 2\n*ELSET, ELSET=all\nrock{}", "\nall".repeat(60))),
            "unsupported-content",
            "line",
        ),
        (abaqus("2, 1, 3,", "1, 1, 3,"), "unexpected-text", "line 15"),
        (abaqus("2, 1, 3,", "9000000000000000, 1, 3,"), "unsupported-content", "line 15"),
        (abaqus("*HEADING", "*INCLUDE, INPUT=b.inp"), "unsupported-content", "line 1"),
        (vtu("0 2 1 4", "0 2 1 5"), "index-out-of-range", "byte"),
        (vtu("0 1 3</", "0 1</"), "truncated-file", "byte"),
        (vtu("0 1 3</", "0 1\n</"), "truncated-file", "byte"),
        (vtu("4 8 11", "4 3 11"), "unexpected-text", "byte"),
        (vtu("10 10 5", "10 12 5"), "unsupported-content", "byte"),
        (vtu("10 10 5", "10 x 5"), "not-a-number", "byte"),
        (vtu("0 0 -1", "0 0 inf"), "not-a-number", "byte"),
        (vtu("UnstructuredGrid", "PolyData"), "unsupported-content", "byte"),
        (vtu("Name=\"offsets\"", "Name=\"ends\""), "unexpected-text", "byte"),
        (vtu("1 2 9", "1 2.5 9"), "unexpected-text", "byte"),
        (("a.vtu", "no tags".to_owned()), "unexpected-text", "byte"),
        (("a.xyz", MEDIT.to_owned()), "unknown-format", "a.xyz"),
        (("a.ele", ELE.to_owned()), "unreadable-file", "a.node"),
    ] {
        let error = refused(name, &text);
        let found = format!("{}: {}: {error}", error.code(), error.place());
        if error.code() != code || !error.place().to_string().contains(place) {
            wrong.push(format!("expected {code}, {place}: {found}"));
        }
        assert!(!error.help().is_empty());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let fields = MeshFields { part: Some("domain"), region: None, values: None };
    let missing = read_with(&[("a.vtu", VTU.as_bytes())], fields).err().expect("no such array");
    assert!(missing.to_string().contains("part"), "{missing}");
    assert!(read_with(&[("a.mesh", MEDIT.as_bytes())], fields).is_err());
}

/// Cut anywhere, a file is read or refused, without a panic.
#[test]
fn cut_files_are_no_panic() {
    for (name, text) in
        [("a.mesh", MEDIT), ("a.msh", GMSH), ("a.msh", GMSH4), ("a.inp", ABAQUS), ("a.vtu", VTU)]
    {
        for n in (0..text.len()).step_by(7) {
            let _ = read(name, &text[..n]);
        }
    }
}

#[test]
fn arrays_are_found_by_their_common_name() {
    let array = |kind: &str, shape: &str, bytes: Vec<u8>| {
        let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut all = b"\x93NUMPY\x01\x00".to_vec();
        all.extend((head.len() as u16).to_le_bytes());
        all.extend(head.as_bytes());
        all.extend(bytes);
        all
    };
    let points: Vec<u8> = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1f64]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let corners = |last: i32| [0, 1, 2, last].iter().flat_map(|v: &i32| v.to_be_bytes()).collect();
    let points = array("<f8", "(4, 3)", points);
    let region = array("|u1", "(1,)", vec![6]);
    let tets_of = |last, shape: &str| array(">i4", shape, corners(last));
    let all = |tets: &[u8]| {
        let dir = tempfile::tempdir().expect("a folder");
        for (name, bytes) in [("points", &points[..]), ("tets", tets), ("region", &region)] {
            std::fs::write(dir.path().join(format!("m_{name}.npy")), bytes).expect("written");
        }
        let mut mesh = RawMesh::new(ScratchSpace::new(1 << 22, dir.path()));
        read_tets(&dir.path().join("m.npy"), MeshFields::default(), &mut mesh).map(|()| mesh)
    };
    let mut mesh = all(&tets_of(3, "(1, 4)")).expect("it can be read");
    assert_eq!(tets(&mut mesh), [([0, 1, 2, 3], 6, 0)]);
    assert_eq!(super::tets_file(Path::new("b/m_points.npy")), Path::new("b/m_tets.npy"));
    for (last, shape) in [(4, "(1, 4)"), (-1, "(1, 4)"), (3, "(2, 4)"), (3, "(4, 1)"), (3, "(4,)")]
    {
        assert!(all(&tets_of(last, shape)).is_err(), "{last} {shape}");
    }
}

#[test]
fn as_many_regions_as_memory_has_no_share_for_are_refused() {
    let mut mesh = RawMesh::new(ScratchSpace::boundless());
    for group in 0..1 << 17 {
        let region = mesh.regions.number(group);
        assert!(mesh.tet([0, 1, 2, 3], region, 0).is_ok(), "{group}");
    }
    let one_more = mesh.regions.number(1 << 17);
    assert!(mesh.tet([0, 1, 2, 3], one_more, 0).is_err());
}
