//! Small random cases: solids cut, tilted, divided, flattened, shaken.

use std::collections::HashMap;

use tetdb_base::geom::Point;

use super::random::Random;
use super::shape::Shape;
use super::solids::{book, chazelle, cylinder, globe, grid, icosphere, nested, twisted, wedge};

/// Case number `n` of a seed.
pub fn draw(seed: u64, n: u64) -> Shape {
    let mut random = Random::new(seed.wrapping_mul(0x9FB2_1C65_1E98_DF25) ^ n);
    let random = &mut random;
    let mut s = base(random);
    for _ in 0..random.below(4) {
        s = step(s, random);
    }
    if random.one_in(3) {
        s = s.turned(random);
    }
    if random.one_in(6) {
        s = s.scaled(10f64.powf(random.between(-9.0, 9.0)));
    }
    if random.one_in(12) {
        let far = 10f64.powf(random.between(0.0, 6.0));
        s = s.moved(Point::new(far, -far * 0.7, far * 0.3));
    }
    if random.one_in(2) {
        s = s.shuffled(random);
    }
    s.named(&format!(" (seed {seed} case {n})"))
}

fn base(random: &mut Random) -> Shape {
    let sign = if random.one_in(2) { 1.0 } else { -1.0 };
    match random.below(12) {
        0..=2 => {
            let n = [(); 3].map(|()| 1 + random.below(4) as u32);
            let way = random.below(3);
            grid(n, |x, y, _| match way {
                0 => true,
                1 => (x + y).is_multiple_of(2),
                _ => random.one_in(2),
            })
        }
        3 | 4 => {
            let (n, layers) = (3 + random.below(6) as u32, 1 + random.below(3) as u32);
            let limit = std::f64::consts::PI * (1.0 - 2.0 / f64::from(n));
            let height = 10f64.powf(random.between(-2.0, 2.0));
            twisted(n, layers, sign * limit * random.between(0.0, 0.97), height)
        }
        5 => nested(&base(random), 2 + random.below(3) as u32, random.between(0.3, 0.95)),
        6 => chazelle(1 + random.below(2) as u32, 10f64.powf(random.between(-4.0, 0.0))),
        7 => {
            let (rings, around) = (1 + random.below(5) as u32, 3 + random.below(8) as u32);
            globe(rings, around, random)
        }
        8 => {
            let (around, rows) = (3 + random.below(8) as u32, 1 + random.below(3) as u32);
            let height = 10f64.powf(random.between(-3.0, 3.0));
            cylinder(around, rows, height, random)
        }
        9 => icosphere(random.below(2) as u32),
        10 => {
            let angle = 10f64.powf(random.between(-6.0, -0.5));
            book(1 + random.below(4) as u32, angle, angle)
        }
        _ => {
            let angle = 10f64.powf(random.between(-6.0, 0.0));
            wedge(1 + random.below(5) as u32, angle, random)
        }
    }
}

/// Applies one change. Changes that keep the shape valid are likely; others are left to the validator.
fn step(s: Shape, random: &mut Random) -> Shape {
    match random.below(7) {
        // Triangles get a point inside, in their plane or nearly.
        0 => {
            let bulge = if random.one_in(2) { 0.0 } else { random.between(-1e-3, 1e-3) };
            divided_inside(s, bulge, random)
        }
        // Edges are divided, together with both of their triangles.
        1 => divided_edges(s, random),
        // Edges are flipped in their quadrilaterals.
        2 => turned_edges(s, random),
        // All points are moved a little.
        3 => {
            let by = 10f64.powf(random.between(-16.0, -1.5));
            s.mapped(|p| p + Point::new(1.0, 1.0, 1.0).map(|_| random.between(-by, by)))
        }
        // The shape is tilted and squeezed.
        4 => {
            let (a, b) = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            s.mapped(|p| Point::new(p.x + a * p.z, p.y + b * p.z, p.z))
        }
        5 => {
            let by = 10f64.powf(random.between(-6.0, 0.0));
            let axis = random.below(3);
            s.mapped(|mut p| {
                p[axis] *= by;
                p
            })
        }
        // Coordinates are moved to a coarse lattice, which creates new ties.
        _ => {
            let steps = f64::from(1u32 << random.below(20));
            s.mapped(|p| (p * steps).round() / steps)
        }
    }
    .named("*")
}

fn divided_inside(mut s: Shape, bulge: f64, random: &mut Random) -> Shape {
    for t in 0..s.triangles.len() {
        if !random.one_in(4) {
            continue;
        }
        let [a, b, c] = s.triangles[t];
        let [p, q, r] = [a, b, c].map(|v| s.points[v as usize]);
        let (u, v) = (random.between(0.05, 0.45), random.between(0.05, 0.45));
        let [x, y, z] = (p + (q - p) * u + (r - p) * v + (q - p).cross(r - p) * bulge).to_array();
        let d = s.point(x, y, z);
        s.triangles[t] = [a, b, d];
        s.triangles.extend([[b, c, d], [c, a, d]]);
    }
    s
}

/// For each edge, the triangles that have it.
fn edges(s: &Shape) -> Vec<([u32; 2], Vec<usize>)> {
    let mut edges: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (t, f) in s.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push(t);
        }
    }
    let mut edges: Vec<_> = edges.into_iter().collect();
    edges.sort_unstable();
    edges
}

fn divided_edges(mut s: Shape, random: &mut Random) -> Shape {
    let mut touched = vec![false; s.triangles.len()];
    for ([a, b], around) in edges(&s) {
        if !random.one_in(4) || around.iter().any(|&t| touched[t]) {
            continue;
        }
        let (p, q) = (s.points[a as usize], s.points[b as usize]);
        let [x, y, z] = (p + (q - p) * random.between(0.1, 0.9)).to_array();
        let m = s.point(x, y, z);
        for t in around {
            touched[t] = true;
            let f = s.triangles[t];
            s.triangles[t] = f.map(|v| if v == a { m } else { v });
            s.triangles.push(f.map(|v| if v == b { m } else { v }));
        }
    }
    s
}

fn turned_edges(mut s: Shape, random: &mut Random) -> Shape {
    let mut touched = vec![false; s.triangles.len()];
    let known: std::collections::HashSet<[u32; 2]> = edges(&s).into_iter().map(|e| e.0).collect();
    for ([a, b], around) in edges(&s) {
        let [t, u] = around[..] else { continue };
        if !random.one_in(3) || touched[t] || touched[u] {
            continue;
        }
        let apex = |f: [u32; 3]| f.into_iter().find(|&v| v != a && v != b);
        let (Some(c), Some(d)) = (apex(s.triangles[t]), apex(s.triangles[u])) else {
            continue;
        };
        if c == d || known.contains(&[c.min(d), c.max(d)]) {
            continue;
        }
        touched[t] = true;
        touched[u] = true;
        s.triangles[t] = s.triangles[t].map(|v| if v == b { d } else { v });
        s.triangles[u] = s.triangles[u].map(|v| if v == a { c } else { v });
    }
    s
}
