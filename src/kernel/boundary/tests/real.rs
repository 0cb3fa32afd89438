//! Real surfaces, when `TETDB_SURFACES` names a directory that has them.

use std::path::PathBuf;
use std::time::Instant;

use super::build::{check, check_facets, delaunay};
use crate::boundary::recover;

#[test]
#[ignore = "needs surfaces that are not in the repository"]
fn every_valid_surface_is_recovered() {
    let Ok(directory) = std::env::var("TETDB_SURFACES") else {
        eprintln!("skipped: TETDB_SURFACES is not set");
        return;
    };
    let only = std::env::var("TETDB_SURFACE").unwrap_or_default();
    let directory = PathBuf::from(directory);
    let index = std::fs::read_to_string(directory.join("INDEX.tsv")).expect("an index");
    println!(
        "{:28} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7} {:>8} {:>7} {:>7} {:>7} {:>7}",
        "surface",
        "tri",
        "mis.seg",
        "mis.fac",
        "seg.flip",
        "fac.flip",
        "fac.pts",
        "patches",
        "points",
        "steiner",
        "dt s",
        "map s",
        "flip s",
        "pts s"
    );
    let mut failed = 0;
    for line in index.lines().skip(1) {
        let fields: Vec<&str> = line.split('\t').collect();
        let (name, class) = (fields[0], fields[8]);
        if !matches!(class, "valid" | "repairable") || !name.contains(&only) {
            continue;
        }
        let surface = match tetdb_io::read::read_surface(&[directory.join(name)], 1 << 30) {
            Ok(surface) => surface,
            Err(e) => {
                println!("{name:28} not read: {e}");
                continue;
            }
        };
        let clock = Instant::now();
        let mut mesh = delaunay(&surface.points, &surface.triangles);
        let built = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        match recover(&mut mesh) {
            Ok(r) => {
                check(&mut mesh);
                check_facets(&mut mesh);
                println!(
                    "{name:28} {:8} {:8} {:8} {:8} {:8} {:8} {:7} {:7} {:8} {built:7.3} {:7.3} {:7.3} {:7.3}",
                    r.facets,
                    r.missing_segments,
                    r.missing_facets,
                    r.segments_by_flips,
                    r.facets_by_flips,
                    r.facets_by_points,
                    r.patches,
                    r.points_on_surface,
                    r.steiner,
                    r.map_time.as_secs_f64(),
                    r.flip_time.as_secs_f64(),
                    r.point_time.as_secs_f64()
                );
            }
            Err(e) => {
                failed += 1;
                check(&mut mesh);
                println!(
                    "{name:28} {:8} FAILED after {:.3} s: {e}",
                    surface.n_triangles(),
                    clock.elapsed().as_secs_f64()
                );
            }
        }
    }
    assert_eq!(failed, 0, "surfaces not recovered");
}
