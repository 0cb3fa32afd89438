//! A query, then a sub-domain chunk by chunk: `cargo run --release --example read_subdomain -- part.tetdb`.
//!
//! A chunk holds some thousands of records and is decoded once; memory stays the same however large the sub-domain is. A query
//! reads only the chunks that its answers can be in.

use std::error::Error;

use tetdb::{Order, Store};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: read_subdomain STORE")?;
    let mut store = Store::open(&path)?;

    // The three worst tetrahedra, and the one in the middle of the first sub-domain's box.
    let worst = store.query().order_by("quality", Order::Falling)?.limit(3).collect()?;
    for hit in &worst {
        let [x, y, z] = hit.centroid().to_array();
        println!("{}: quality {:.3} at {x:.3} {y:.3} {z:.3}", hit.id, hit.shape.quality);
    }
    let [low, high] = store.summary().subdomains[0].bounds;
    let middle: [f64; 3] = std::array::from_fn(|i| (low[i] + high[i]) / 2.0);
    match store.locate(&[middle])?[0] {
        Some(hit) => println!("{middle:?} lies in {}", hit.id),
        None => println!("{middle:?} lies outside of the mesh"),
    }

    let mut volume = 0.0;
    for row in &store.summary().subdomains {
        let mut part = store.subdomain(row.rank)?;
        let (mut n_tets, mut n_boundary) = (0, 0);
        for chunk in 0..part.tet_summaries().len() as u32 {
            let tets = part.tet_chunk(chunk)?;
            for tet in &tets.records {
                // Positions come from a small cache of decoded vertex chunks.
                let [a, b, c, d] = part.corners(tet.nodes)?.map(|corner| corner.point);
                volume += (b - a).cross(c - a).dot(d - a) / 6.0;
            }
            n_tets += tets.records.len() as u64;
        }
        // Input triangles of this sub-domain, with the labels that boundary conditions need.
        for chunk in part.facet_chunks() {
            n_boundary += chunk?.records.len() as u64;
        }
        assert_eq!((n_tets, n_boundary), (row.tets, row.facets));
        println!("sub-domain {}: {n_tets} tetrahedra, {n_boundary} boundary triangles", row.rank);
    }
    let recorded: f64 = store.summary().subdomains.iter().map(|r| r.volume).sum();
    assert!((volume - recorded).abs() < 1e-9 * recorded);
    println!("volume {volume:.9}");
    Ok(())
}
