//! `transfer`, and `resaturate` of stores with fields: values evaluated on another mesh.
//!
//! Why: a result on one mesh begins the next computation on another; values of half a mesh, or of the wrong one, are worse than none.
//! How: linear fields and integrals have known results; threads, memory, kills and `undo` leave what they must.

use super::fields::{doubles, fields};
use super::place::Place;
use serde_json::Value;

/// `a.tetdb` with fields, and other meshes of the same space: `b.tetdb` and `d.tetdb` in two sub-domains, `c.tetdb` in one.
fn meshes(place: &Place) {
    let mesh = |h: &str, more: &str| {
        place.run_line(&format!("mesh sample:box,h={h} --no-verify {more}")).succeeds();
    };
    mesh("0.06", "-o a.tetdb");
    mesh("0.045", "-o b.tetdb --subdomains 2");
    mesh("0.08", "-o c.tetdb");
    mesh("0.045", "-o d.tetdb --subdomains 2");
    add_fields(place, "a.tetdb");
}

fn add_fields(place: &Place, store: &str) {
    for line in [
        "T --at vertices --from 300+x+2*y-3*z",
        "u --at vertices --from x-y,z,2*x --type f32",
        "step --at vertices --from round(4*x) --type i32",
        "heat --at tets --from 1+x*y+z*z",
        "flux --at tets --from x,-y,1",
        "mark --at tets --from if(x>0.5,7,-1) --type i64",
    ] {
        place.run_line(&format!("field {store} add {line}")).succeeds();
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// A linear field is the same to 1e-12 and integrals are kept to 1e-12, with the same bytes for any threads and memory.
#[test]
fn linear_fields_and_integrals_are_kept() {
    let place = Place::new();
    meshes(&place);
    let mut digests = Vec::new();
    for (to, more) in [
        ("b", "--threads 1"),
        ("d", "--threads 2 --memory 64MiB"),
        ("c", "--memory 256MiB --field T --field heat --field flux --field mark"),
    ] {
        let line = format!("transfer a.tetdb {to}.tetdb {more} --json");
        let all = place.run_line(&line).succeeds().json()["fields"].clone();
        for field in all.as_array().expect("fields") {
            assert_eq!(field["from_outside"], 0, "{field}");
            let is_at_tets = field["at"] == "tets";
            assert_eq!(field["method"], if is_at_tets { "overlap" } else { "linear" });
            let is_float = is_at_tets && field["type"] == "f64";
            assert_eq!(field["integrals"].is_array(), is_float, "{field}");
            for component in 0..field["components"].as_u64().filter(|_| is_float).unwrap_or(0) {
                let of = |i: usize| number(&field["integrals"][i][component as usize]);
                assert!((of(0) - of(1)).abs() < 1e-12 * of(0).abs(), "{field}");
            }
        }
        let digest = |field: &Value| format!("{} {}", field["name"], field["digest"]);
        digests.push(all.as_array().expect("fields").iter().map(digest).collect::<Vec<_>>());
        place.run_line(&format!("export {to}.tetdb {to}.npy")).succeeds();
        let points = doubles(&place, &format!("{to}_points.npy"));
        let values = doubles(&place, &format!("{to}_T.npy"));
        for (p, value) in points.chunks(3).zip(values) {
            let expected = 300.0 + p[0] + 2.0 * p[1] - 3.0 * p[2];
            assert!((value - expected).abs() < 1e-12 * expected, "{value} {expected}");
        }
    }
    assert_eq!(digests[0], digests[1]);
    place.run_line("verify b.tetdb --full").succeeds();
    // Marks are those of the old mesh, on both sides of the wall between them.
    let wrong = "x > 0.6 and mark != 7 or x < 0.4 and mark != -1";
    let found = place.run(&["query", "b.tetdb", "--where", wrong, "--select", "id", "--csv"]);
    assert_eq!(found.succeeds().stdout().lines().count(), 1);
    let constant = "flux.z < 0.999999999999 or flux.z > 1.000000000001";
    let found = place.run(&["query", "b.tetdb", "--where", constant, "--select", "id", "--csv"]);
    assert_eq!(found.succeeds().stdout().lines().count(), 1);
}

/// A mesh has the values of an equal one, whatever the method.
#[test]
fn equal_meshes_have_equal_values() {
    let place = Place::new();
    for store in ["a", "b"] {
        let mesh = "mesh sample:box,h=0.045 --no-verify --subdomains 2 -o";
        place.run_line(&format!("{mesh} {store}.tetdb")).succeeds();
    }
    add_fields(&place, "a.tetdb");
    place.run_line("field a.tetdb add hole --at vertices --from sqrt(x-0.5)").succeeds();
    let line = "transfer a.tetdb b.tetdb --method nearest --json";
    place.run_line(line).succeeds();
    assert_eq!(fields(&place, "a.tetdb"), fields(&place, "b.tetdb"));
    place.run_line("field b.tetdb drop T").succeeds();
    place.run_line("field b.tetdb drop hole").succeeds();
    place.run_line("transfer a.tetdb b.tetdb --field hole --field T").succeeds();
    let digests = |store: &str| {
        let mut all: Vec<String> = fields(&place, store)
            .iter()
            .map(|f| format!("{} {}", f["name"], f["digest"]))
            .collect();
        all.sort();
        all
    };
    assert_eq!(digests("a.tetdb"), digests("b.tetdb"));
}

/// What lies outside is counted, and has the values of the nearest point.
#[test]
fn values_outside_are_counted() {
    let place = Place::new();
    place.write("tetra.off", super::place::TETRA);
    place.run_line("mesh tetra.off --hsiz 0.2 --no-verify -o a.tetdb").succeeds();
    place.run_line("mesh sample:box,h=0.2 --no-verify -o b.tetdb").succeeds();
    place.run_line("field a.tetdb add T --at vertices --from x+y+z").succeeds();
    place.run_line("field a.tetdb add one --at tets --from 1").succeeds();
    let all = place.run_line("transfer a.tetdb b.tetdb --json").succeeds().json();
    place.run_line("export b.tetdb b.npy").succeeds();
    let (points, values) = (doubles(&place, "b_points.npy"), doubles(&place, "b_T.npy"));
    let mut n_outside = 0;
    for (p, value) in points.chunks(3).zip(&values) {
        let sum = p[0] + p[1] + p[2];
        n_outside += u64::from(sum > 1.0 + 1e-9);
        assert!((value - sum.min(1.0)).abs() < 1e-12, "{p:?} {value}");
    }
    assert!(n_outside > 100);
    let [at_vertices, at_tets] = [0, 1].map(|i| &all["fields"][i]);
    assert_eq!(at_vertices["from_outside"].as_u64(), Some(n_outside));
    assert!(number(&at_tets["from_outside"]) > 100.0);
    assert!((number(&at_tets["covered"]) - 1.0 / 6.0).abs() < 1e-12, "{at_tets}");
    let integral = |i: usize| number(&at_tets["integrals"][i][0]);
    assert!((integral(0) - 1.0 / 6.0).abs() < 1e-12 && (integral(1) - 1.0).abs() < 1e-12);
    assert!(doubles(&place, "b_one.npy").iter().all(|one| (one - 1.0).abs() < 1e-12));
    let text = "transfer b.tetdb a.tetdb --field one --json";
    assert_eq!(place.run_line(text).error()["code"], "bad-field");
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let place = Place::new();
    for store in ["a", "b"] {
        place.run_line(&format!("mesh sample:box,h=0.5 --no-verify -o {store}.tetdb")).succeeds();
    }
    let refused = |line: &str, code: &str, exit: i32| {
        let done = place.run_line(&format!("{line} --json"));
        assert_eq!((&done.error()["code"], done.exit()), (&code.into(), Some(exit)), "{line}");
    };
    refused("transfer a.tetdb b.tetdb", "bad-field", 3);
    place.run_line("field a.tetdb add T --at vertices --from x").succeeds();
    place.run_line("field a.tetdb add q --at tets --from x").succeeds();
    refused("transfer a.tetdb b.tetdb --field U", "no-such-part", 3);
    refused("transfer a.tetdb b.tetdb --method overlap", "bad-field", 3);
    refused("transfer a.tetdb b.tetdb --method linear --field q", "bad-field", 3);
    refused("transfer a.tetdb b.tetdb --method cubic", "usage", 2);
    refused("transfer a.tetdb a.tetdb", "bad-field", 3);
    refused("transfer a.tetdb c.tetdb", "no-such-store", 3);
    refused("transfer a.tetdb b.tetdb --memory 1MiB", "memory", 6);
    place.run_line("transfer a.tetdb b.tetdb --field T").succeeds();
    refused("transfer a.tetdb b.tetdb", "bad-field", 3);
    assert_eq!(fields(&place, "b.tetdb").len(), 1);
    assert!(!place.names().iter().any(|name| name.starts_with("b.tetdb/field-00000-g2")));
}

/// Names and digests of the fields, with the files of sub-domain 0.
fn state(place: &Place) -> (Vec<String>, Vec<String>) {
    let said = fields(place, "a.tetdb");
    let digests = said.iter().map(|f| format!("{} {}", f["name"], f["digest"])).collect();
    let names = place.names().into_iter().filter(|name| name.contains("/field-00000"));
    (digests, names.collect())
}

/// Fields go with a sub-domain that is meshed again, and come back with it; those of the other stay as they are.
#[test]
fn meshing_again_takes_the_fields_along() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --no-verify").succeeds();
    add_fields(&place, "a.tetdb");
    let before = state(&place);
    let again = "resaturate a.tetdb --subdomain 1 --refine-by 0.8 --json";
    let done = place.run_line(again).succeeds().json();
    let carried = done["fields"].as_array().expect("fields");
    assert_eq!(carried.len(), 6);
    for field in carried {
        assert_eq!(field["from_outside"], 0);
        for component in 0..3 {
            let of = |i: usize| field["integrals"][i][component].as_f64();
            if let (Some(a), Some(b)) = (of(0), of(1)) {
                assert!((a - b).abs() < 1e-12 * a.abs(), "{field}");
            }
        }
    }
    let after = state(&place);
    assert!(after.0 != before.0 && after.1 == before.1, "{after:?} {before:?}");
    place.run_line("verify a.tetdb --full").succeeds();
    place.run_line("export a.tetdb a.npy").succeeds();
    let (points, values) = (doubles(&place, "a_points.npy"), doubles(&place, "a_T.npy"));
    for (p, value) in points.chunks(3).zip(values) {
        assert!((value - (300.0 + p[0] + 2.0 * p[1] - 3.0 * p[2])).abs() < 1e-9);
    }
    // What was before comes back, without the files of what came after.
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!(state(&place), before);
    let n_files = || place.names().iter().filter(|name| name.contains("/field-")).count();
    assert_eq!(n_files(), 12);
    place.run_line("verify a.tetdb --full").succeeds();
    // A field that came later has no values of the mesh before.
    place.run_line(again).succeeds();
    assert_eq!(n_files(), 18);
    place.run_line("field a.tetdb add late --at tets --from 1").succeeds();
    place.run_line("field a.tetdb drop heat").succeeds();
    // Undoing would bring the dropped field back, so its files stay.
    assert_eq!(n_files(), 19);
    let refused = place.run_line("resaturate a.tetdb --undo --json");
    assert_eq!(refused.error()["code"], "bad-field");
    assert!(refused.error()["message"].as_str().expect("text").contains("late"));
    place.run_line("field a.tetdb drop late").succeeds();
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!((fields(&place, "a.tetdb").len(), n_files()), (6, 12));
    // Each change drops what was kept for the one before.
    place.run_line(again).succeeds();
    place.run_line("resaturate a.tetdb --subdomain 0 --refine-by 0.9 --no-verify").succeeds();
    assert_eq!(n_files(), 18);
    place.run_line("resaturate a.tetdb --forget").succeeds();
    assert_eq!(n_files(), 12);
    let kept = fields(&place, "a.tetdb");
    let name = place.names().into_iter().find(|name| name.contains("/subdomain-00001"));
    let path = place.path(&name.expect("it is there"));
    let mut bytes = std::fs::read(&path).expect("it can be read");
    let middle = bytes.len() / 2;
    bytes[middle..middle + 4096].fill(7);
    std::fs::write(&path, bytes).expect("it can be written");
    place.run_line("resaturate a.tetdb --repair").succeeds();
    assert_eq!(fields(&place, "a.tetdb"), kept);
    place.run_line("verify a.tetdb --full").succeeds();
    place.run_line("resaturate a.tetdb --subdomain 0 --refine-by 0.9 --drop-fields").succeeds();
    assert_eq!((fields(&place, "a.tetdb").len(), n_files()), (0, 12));
    place.run_line("resaturate a.tetdb --forget").succeeds();
    assert_eq!(n_files(), 0);
}

/// A killed change leaves the old mesh with its values or the new one with its own.
#[test]
fn kills_leave_mesh_and_values_of_one_time() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --no-verify").succeeds();
    add_fields(&place, "a.tetdb");
    let now = |place: &Place| (place.digest("a.tetdb"), state(place).0);
    let words = ["resaturate", "a.tetdb", "--subdomain", "1", "--refine-by", "1.2", "--no-verify"];
    let old = now(&place);
    let clock = std::time::Instant::now();
    place.run(&words).succeeds();
    let (whole, new) = (clock.elapsed(), now(&place));
    assert!(old.0 != new.0 && old.1 != new.1);
    place.run_line("resaturate a.tetdb --undo --no-verify").succeeds();
    let mut n_killed = 0;
    for i in 0..8 {
        let mut child = place.command(&words).spawn().expect("the program starts");
        std::thread::sleep(whole * (40 + 8 * i) / 100);
        child.kill().expect("it can be killed");
        n_killed += usize::from(!child.wait().expect("it ends").success());
        let found = now(&place);
        assert!(found == old || found == new, "{found:?}");
        if found == new {
            place.run_line("resaturate a.tetdb --undo --no-verify").succeeds();
            assert_eq!(now(&place), old);
        }
    }
    assert!(n_killed > 2, "{n_killed}");
    place.run_line("verify a.tetdb --full").succeeds();
}
