//! Solids that are known to be hard, each for a reason given at its constructor.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use tetdb_base::geom::Point;

use super::plane::triangulated;
use super::random::Random;
use super::shape::Shape;

/// A stack of `layers` prisms over a regular polygon of `n` corners, each turned by `twist` against the one below.
///
/// The sides are cut along the diagonal the twist pushes inward: with three corners and one layer this is Schönhardt's
/// polyhedron, which has no tetrahedra without further points.
pub fn twisted(n: u32, layers: u32, twist: f64, height: f64) -> Shape {
    let mut s = Shape::new(format!("{layers} prisms of {n} sides turned by {twist}"));
    for k in 0..=layers {
        for i in 0..n {
            let t = f64::from(i) / f64::from(n) * TAU + twist * f64::from(k);
            s.point(t.cos(), t.sin(), height * f64::from(k));
        }
    }
    let top = n * layers;
    for i in 1..n - 1 {
        s.triangles.push([0, i + 1, i]);
        s.triangles.push([top, top + i, top + i + 1]);
    }
    for k in 0..layers {
        for i in 0..n {
            let (a, b) = (n * k + i, n * k + (i + 1) % n);
            s.quad([a, b, b + n, a + n], twist > 0.0);
        }
    }
    s
}

/// `shells` copies of a shape inside each other, each `ratio` the size of the one around it.
pub fn nested(shape: &Shape, shells: u32, ratio: f64) -> Shape {
    let low = shape.points.iter().fold(Point::INFINITY, |m, &p| m.min(p));
    let high = shape.points.iter().fold(Point::NEG_INFINITY, |m, &p| m.max(p));
    let center = (low + high) * 0.5;
    let mut all = Shape::new(format!("{shells} nested: {}", shape.name));
    for k in 0..shells {
        let by = ratio.powi(k as i32);
        all = all.with(&shape.clone().mapped(|p| center + (p - center) * by));
    }
    all
}

/// Chazelle's polyhedron with `n + 1` notches from below and from above whose tips lie on two saddles `2 gap` apart.
///
/// Any tetrahedra inside need of the order of n² points (B. Chazelle, "Convex partitions of polyhedra", 1984).
pub fn chazelle(n: u32, gap: f64) -> Shape {
    let mut s = Shape::new(format!("Chazelle's polyhedron {n} gap {gap:e}"));
    let w = f64::from(n);
    let depth = w * w + 2.0;
    // Tips and bases alternate: below they run along x, above along y.
    let strip = |s: &mut Shape, above: bool| -> Vec<[u32; 2]> {
        (0..=2 * n)
            .map(|k| {
                let at = f64::from(k) / 2.0;
                let tip = k % 2 == 0;
                [0.0, w].map(|end| match (tip, above) {
                    (true, false) => s.point(end, at, end * at - gap),
                    (true, true) => s.point(at, end, end * at + gap),
                    (false, false) => s.point(end, at, -depth),
                    (false, true) => s.point(at, end, w * w + depth),
                })
            })
            .collect()
    };
    let below = strip(&mut s, false);
    let above = strip(&mut s, true);
    for rows in [&below, &above] {
        for (k, pair) in rows.windows(2).enumerate() {
            let ([a, b], [d, c]) = (pair[0], pair[1]);
            // Cut either way, a strip stays on its side of the saddle.
            s.quad([a, b, c, d], k % 2 == 0);
        }
    }
    // The four walls are polygons in the planes x = 0, x = w, y = 0, y = w.
    for end in 0..2 {
        let mut wall: Vec<u32> = below.iter().map(|r| r[end]).collect();
        wall.extend(if end == 0 { above[0] } else { above[2 * n as usize] }.iter().rev());
        wall_of(&mut s, &wall, [1, 2]);
        let mut wall: Vec<u32> = above.iter().map(|r| r[end]).collect();
        wall.extend(if end == 0 { below[0] } else { below[2 * n as usize] }.iter().rev());
        wall_of(&mut s, &wall, [0, 2]);
    }
    s
}

/// Fills a polygon that lies in a plane of two axes.
fn wall_of(s: &mut Shape, polygon: &[u32], axes: [usize; 2]) {
    let flat: Vec<[f64; 2]> =
        polygon.iter().map(|&v| axes.map(|axis| s.points[v as usize].to_array()[axis])).collect();
    for t in triangulated(&flat) {
        s.triangles.push(t.map(|i| polygon[i]));
    }
}

/// The surface of a box of `n[0] * n[1] * n[2]` cells; `diagonal(x, y, face)` selects the diagonal that cuts a square.
///
/// The points of a grid are cospherical by dozens, so most diagonals are chosen by ties, and most of these choices are wrong.
pub fn grid(n: [u32; 3], mut diagonal: impl FnMut(u32, u32, usize) -> bool) -> Shape {
    let mut s = Shape::new(format!("grid {n:?}"));
    let mut ids: HashMap<[u32; 3], u32> = HashMap::new();
    for face in 0..6 {
        let (axis, high) = (face / 2, face % 2 == 1);
        let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
        for u in 0..n[u_axis] {
            for v in 0..n[v_axis] {
                let mut corner = [(u, v), (u + 1, v), (u + 1, v + 1), (u, v + 1)].map(|(u, v)| {
                    let mut p = [0; 3];
                    p[axis] = if high { n[axis] } else { 0 };
                    (p[u_axis], p[v_axis]) = (u, v);
                    *ids.entry(p).or_insert_with(|| {
                        let [x, y, z] = p.map(f64::from);
                        s.point(x, y, z)
                    })
                });
                if !high {
                    corner.reverse();
                }
                s.quad(corner, diagonal(u, v, face));
            }
        }
    }
    s
}

/// A sphere of rings and meridians: cocircular along each, cospherical as a whole.
pub fn globe(rings: u32, around: u32, random: &mut Random) -> Shape {
    let mut s = Shape::new(format!("globe {rings} by {around}"));
    let (south, north) = (s.point(0.0, 0.0, -1.0), s.point(0.0, 0.0, 1.0));
    for r in 1..=rings {
        let t = PI * (f64::from(r) / f64::from(rings + 1) - 0.5);
        for k in 0..around {
            let u = TAU * f64::from(k) / f64::from(around);
            s.point(t.cos() * u.cos(), t.cos() * u.sin(), t.sin());
        }
    }
    let id = |r: u32, k: u32| 2 + r * around + k % around;
    for k in 0..around {
        s.triangles.push([south, id(0, k + 1), id(0, k)]);
        s.triangles.push([north, id(rings - 1, k), id(rings - 1, k + 1)]);
        for r in 0..rings - 1 {
            let corner = [id(r, k), id(r, k + 1), id(r + 1, k + 1), id(r + 1, k)];
            s.quad(corner, random.one_in(2));
        }
    }
    s
}

/// A cylinder whose caps are fans from a corner, all in one plane each.
pub fn cylinder(around: u32, rows: u32, height: f64, random: &mut Random) -> Shape {
    let mut s = Shape::new(format!("cylinder {around} by {rows} height {height:e}"));
    for r in 0..=rows {
        for k in 0..around {
            let u = TAU * f64::from(k) / f64::from(around);
            s.point(u.cos(), u.sin(), height * f64::from(r) / f64::from(rows));
        }
    }
    let top = rows * around;
    for k in 1..around - 1 {
        s.triangles.push([0, k + 1, k]);
        s.triangles.push([top, top + k, top + k + 1]);
    }
    for r in 0..rows {
        for k in 0..around {
            let (a, b) = (r * around + k, r * around + (k + 1) % around);
            s.quad([a, b, b + around, a + around], random.one_in(2));
        }
    }
    s
}

/// An icosahedron whose triangles are divided in four `levels` times, all corners moved to the sphere.
pub fn icosphere(levels: u32) -> Shape {
    let mut s = Shape::new(format!("icosphere {levels}"));
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    for [x, y] in [[1.0, g], [-1.0, g], [1.0, -g], [-1.0, -g]] {
        s.point(x, y, 0.0);
        s.point(0.0, x, y);
        s.point(y, 0.0, x);
    }
    // The faces are the triples of neighbors at distance two.
    let near = |a: u32, b: u32| s.points[a as usize].distance(s.points[b as usize]) < 2.1;
    let mut triangles = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    triangles.push([a, b, c]);
                }
            }
        }
    }
    s.triangles = triangles;
    for _ in 0..levels {
        let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in std::mem::take(&mut s.triangles) {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
                *middle.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    let [x, y, z] =
                        ((s.points[p as usize] + s.points[q as usize]) * 0.5).to_array();
                    s.point(x, y, z)
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        s.triangles = finer;
    }
    s.mapped(|p| p / p.length())
}

/// `n` tetrahedra around one edge like the pages of a book, each `angle` thick, with gaps of `gap` between them.
///
/// All share the edge, which therefore has 2n triangles. The angles may be arbitrarily small.
pub fn book(n: u32, angle: f64, gap: f64) -> Shape {
    let mut s = Shape::new(format!("book of {n} pages of {angle:e} rad"));
    let (a, b) = (s.point(0.0, 0.0, 0.0), s.point(0.0, 0.0, 1.0));
    for k in 0..n {
        let at = f64::from(k) * (angle + gap);
        let c = s.point(at.cos(), at.sin(), 0.3);
        let d = s.point((at + angle).cos(), (at + angle).sin(), 0.7);
        s.triangles.extend([[a, c, b], [a, b, d], [a, d, c], [b, c, d]]);
    }
    s
}

/// A wedge of the given angle whose sharp edge and slopes are divided into `n` pieces.
pub fn wedge(n: u32, angle: f64, random: &mut Random) -> Shape {
    let mut s = Shape::new(format!("wedge of {angle:e} rad in {n} pieces"));
    let row = |s: &mut Shape, x: f64, z: f64| -> Vec<u32> {
        (0..=n).map(|k| s.point(x, f64::from(k) / f64::from(n), z)).collect()
    };
    let edge = row(&mut s, 0.0, 0.0);
    let low = row(&mut s, 1.0, 0.0);
    let high = row(&mut s, 1.0, angle.tan());
    for k in 0..n as usize {
        for [p, q] in [[&edge, &high], [&low, &edge], [&high, &low]] {
            s.quad([p[k], q[k], q[k + 1], p[k + 1]], random.one_in(2));
        }
    }
    let n = n as usize;
    s.triangles.extend([[edge[0], low[0], high[0]], [edge[n], high[n], low[n]]]);
    s
}

/// The cells of a pattern, row by row, extruded: letters and plates with holes. `#` is a cell.
pub fn extruded(rows: &[&str], depth: f64, random: &mut Random) -> Shape {
    let mut s = Shape::new(format!("letters {depth:e} deep"));
    let filled = |x: i64, y: i64| {
        usize::try_from(y)
            .ok()
            .and_then(|y| rows.get(y))
            .and_then(|r| usize::try_from(x).ok().and_then(|x| r.as_bytes().get(x)))
            .is_some_and(|&c| c == b'#')
    };
    let mut ids: HashMap<(i64, i64, bool), u32> = HashMap::new();
    let mut id = |s: &mut Shape, (x, y, top): (i64, i64, bool)| {
        *ids.entry((x, y, top))
            .or_insert_with(|| s.point(x as f64, -y as f64, if top { depth } else { 0.0 }))
    };
    for y in 0..rows.len() as i64 {
        for x in 0..rows[y as usize].len() as i64 {
            if !filled(x, y) {
                continue;
            }
            let corner = [(x, y + 1), (x + 1, y + 1), (x + 1, y), (x, y)];
            let [bottom, top] = [false, true].map(|up| corner.map(|(x, y)| id(&mut s, (x, y, up))));
            s.quad([bottom[3], bottom[2], bottom[1], bottom[0]], random.one_in(2));
            s.quad(top, random.one_in(2));
            let outside = [(x, y + 1), (x + 1, y), (x, y - 1), (x - 1, y)];
            for (k, (x, y)) in outside.into_iter().enumerate() {
                let l = (k + 1) % 4;
                if !filled(x, y) {
                    s.quad([bottom[k], bottom[l], top[l], top[k]], random.one_in(2));
                }
            }
        }
    }
    s
}

/// An extruded polygon whose two ends have as few triangles as possible.
pub fn pulled(name: &str, outline: &[[f64; 2]], depth: f64) -> Shape {
    let mut s = Shape::new(format!("{name} {depth:e} deep"));
    let n = outline.len() as u32;
    for z in [0.0, depth] {
        for &[x, y] in outline {
            s.point(x, y, z);
        }
    }
    for [a, b, c] in triangulated(outline).into_iter().map(|t| t.map(|i| i as u32)) {
        s.triangles.extend([[a, c, b], [a + n, b + n, c + n]]);
    }
    for i in 0..n {
        let j = (i + 1) % n;
        s.quad([i, j, j + n, i + n], i % 2 == 0);
    }
    s
}

/// The next double away from zero.
pub fn next_up(x: f64) -> f64 {
    f64::from_bits(x.to_bits() + 1)
}

/// A grid on a cube with many triangles divided at a point a few bits away from a corner.
pub fn twins(n: u32, random: &mut Random) -> Shape {
    let mut s = grid([n; 3], |x, y, _| (x + y).is_multiple_of(2));
    s.name = format!("cube of {n} with twin vertices");
    s = s.mapped(|p| p + Point::ONE);
    let mut done: Vec<bool> = vec![false; s.points.len()];
    for t in 0..s.triangles.len() {
        let [a, b, c] = s.triangles[t];
        if done[a as usize] || done[b as usize] || done[c as usize] || random.one_in(3) {
            continue;
        }
        // A new corner next to `a`, inside the triangle, as near as doubles of this size allow.
        let [p, q, r] = [a, b, c].map(|v| s.points[v as usize]);
        let step = (f64::from(n) + 1.0).log2().floor().exp2() * f64::EPSILON;
        let [x, y, z] = (p + ((q - p) * 2.0 + (r - p)) * step).to_array();
        let d = s.point(x, y, z);
        s.triangles[t] = [a, b, d];
        s.triangles.extend([[b, c, d], [c, a, d]]);
        for v in [a, b, c] {
            done[v as usize] = true;
        }
    }
    s
}
