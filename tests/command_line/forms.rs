//! A mesh kept as working pages is the same mesh to every reader.
//!
//! Why: `--seal none` saves the time of packing, and must not change an answer, an id or a digest.
//! How: one mesh is kept in both forms. Every reading command must report the same for both, except for bytes, also after a sub-domain
//! was meshed again.

use serde_json::Value;

use super::place::Place;

/// The answer of `info`, without values that depend on the form.
fn info(place: &Place, store: &str) -> Value {
    let mut info = place.run_line(&format!("info {store} --json")).succeeds().json();
    for key in ["store", "bytes", "catalog_bytes", "previous_bytes", "options", "journal"] {
        info[key] = Value::Null;
    }
    for part in info["subdomains"].as_array_mut().expect("a list") {
        (part["bytes"], part["state"]) = (Value::Null, Value::Null);
    }
    info
}

fn same(place: &Place) {
    assert_eq!(info(place, "pages.tetdb"), info(place, "packed.tetdb"));
    for question in [
        "--point 0.31,0.42,0.53",
        "--box 0.1,0.1,0.1,0.4,0.3,0.2 --csv",
        "--touching-surface --csv",
        "--label 0 --csv",
        "--interface 0,1 --csv",
        "--neighbors 1:7 --csv",
        "--tet 0:4095 --csv",
    ] {
        let [packed, pages] = ["packed", "pages"].map(|store| {
            let done = place.run_line(&format!("query {store}.tetdb {question}"));
            done.succeeds().stdout()
        });
        assert!(packed.lines().count() > 1, "{question}: {packed}");
        assert_eq!(pages, packed, "{question}");
    }
    let [packed, pages] = ["packed", "pages"].map(|store| {
        let line = format!("export {store}.tetdb {store}.vtu {store}.msh");
        place.run_line(&line).succeeds();
        let files = [".vtu", "_boundary.vtu", ".msh"].map(|end| format!("{store}{end}"));
        files.map(|file| std::fs::read(place.path(&file)).expect("just written"))
    });
    assert!(packed == pages, "exports differ");
    place.run_line("compare packed.tetdb pages.tetdb").succeeds();
    let against = "sample:box,h=0.045";
    place.run_line(&format!("verify pages.tetdb --full --against {against}")).succeeds();
}

#[test]
fn pages_and_chunks_are_one_mesh() {
    let place = Place::new();
    for (store, form) in [("packed", "packed"), ("pages", "none")] {
        let line = format!("mesh sample:box,h=0.045 -o {store}.tetdb --subdomains 2 --seal {form}");
        place.run_line(&line).succeeds();
    }
    same(&place);
    let state = |store: &str| {
        let info = place.run_line(&format!("info {store} --json")).succeeds().json();
        info["subdomains"][1]["state"].as_str().map(str::to_owned)
    };
    for store in ["packed.tetdb", "pages.tetdb"] {
        let line = format!("resaturate {store} --subdomain 1 --refine-by 0.8");
        place.run_line(&line).succeeds();
    }
    // A sub-domain that is meshed again keeps its form.
    assert_eq!(state("packed.tetdb").as_deref(), Some("sealed"));
    assert_eq!(state("pages.tetdb").as_deref(), Some("optimized"));
    same(&place);
    // For `mesh`, neither is a different mesh.
    let again = "mesh sample:box,h=0.045 -o pages.tetdb --subdomains 2 --no-verify";
    place.run_line(again).succeeds();
}

#[test]
fn damage_in_a_page_is_named() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.1 -o a.tetdb --seal none").succeeds();
    let file = std::fs::read_dir(place.path("a.tetdb"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .find(|path| path.to_string_lossy().contains("subdomain-"))
        .expect("a sub-domain");
    let mut bytes = std::fs::read(&file).expect("a file");
    // Pages have 64 KiB; this position is in the middle of a page of tetrahedra.
    let magic = b"TETP\x01\x00\x01\x00";
    let header = bytes.windows(magic.len()).position(|w| w == magic).expect("a page of tetrahedra");
    bytes[header - 30_000] ^= 4;
    std::fs::write(&file, bytes).expect("room");
    let done = place.run_line("verify a.tetdb --json");
    assert_eq!(done.exit(), Some(4));
    let error = done.error();
    assert_eq!(error["code"], "damaged");
    assert!(error.to_string().contains("Tets"), "{error}");
}
