//! Sub-domains of a finished store can be meshed again, and nothing else changes.
//!
//! Why: refining one place of a large mesh must not require meshing all of it, nor lose the old mesh. A lost file must not require a new
//! mesh either.
//! How: one small store in three sub-domains for each case. Digests, edge lengths and qualities are compared before and after.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use tetdb_schema::record::tag;
use tetdb_store::store::Catalog;

use super::place::{Done, Place};

const MESH: &str = "mesh sample:box,h=0.045 -o a.tetdb --subdomains 3 --no-verify";

fn made() -> Place {
    let place = Place::new();
    place.run_line(MESH).succeeds();
    place
}

fn info(place: &Place) -> Value {
    place.run_line("info a.tetdb --json").succeeds().json()
}

/// The value of a key for each sub-domain.
fn each(info: &Value, key: &str) -> Vec<String> {
    let parts = info["subdomains"].as_array().expect("a list");
    parts.iter().map(|part| part[key].to_string()).collect()
}

fn verifies(place: &Place) {
    place.run_line("verify a.tetdb --full").succeeds();
}

fn refuses(done: &Done, code: &str, exit: i32) {
    let error = done.error();
    assert_eq!((error["code"].as_str(), done.exit()), (Some(code), Some(exit)), "{error}");
    assert!(error["help"].as_str().is_some_and(|help| !help.is_empty()));
}

/// Ranks with different digests.
fn changed(before: &Value, after: &Value) -> BTreeSet<usize> {
    assert_eq!(each(before, "interface_digest"), each(after, "interface_digest"));
    assert_eq!(before["interfaces"], after["interfaces"]);
    let pairs = each(before, "digest").into_iter().zip(each(after, "digest"));
    (pairs.enumerate()).filter(|(_, (a, b))| a != b).map(|(rank, _)| rank).collect()
}

#[test]
fn without_options_the_mesh_is_the_same_whatever_the_machine() {
    let place = made();
    let before = info(&place);
    assert!(before["coarse_bytes"].as_u64().is_some_and(|b| b > 0));
    for options in ["--threads 1 --memory 64MiB", "--threads 2"] {
        let line = format!("resaturate a.tetdb --subdomain 0,1,2 {options} --json");
        let answer = place.run_line(&line).succeeds().json();
        assert_eq!(answer["digest"], before["digest"]);
        assert_eq!(answer["subdomains"].as_array().map(Vec::len), Some(3));
        assert!(changed(&before, &info(&place)).is_empty());
    }
    let line = "resaturate a.tetdb --subdomain 2 --refine-by 0.7 --json --threads";
    let digest = |options: &str| {
        let answer = place.run_line(&format!("{line} {options}")).succeeds().json();
        place.run_line("resaturate a.tetdb --undo").succeeds();
        answer["digest"].clone()
    };
    assert_eq!(digest("1 --memory 64MiB"), digest("2 --memory 1GiB"));
    assert_eq!(info(&place)["digest"], before["digest"]);
}

#[test]
fn half_the_size_changes_one_part_only_and_can_be_undone() {
    let place = made();
    let before = info(&place);
    let line = "resaturate a.tetdb --subdomain 1 --refine-by 0.5";
    let list = place.run_line(&format!("{line} --dry-run --json")).succeeds();
    let predicted = list.json()["subdomains"][0]["predicted_tets"].as_f64();
    place.run_line(line).succeeds();
    verifies(&place);
    let after = info(&place);
    assert_eq!(changed(&before, &after), BTreeSet::from([1]));
    let tets = after["subdomains"][1]["tets"].as_f64().expect("a number");
    let ratio = predicted.expect("a number") / tets;
    assert!((0.8..1.25).contains(&ratio), "{ratio} of {tets}");
    let sum: f64 = after["regions"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|r| r["tets"].as_f64().unwrap_or_default())
        .sum();
    assert_eq!(sum, after["tets"].as_f64().expect("a number"));
    assert!(after["subdomains"][1]["sizes"]["refine_by"] == "0.5");
    let median = metric_median(&place, 1);
    assert!((0.9..1.1).contains(&median), "{median}");
    let good = |info: &Value| {
        let bins = info["subdomains"][1]["quality"]["bins"].as_array().expect("a list").clone();
        let bins: Vec<f64> = bins.iter().filter_map(Value::as_f64).collect();
        100.0 * bins[0] / bins.iter().sum::<f64>()
    };
    assert!((good(&after) - good(&before)).abs() < 0.5, "{} {}", good(&before), good(&after));
    // Meshed again unchanged, without any sizes.
    place.run_line("resaturate a.tetdb --subdomain 1").succeeds();
    assert!(changed(&after, &info(&place)).is_empty());
    // That was no change, so the change before it is undone.
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!(info(&place)["digest"], before["digest"]);
    refuses(&place.run_line("resaturate a.tetdb --undo --json"), "nothing-to-undo", 8);
    place.run_line(line).succeeds();
    assert_eq!(info(&place)["digest"], after["digest"]);
    place.run_line(line).succeeds();
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!(info(&place)["digest"], after["digest"]);
    verifies(&place);
    place.run_line(line).succeeds();
    let files = || place.names().iter().filter(|n| n.contains("/subdomain-")).count();
    assert_eq!(files(), 4);
    place.run_line("resaturate a.tetdb --forget").succeeds();
    assert_eq!(files(), 3);
    refuses(&place.run_line("resaturate a.tetdb --undo --json"), "nothing-to-undo", 8);
}

/// The median edge length, in units of the lengths wanted at the edge's ends. Only edges farther than twice that length from all fixed
/// faces count.
fn metric_median(place: &Place, rank: u32) -> f64 {
    let mut store = Catalog::open(place.path("a.tetdb")).expect("a finished store");
    let mut part = store.open_subdomain(rank, 16 << 20).expect("a sealed sub-domain");
    let vertices: Vec<_> = part.vertices().map(|v| v.expect("no damage")).collect();
    let skin: Vec<[f64; 3]> = (vertices.iter())
        .filter(|v| v.tag == tag::SURFACE || v.tag == tag::INTERFACE)
        .map(|v| v.point)
        .collect();
    let distance = |a: [f64; 3], b: [f64; 3]| {
        let squares = (0..3).map(|i| (a[i] - b[i]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let inner: Vec<bool> = (vertices.iter())
        .map(|v| {
            let near = |p: &[f64; 3]| distance(*p, v.point) < 2.5 * f64::from(v.h);
            !skin.iter().any(near)
        })
        .collect();
    let mut edges = BTreeSet::new();
    for tet in part.tets() {
        let nodes = tet.expect("no damage").1.nodes;
        for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            edges.insert((nodes[i].min(nodes[j]), nodes[i].max(nodes[j])));
        }
    }
    let mut lengths: Vec<f64> = (edges.into_iter())
        .filter(|&(a, b)| inner[a as usize] && inner[b as usize])
        .map(|(a, b)| {
            let (a, b) = (&vertices[a as usize], &vertices[b as usize]);
            distance(a.point, b.point) * 0.5 * f64::from(1.0 / a.h + 1.0 / b.h)
        })
        .collect();
    assert!(lengths.len() > 1000, "{} edges", lengths.len());
    lengths.sort_unstable_by(f64::total_cmp);
    lengths[lengths.len() / 2]
}

#[test]
fn only_what_a_size_reaches_is_changed() {
    let place = made();
    let before = info(&place);
    let corner = "--size-sphere 0,0,0,0.1,0.02";
    let line = format!("resaturate a.tetdb --changed {corner} --dry-run --json");
    let list = place.run_line(&line).succeeds().json();
    let ids: Vec<usize> = (list["subdomains"].as_array().expect("a list").iter())
        .filter_map(|f| f["id"].as_u64())
        .map(|id| id as usize)
        .collect();
    assert!(!ids.is_empty() && ids.len() < 3, "{list}");
    assert_eq!(info(&place)["digest"], before["digest"], "a dry run writes nothing");
    place.run_line(&format!("resaturate a.tetdb --changed {corner}")).succeeds();
    let after = info(&place);
    assert_eq!(changed(&before, &after), ids.iter().copied().collect());
    assert!(after["tets"].as_u64() > before["tets"].as_u64());
    // Repeating the request changes nothing.
    let again = place.run_line(&format!("resaturate a.tetdb --changed {corner} --json"));
    assert_eq!(again.succeeds().json()["subdomains"], Value::Array(Vec::new()));
}

#[test]
fn lengths_of_the_first_run_hold_unless_new_ones_say_otherwise() {
    let place = Place::new();
    let mesh = "mesh sample:box,h=0.1 --size-sphere 0.3,0.3,0.3,0.1,0.015 -o a.tetdb --no-verify";
    place.run_line(mesh).succeeds();
    let tets = || info(&place)["tets"].as_f64().expect("a number");
    let (digest, before) = (info(&place)["digest"].clone(), tets());
    let again = |options: &str| {
        let line = format!("resaturate a.tetdb --subdomain 0 --no-verify {options}");
        place.run_line(&line).succeeds();
        let ratio = tets() / before;
        place.run_line("resaturate a.tetdb --undo").succeeds();
        assert_eq!(info(&place)["digest"], digest, "{options}");
        ratio
    };
    for same in ["--refine-by 1", "--size-sphere 5,5,5,0.1,0.02"] {
        let line = format!("resaturate a.tetdb --subdomain 0 --no-verify {same}");
        place.run_line(&line).succeeds();
        assert_eq!(info(&place)["digest"], digest, "{same}");
        // Nothing has changed, so nothing can be undone.
        let undo = place.run_line("resaturate a.tetdb --undo --json");
        refuses(&undo, "nothing-to-undo", 8);
    }
    let (some, more) = (again("--refine-by 0.9"), again("--refine-by 0.6"));
    assert!(some > 1.0 && more > some, "{some} {more}");
    // Nine tenths of the vertices are free.
    assert!((0.7..1.1).contains(&(more * 0.6f64.powi(3))), "{more}");
    // The first run's sphere applies together with the new one.
    let beside = again("--size-sphere 0.8,0.8,0.8,0.05,0.02");
    assert!(beside > 1.01, "{beside}");
}

/// The current file of a sub-domain.
fn sealed(place: &Place, rank: u32) -> std::path::PathBuf {
    let start = format!("a.tetdb/subdomain-{rank:05}-");
    let name = place.names().into_iter().find(|n| n.starts_with(&start));
    place.path(&name.expect("a sealed sub-domain has a file"))
}

#[test]
fn a_damaged_part_is_made_again_from_its_coarse_leaf() {
    let place = made();
    let before = info(&place);
    place.run_line("resaturate a.tetdb --repair").succeeds();
    // Damages a chunk, the whole file, or removes the file.
    for damage in 0..3 {
        let file = sealed(&place, 2);
        let mut bytes = std::fs::read(&file).expect("the file is readable");
        let chunk = bytes.windows(4).position(|w| w == b"TETC").expect("a chunk");
        match damage {
            0 => bytes[chunk + 100] ^= 1,
            1 => bytes[..4096].fill(0xff),
            _ => {}
        }
        match damage {
            2 => std::fs::remove_file(&file).expect("the file can be removed"),
            _ => std::fs::write(&file, &bytes).expect("the file is writable"),
        }
        let done = place.run_line("verify a.tetdb --json");
        refuses(&done, "damaged", 4);
        let error = done.error();
        assert!(error["message"].as_str().is_some_and(|m| m.contains("00002")), "{error}");
        assert!(error["help"].as_str().is_some_and(|h| h.contains("--repair")), "{error}");
        place.run_line("resaturate a.tetdb --repair").succeeds();
        verifies(&place);
        assert_eq!(info(&place)["digest"], before["digest"]);
    }
    // Repairs a sub-domain with sizes of its own, too.
    place.run_line("resaturate a.tetdb --subdomain 2 --refine-by 0.8").succeeds();
    place.run_line("resaturate a.tetdb --forget").succeeds();
    let finer = info(&place);
    std::fs::remove_file(sealed(&place, 2)).expect("the file can be removed");
    place.run_line("resaturate a.tetdb --repair --subdomain 2").succeeds();
    assert_eq!(info(&place)["digest"], finer["digest"]);
}

#[test]
fn a_killed_change_leaves_old_or_new() {
    let place = made();
    let before = info(&place)["digest"].clone();
    let line = "resaturate a.tetdb --subdomain 0,2 --refine-by 0.7 --no-verify";
    place.run_line(line).succeeds();
    let after = info(&place)["digest"].clone();
    place.run_line("resaturate a.tetdb --undo --no-verify").succeeds();
    assert_eq!(info(&place)["digest"], before);
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut n_old = 0;
    for millis in [0, 60, 250, 700] {
        let mut child = place.command(&words).spawn().expect("the program starts");
        std::thread::sleep(Duration::from_millis(millis));
        child.kill().expect("the child can be killed");
        child.wait().expect("the child can be waited for");
        // The lock of a killed writer is released.
        let found = info(&place)["digest"].clone();
        assert!(found == before || found == after, "{found} after {millis} ms");
        verifies(&place);
        if found == before {
            n_old += 1;
            place.run_line(line).succeeds();
            assert_eq!(info(&place)["digest"], after);
        }
        place.run_line("resaturate a.tetdb --undo --no-verify").succeeds();
        assert_eq!(info(&place)["digest"], before);
    }
    assert!(n_old > 0, "every run was done before it was killed");
}

#[test]
fn what_cannot_be_made_again_is_told() {
    let place = made();
    let line = |rest: &str| place.run_line(&format!("resaturate a.tetdb --json {rest}"));
    refuses(&line(""), "usage", 2);
    refuses(&line("--changed"), "usage", 2);
    refuses(&line("--undo --hsiz 1"), "usage", 2);
    refuses(&line("--undo"), "nothing-to-undo", 8);
    refuses(&line("--subdomain 7"), "no-such-part", 3);
    refuses(&line("--subdomain 1 --refine-by 0"), "bad-size", 2);
    refuses(&line("--subdomain 1 --hsiz -1"), "bad-size", 2);
    refuses(&line("--subdomain 1 --hmin 2 --hmax 1"), "bad-size", 2);
    // Refused at once, not when the disk is full.
    refuses(&line("--subdomain 1 --refine-by 1e-5 --hgrad 10"), "no-room", 6);
    refuses(&line("--subdomain 1 --size-field none.npy"), "unreadable-file", 3);
    let npy = |shape: &str, values: &[f64]| {
        let head = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((head.len() as u16).to_le_bytes());
        bytes.extend(head.as_bytes());
        bytes.extend(values.iter().flat_map(|h| h.to_le_bytes()));
        place.write("h.npy", bytes);
    };
    npy("(2,)", &[0.1, 0.2]);
    let file = "--subdomain 1 --size-field h.npy";
    refuses(&line(file), "count-mismatch", 3);
    refuses(&line(&format!("{file} --hsiz 1")), "usage", 2);
    npy("(2,)", &[0.1, -0.2]);
    refuses(&line(file), "unexpected-text", 3);
    npy("(1, 2)", &[0.1, 0.2]);
    refuses(&line(file), "unexpected-text", 3);
    // Without coarse snapshots, the mesh is the same and final.
    let digest = place.digest("a.tetdb");
    place.run_line(&format!("{MESH} --drop-coarse --force")).succeeds();
    assert_eq!(place.digest("a.tetdb"), digest);
    assert_eq!(info(&place)["coarse_bytes"], 0);
    refuses(&line("--subdomain 1"), "no-coarse-leaf", 8);
    assert!(!place.names().iter().any(|name| name.contains("coarse-")));
    // An unfinished store cannot be meshed again.
    let words = ["mesh", "sample:balls,count=12", "-o", "b.tetdb", "--threads", "1"];
    let mut child = place.command(&words).spawn().expect("the program starts");
    while !Path::new(&place.path("b.tetdb/catalog.redb")).exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("the child can be killed");
    child.wait().expect("the child can be waited for");
    refuses(&place.run_line("resaturate b.tetdb --subdomain 0 --json"), "store-unfinished", 8);
}
