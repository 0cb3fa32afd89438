//! A mesh with more regions than 16 bits can number.
//!
//! Why: region numbers that wrap would silently join materials.
//! How: a grid of small, separate tetrahedra, each a region of its own, is meshed and verified.

use std::fmt::Write;

use super::place::Place;

/// Solids along one axis of the grid.
const SIDE: usize = 42;
const REGIONS: usize = 70_000;

#[test]
fn seventy_thousand_regions_stay_apart() {
    let place = Place::new();
    let mut text = format!("OFF\n{} {} 0\n", 4 * REGIONS, 4 * REGIONS);
    for n in 0..REGIONS {
        let corner = [n % SIDE, n / SIDE % SIDE, n / SIDE / SIDE];
        for offset in [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]] {
            let [x, y, z] = [0, 1, 2].map(|i| corner[i] as f64 + offset[i]);
            writeln!(text, "{x} {y} {z}").expect("text grows");
        }
    }
    for n in 0..REGIONS {
        for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
            let [a, b, c] = face.map(|v| v + 4 * n);
            writeln!(text, "3 {a} {b} {c}").expect("text grows");
        }
    }
    place.write("many.off", &text);
    place.run_line("mesh many.off -o many.tetdb --optimize none").succeeds();
    let info = place.run_line("info many.tetdb --json").succeeds().json();
    let regions = info["regions"].as_array().expect("a list");
    let filled: Vec<u64> = regions
        .iter()
        .filter(|r| r["filled"] == true)
        .map(|r| {
            assert!(r["tets"].as_u64() >= Some(1), "{r}");
            r["region"].as_u64().expect("a number")
        })
        .collect();
    assert_eq!(filled.len(), REGIONS);
    assert!(filled.iter().max() >= Some(&(REGIONS as u64 - 1)));
}
