//! A store that is not what was written is found out, never trusted.
//!
//! Why: disks and copies fail silently, and a mesh with a few wrong bits looks like a mesh.
//! How: bytes of a sealed chunk, of a database file's head and of the format row are changed behind the program's back.

use std::fs;

use redb::{Database, ReadableTable, TableDefinition};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::place::Place;

/// A finished store of a box, and the path of its one sub-domain.
fn finished() -> (Place, std::path::PathBuf) {
    let place = Place::new();
    place
        .run_line("mesh sample:box,h=0.2 -o box.tetdb")
        .succeeds();
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
    // The magic of a sealed chunk stands behind its checksum.
    let chunks: Vec<usize> = (0..good.len() - 64)
        .filter(|&i| good[i..].starts_with(b"TETC"))
        .collect();
    assert!(
        chunks.len() >= 3,
        "tetrahedra, vertices and facets have chunks, found {chunks:?}"
    );
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
            error["message"]
                .as_str()
                .is_some_and(|m| m.contains("subdomain-00000")),
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
    for content in [
        Some(&bad[..]),
        Some(&good[..good.len() / 2]),
        Some(b""),
        None,
    ] {
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
    // The format row: a checksum that knows the key, the magic, the version.
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
