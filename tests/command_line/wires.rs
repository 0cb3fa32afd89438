//! Edges and points inside a volume stay whole and in place through every step, or are refused with a place.
//!
//! Why: a well whose edges were moved is in other rock, and a sensor that is no vertex measures nothing.
//! How: a box with layers, wells and sensors, from a sample and from files of every kind; edges and points in wrong places.

use super::place::Place;

/// Large enough for four sub-domains.
const MANY: &str = "sample:wells,count=40,points=60,cells=22";

/// A box from 0 to 1 with twelve triangles.
const BOX: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n";

#[test]
fn wells_and_sensors_are_edges_and_vertices_in_one_piece_and_in_several() {
    let place = Place::new();
    for (store, n) in [("one", 1), ("four", 4)] {
        let line = format!("mesh {MANY} -o {store}.tetdb --subdomains {n}");
        place.run_line(&line).succeeds();
        let verified =
            place.run_line(&format!("verify {store}.tetdb --full --json")).succeeds().json();
        for (what, count) in [("edges", 0), ("points", 0), ("triangles", 0)] {
            assert_eq!(verified[format!("{what}_missing")], count, "{store}");
        }
        assert_eq!(verified["points_present"], 60);
        let info = place.run_line(&format!("info {store}.tetdb --json"));
        let info = info.succeeds().json();
        assert_eq!(info["subdomains"].as_array().map(Vec::len), Some(n));
        // Triangles on interfaces count once, and the support triangles of edges do not count.
        assert_eq!(info["input_triangles"], verified["triangles_present"]);
        assert_eq!(info["regions"].as_array().map(Vec::len), Some(1));
        let edges = info["wires"].as_array().expect("a list").iter();
        let edges: u64 = edges.filter_map(|w| w["edges"].as_u64()).sum();
        assert_eq!(verified["edges_present"], edges);
        let found = |label: &str| {
            let line = format!("query {store}.tetdb --json --select id --label {label}");
            place.run_line(&line).succeeds().stdout().lines().count()
        };
        assert!(found("well-1") > 10 && found("sensors") > 60 * 4);
        // The support triangles of edges are no sheet.
        let sheets = place.run_line(&format!(
            "query {store}.tetdb --json --select id --touching-sheet --label well-1"
        ));
        let sheets = sheets.succeeds().stdout().lines().count();
        assert!(sheets < found("well-1"));
    }
    place.check_four(MANY);
}

#[test]
fn wires_of_files_keep_their_names_and_give_the_mesh_of_the_sample() {
    let place = Place::new();
    place.run_line("sample wells,count=5,points=4 -o box.obj").succeeds();
    let from_files = "mesh box.obj --embed box_sheets.obj --embed-edges box_wires.obj --embed-points box_wires.obj \
         --name box_wires.obj=inside -o files.tetdb";
    place.run_line(from_files).succeeds();
    place.run_line("mesh sample:wells,count=5,points=4 -o sample.tetdb").succeeds();
    assert_eq!(place.digest("files.tetdb"), place.digest("sample.tetdb"));
    let known = place.run_line(from_files).succeeds().stderr();
    assert!(known.contains("already holds"), "{known}");
    place.run_line("verify files.tetdb --full").succeeds();
    for (file, words) in [
        ("out.msh", &["0 ", "\"inside\"", "1 ", "\"inside:well-3\""][..]),
        ("out.mesh", &["\nEdges\n", "\nRequiredVertices\n4\n"]),
        ("out.inp", &["TYPE=T3D2, ELSET=edges_inside_well-3", "*NSET, NSET=points_inside"]),
        ("out.vtu", &[]),
    ] {
        place.run_line(&format!("export files.tetdb {file}")).succeeds();
        let text = std::fs::read(place.path(file)).expect("it was written");
        let text = String::from_utf8_lossy(&text);
        assert!(words.iter().all(|word| text.contains(word)), "{file}");
    }
    let list = std::fs::read_to_string(place.path("out_wires.csv")).expect("it was written");
    assert!(list.contains("edge,\"inside:well-1\",") && list.contains("point,\"inside\","));
    place.run_line("export files.tetdb out.ele").succeeds();
    let info = place.run_line("info files.tetdb --json").succeeds().json();
    let edges: u64 = (info["wires"].as_array().expect("a list").iter())
        .filter_map(|w| w["edges"].as_u64())
        .sum();
    let list = std::fs::read_to_string(place.path("out.edge")).expect("it was written");
    assert!(list.starts_with(&format!("{edges} 1\n")));
}

#[test]
fn every_kind_of_file_gives_the_same_mesh() {
    let place = Place::new();
    place.write("box.obj", BOX);
    place.write("e.obj", "v .25 .25 .25\nv .25 .25 .75\nv .5 .75 .5\nl 1 2 3\n");
    place.write(
        "e.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 double\n.25 .25 .25 .25 .25 .75 .5 .75 .5\nLINES 1 4\n3 0 1 2\n",
    );
    place.write(
        "e5.vtk",
        "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n.25 .25 .25 .25 .25 .75 .5 .75 .5\n\
         CELLS 3 4\nOFFSETS vtktypeint64\n0 2 4\nCONNECTIVITY vtktypeint64\n0 1 1 2\nCELL_TYPES 2\n3\n3\n",
    );
    let mut binary =
        b"# vtk DataFile Version 5.1\nt\nBINARY\nDATASET POLYDATA\nPOINTS 3 double\n".to_vec();
    for x in [0.25, 0.25, 0.25, 0.25, 0.25, 0.75, 0.5, 0.75, 0.5f64] {
        binary.extend(x.to_be_bytes());
    }
    binary.extend(b"\nMETADATA\nINFORMATION 0\n\nLINES 2 3\nOFFSETS vtktypeint64\n");
    [0, 3i64].iter().for_each(|n| binary.extend(n.to_be_bytes()));
    binary.extend(b"\nCONNECTIVITY vtktypeint64\n");
    [0, 1, 2i64].iter().for_each(|n| binary.extend(n.to_be_bytes()));
    place.write("eb.vtk", binary);
    place.write(
        "e.poly",
        "3 3 0 0\n1 .25 .25 .25\n2 .25 .25 .75\n3 .5 .75 .5\n2 1\n1 0 7\n2 1 2\n1 0 7\n2 2 3\n0\n0\n",
    );
    place.write("p.csv", "x,y,z,name\n0.7,0.25,0.5,north\n0.75, 0.7, 0.2\n");
    place.write("p.node", "2 3 0 1\n0 0.7 0.25 0.5 4\n1 0.75 0.7 0.2 0\n");
    // The number of attributes in a head may be wrong; lines end at their line breaks.
    place.write("mad.node", "2 3 999999999991 1\n0 0.7 0.25 0.5 4\n1 0.75 0.7 0.2 0\n");
    place.write("p.txt", "# two\n0.7 0.25 0.5 north\n0.75\t0.7 0.2\n");
    let mut digests = Vec::new();
    for edges in ["e.obj", "e.vtk", "e5.vtk", "eb.vtk", "e.poly"] {
        for points in ["p.csv", "p.node", "p.txt", "mad.node"] {
            let line = format!(
                "mesh box.obj --embed-edges {edges} --embed-points {points} -o s.tetdb --force"
            );
            place.run_line(&line).succeeds();
            digests.push(place.digest("s.tetdb"));
        }
    }
    assert!(digests.windows(2).all(|d| d[0] == d[1]), "{digests:?}");
    let verified = place.run_line("verify s.tetdb --full --json").succeeds();
    let verified = verified.json();
    assert_eq!((&verified["edges_present"], &verified["points_present"]), (&2.into(), &2.into()));
    // On an edge of the surface, on its corner and inside: nothing is added where a triangle has it already.
    place.write("on.obj", "v 0 0 0\nv 1 0 0\nv .5 .5 .5\nl 1 2\nl 2 3\np 1\n");
    place
        .run_line("mesh box.obj --embed-edges on.obj --embed-points on.obj -o on.tetdb")
        .succeeds();
    place.run_line("verify on.tetdb --full").succeeds();
}

#[test]
fn points_and_ends_on_triangles_are_put_into_a_surface_that_may_be_divided() {
    let place = Place::new();
    place.write("box.obj", BOX);
    place.write(
        "sheet.obj",
        "v .25 .25 .5\nv .75 .25 .5\nv .75 .75 .75\nv .25 .75 .75\nf 1 2 3\nf 1 3 4\n",
    );
    // Inside triangles, on edges of two triangles, on the sheet, and in empty space.
    place.write(
        "on.csv",
        "0.5,0.25,0,a\n0.5,0,0,a\n0.75,0.125,0,b\n0.5,0.5,0.625,b\n.125,.125,.125,b\n",
    );
    place.write("rod.obj", "v .5 .5 .875\nv .5 .25 1\nv 0 0 1\nv 0 .5 1\nl 1 2\nl 3 4\n");
    let inside = "--embed sheet.obj --embed-edges rod.obj --embed-points on.csv";
    let refused = place.run_line(&format!("mesh box.obj {inside} --json"));
    assert_eq!(refused.error()["code"], "wire-contact");
    let line = format!("mesh box.obj {inside} --refine-surface --hsiz 0.2 -o s.tetdb");
    place.run_line(&line).succeeds();
    let again = place.run_line(&line).succeeds().stderr();
    assert!(again.contains("already holds"), "{again}");
    place.run_line("resaturate s.tetdb --subdomain 0 --hgrad 1.2").succeeds();
    let verified = place.run_line("verify s.tetdb --full --json").succeeds().json();
    // An edge of the box is divided with it.
    assert_eq!((&verified["edges_present"], &verified["points_present"]), (&3.into(), &5.into()));
    let info = place.run_line("info s.tetdb --json").succeeds().json();
    assert_eq!(info["input_triangles"], verified["triangles_present"]);
    assert_eq!(info["wires"].as_array().map(Vec::len), Some(3));
    let found = |label: &str| {
        let line = format!("query s.tetdb --json --select id --touching-sheet --label {label}");
        place.run_line(&line).succeeds().stdout().lines().count()
    };
    assert!(found("sheet") > 20);
    // Closer to the bottom than can be meshed, and farther away than by rounding.
    for (file, text, option) in [
        ("near.csv", "0.5,0.25,1e-13\n", "points"),
        ("near.obj", "v .5 .5 .5\nv .5 .25 1e-13\nl 1 2\n", "edges"),
    ] {
        place.write(file, text);
        let line = format!("mesh box.obj --embed-{option} {file} --refine-surface --json");
        let error = place.run_line(&line).error();
        assert_eq!(error["code"], "wire-too-near", "{file}: {error}");
        assert!(
            error["message"].as_str().is_some_and(|m| m.contains("1.0e-13 from it")),
            "{error}"
        );
    }
}

#[test]
fn edges_and_points_in_wrong_places_are_refused_with_the_place() {
    let place = Place::new();
    place.write("box.obj", BOX);
    let inside = "v .25 .25 .25\nv .25 .25 .75\nv .5 .75 .5\nv .25 .25 .5\n";
    for (file, option, text, code) in [
        ("out.obj", "edges", "v 2 0 0\nv 3 0 0\nl 1 2\n", "wire-outside"),
        ("leave.obj", "edges", "v .5 .5 .5\nv .5 .4 1.5\nl 1 2\n", "wire-contact"),
        ("end.obj", "edges", "v .5 .5 .5\nv .5 .4 1\nl 1 2\n", "wire-contact"),
        ("side.obj", "edges", "v .5 .5 .5\nv .5 0 0\nl 1 2\n", "wire-contact"),
        ("in_face.obj", "edges", "v 1 0 0\nv 0 1 0\nl 1 2\n", "wire-contact"),
        ("along.obj", "edges", "v 0 0 0\nv .5 0 0\nl 1 2\n", "wire-contact"),
        (
            "cross.obj",
            "edges",
            "v .4 .4 .4\nv .6 .6 .4\nv .4 .6 .4\nv .6 .4 .4\nl 1 2\nl 3 4\n",
            "wire-contact",
        ),
        (
            "touch.obj",
            "edges",
            "v .4 .4 .4\nv .6 .6 .6\nv .5 .5 .5\nv .5 .5 .1\nl 1 2\nl 3 4\n",
            "wire-contact",
        ),
        ("fold.obj", "edges", "v .4 .4 .4\nv .6 .6 .6\nv .5 .5 .5\nl 1 2\nl 1 3\n", "wire-contact"),
        ("point.obj", "edges", "v .5 .5 .5\nl 1 1\n", "degenerate-edge"),
        ("equal.obj", "edges", "v .5 .5 .5\nv .5 .5 .5\nl 1 2\n", "degenerate-edge"),
        ("twice.obj", "edges", "v .4 .4 .4\nv .6 .6 .6\nl 1 2\nl 2 1\n", "duplicate-wire"),
        (
            "near.obj",
            "edges",
            "v .4 .4 .4\nv .6 .6 .4\nv .4 .6 .40000000000001\nv .6 .4 .40000000000001\nl 1 2\nl 3 4\n",
            "wire-too-near",
        ),
        ("nan.obj", "edges", "v .4 .4 nan\nv .6 .6 .6\nl 1 2\n", "not-a-number"),
        ("index.obj", "edges", "v .4 .4 .4\nv .6 .6 .6\nl 1 3\n", "index-out-of-range"),
        ("none.obj", "edges", "v .4 .4 .4\nv .6 .6 .6\np 1\n", "unexpected-text"),
        ("edges.stl", "edges", "solid\nendsolid\n", "unknown-format"),
        (
            "short.vtk",
            "edges",
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 double\n.4 .4 .4 .5\n",
            "truncated-file",
        ),
        ("text.vtk", "edges", "no such file\n", "unexpected-text"),
        (
            "cells.vtk",
            "edges",
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 double\n.4 .4 .4 .5 .5 .5\nLINES 1 3\n9 0 1\n",
            "count-mismatch",
        ),
        ("far.csv", "points", "1,1,7\n", "wire-outside"),
        ("face.csv", "points", "0.5,0.25,0\n", "wire-contact"),
        ("edge.csv", "points", "0.5,0,0\n", "wire-contact"),
        ("same.csv", "points", "0.5,0.5,0.5,a\n0.5,0.5,0.5,b\n", "duplicate-wire"),
        ("close.csv", "points", "0.5,0.5,0.5,a\n0.5,0.5,0.50000000000001,b\n", "wire-too-near"),
        ("word.csv", "points", "0.5,0.5,0.5\n0.1,x,0.1\n", "not-a-number"),
        ("inf.csv", "points", "0.5,0.5,inf\n", "not-a-number"),
        ("huge.csv", "points", "0.5,0.5,1e200\n", "coordinate-range"),
        ("two.csv", "points", "0.5,0.5\n", "not-a-number"),
        ("flat.node", "points", "1 2 0 0\n1 0.5 0.5\n", "unsupported-content"),
        ("empty.csv", "points", "", "unexpected-text"),
    ] {
        place.write(file, text);
        let run =
            place.run_line(&format!("mesh box.obj --embed-{option} {file} -o s.tetdb --json"));
        let error = run.error();
        assert_eq!((run.exit(), &error["code"]), (Some(3), &code.into()), "{file}: {error}");
        assert!(!error["where"].is_null(), "{file}: {error}");
        assert!(!place.path("s.tetdb").exists(), "{file}");
    }
    // A point on an embedded edge is refused, too. So is the repair of a surface with embedded edges.
    place.write("edge.obj", inside.to_owned() + "l 1 2\n");
    place.write("on.csv", "0.25,0.25,0.5\n");
    let run = place.run_line("mesh box.obj --embed-edges edge.obj --embed-points on.csv --json");
    assert_eq!(run.error()["code"], "wire-contact");
    let run = place.run_line("check box.obj --embed-edges edge.obj --repair --write r.obj --json");
    assert_eq!(run.error()["code"], "usage");
    place.run_line("mesh box.obj --embed-edges edge.obj").succeeds();
}

#[test]
fn polygons_of_two_corners_in_a_surface_are_embedded_edges() {
    let place = Place::new();
    let points = "1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n9 .5 .5 .3\n10 .5 .5 .7\n11 .3 .4 .5\n";
    let sides =
        "1\n4 1 4 3 2\n1\n4 5 6 7 8\n1\n4 1 2 6 5\n1\n4 3 4 8 7\n1\n4 1 5 8 4\n1\n4 2 3 7 6\n";
    let edges = "1 0 7\n2 9 10\n2 0 8\n2 10 11\n2 11 9\n";
    place.write("rods.poly", format!("11 3\n{points}8 1\n{sides}{edges}0\n0\n"));
    let run = place.run_line("mesh rods.poly -o rods.tetdb").succeeds();
    assert!(run.stderr().contains("3 polygons of two corners"), "{}", run.stderr());
    let verified = place.run_line("verify rods.tetdb --full --json").succeeds().json();
    assert_eq!((&verified["edges_present"], &verified["edges_missing"]), (&3.into(), &0.into()));
    // The same as a surface and its edges from two files, also for a store that is begun anew.
    place.write("box.poly", format!("11 3\n{points}6 0\n{sides}0\n0\n"));
    place.run_line("mesh box.poly --embed-edges rods.poly -o two.tetdb").succeeds();
    assert_eq!(place.digest("rods.tetdb"), place.digest("two.tetdb"));
    let again = place.run_line("mesh rods.poly -o rods.tetdb").succeeds().stderr();
    assert!(again.contains("already holds"), "{again}");
}

/// A tetrahedron with a slanted side, x/10 + y/10 + z/7 = 1.
const SLANTED: &str = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 7\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn points_near_the_surface_are_moved_onto_it_where_that_is_asked_for() {
    let place = Place::new();
    place.write("slanted.obj", SLANTED);
    // Outside and inside of the slanted side, beside an edge and beside a corner.
    place
        .write("near.csv", "2,3,3.5001\n3,2,3.4999\n5.00003,5.00002,0\n9.99999,0.00001,0\n1,1,1\n");
    place.write("rod.obj", "v 1 2 1\nv 4 1 3.49995\nl 1 2\n");
    let embedded = "--embed-edges rod.obj --embed-points near.csv";
    let refused = place.run_line(&format!("mesh slanted.obj {embedded} --refine-surface --json"));
    assert_eq!(refused.error()["code"], "wire-outside");
    for (within, store) in [("0.001", "a"), ("0.01%", "b")] {
        let line = format!("mesh slanted.obj {embedded} --snap-embedded {within} -o {store}.tetdb");
        let notes = place.run_line(&line).succeeds().stderr();
        assert!(notes.contains("near: 4 embedded points") && notes.contains("rod: 1 "), "{notes}");
        place.run_line(&format!("resaturate {store}.tetdb --subdomain 0 --hgrad 1.2")).succeeds();
        let verified = place.run_line(&format!("verify {store}.tetdb --full --json"));
        let verified = verified.succeeds().json();
        let found = (&verified["edges_present"], &verified["points_present"]);
        assert_eq!(found, (&1.into(), &5.into()));
    }
    // In a file of options, and with refinement.
    place.write("o.toml", "snap_embedded = 0.001\nhsiz = 2\nrefine_surface = true\n");
    place.run_line(&format!("mesh slanted.obj {embedded} --config o.toml -o c.tetdb")).succeeds();
    place.run_line("verify c.tetdb --full").succeeds();
    for (within, code) in [("0", "bad-size"), ("-1%", "bad-size"), ("x", "bad-size")] {
        let line = format!("mesh slanted.obj {embedded} --snap-embedded {within} --json");
        assert_eq!(place.run_line(&line).error()["code"], code, "{within}");
    }
    // Two points whose nearest place is one corner.
    place.write("same.csv", "10.0001,0,0\n10.0002,0,0\n");
    let line = "mesh slanted.obj --embed-points same.csv --snap-embedded 0.001 --json";
    assert_eq!(place.run_line(line).error()["code"], "duplicate-wire");
}

#[test]
fn what_is_embedded_outside_is_left_out_where_that_is_asked_for() {
    let place = Place::new();
    place.write("box.obj", BOX);
    place.write("some.csv", "0.5,0.5,0.5,in\n2,2,2,out\n0.5,0.5,1.25,out\n.3,.6,.2,in\n");
    place.write("all.csv", "2,2,2,out\n");
    place.write("inner.csv", "0.5,0.5,0.5,in\n.3,.6,.2,in\n");
    // A rod outside from a corner of the box, with points at its ends, and one inside.
    place.write("rods.obj", "v 1 1 1\nv 2 2 1\nv .5 .2 .3\nv .6 .4 .7\nl 1 2\nl 3 4\np 1\np 2\n");
    let error = place.run_line("mesh box.obj --embed-points some.csv --json").error();
    assert_eq!(error["code"], "wire-outside");
    let message = error["message"].as_str().unwrap_or_default();
    for words in
        ["2 of the embedded points", "the point \"some:out\" in line 2 of its file", "1.7e0 from"]
    {
        assert!(message.contains(words), "{message}");
    }
    for (embedded, left_out, edges, points) in [
        ("--embed-points some.csv", "0 edges and 2 points outside", 0, 2),
        ("--embed-points all.csv", "0 edges and 1 point outside", 0, 0),
        ("--embed-points inner.csv", "", 0, 2),
        ("--embed-edges rods.obj --embed-points rods.obj", "1 edge and 1 point outside", 1, 1),
        ("--embed-edges rods.obj --refine-surface --hsiz 0.5", "1 edge and 0 points", 1, 0),
    ] {
        let line = format!("mesh box.obj {embedded} --embed-outside skip -o s.tetdb --force");
        let notes = place.run_line(&line).succeeds().stderr();
        assert!(notes.contains(left_out), "{embedded}: {notes}");
        assert_eq!(notes.contains("were left out"), !left_out.is_empty(), "{embedded}: {notes}");
        let verified = place.run_line("verify s.tetdb --full --json").succeeds().json();
        let found = (&verified["edges_present"], &verified["points_present"]);
        assert_eq!(found, (&edges.into(), &points.into()), "{embedded}");
        let line = line.replace(" --force", "");
        let again = place.run_line(&line).succeeds().stderr();
        assert!(again.contains("already holds"), "{again}");
    }
    for command in ["estimate", "check"] {
        let line = format!("{command} box.obj --embed-points some.csv");
        assert_eq!(place.run_line(&format!("{line} --json")).error()["code"], "wire-outside");
        let skips = place.run_line(&format!("{line} --embed-outside skip")).succeeds();
        assert!(skips.stderr().contains("0 edges and 2 points outside"), "{}", skips.stderr());
    }
    let words = "mesh box.obj --embed-points some.csv --embed-outside drop --json";
    assert_eq!(place.run_line(words).error()["code"], "usage");
}

#[test]
fn a_check_finds_what_a_run_would_refuse_and_names_lines() {
    let place = Place::new();
    place.write("box.obj", BOX);
    // Comments and a line of names count as lines.
    place.write("near.csv", "# gauges\nx,y,z,name\n0.5,0.5,0.5,mid\n\n0.2,0.3,1.001,top\n");
    place.write("close.csv", "0.5 0.5 0.5\n0.2 0.3 0.99999999999999\n0.4 0.3 0.99999999999999\n");
    place.write("wall.obj", "v 0.5 2 0\nv 0.5 3 0\nv 0.5 2 1\nf 1 2 3\n");
    for (inside, code, message) in [
        ("--embed-points near.csv", "wire-outside", "\"near:top\" in line 5 of its file"),
        ("--embed-points close.csv", "wire-too-near", "\"close\" in line 2 of its file, the point"),
        ("--embed wall.obj", "sheet-outside", "wall"),
    ] {
        for command in ["check box.obj", "mesh box.obj -o a.tetdb"] {
            let error = place.run_line(&format!("{command} {inside} --json")).error();
            assert_eq!(error["code"], code, "{command} {inside}: {error}");
            let found = error["message"].as_str().unwrap_or_default();
            assert!(found.contains(message), "{command} {inside}: {found}");
        }
    }
    let line = "check box.obj --embed-points near.csv --snap-embedded 1% --json";
    let report = place.run_line(line).succeeds();
    assert_eq!(report.json()["triangles"], 14, "the snapped point divides a triangle");
    assert_eq!(
        place.run_line("check box.obj --snap-embedded x --json").error()["code"],
        "bad-size"
    );
    // A hole where the surface is open is reported as before.
    place.write("open.obj", BOX.replace("f 2 8 6\n", ""));
    let line = "check open.obj --embed-points near.csv --snap-embedded 1%";
    assert_eq!(place.run_line(line).exit(), Some(3));
}
