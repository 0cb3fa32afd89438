//! A surface from arrays becomes a store: `cargo run --release --example mesh_arrays -- cube.tetdb`.
//!
//! The arrays here are a cube with three labels; yours come from a CAD kernel, a scan or a solver. The store keeps a copy of such a
//! surface, so that `tetdb resume` and `tetdb resaturate` work on it, too.

use std::error::Error;

use tetdb::{Existing, Length, Mesher, Regions, Sizes, Surface};

const POINTS: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

/// Corners of each side, counter-clockwise seen from outside, and its label.
const SIDES: [([u32; 4], &str); 6] = [
    ([0, 3, 2, 1], "bottom"),
    ([4, 5, 6, 7], "top"),
    ([0, 1, 5, 4], "wall"),
    ([1, 2, 6, 5], "wall"),
    ([2, 3, 7, 6], "wall"),
    ([3, 0, 4, 7], "wall"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: mesh_arrays STORE")?;

    let triangles: Vec<[u32; 3]> =
        SIDES.iter().flat_map(|([a, b, c, d], _)| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let labels: Vec<&str> = SIDES.iter().flat_map(|(_, label)| [*label; 2]).collect();

    // Twelve triangles with edges of 1 are divided first: the mesh keeps the surface's triangles as they are.
    let surface =
        Surface::from_arrays(&POINTS, &triangles, Some(&labels))?.refined(Length::units(0.2))?;
    let report = surface.check()?;
    assert!(report.is_valid() && report.n_open_edges == 0);

    let mesher = Mesher::new(surface)
        .sizes(Sizes::interior(Length::share_of_diagonal(0.05)).gradation(1.5))
        .regions(Regions::All)
        .existing(Existing::Replace);
    println!("about {:.0} tetrahedra to expect", mesher.predict()?.tets);

    // Refused before anything is written, or meshed, verified and opened.
    let store = mesher.create(&path)?;
    let summary = store.summary();
    println!(
        "{} tetrahedra in {}, worst quality {:.2}, labels {:?}, digest {}",
        summary.n_tets,
        store.path().display(),
        summary.worst_quality,
        summary.labels,
        summary.digest
    );
    assert!(summary.is_verified && summary.labels.len() == 3);
    assert!((summary.subdomains[0].volume - 1.0).abs() < 1e-9);
    Ok(())
}
