//! A stiffness matrix of linear elements, one sub-domain at a time: `cargo run --release --example assembly -- part.tetdb`.
//!
//! Memory is needed for the vertices and rows of one sub-domain. Rows of vertices on an interface are complete once the parts of all
//! sub-domains that share them are added; each part alone satisfies what is checked here: constants are in the kernel, so rows sum to
//! zero, and the energy of the function u = x is the volume.

use std::collections::HashMap;
use std::error::Error;

use tetdb::data::{DVec3, Subdomain};
use tetdb::{Store, data};

/// Entries by row and column, which are vertex numbers of the sub-domain.
type Matrix = HashMap<[u32; 2], f64>;

/// Integrals of the products of gradients of two hat functions over one tetrahedron.
fn element([a, b, c, d]: [DVec3; 4]) -> [[f64; 4]; 4] {
    let (u, v, w) = (b - a, c - a, d - a);
    let det = u.dot(v.cross(w));
    let [gb, gc, gd] = [v.cross(w) / det, w.cross(u) / det, u.cross(v) / det];
    let gradients = [-(gb + gc + gd), gb, gc, gd];
    gradients.map(|g| gradients.map(|h| g.dot(h) * det / 6.0))
}

fn assemble(part: &mut Subdomain) -> Result<(Vec<DVec3>, Matrix), data::SealedError> {
    let mut points = Vec::with_capacity(part.row().vertices as usize);
    for chunk in part.vertex_chunks() {
        points.extend(chunk?.records.iter().map(|vertex| DVec3::from_array(vertex.point)));
    }
    let mut matrix = Matrix::new();
    for chunk in part.tet_chunks() {
        for tet in chunk?.records {
            let entries = element(tet.nodes.map(|v| points[v as usize]));
            for (row, entries) in tet.nodes.iter().zip(entries) {
                for (column, entry) in tet.nodes.iter().zip(entries) {
                    *matrix.entry([*row, *column]).or_default() += entry;
                }
            }
        }
    }
    Ok((points, matrix))
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: assembly STORE")?;
    let store = Store::open(&path)?;
    for row in &store.summary().subdomains {
        let (points, matrix) = assemble(&mut store.subdomain(row.rank)?)?;
        let (mut sums, mut largest, mut energy) = (vec![0.0; points.len()], 0.0_f64, 0.0);
        for ([i, j], entry) in &matrix {
            sums[*i as usize] += entry;
            largest = largest.max(entry.abs());
            energy += points[*i as usize].x * entry * points[*j as usize].x;
        }
        let sum = sums.iter().fold(0.0_f64, |most, sum| most.max(sum.abs()));
        println!(
            "sub-domain {}: {} rows, {} entries, greatest row sum {sum:.1e}, energy of x {energy:.9}, volume {:.9}",
            row.rank,
            points.len(),
            matrix.len(),
            row.volume
        );
        assert!(sum < 1e-12 * largest * 100.0, "rows sum to zero");
        assert!((energy - row.volume).abs() < 1e-9 * row.volume);
    }
    Ok(())
}
