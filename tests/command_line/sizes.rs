//! The mesh has the requested sizes, and its cost is predicted before the run.
//!
//! Why: users want to see the requested sizes in the mesh, and to know beforehand whether it fits.
//! How: estimates are compared with the actual meshes. Each size option gets values that make sense and values that do not.

use super::place::Place;
use serde_json::Value;

fn number(value: &Value, name: &str) -> f64 {
    let found = value[name].as_f64();
    found.unwrap_or_else(|| panic!("no number {name} in {value}"))
}

/// A box with two tiny notches in a side with a few large triangles.
const NOTCHES: &str = "OFF\n20 36 0\n-1 -1 -1\n-1 -1 1\n-1 1 -1\n-1 1 1\n-0.1525 0.497 1\n-0.0969 0.497 0.9852\n\
    -0.2082 0.5526 1\n-0.2082 0.6082 0.9852\n-0.1525 0.6082 1\n-0.0969 0.5526 1\n1 -1 -1\n\
    1 -1 1\n1 1 -1\n0.1791 0.089 1\n0.1774 0.0907 1\n0.1774 0.0924 0.9984\n0.1791 0.0924 1\n\
    0.1808 0.089 0.9984\n0.1808 0.0907 1\n1 1 1\n3 0 10 1\n3 0 2 10\n3 0 1 3\n3 1 11 3\n\
    3 0 3 2\n3 3 11 6\n3 4 16 9\n3 2 3 19\n3 3 6 8\n3 3 8 19\n3 10 12 11\n3 1 10 11\n\
    3 11 13 14\n3 11 18 13\n3 11 14 4\n3 2 12 10\n3 2 19 12\n3 4 14 16\n3 11 4 6\n3 19 16 18\n\
    3 19 9 16\n3 19 8 9\n3 11 12 19\n3 11 19 18\n3 7 6 4\n3 7 8 6\n3 7 4 5\n3 7 5 9\n3 7 9 8\n\
    3 5 4 9\n3 15 14 13\n3 15 13 17\n3 15 17 16\n3 15 16 14\n3 17 13 18\n3 17 18 16\n";

#[test]
fn beside_tiny_notches_lengths_stay_those_of_the_surface() {
    let place = Place::new();
    place.write("notches.off", NOTCHES);
    // Interpolated lengths once fell below zero here, and 1e16 tetrahedra were predicted.
    let expected = place.run_line("estimate notches.off --json");
    let expected = number(&expected.succeeds().json(), "tets");
    place.run_line("mesh notches.off -o n.tetdb --quiet").succeeds();
    let found = place.run_line("info n.tetdb --json").succeeds().json();
    let ratio = expected / number(&found, "tets");
    assert!((0.5..2.0).contains(&ratio), "{expected} expected, {ratio}");
}

#[test]
fn estimates_come_true() {
    let place = Place::new();
    for (k, line) in [
        "sample:box,h=0.1",
        "sample:box,h=0.2 --hsiz 0.05 --optimize none",
        "sample:balls,count=3",
        "sample:knot,h=0.15",
        "sample:shells,count=3,h=0.2 --regions all",
        "sample:box,h=0.2 --size-sphere 0.5,0.5,0.5,0.2,0.02",
        "sample:box,h=0.2 --size-expr 0.03+0.3*abs(x-0.5)",
        "sample:shells,count=2,h=0.2 --regions all --size-region 2,0.06",
        "sample:shells,count=2,h=0.2 --regions all --size-label shell-2,0.05",
        "sample:shells,count=2,h=0.2 --size-label shell-2,0.06,10%",
    ]
    .into_iter()
    .enumerate()
    {
        let told = place.run_line(&format!("estimate {line} --json"));
        let told = told.succeeds().json();
        let made = place.run_line(&format!("mesh {line} -o {k}.tetdb --json"));
        let made = made.succeeds().json();
        for (name, off_max) in [("tets", 0.15), ("vertices", 0.15), ("peak_bytes", 0.35)] {
            let ratio = number(&told, name) / number(&made, name);
            assert!((ratio - 1.0).abs() < off_max, "{line}: {name} is {ratio} of what came");
        }
        let subdomains = made["subdomains"].as_array().map(Vec::len);
        assert_eq!(told["subdomains"].as_u64(), subdomains.map(|n| n as u64));
        assert_eq!(told["fits"]["memory"], true);
    }
}

#[test]
fn estimates_refuse_nothing() {
    let place = Place::new();
    let line = "estimate sample:box,h=0.5 --size-sphere 0.5,0.5,0.5,0.2,0.0001 --memory 64MiB";
    let told = place.run_line(&format!("{line} --json")).succeeds().json();
    assert!(number(&told, "tets") > 1e11, "{told}");
    assert_eq!(told["fits"]["disk"], false);
    assert_eq!(told["fits"]["memory"], true);
    let text = place.run_line(line).succeeds().stdout();
    assert!(text.contains("fits: no, the disk is too small"), "{text}");
    assert!(place.names().is_empty());
}

#[test]
fn the_look_ahead_can_be_left_out() {
    let place = Place::new();
    let line = "mesh sample:box,h=0.5 -o a.tetdb --no-preflight";
    place.run_line(line).succeeds();
}

/// Number of tetrahedra in each region.
fn tets_of_regions(place: &Place, store: &str) -> Vec<f64> {
    let info = place.run(&["info", store, "--json"]).succeeds().json();
    let regions = info["regions"].as_array().expect("a list").clone();
    regions.iter().map(|r| number(r, "tets")).collect()
}

#[test]
fn regions_have_sizes_of_their_own() {
    let place = Place::new();
    let sample = "sample:shells,count=3,h=0.2 --regions all";
    let mut found = Vec::new();
    for (store, options) in [
        ("plain", ""),
        ("first", "--size-region 1,0.1"),
        ("second", "--size-region 2,0.08"),
        ("named", "--size-region shell-2,0.08"),
        ("both", "--size-region 2,0.08 --size-region shell-3,0.04"),
    ] {
        let line = format!("mesh {sample} {options} -o {store}.tetdb");
        place.run_line(&line).succeeds();
        found.push(tets_of_regions(&place, &format!("{store}.tetdb")));
    }
    // The requested region gets its tetrahedra; other regions get only those of the transition.
    let [plain, first, second, named, both] = &found[..] else { panic!("{found:?}") };
    assert!(first[0] > 4.0 * plain[0] && first[2] < 3.0 * plain[2], "{found:?}");
    assert!(second[1] > 8.0 * plain[1] && second[1] > second[0], "{found:?}");
    assert_eq!(second, named);
    assert!(both[2] > 3.0 * second[2], "{found:?}");
    for (option, named) in [
        ("--size-region=4,0.1", "regions 1 to 3"),
        ("--size-region=0,0.1", "regions 1 to 3"),
        ("--size-region=core,0.1", "shell-3"),
        ("--size-region=1", "REGION,H"),
        ("--size-region=1,-0.1", "-0.1"),
    ] {
        let mut words: Vec<&str> =
            "mesh sample:shells,count=3,h=0.2 --regions all -o bad.tetdb --json"
                .split(' ')
                .collect();
        words.push(option);
        let done = place.run(&words);
        let error = done.error();
        assert_eq!((error["code"].as_str(), done.exit()), (Some("bad-size"), Some(2)));
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.contains(named), "{option}: {message}");
        assert!(!place.path("bad.tetdb").exists());
    }
}

#[test]
fn lengths_near_a_label_follow_it() {
    let place = Place::new();
    place.run_line("sample faults,cells=8 -o rock.obj").succeeds();
    let inside = "--embed rock_sheets.obj --name rock_sheets.obj=f";
    for (k, (surface, label, options)) in [
        ("sample:shells,count=2,h=0.3", "shell-2", "--size-label shell-2,0.08"),
        ("sample:shells,count=2,h=0.3,kind=boxes", "shell-1", "--size-label shell-1,2%,3%"),
        (&format!("rock.obj {inside}"), "f:fault-1", "--size-label f:fault-1,0.03 --threads 1"),
    ]
    .into_iter()
    .enumerate()
    {
        let tets = |store: &str, label: &str| {
            let line = format!("query {store} --label {label} --json");
            let text = place.run_line(&line).succeeds().stdout();
            text.lines().filter(|line| line.contains("\"id\"")).count()
        };
        let mut found = Vec::new();
        for (name, options) in [("plain", ""), ("near", options)] {
            let store = format!("{k}{name}.tetdb");
            let line = format!("mesh {surface} {options} --refine-surface -o {store}");
            place.run_line(&line).succeeds();
            found.push(tets(&store, label));
        }
        assert!(found[1] >= 4 * found[0], "{surface}: {found:?}");
    }
    let (store, info) = ("1near.tetdb", "info 1near.tetdb --json");
    let recorded = place.run_line(info).succeeds().stdout();
    assert!(recorded.contains("shell-1,2%,3%"), "{store}: {recorded}");
    place
        .write("job.toml", "size_label = [[\"shell-1\", \"2%\", \"3%\"]]\nrefine_surface = true\n");
    let line =
        "mesh sample:shells,count=2,h=0.3,kind=boxes --config job.toml --memory 64MiB -o c.tetdb";
    place.run_line(line).succeeds();
    assert_eq!(place.digest("c.tetdb"), place.digest(store));
    for (asked, named) in [
        ("--size-label=shell,0.1", "shell-1, shell-2"),
        ("--size-label=shell-1", "LABEL,H,DISTANCE"),
        ("--size-label=shell-1,-0.1", "-0.1"),
    ] {
        let line = format!("mesh sample:shells,count=2,h=0.3 -o bad.tetdb --json {asked}");
        let done = place.run_line(&line);
        let error = done.error();
        assert_eq!((error["code"].as_str(), done.exit()), (Some("bad-size"), Some(2)), "{asked}");
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.contains(named), "{asked}: {message}");
    }
}

#[test]
fn sizes_by_position_give_one_mesh() {
    let place = Place::new();
    let expression = "0.06+0.3*abs(x-0.5)";
    let mut digests = Vec::new();
    place.write("job.toml", format!("size_expr = \"{expression}\"\nsize_region = [\"1,0.15\"]\n"));
    let typed = format!("--size-expr {expression} --size-region 1,0.15");
    for (store, options) in [
        ("a", format!("{typed} --threads 1 --memory 64MiB")),
        ("b", format!("{typed} --threads 2 --memory 1GiB")),
        ("c", "--config job.toml".to_owned()),
    ] {
        let line = format!("mesh sample:box,h=0.2 {options} -o {store}.tetdb");
        place.run_line(&line).succeeds();
        digests.push(place.digest(&format!("{store}.tetdb")));
    }
    for millis in [30, 100, 300] {
        let line = format!("mesh sample:box,h=0.2 {typed} -o k.tetdb --threads 1");
        let words: Vec<&str> = line.split_whitespace().collect();
        let mut child = place.command(&words).spawn().expect("the program starts");
        std::thread::sleep(std::time::Duration::from_millis(millis));
        child.kill().expect("the child can be killed");
        child.wait().expect("the child can be waited for");
        if place.path("k.tetdb/catalog.redb").exists() {
            place.run_line("resume k.tetdb").succeeds();
            digests.push(place.digest("k.tetdb"));
        }
        let _ = std::fs::remove_dir_all(place.path("k.tetdb"));
    }
    assert!(digests.iter().all(|d| *d == digests[0]), "{digests:?}");
}

#[test]
fn expressions_that_are_no_sizes_are_named() {
    let place = Place::new();
    for (expression, named) in [
        ("x", "is 0 at (0, 0, 0)"),
        ("1/(x-x)", "inf"),
        ("x+", "character 3"),
        ("x>1", "true or false"),
        ("w", "w"),
    ] {
        let option = format!("--size-expr={expression}");
        let done = place.run(&["mesh", "sample:box,h=0.5", "-o", "a.tetdb", "--json", &option]);
        let error = done.error();
        assert_eq!((error["code"].as_str(), done.exit()), (Some("bad-size"), Some(2)));
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.contains(named), "{expression}: {message}");
        assert!(place.names().is_empty());
    }
}

#[test]
fn a_shape_names_its_bad_number_and_help_fits_the_fault() {
    let place = Place::new();
    for (asked, parts) in [
        ("--size-sphere 1.5,0,5%,1,2%", ["in it 5%", "coordinates are numbers"]),
        ("--size-box 0,0,0,1,1,x,0.1", ["in it x", "coordinates are numbers"]),
        ("--size-cylinder 0,0,0,1,1,1,1,-2", ["in it -2", "lengths above zero"]),
        ("--size-sphere 1,2,3", ["X,Y,Z,R,H", "coordinates are numbers"]),
        ("--size-region 5,0.1", ["5", "name a region"]),
        ("--size-expr x", ["size-expr x is", "everywhere in the surface's box"]),
        ("--hsiz 5mm", ["5mm", "share of its box diagonal"]),
    ] {
        let done = place.run_line(&format!("estimate sample:box,h=0.5 {asked}"));
        assert_eq!(done.exit(), Some(2), "{asked}");
        for part in parts {
            assert!(done.stderr().contains(part), "{asked}: {}", done.stderr());
        }
    }
}
