//! Signs: what the filter decides, what whole numbers decide, and what expansions cost instead.
//!
//! `cargo bench --bench predicates`; with `-- --test` each runs once.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use robust::Coord3D;
use tetdb_base::geom::{Point, insphere, orient};

/// Seeded, uniform in [-0.5, 0.5).
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 9u64;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }
}

fn sets(mut make: impl FnMut() -> Point) -> Vec<[Point; 5]> {
    (0..1000).map(|_| [0; 5].map(|_| make())).collect()
}

fn coordinates(p: Point) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

fn signs(c: &mut Criterion) {
    let mut next = numbers();
    let random = sets(|| Point::new(next(), next(), next()));
    let mut next = numbers();
    let center = Point::new(0.31, 0.77, 0.13);
    let on_sphere = sets(|| center + Point::new(next(), next(), next()).normalize() * 0.05);
    let mut next = numbers();
    let on_grid = sets(|| (Point::new(next(), next(), next()) * 8.0).round());
    for (name, points) in
        [("random", &random), ("on one sphere", &on_sphere), ("on a grid", &on_grid)]
    {
        c.bench_function(&format!("1000 insphere, {name}"), |b| {
            b.iter(|| {
                let signs = points.iter().map(|&[a, b, c, d, e]| insphere(a, b, c, d, e));
                black_box(signs.filter(|&x| x > 0.0).count())
            });
        });
        c.bench_function(&format!("1000 insphere by expansions, {name}"), |b| {
            b.iter(|| {
                let signs = points.iter().map(|p| {
                    let [a, b, c, d, e] = p.map(coordinates);
                    robust::insphere(a, b, c, d, e)
                });
                black_box(signs.filter(|&x| x < 0.0).count())
            });
        });
        c.bench_function(&format!("1000 orient, {name}"), |b| {
            b.iter(|| {
                let signs = points.iter().map(|&[a, b, c, d, _]| orient(a, b, c, d));
                black_box(signs.filter(|&x| x > 0.0).count())
            });
        });
    }
}

criterion_group!(benches, signs);
criterion_main!(benches);
