//! An adaptive loop: `cargo run --release --example adaptive -- part.tetdb`, a store of several sub-domains.
//!
//! A known function with a steep front stands for a solution. How far its mean over a tetrahedron's corners is from its value in the
//! middle stands for an error indicator. Where that is large, the last sub-domain gets shorter edges; interfaces and all other
//! sub-domains stay as they are, and `Store::undo` would bring back the last mesh.

use std::error::Error;

use tetdb::Store;
use tetdb::data::DVec3;

const ROUNDS: usize = 3;
const TOLERANCE: f64 = 0.005;

/// A step across a sphere around `center`.
fn front(point: DVec3, center: DVec3, radius: f64) -> f64 {
    ((point.distance(center) - radius) / (0.3 * radius)).tanh()
}

/// For each tetrahedron of a sub-domain, in the order in which they are read: its error, and the length wanted there.
fn errors_and_lengths(store: &Store, rank: u32) -> Result<(f64, Vec<f64>), Box<dyn Error>> {
    let mut part = store.subdomain(rank)?;
    let [low, high] = part.row().bounds.map(DVec3::from_array);
    let (center, radius) = ((low + high) / 2.0, 0.2 * low.distance(high));
    let (mut squares, mut lengths) = (0.0, Vec::new());
    for chunk in 0..part.tet_summaries().len() as u32 {
        for tet in part.tet_chunk(chunk)?.records {
            let [a, b, c, d] = part.corners(tet.nodes)?.map(|corner| corner.point);
            let mean = [a, b, c, d].map(|p| front(p, center, radius));
            let mean = mean.iter().sum::<f64>() / 4.0;
            let error = (mean - front((a + b + c + d) / 4.0, center, radius)).abs();
            let edges = [b - a, c - a, d - a, c - b, d - b, d - c].map(DVec3::length);
            let edge = edges.iter().sum::<f64>() / 6.0;
            // The error falls with the square of the length; one round changes it by 0.6 at most.
            let change = (TOLERANCE / error.max(1e-12)).sqrt().clamp(0.6, 1.0);
            lengths.push(edge * change);
            squares += error * error;
        }
    }
    Ok(((squares / lengths.len() as f64).sqrt(), lengths))
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: adaptive STORE")?;
    let mut store = Store::open(&path)?;
    let rank = store.summary().subdomains.len() as u32 - 1;
    let others: Vec<_> = store.summary().subdomains[..rank as usize].to_vec();

    let (first, mut lengths) = errors_and_lengths(&store, rank)?;
    let mut last = first;
    println!("{} tetrahedra, error {first:.5}", lengths.len());
    for _ in 0..ROUNDS {
        let remesh = store.remesh().subdomains(&[rank]).lengths_of_tets(lengths);
        store = remesh.run()?.store;
        (last, lengths) = errors_and_lengths(&store, rank)?;
        println!("{} tetrahedra, error {last:.5}", lengths.len());
    }
    assert!(last < 0.75 * first, "the error falls");
    for (before, now) in others.iter().zip(&store.summary().subdomains) {
        assert_eq!(before.digest, now.digest, "sub-domain {}", now.rank);
    }
    Ok(())
}
