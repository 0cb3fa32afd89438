//! `import`: meshes of other programs become stores.
//!
//! Why: an imported mesh must be the file's mesh to the last bit, and a bad one must not pass.
//! How: exports of a store come back with its digest; small meshes with one fault each are refused with their place.

use super::place::Place;

const POINTS: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n";
/// Two tetrahedra on one another.
const TWO: [&str; 2] = ["1 2 3 4", "1 3 2 5"];

/// A text of MEDIT: vertices by lines, tetrahedra with a region each, triangles with a label.
fn medit(points: &str, tets: &[&str], triangles: &[&str]) -> String {
    let vertices: String = points.lines().map(|line| format!("{line} 0\n")).collect();
    let mut text = format!(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n{vertices}",
        points.lines().count()
    );
    if !triangles.is_empty() {
        let lines: String = triangles.iter().map(|t| format!("{t}\n")).collect();
        text += &format!("Triangles\n{}\n{lines}", triangles.len());
    }
    let lines: String = tets.iter().map(|t| format!("{t} 1\n")).collect();
    text + &format!("Tetrahedra\n{}\n{lines}End\n", tets.len())
}

/// An array of NumPy.
fn npy(kind: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape},)}}\n");
    let length = (head.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], head.as_bytes(), bytes].concat()
}

/// A store of two regions.
fn balls(place: &Place) -> String {
    place
        .run_line("mesh sample:balls,count=2,h=0.25 -o a.tetdb --regions all --no-verify")
        .succeeds();
    place.digest("a.tetdb")
}

#[test]
fn every_export_comes_back_with_its_digest() {
    let place = Place::new();
    let digest = balls(&place);
    for (file, options) in [
        ("a.mesh", ""),
        ("b.meshb", ""),
        ("c.msh", ""),
        ("d.msh", "--ascii"),
        ("e.msh", "--format msh22"),
        ("f.vtu", ""),
        ("l.vtkhdf", ""),
        ("m.vtkhdf", "--one-partition"),
        ("g.ele", ""),
        ("h.inp", ""),
        ("i.npy", ""),
        ("j.vtu", "--order 2"),
        ("k.msh", "--order 2"),
    ] {
        place.run_line(&format!("export a.tetdb {file} {options}")).succeeds();
        let store = format!("{}.tetdb", &file[..1]);
        let store = if store == "a.tetdb" { "z.tetdb".to_owned() } else { store };
        place.run_line(&format!("import {file} -o {store} --memory 96MiB")).succeeds();
        assert_eq!(place.digest(&store), digest, "{file} {options}");
    }
    place.run_line("verify c.tetdb --full").succeeds();
    let info = place.run_line("info c.tetdb --json").succeeds().json();
    let labels = place.run_line("info a.tetdb --json").succeeds().json()["labels"].clone();
    assert_eq!(info["labels"], labels);
    assert!(info.to_string().contains("imported:"), "{info}");
}

#[test]
fn sub_domains_are_those_of_planes_or_of_the_file() {
    let place = Place::new();
    let line = "mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --no-verify";
    place.run_line(line).succeeds();
    place.run_line("export a.tetdb a.vtu a.msh a.npy a.vtkhdf").succeeds();
    let digest = place.digest("a.tetdb");
    for (file, name) in [
        ("a.vtu", "subdomain"),
        ("a.msh", "subdomain"),
        ("a.npy", "subdomain"),
        ("a.vtkhdf", "subdomain"),
        ("a.vtkhdf", "partition"),
    ] {
        let line = format!("import {file} -o b.tetdb --part-field {name} --force");
        place.run_line(&line).succeeds();
        assert_eq!(place.digest("b.tetdb"), digest, "{file}");
    }
    for n in [1, 3, 7] {
        place.run_line(&format!("import a.vtu -o b.tetdb --subdomains {n} --force")).succeeds();
        place.run_line("verify b.tetdb --full").succeeds();
        let one = place.digest("b.tetdb");
        let line = format!(
            "import a.vtu -o c.tetdb --subdomains {n} --threads 1 --memory 80MiB --force --no-verify"
        );
        place.run_line(&line).succeeds();
        assert_eq!(place.digest("c.tetdb"), one);
        let info = place.run_line("info b.tetdb --json").succeeds().json();
        let parts = info["subdomains"].as_array().expect("a list");
        let counts: Vec<u64> = parts.iter().filter_map(|part| part["tets"].as_u64()).collect();
        let total: u64 = counts.iter().sum();
        assert_eq!(counts.len(), n);
        assert!(counts.iter().all(|&k| k + 1 >= total / n as u64), "{counts:?}");
    }
    place.run_line("query b.tetdb --point 0.5,0.5,0.5").succeeds();
    place.run_line("export b.tetdb c.pvtu c.foam").succeeds();
    place.run_line("snapshot b.tetdb b.png").succeeds();
    place.run_line("report b.tetdb b.html").succeeds();
    place.run_line("field b.tetdb add t --at vertices --from x").succeeds();
    // What is on disk of a sub-domain that was never meshed here is all there is of it.
    let error = place.run_line("resaturate b.tetdb --subdomain 1 --repair --json").error();
    assert_eq!(error["code"], "no-coarse-leaf");
    place.run_line("resume b.tetdb --no-verify").succeeds();
}

/// Sub-domains are meshed again from their shells, whatever threads and memory; undo brings back the file's mesh.
#[test]
fn imported_sub_domains_are_meshed_again() {
    let place = Place::new();
    balls(&place);
    place.run_line("export a.tetdb a.vtu").succeeds();
    for n in [1, 3] {
        let import = format!("import a.vtu -o b.tetdb --subdomains {n} --force --no-verify");
        let mut digests = Vec::new();
        for limits in ["--threads 1 --memory 64MiB", "--threads 2 --memory 96MiB", ""] {
            place.run_line(&import).succeeds();
            let before = place.digest("b.tetdb");
            place.run_line("field b.tetdb add t --at vertices --from x").succeeds();
            let all: Vec<String> = (0..n).map(|rank: u32| rank.to_string()).collect();
            let line = format!("resaturate b.tetdb --subdomain {} --refine-by 0.6", all.join(","));
            let forecast = place.run_line(&format!("{line} --dry-run --json")).succeeds().json();
            assert_eq!(forecast["subdomains"].as_array().map(Vec::len), Some(n as usize));
            place.run_line(&format!("{line} {limits}")).succeeds();
            digests.push(place.digest("b.tetdb"));
            assert_ne!(digests[0], before);
            place.run_line("verify b.tetdb --full").succeeds();
            let info = place.run_line("info b.tetdb --json").succeeds().json();
            let range = &info["fields"][0]["ranges"][0];
            assert_eq!((&range["low"], &range["high"]), (&0.0.into(), &1.0.into()));
            // Meshed anew from the snapshot that is there by now, it is the same.
            place.run_line("resaturate b.tetdb --subdomain 0 --repair").succeeds();
            assert_eq!(place.digest("b.tetdb"), digests[0]);
            place.run_line("resaturate b.tetdb --undo").succeeds();
            assert_eq!(place.digest("b.tetdb"), before);
            let line = "resaturate b.tetdb --subdomain 0 --repair --json";
            assert_eq!(place.run_line(line).error()["code"], "no-coarse-leaf");
        }
        assert!(digests.iter().all(|digest| *digest == digests[0]), "{n}: {digests:?}");
    }
    for sizes in ["", "--hsiz 0.1", "--size-sphere 0.5,0.5,0.5,0.2,0.05"] {
        place.run_line(&format!("resaturate b.tetdb --subdomain 1 {sizes}")).succeeds();
        place.run_line("verify b.tetdb --full").succeeds();
    }
}

/// Lengths are those of the file's tetrahedra, in each region, not those of the faces around them. They stay on record.
#[test]
fn regions_of_a_file_keep_their_lengths() {
    let place = Place::new();
    let sizes = "--size-region 1,0.09 --size-region 2,0.2";
    place
        .run_line(&format!("mesh sample:shells,count=2,h=0.4 -o a.tetdb --regions all {sizes}"))
        .succeeds();
    place.run_line("export a.tetdb a.meshb").succeeds();
    place.run_line("import a.meshb -o b.tetdb").succeeds();
    let tets = || {
        let info = place.run_line("info b.tetdb --json").succeeds().json();
        [0, 1].map(|region| info["regions"][region]["tets"].as_f64().expect("a number"))
    };
    let before = tets();
    let check = |case: &str, factor: f64, within: f64| {
        let [outer, inner] = tets();
        let wanted = before.map(|n| n * factor);
        let is_near = |n: f64, wanted: f64| (wanted / within..wanted * within).contains(&n);
        let is_near = is_near(outer, wanted[0]) && is_near(inner, wanted[1]);
        assert!(is_near, "{case}: {outer} and {inner}, not {wanted:?}");
    };
    let line = "resaturate b.tetdb --subdomain 0 --refine-by 0.8";
    let forecast = place.run_line(&format!("{line} --dry-run --json")).succeeds().json();
    let predicted = forecast["subdomains"][0]["predicted_tets"].as_f64().expect("a number");
    let all = before[0] + before[1];
    assert!((1.6..2.3).contains(&(predicted / all)), "{predicted} from {all}: {forecast}");
    place.run_line("resaturate b.tetdb --subdomain 0").succeeds();
    check("as they were", 1.0, 1.2);
    place.run_line(line).succeeds();
    check("refined", 1.95, 1.2);
    place.run_line("resaturate b.tetdb --undo").succeeds();
    // What is new changes no other place.
    place.run_line("resaturate b.tetdb --subdomain 0 --size-sphere 0,0,0,0.25,0.06").succeeds();
    assert!(tets()[1] > 2.0 * before[1], "{:?} {before:?}", tets());
    assert!((0.8..1.2).contains(&(tets()[0] / before[0])), "{:?} {before:?}", tets());
    place.run_line("resaturate b.tetdb --undo").succeeds();
    check("undone", 1.0, 1.2);
    place.run_line("verify b.tetdb --full").succeeds();
}

/// Parts of a file may touch themselves at edges and vertices, and lie in pieces.
#[test]
fn parts_that_touch_themselves_are_meshed_again() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.25 -o a.tetdb --no-verify").succeeds();
    place.run_line("export a.tetdb a.npy").succeeds();
    let n = place.run_line("info a.tetdb --json").succeeds().json()["tets"].as_u64();
    let n = n.expect("a number");
    // Every third tetrahedron, but for a few: nearly none has a neighbor in its part.
    let parts: Vec<u8> = (0..n).map(|t| (t * t % 7 % 3) as u8).collect();
    place.write("a_p.npy", npy("|u1", &n.to_string(), &parts));
    place.run_line("import a.npy -o b.tetdb --part-field p").succeeds();
    place.run_line("resaturate b.tetdb --subdomain 0,1,2 --refine-by 0.4").succeeds();
    place.run_line("verify b.tetdb --full").succeeds();
}

#[test]
fn an_imported_mesh_is_adapted_to_a_field() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.12 -o a.tetdb --no-verify").succeeds();
    place.run_line("export a.tetdb a.meshb").succeeds();
    place.run_line("import a.meshb -o b.tetdb --subdomains 3 --no-verify").succeeds();
    place.run_line("field b.tetdb add t --at vertices --from exp(-50*(x-0.5)^2)").succeeds();
    let before = place.digest("b.tetdb");
    place.run_line("adapt b.tetdb --field t --factor 3").succeeds();
    assert_ne!(place.digest("b.tetdb"), before);
    place.run_line("verify b.tetdb --full").succeeds();
}

/// Values at vertices and tetrahedra become fields, equal to the last bit.
#[test]
fn arrays_of_values_become_fields() {
    let place = Place::new();
    balls(&place);
    // Imports have an order of their own, on which digests of fields depend.
    place.run_line("export a.tetdb c.vtu").succeeds();
    place.run_line("import c.vtu -o a.tetdb --force").succeeds();
    for line in [
        "a --at vertices --from x*x+y",
        "u --at vertices --from x,y,z --type f32",
        "k --at tets --from region*7 --type i32",
        "b --at tets --from floor(x*1000) --type i64",
        "m --at tets --from x,y,z,y,x,z,z,x,y",
        "s --at vertices --from x,y,z,y,z,x",
    ] {
        place.run_line(&format!("field a.tetdb add {line}")).succeeds();
    }
    let fields = |store: &str| {
        let info = place.run_line(&format!("info {store} --json")).succeeds().json();
        let list = info["fields"].as_array().expect("a list").iter();
        let mut list: Vec<String> = list
            .map(|f| {
                format!(
                    "{} {} {} {} {}",
                    f["name"], f["type"], f["at"], f["components"], f["digest"]
                )
            })
            .collect();
        list.sort();
        list
    };
    let expected = fields("a.tetdb");
    assert_eq!(expected.len(), 6);
    place.run_line("export a.tetdb b.vtu b.vtkhdf b.npy").succeeds();
    for file in ["b.vtu", "b.vtkhdf", "b.npy"] {
        for memory in ["64MiB", "1GiB"] {
            place
                .run_line(&format!("import {file} -o b.tetdb --force --memory {memory}"))
                .succeeds();
            assert_eq!(fields("b.tetdb"), expected, "{file}");
        }
        let note =
            place.run_line(&format!("import {file} -o b.tetdb --force --subdomains 3")).succeeds();
        assert!(note.stderr().contains("left out: global_id"), "{}", note.stderr());
        place.run_line("verify b.tetdb --full").succeeds();
        let condition = "abs(k - region * 7) + abs(m.xx - x) + abs(m.yy - x) > 0";
        let line = ["query", "b.tetdb", "--where", condition, "--json"];
        let done = place.run(&line).succeeds();
        let wrong = format!("{}{}", done.stdout(), done.stderr());
        assert!(wrong.contains("\"found\":0"), "{wrong}");
        place.run_line(&format!("import {file} -o b.tetdb --force --no-fields")).succeeds();
        assert!(fields("b.tetdb").is_empty());
    }
    // Gmsh's values are doubles, and symmetric tensors have nine of them.
    for options in ["", "--ascii"] {
        place.run_line(&format!("export a.tetdb b.msh {options}")).succeeds();
        place.run_line("import b.msh -o b.tetdb --force").succeeds();
        let found = fields("b.tetdb");
        // Its nodes have another order, so the digest of values at vertices is another.
        let is_same = |field: &&String| field.starts_with("\"m\" \"f64\" \"tets\" 9 ");
        assert_eq!((found.len(), expected.iter().filter(is_same).count()), (6, 1));
        assert!(expected.iter().filter(is_same).all(|field| found.contains(field)), "{found:?}");
        let line = "query b.tetdb --where abs(u.x-x)+abs(s.xx-x)+abs(b-floor(x*1000))>1e-6 --json";
        let done = place.run_line(line).succeeds();
        assert!(format!("{}{}", done.stdout(), done.stderr()).contains("\"found\":0"));
    }
}

#[test]
fn a_value_that_no_field_holds_is_refused_with_its_place() {
    let place = Place::new();
    balls(&place);
    place.run_line("export a.tetdb b.npy b.vtu").succeeds();
    let n = place.run_line("info a.tetdb --json").succeeds().json()["tets"].as_u64();
    let n = n.expect("a number") as usize;
    let mut numbers = vec![0u8; 8 * n];
    numbers[8 * 11 + 7] = 0x80;
    place.write("b_big.npy", npy("<u8", &n.to_string(), &numbers));
    // The second number of the last point is too large for single precision.
    let points = place.run_line("info a.tetdb --json").succeeds().json()["vertices"].as_u64();
    let text = "1 2 3 ".repeat(points.expect("a number") as usize - 1) + "1 2e39 3";
    let array = "type=\"Float32\" Name=\"far\" NumberOfComponents=\"3\" format=\"ascii\"";
    let array = format!("<PointData><DataArray {array}>{text}</DataArray>");
    let file = std::fs::read(place.path("b.vtu")).expect("it was written");
    let tag = b"<PointData>";
    let at = file.windows(tag.len()).position(|bytes| bytes == tag).expect("it has values");
    place.write("c.vtu", [&file[..at], array.as_bytes(), &file[at + tag.len()..]].concat());
    let last = format!("value {}", points.expect("a number") - 1);
    for (line, file, array, row) in
        [("b.npy", "b_big.npy", "big", "value 11 "), ("c.vtu", "c.vtu", "far", &*last)]
    {
        let done = place.run_line(&format!("import {line} -o b.tetdb --json"));
        let error = done.error();
        assert_eq!((done.exit(), &error["code"]), (Some(3), &"bad-field".into()), "{error}");
        assert!(error["where"].to_string().contains(file), "{error}");
        for words in [array, row] {
            assert!(error["message"].to_string().contains(words), "{words}: {error}");
        }
        assert!(error["help"].to_string().contains("--no-fields"), "{error}");
        assert!(!place.path("b.tetdb").exists());
        place.run_line(&format!("import {line} -o {array}.tetdb --no-fields")).succeeds();
    }
}

/// Files whose names begin as those of the mesh do, and which no export of it wrote.
#[test]
fn arrays_of_other_meshes_are_left_out() {
    let place = Place::new();
    let digest = balls(&place);
    place.run_line("field a.tetdb add w_1 --at vertices --from x").succeeds();
    place.run_line("export a.tetdb a.npy").succeeds();
    // Another mesh of as many tetrahedra, arrays of other lengths, and no array.
    place.run_line("export a.tetdb a_b.npy").succeeds();
    place.write("a_short.npy", npy("<f8", "2", &[0; 16]));
    place.write("a_wide.npy", npy("<f8", "2, 3", &[0; 48]));
    place.write("a_text.npy", "no array");
    place.write("a_empty.npy", "");
    let done = place.run_line("import a.npy -o b.tetdb").succeeds();
    for words in ["values were left out: empty, global_id,", " short, ", " text, ", " wide"] {
        assert!(done.stderr().contains(words), "{words}: {}", done.stderr());
    }
    assert!(done.stderr().contains("arrays of other meshes were left out: b\n"));
    let info = place.run_line("info b.tetdb --json").succeeds().json();
    let fields = info["fields"].as_array().expect("a list");
    assert_eq!((fields.len(), &fields[0]["name"]), (1, &"w_1".into()));
    assert_eq!(place.digest("b.tetdb"), digest);
}

#[test]
fn values_of_gmsh_become_fields() {
    let place = Place::new();
    place.write("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n9 0 0 -1\n$EndNodes\n\
        $Elements\n3\n1 2 2 1 1 1 2 3\n2 4 2 1 1 1 2 3 4\n7 4 2 1 1 1 3 2 9\n$EndElements\n\
        $NodeData\n1\n\"temp\"\n1\n0.0\n3\n0\n1\n5\n1 1.5\n2 2.5\n3 -7\n4 4\n9 5\n$EndNodeData\n\
        $ElementData\n1\n\"vel\"\n1\n0.0\n3\n0\n3\n3\n2 1 2 3\n7 4 5 6\n1 0 0 0\n$EndElementData\n\
        $NodeData\n1\n\"some\"\n0\n3\n0\n1\n1\n1 1.5\n$EndNodeData\n");
    let done = place.run_line("import a.msh").succeeds();
    assert!(done.stderr().contains("arrays of values were left out: some"), "{}", done.stderr());
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let fields = &info["fields"];
    assert_eq!((&fields[0]["name"], &fields[0]["values"]), (&"temp".into(), &5.into()));
    assert_eq!(fields[0]["ranges"][0]["low"], -7.0);
    assert_eq!((&fields[1]["name"], &fields[1]["components"]), (&"vel".into(), &3.into()));
    assert_eq!(fields[1]["ranges"][2]["high"], 6.0);
}

#[test]
fn what_is_changed_or_left_out_is_said() {
    let turned = ["2 1 3 4", "3 1 2 5"];
    let stray = format!("{POINTS}5 5 5\n");
    let twice = format!("{POINTS}0 0 0\n");
    for (text, note) in [
        (medit(POINTS, &turned, &[]), "turned back"),
        (medit(&stray, &TWO, &[]), "1 vertex belongs to no tetrahedron"),
        (medit(&twice, &["1 2 3 4", "6 3 2 5"], &[]), "1 vertex repeats"),
        (medit(POINTS, &TWO, &["1 4 5 7"]), "1 triangle is no face"),
        (medit(POINTS, &TWO, &["1 1 2 7"]), "1 triangle is no face"),
    ] {
        let place = Place::new();
        place.write("a.mesh", &text);
        let done = place.run_line("import a.mesh").succeeds();
        assert!(done.stderr().contains(note), "{note}: {}", done.stderr());
        place.run_line("verify a.tetdb --full").succeeds();
        let info = place.run_line("info a.tetdb --json").succeeds().json();
        assert_eq!(info["tets"], 2);
    }
}

#[test]
fn labels_regions_and_sheets_are_taken_over() {
    let place = Place::new();
    let text = medit(POINTS, &TWO, &["1 2 3 8", "1 2 4 9"]);
    place.write("a.mesh", &text);
    place.run_line("import a.mesh --subdomains 2").succeeds();
    place.run_line("verify a.tetdb --full").succeeds();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let mut labels: Vec<String> = serde_json::from_value(info["labels"].clone()).expect("names");
    labels.sort();
    assert_eq!(labels, ["8", "9", "a"]);
    let text = text.replace("1 3 2 5 1", "1 3 2 5 40");
    place.write("b.mesh", &text);
    place.run_line("import b.mesh --subdomains 2").succeeds();
    let info = place.run_line("info b.tetdb --json").succeeds().json();
    let filled =
        info["regions"].as_array().expect("regions").iter().filter(|r| r["filled"] == true);
    let numbers: Vec<u64> = filled.filter_map(|r| r["region"].as_u64()).collect();
    assert_eq!(numbers, [1, 40]);
}

/// Meshes that are read and are no meshes.
#[test]
fn bad_meshes_are_refused_with_their_places() {
    let six = format!("{POINTS}0.2 0.2 -3\n");
    let flat = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
    let nearly = "0 0 0\n1 0 0\n0 1 0\n0.25 0.25 1e-200\n";
    let seven = format!("{POINTS}0.3 0.3 2\n1 1 1\n");
    let many = |n: usize| vec!["1 2 3 4"; n];
    for (text, place_of, words) in [
        (medit(POINTS, &[], &[]), "a.mesh", "no tetrahedra"),
        (medit("", &[], &[]), "a.mesh", "no tetrahedra"),
        (medit(POINTS, &[], &["1 2 3 1"]), "a.mesh", "no tetrahedra"),
        (medit(POINTS, &["1 2 3 4", "1 2 3 5"], &[]), "tetrahedron 2: (0, 0, 0)", "inside out"),
        (medit(POINTS, &["1 3 2 4", "1 3 2 5"], &[]), "tetrahedron 1", "inside out"),
        (medit(POINTS, &["1 2 3 3"], &[]), "tetrahedron 1", "one vertex twice"),
        (medit(POINTS, &["1 2 3 4", "1 1 2 5"], &[]), "tetrahedron 2", "one vertex twice"),
        (medit(POINTS, &["4 4 4 4"], &[]), "tetrahedron 1", "one vertex twice"),
        (medit("0 0 0\n1 0 0\n0 1 0\n0 0 0\n", &["1 2 3 4"], &[]), "tetrahedron 1", "at one place"),
        (
            medit("0 0 0\n1 0 0\n0 1 0\n-0 0 -0\n", &["1 2 3 4"], &[]),
            "tetrahedron 1",
            "at one place",
        ),
        (medit(flat, &["1 2 3 4"], &[]), "tetrahedron 1", "no volume"),
        (medit("0 0 0\n1 1 1\n2 2 2\n3 3 3\n", &["1 2 3 4"], &[]), "tetrahedron 1", "no volume"),
        (
            medit(&format!("{POINTS}1 1 0\n"), &["1 2 3 4", "1 2 3 6"], &[]),
            "tetrahedron 2",
            "no volume",
        ),
        (medit(&six, &["1 2 3 4", "1 3 2 5", "1 3 2 6"], &[]), "tetrahedron", "one side of a face"),
        (medit(POINTS, &many(2), &[]), "tetrahedron", "one side of a face"),
        (medit(POINTS, &many(3), &[]), "tetrahedron", "one side of a face"),
        (medit(POINTS, &["1 2 3 4", "2 3 1 4"], &[]), "tetrahedron", "one side of a face"),
        (medit(&seven, &["1 2 3 4", "1 2 3 6"], &[]), "tetrahedron", "one side of a face"),
        (
            medit(&six, &["1 2 3 4", "1 3 2 5", "1 3 2 6"], &["1 2 3 4"]),
            "tetrahedron",
            "one side of a face",
        ),
        (
            medit(POINTS, &many(2), &["1 2 3 4", "1 2 4 4", "2 3 4 4", "1 3 4 4"]),
            "tetrahedron",
            "one side of a face",
        ),
    ] {
        let place = Place::new();
        place.write("a.mesh", &text);
        let done = place.run_line("import a.mesh --json");
        let error = done.error();
        let found = format!("{error}\n{text}");
        assert_eq!((done.exit(), &error["code"]), (Some(3), &"bad-mesh".into()), "{found}");
        assert!(error["message"].to_string().contains(words), "{words}: {found}");
        assert!(error["where"].to_string().contains(place_of), "{place_of}: {found}");
        assert!(error["help"].is_string(), "{found}");
        assert_eq!(place.names().len(), 1, "nothing is left: {:?}", place.names());
    }
    // Exact: a volume of 1e-200 / 6 is positive.
    let place = Place::new();
    place.write("a.mesh", medit(nearly, &["1 2 3 4"], &[]));
    place.run_line("import a.mesh --no-verify").succeeds();
}

#[test]
fn a_store_that_is_there_is_kept_or_replaced() {
    let place = Place::new();
    place.write("a.mesh", medit(POINTS, &TWO, &[]));
    place.run_line("import a.mesh").succeeds();
    let error = place.run_line("import a.mesh --json").error();
    assert_eq!(error["code"], "store-exists");
    place.write("a.mesh", medit(POINTS, &TWO[..1], &[]));
    place.run_line("import a.mesh --force").succeeds();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    assert_eq!(info["tets"], 1);
    // A bad mesh leaves the old store as it was.
    place.write("a.mesh", medit(POINTS, &["1 2 3 3"], &[]));
    assert_eq!(place.run_line("import a.mesh --force").exit(), Some(3));
    place.run_line("verify a.tetdb").succeeds();
}

/// What an import that was killed leaves is no store, and the next one removes it.
#[test]
fn an_interrupted_import_leaves_no_store() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.06 -o a.tetdb --no-verify").succeeds();
    place.run_line("export a.tetdb a.meshb").succeeds();
    for milliseconds in [5, 20, 40, 60, 80, 110, 150, 200, 300] {
        let mut child = place
            .command(&["import", "a.meshb", "-o", "b.tetdb", "--force", "--no-verify"])
            .spawn()
            .expect("the program starts");
        std::thread::sleep(std::time::Duration::from_millis(milliseconds));
        let _ = child.kill();
        let _ = child.wait();
        if place.path("b.tetdb").exists() {
            place.run_line("verify b.tetdb").succeeds();
        }
    }
    place.run_line("import a.meshb -o b.tetdb --force").succeeds();
    assert!(!place.names().iter().any(|name| name.contains("being-")), "{:?}", place.names());
}
