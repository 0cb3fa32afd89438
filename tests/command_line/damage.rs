//! A damaged store is detected and never trusted.
//!
//! Why: disks and copies fail silently, and a mesh with a few wrong bits looks like a mesh.
//! How: bytes of a sealed chunk, of a database file's head and of the format row are changed on disk.

use std::fs;

use redb::{Database, ReadableTable, TableDefinition};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::place::Place;

/// A finished store of a box, and the path of its only sub-domain's file.
fn finished() -> (Place, std::path::PathBuf) {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.2 -o box.tetdb").succeeds();
    let file = fs::read_dir(place.path("box.tetdb"))
        .expect("a store is a folder")
        .map(|entry| entry.expect("an entry is readable").path())
        .find(|path| path.to_string_lossy().contains("subdomain-"))
        .expect("a finished store has a sub-domain");
    (place, file)
}

#[test]
fn a_changed_byte_in_any_chunk_is_found() {
    let (place, file) = finished();
    let good = fs::read(&file).expect("the file is readable");
    // The magic of a sealed chunk follows its checksum.
    let chunks: Vec<usize> =
        (0..good.len() - 64).filter(|&i| good[i..].starts_with(b"TETC")).collect();
    assert!(chunks.len() >= 3, "tetrahedra, vertices and facets have chunks, found {chunks:?}");
    for magic in chunks {
        let mut bad = good.clone();
        bad[magic + 60] ^= 0x10;
        fs::write(&file, &bad).expect("the file is writable");
        let done = place.run_line("verify box.tetdb --json");
        let error = done.error();
        assert_eq!(
            (error["code"].as_str(), done.exit()),
            (Some("damaged"), Some(4)),
            "byte {}: {error}",
            magic + 60
        );
        assert!(
            error["message"].as_str().is_some_and(|m| m.contains("subdomain-00000")),
            "{error}"
        );
    }
    fs::write(&file, &good).expect("the file is writable");
    place.run_line("verify box.tetdb").succeeds();
}

#[test]
fn a_damaged_or_missing_database_file_is_found() {
    let (place, file) = finished();
    let good = fs::read(&file).expect("the file is readable");
    let mut bad = good.clone();
    bad[..512].fill(0xff);
    for content in [Some(&bad[..]), Some(&good[..good.len() / 2]), Some(b""), None] {
        match content {
            Some(bytes) => fs::write(&file, bytes).expect("the file is writable"),
            None => fs::remove_file(&file).expect("the file can be removed"),
        }
        let done = place.run_line("verify box.tetdb --json");
        let length = content.map(<[u8]>::len);
        assert_eq!(done.exit(), Some(4), "{length:?} bytes: {}", done.stderr());
        assert_eq!(done.error()["code"], "damaged");
    }
}

#[test]
fn another_format_version_is_refused() {
    const PAGES: TableDefinition<u64, &[u8]> = TableDefinition::new("pages");
    // The format row: a checksum seeded with the key, the magic, the version.
    const KEY: u64 = 64 << 56;
    let (place, _) = finished();
    let db =
        Database::open(place.path("box.tetdb/catalog.redb")).expect("the catalog is a redb file");
    let change = db.begin_write().expect("nobody else writes");
    {
        let mut table = change.open_table(PAGES).expect("the catalog has its table");
        let mut row = table
            .get(KEY)
            .expect("the table is readable")
            .expect("the format row")
            .value()
            .to_vec();
        let version = row.len() - 2;
        row[version..].copy_from_slice(&999_u16.to_le_bytes());
        let sum = xxh3_64_with_seed(&row[8..], KEY).to_le_bytes();
        row[..8].copy_from_slice(&sum);
        table.insert(KEY, &row[..]).expect("the table takes it");
    }
    change.commit().expect("the change is committed");
    drop(db);
    for line in [
        "info box.tetdb --json",
        "mesh sample:box,h=0.2 -o box.tetdb --json",
        "resume box.tetdb --json",
    ] {
        let done = place.run_line(line);
        let error = done.error();
        assert_eq!(
            (error["code"].as_str(), done.exit()),
            (Some("store-format"), Some(8)),
            "{line}: {error}"
        );
    }
}

/// Flips a bit in the payload of the `n`-th chunk of the file whose name starts with `begins`. Returns the name.
fn flip(place: &Place, begins: &str, generation: bool, n: usize) -> String {
    let mut names: Vec<String> = fs::read_dir(place.path("a.tetdb"))
        .expect("a store is a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with(begins))
        .collect();
    // Of two generations, the older one has the shorter name, or the lesser of equal length.
    names.sort_by_key(|name| (name.len(), name.clone()));
    let name = match generation {
        true => names.first(),
        false => names.last(),
    };
    let name = name.expect("a file").clone();
    let path = place.path(&format!("a.tetdb/{name}"));
    let mut bytes = fs::read(&path).expect("a file");
    let chunks = (0..bytes.len() - 64).filter(|&i| bytes[i..].starts_with(b"TETC"));
    let magic = chunks.clone().nth(n).expect("so many chunks");
    bytes[magic + 70] ^= 1;
    fs::write(&path, bytes).expect("room");
    name
}

#[test]
fn damage_in_what_is_only_kept_is_found_and_all_of_it_listed() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.045 -o a.tetdb --subdomains 2").succeeds();
    place.run_line("resaturate a.tetdb --subdomain 1 --refine-by 0.9").succeeds();
    place.run_line("verify a.tetdb").succeeds();
    let digest = place.digest("a.tetdb");
    let before = flip(&place, "subdomain-00001", true, 1);
    let leaf = flip(&place, "coarse-00000", true, 0);
    let refused = |line: &str, names: &[&String]| {
        let done = place.run_line(line);
        assert_eq!(done.exit(), Some(4), "{}", done.stderr());
        assert_eq!(done.error()["code"], "damaged");
        for name in names {
            assert!(done.stderr().contains(*name), "{name}: {}", done.stderr());
        }
    };
    refused("verify a.tetdb --json", &[&before, &leaf]);
    // The mesh is intact, and the dispensable files can be dropped.
    assert_eq!(place.digest("a.tetdb"), digest);
    place.run_line("query a.tetdb --point 0.1,0.2,0.3").succeeds();
    refused("resaturate a.tetdb --subdomain 0 --json", &[&leaf]);
    place.run_line("resaturate a.tetdb --forget").succeeds();
    let part = flip(&place, "subdomain-00001", false, 2);
    refused("verify a.tetdb --json", &[&part, &leaf]);
    assert!(!place.run_line("verify a.tetdb --json").stderr().contains(&before));
    // A sound coarse snapshot restores its sub-domain. The other sub-domain cannot be repaired.
    place.run_line("resaturate a.tetdb --repair --no-verify").succeeds();
    assert_eq!(place.digest("a.tetdb"), digest);
    refused("verify a.tetdb --json", &[&leaf]);
}

#[test]
fn an_older_file_of_a_part_in_the_place_of_the_newer_is_found() {
    let (place, old) = finished();
    place.run_line("resaturate box.tetdb --subdomain 0 --refine-by 0.8").succeeds();
    let files = fs::read_dir(place.path("box.tetdb")).expect("a store is a folder");
    let new = files
        .map(|entry| entry.expect("an entry is readable").path())
        .find(|path| path.to_string_lossy().contains("subdomain-") && *path != old)
        .expect("the change made a file");
    place.run_line("verify box.tetdb").succeeds();
    fs::copy(&old, &new).expect("the file is writable");
    for line in ["verify box.tetdb --json", "verify box.tetdb --full --json"] {
        let done = place.run_line(line);
        let error = done.error();
        let found = (error["code"].as_str(), done.exit());
        assert_eq!(found, (Some("damaged"), Some(4)), "{error}");
    }
}
