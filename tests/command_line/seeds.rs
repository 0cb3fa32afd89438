//! Regions are selected and named by points inside them.
//!
//! Why: a region filled, left out or named by mistake gives a wrong simulation. A seed must take effect everywhere or be refused.
//! How: three nested spheres; seeds on the command line, in files of seeds, and in files of three formats.

use super::place::Place;

const SHELLS: &str = "sample:shells,count=3,h=0.3";

/// Checks that the command ends with this error.
fn refused(place: &Place, line: &str, code: &str) {
    let run = place.run_line(&format!("{line} --json"));
    assert_eq!(run.exit(), Some(3), "{line}");
    assert_eq!(run.error()["code"], code, "{line}");
}

/// For each region by number: its name, and whether it is filled.
fn regions(place: &Place, store: &str) -> Vec<(Option<String>, bool)> {
    let info = place.run_line(&format!("info {store} --json")).succeeds();
    let info: serde_json::Value = serde_json::from_str(&info.stdout()).expect("an object");
    let all = info["regions"].as_array().expect("regions");
    all.iter()
        .map(|r| {
            let name = r["name"].as_str().map(str::to_owned);
            (name, r["filled"] == true)
        })
        .collect()
}

fn tets(place: &Place, store: &str) -> u64 {
    let info = place.run_line(&format!("info {store} --json")).succeeds().json();
    info["tets"].as_u64().expect("a number")
}

#[test]
fn seeds_fill_and_name_regions_and_names_are_good_wherever_regions_are() {
    let place = Place::new();
    place.write("seeds.txt", "# three of them\n0 0 0 core\n0.5, 0, 0, the shell\n0.9 0 0 hole\n");
    let two_names =
        format!("mesh {SHELLS} -o s.tetdb --seeds seeds.txt --region-seed 0,0.01,0,kernel");
    refused(&place, &two_names, "bad-seed");
    place.run_line(&format!("mesh {SHELLS} -o s.tetdb --seeds seeds.txt")).succeeds();
    let named = |name: &str| (Some(name.to_owned()), true);
    let expected = vec![(None, false), named("the shell"), named("core")];
    assert_eq!(regions(&place, "s.tetdb"), expected);
    let of = |region: &str| {
        let line = format!("query s.tetdb --json --select id,region --region {region}");
        place.run_line(&line).succeeds().stdout()
    };
    assert!(!of("core").is_empty());
    assert_eq!(of("core"), of("2"));
    refused(&place, "query s.tetdb --region rock", "no-such-part");
    let all = format!("mesh {SHELLS} -o all.tetdb --regions all --region-seed 0,0,0,core");
    place.run_line(&format!("{all} --size-region core,0.1")).succeeds();
    let expected = vec![(None, true), (None, true), named("core")];
    assert_eq!(regions(&place, "all.tetdb"), expected);
}

#[test]
fn names_go_into_every_export_that_has_names_and_come_back_from_there() {
    let place = Place::new();
    let seeds = "--region-seed 0,0,0,core --region-seed 0.5,0,0,mantle";
    place.run_line(&format!("mesh {SHELLS} -o s.tetdb {seeds}")).succeeds();
    for (file, text) in [
        ("s.msh", "3 1 \"mantle\"\n3 2 \"core\""),
        ("s22.msh", "3 1 \"mantle\"\n3 2 \"core\""),
        ("s.inp", "*ELSET, ELSET=core"),
        ("s.vtu", "Name=\"region_names\""),
        ("s.vtkhdf", "region_names"),
    ] {
        let format = if file == "s22.msh" { "--format msh22" } else { "" };
        place.run_line(&format!("export s.tetdb {file} {format}")).succeeds();
        let bytes = std::fs::read(place.path(file)).expect("it was written");
        let found = bytes.windows(text.len()).any(|w| w == text.as_bytes());
        assert!(found, "{file} has no {text}");
    }
    place.run_line("export s.tetdb case.foam").succeeds();
    let zones = place.path("case.foam").with_file_name("constant/polyMesh/cellZones");
    let zones = std::fs::read(zones).expect("it was written");
    assert!(zones.windows(6).any(|w| w == b"mantle"));
    for (file, rule) in [("s.msh", ""), ("s22.msh", ""), ("s22.msh", "--regions seeds")] {
        let line = format!("mesh {file} -o again.tetdb --force {rule}");
        place.run_line(&line).succeeds();
        let names: Vec<_> = regions(&place, "again.tetdb").into_iter().map(|r| r.0).collect();
        let expected = ["mantle", "core"].map(|name| Some(name.to_owned()));
        assert_eq!(names, expected, "{file}");
    }
    for file in ["s.mesh", "s.meshb"] {
        place.run_line(&format!("export s.tetdb {file}")).succeeds();
        let line = format!("mesh {file} -o again.tetdb --force");
        place.run_line(&line).succeeds();
        let names: Vec<_> = regions(&place, "again.tetdb").into_iter().map(|r| r.0).collect();
        let expected = ["ref_1", "ref_2"].map(|name| Some(name.to_owned()));
        assert_eq!(names, expected, "{file}");
    }
}

#[test]
fn holes_and_attributes_of_a_poly_choose_regions_where_seeds_do() {
    let place = Place::new();
    let cube = |from: usize, low: f64, high: f64| {
        let at = |bit: usize| if bit == 1 { high } else { low };
        let points: Vec<String> = (0..8)
            .map(|c| format!("{} {} {} {}", from + c, at(c & 1), at(c >> 1 & 1), at(c >> 2)))
            .collect();
        let sides =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let sides: Vec<String> = sides
            .iter()
            .map(|s| format!("1\n4 {}", s.map(|c: usize| (from + c).to_string()).join(" ")))
            .collect();
        (points.join("\n"), sides.join("\n"))
    };
    let (a, b) = (cube(0, 0.0, 3.0), cube(8, 1.0, 2.0));
    let text = |holes: &str, regions: &str| {
        format!("16 3\n{}\n{}\n12\n{}\n{}\n{holes}\n{regions}\n", a.0, b.0, a.1, b.1)
    };
    place.write("hole.poly", text("1\n1 1.5 1.5 1.5", "1\n1 0.5 0.5 0.5 7 0.1"));
    place.write("full.poly", text("0", "2\n1 0.5 0.5 0.5 7 0.1\n2 1.5 1.5 1.4 8"));
    place.write("bad.poly", text("1\n1 0.4 0.5 0.5", "1\n1 0.5 0.5 0.5 7"));
    for rule in ["", "--regions seeds", "--regions all-but-holes"] {
        place.run_line(&format!("mesh hole.poly --force {rule}")).succeeds();
        let expected = vec![(Some("attribute_7".to_owned()), true), (None, false)];
        assert_eq!(regions(&place, "hole.tetdb"), expected);
    }
    let named = |name: &str| (Some(name.to_owned()), true);
    let coarse = tets(&place, "hole.tetdb");
    // The largest volume of a region makes it finer. A hole outside changes nothing, a region without a point is filled.
    place.write("fine.poly", text("2\n1 9 9 9\n2 1.5 1.5 1.5", "1\n1 0.5 0.5 0.5 7 0.002"));
    place.run_line("mesh fine.poly").succeeds();
    assert!(tets(&place, "fine.tetdb") > 4 * coarse);
    place.write("half.poly", text("0", "1\n1 1.5 1.5 1.5 8"));
    let run = place.run_line("mesh half.poly").succeeds();
    assert!(run.stderr().contains("every region without a hole point"), "{}", run.stderr());
    assert_eq!(regions(&place, "half.tetdb"), [(None, true), named("attribute_8")]);
    place.run_line("mesh half.poly -o parity.tetdb --regions parity").succeeds();
    assert_eq!(regions(&place, "parity.tetdb"), [(None, true), (None, false)]);
    for rule in ["", "--regions seeds"] {
        place.run_line(&format!("mesh full.poly --force {rule}")).succeeds();
        let expected = vec![named("attribute_7"), named("attribute_8")];
        assert_eq!(regions(&place, "full.tetdb"), expected);
        refused(&place, &format!("mesh bad.poly {rule}"), "bad-seed");
    }
    // Other rules fill their regions; names apply where they fit.
    place.run_line("mesh bad.poly -o parity.tetdb --regions parity --force").succeeds();
    let expected = vec![named("attribute_7"), (None, false)];
    assert_eq!(regions(&place, "parity.tetdb"), expected);
}

#[test]
fn seeds_without_a_meaning_are_refused_and_leave_nothing_behind() {
    let place = Place::new();
    place.write("bad.txt", "0 0 0 core\n1 2\n");
    for seeds in [
        "--region-seed 9,9,9,far",
        "--region-seed 0,0,0,a --region-seed 0.1,0,0,b",
        "--region-seed 0,0,0,a --hole 0.1,0,0",
        "--regions seeds",
        "--region-seed 0,0,a",
        "--hole 0,0",
        "--region-seed 0,0,nan,a",
        "--region-seed 1,0,0,face",
        "--regions parity --region-seed 0.5,0,0,empty",
        "--seeds bad.txt",
    ] {
        let line = format!("mesh {SHELLS} -o s.tetdb {seeds}");
        refused(&place, &line, "bad-seed");
        assert!(!place.path("s.tetdb").exists(), "{seeds}");
    }
}
