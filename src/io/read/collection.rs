//! Every file of a folder of real surfaces, against the facts its index states.
//!
//! Called by hand: `TETDB_SURFACES=FOLDER cargo test --release --lib collection -- --ignored --nocapture`.
//! The folder's `INDEX.tsv` has the columns file, vertices (4), triangles (5), components (6), genus (7),
//! class (8) and defect (9), counted from 0.

use std::path::PathBuf;
use std::time::Instant;

use super::read_surface;
use tetdb_base::surface::{orient_alike, validate};

/// Codes that fit what the index says is wrong.
fn fitting(defect: &str) -> &'static [&'static str] {
    let table: [(&str, &[&str]); 9] = [
        ("unreadable: a coordinate", &["not-a-number"]),
        ("unreadable: file cut", &["truncated-file"]),
        ("face names a vertex", &["index-out-of-range"]),
        ("zero-area", &["degenerate-triangle"]),
        ("repeated-index", &["degenerate-triangle"]),
        // Repeated with opposite orientation they are two-sided, and what is wrong is the open rim.
        ("duplicate", &["duplicate-triangle", "open-surface"]),
        ("self-intersection", &["self-intersection"]),
        ("odd non-manifold", &["duplicate-triangle", "self-intersection", "open-surface"]),
        ("open", &["open-surface"]),
    ];
    table.iter().find(|(start, _)| defect.starts_with(start)).map_or(&[], |(_, codes)| codes)
}

#[test]
#[ignore = "needs a folder of surfaces, named by TETDB_SURFACES"]
fn the_collection_reads_and_validates_as_its_index_says() {
    let Some(folder) = std::env::var_os("TETDB_SURFACES").map(PathBuf::from) else {
        println!("skipped: TETDB_SURFACES is not set");
        return;
    };
    let index = std::fs::read_to_string(folder.join("INDEX.tsv")).expect("an INDEX.tsv");
    let mut wrong = Vec::new();
    println!(
        "{:34} {:>8} {:>8} {:>5} {:>6} {:>8} {:>8} {:>6}  result",
        "file", "vertices", "triangles", "parts", "genus", "read ms", "valid ms", "us/tri"
    );
    for row in index.lines().skip(1) {
        let column: Vec<&str> = row.split('\t').collect();
        let (name, class) = (column[0], column[8]);
        let mut raise = |what: String| wrong.push(format!("{name}: {what}"));
        let start = Instant::now();
        let surface = read_surface(&[folder.join(name)], 1 << 22);
        let read_ms = start.elapsed().as_secs_f64() * 1e3;
        let mut surface = match surface {
            Ok(surface) => surface,
            Err(e) => {
                println!("{name:34} error[{}]: {e}; {}", e.code(), e.place());
                if class != "invalid" || !fitting(column[9]).contains(&e.code().as_str()) {
                    raise(format!("refused: {e}"));
                }
                continue;
            }
        };
        let turned = if class == "invalid" { None } else { Some(orient_alike(&mut surface)) };
        let start = Instant::now();
        let found = validate(&surface);
        let valid_ms = start.elapsed().as_secs_f64() * 1e3;
        let (v, t, c) = (surface.n_vertices(), surface.n_triangles(), &found.closedness);
        let genus = c.n_components as i64 - (v as i64 - c.n_edges as i64 + t as i64) / 2;
        let us = valid_ms * 1e3 / t as f64;
        let mut codes: Vec<(&str, usize)> = Vec::new();
        for defect in &found.defects {
            match codes.iter_mut().find(|(code, _)| defect.code() == *code) {
                Some((_, n)) => *n += 1,
                None => codes.push((defect.code().as_str(), 1)),
            }
        }
        let flips = turned.as_ref().map_or(0, |o| o.flipped.len());
        println!(
            "{name:34} {v:8} {t:9} {:5} {genus:6} {read_ms:8.1} {valid_ms:8.1} {us:6.2}  {class}: {codes:?} rims {} two-sided {} non-manifold {}/{} turned {flips}",
            c.n_components,
            c.n_open_loops,
            c.two_sided.len(),
            c.n_nonmanifold,
            c.n_odd,
        );
        for note in &surface.notes {
            println!("    note: {note}");
        }
        let same = |text: &str, n: i64| text == "-" || text.parse() == Ok(n);
        // Triangles without area leave the number of parts open.
        let parts = if class == "invalid" { "-" } else { column[6] };
        if !same(column[4], v as i64)
            || !same(column[5], t as i64)
            || !same(parts, c.n_components as i64)
        {
            raise(format!("counts {v} {t} {}", c.n_components));
        }
        if class == "invalid" {
            println!("    index: {}", column[9]);
            if !column[9]
                .split("; ")
                .any(|d| fitting(d).iter().any(|code| codes.iter().any(|(c, _)| c == code)))
            {
                raise(format!("found {codes:?}"));
            }
        } else if !found.is_valid() || c.n_inconsistent > 0 || !same(column[7], genus) {
            raise(format!(
                "found {codes:?}, {} edges of one direction, genus {genus}",
                c.n_inconsistent
            ));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
