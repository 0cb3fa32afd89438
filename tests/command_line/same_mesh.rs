//! The same input gives the same mesh, for any amount of memory and any number of threads.
//!
//! Why: results that depend on the machine cannot be compared, resumed or trusted.
//! How: one sample, several caps and thread counts, one digest.

use super::place::Place;

#[test]
fn caps_and_threads_do_not_change_the_mesh() {
    let place = Place::new();
    let mut digests = Vec::new();
    for (store, options) in [
        ("a", "--threads 1 --memory 64MiB"),
        ("b", "--threads 2 --memory 1GiB"),
        ("c", "--threads 2 --memory 64MiB"),
        ("d", "--threads 5"),
    ] {
        let line = format!("mesh sample:balls,count=8 -o {store}.tetdb {options}");
        place.run_line(&line).succeeds();
        digests.push(place.digest(&format!("{store}.tetdb")));
    }
    assert!(digests.iter().all(|d| *d == digests[0]), "{digests:?}");
}

/// All threads evaluate improvements of bad tetrahedra speculatively. On these two samples, state left over from one evaluation would
/// change the next.
#[test]
fn threads_do_not_change_what_is_mended() {
    let place = Place::new();
    for sample in ["needles,seed=3", "caps,seed=5"] {
        let digests = [1, 3].map(|threads| {
            let store = format!("{sample}-{threads}.tetdb");
            let line = format!("mesh sample:{sample} -o {store} --threads {threads}");
            place.run_line(&line).succeeds();
            place.digest(&store)
        });
        assert_eq!(digests[0], digests[1], "{sample}");
    }
}

#[test]
fn options_that_shape_the_mesh_do_change_it() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.3 -o a.tetdb").succeeds();
    place.run_line("mesh sample:box,h=0.3 -o b.tetdb --hsiz 0.15").succeeds();
    assert_ne!(place.digest("a.tetdb"), place.digest("b.tetdb"));
}

#[test]
fn a_finished_store_is_left_as_it_is() {
    let place = Place::new();
    let line = "mesh sample:box,h=0.3 -o a.tetdb";
    place.run_line(line).succeeds();
    let digest = place.digest("a.tetdb");
    let again = place.run_line(line).succeeds();
    assert!(again.stderr().contains("already holds"), "{}", again.stderr());
    assert_eq!(place.digest("a.tetdb"), digest);

    place.run_line("mesh sample:box,h=0.3 -o a.tetdb --hsiz 0.15 --force").succeeds();
    assert_ne!(place.digest("a.tetdb"), digest);
    let names = place.names();
    assert!(names.iter().all(|n| n == "a.tetdb" || n.starts_with("a.tetdb/")), "{names:?}");
}

#[test]
fn answers_for_programs_have_their_fields() {
    let place = Place::new();
    let made = place.run_line("mesh sample:box,h=0.3 -o a.tetdb --json").succeeds().json();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    for (field, value) in info.as_object().expect("info answers an object") {
        assert_eq!(&made[field], value, "mesh and info agree on {field}");
    }
    for field in ["memory_cap_bytes", "pages_read", "pages_written"] {
        assert!(made[field].is_u64(), "{field} of {made}");
    }
    let whole = &info["subdomains"][0];
    assert_eq!((&info["schema"], &info["state"]), (&1.into(), &"verified".into()));
    assert_eq!(whole["tets"], info["tets"]);
    let bins = whole["quality"]["bins"].as_array().expect("bins are a list");
    assert_eq!(
        bins.iter().filter_map(serde_json::Value::as_u64).sum::<u64>(),
        info["tets"].as_u64().unwrap_or(0)
    );

    let proof = place.run_line("verify a.tetdb --full --json").succeeds().json();
    assert_eq!((&proof["valid"], &proof["digest"]), (&true.into(), &info["digest"]));
    assert_eq!(place.run_line("digest a.tetdb --json").json()["digest"], info["digest"]);
}
