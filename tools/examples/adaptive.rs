//! An adaptive loop: `cargo run --release --example adaptive -- box.tetdb`, a store of the unit cube such as of `sample:box`.
//!
//! A known function with a steep front stands for a solution. Each round keeps it as a field and adapts the mesh to it. The error of its
//! interpolation ends below that of a uniform mesh of as many tetrahedra; `Store::undo` would bring back the last mesh.

use std::error::Error;

use tetdb::data::DVec3;
use tetdb::{FieldPlace, FieldValues, NewField, Store};

const ROUNDS: usize = 2;
const FACTOR: f64 = 1.5;

/// A step across a sphere around the middle of the unit cube.
fn front(point: DVec3) -> f64 {
    ((point.distance(DVec3::splat(0.5)) - 0.3) / 0.08).tanh()
}

/// The number of tetrahedra, and the root mean square of the error in their middles.
fn error(store: &Store) -> Result<(f64, f64), Box<dyn Error>> {
    let (mut squares, mut volumes, mut n) = (0.0, 0.0, 0.0);
    for rank in 0..store.summary().subdomains.len() as u32 {
        let mut part = store.subdomain(rank)?;
        for chunk in 0..part.tet_summaries().len() as u32 {
            for tet in part.tet_chunk(chunk)?.records {
                let corners = part.corners(tet.nodes)?.map(|corner| corner.point);
                let [a, b, c, d] = corners;
                let volume = (b - a).dot((c - a).cross(d - a)) / 6.0;
                let mean = corners.map(front).iter().sum::<f64>() / 4.0;
                squares += volume * (mean - front((a + b + c + d) / 4.0)).powi(2);
                volumes += volume;
                n += 1.0;
            }
        }
    }
    Ok((n, (squares / volumes).sqrt()))
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: adaptive STORE")?;
    let mut store = Store::open(&path)?;
    let (n_first, first) = error(&store)?;
    println!("{n_first} tetrahedra, error {first:.5}");
    let solution = NewField::new("front", FieldPlace::Vertices);
    let (mut n, mut last) = (n_first, first);
    for _ in 0..ROUNDS {
        store.add_field(&solution, |mesh, chunk| {
            let vertices = mesh.vertex_chunk(chunk)?.records;
            let values = vertices.iter().map(|vertex| front(DVec3::from_array(vertex.point)));
            Ok(FieldValues::F64(values.collect()))
        })?;
        store = store.adapt("front").factor(FACTOR).run()?.remeshed.store;
        store.drop_field("front")?;
        (n, last) = error(&store)?;
        println!("{n} tetrahedra, error {last:.5}");
    }
    let uniform = first * (n_first / n).powf(2.0 / 3.0);
    assert!(last < 0.8 * uniform, "{last} is not below {uniform}, the error of a uniform mesh");
    Ok(())
}
