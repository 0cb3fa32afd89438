//! Spheres: an icosahedron whose faces are divided, its points moved out to the sphere.
//!
//! ```text
//!        a            i counts from a, j from b, k from c, i + j + k = n.
//!       / \           Each of the 20 faces is cut into n^2 triangles: 20 n^2 in all,
//!      *---*          with 10 n^2 + 2 points. Mean edge 1.21 r/n, from 0.92 to 1.33 r/n
//!     / \ / \         on fine spheres.
//!    b---*---c
//! ```

use super::build::Builder;
use super::build::triangles_checked;
use super::sample::Sample;
use super::{SampleError, random::Random};
use std::collections::{BTreeMap, HashMap};
use tetdb_base::geom::Point;

/// Arc of an edge of the icosahedron, in radii: arctan 2.
const ICOSAHEDRON_ARC: f64 = 1.107_148_717_794_090_4;
/// Fewest pieces of an icosahedron's edge: 180 triangles. With two a ball is visibly a polyhedron
/// (its volume is 16 % short, with three 8 %); with four small balls outnumber all other triangles.
const PIECES_MIN: f64 = 3.0;

/// A sphere `sphere,radius=R,h=H` around the origin.
pub(super) fn make_sphere(radius: f64, h: f64, bytes_max: u64) -> Result<Sample, SampleError> {
    let pieces = sphere_pieces(radius, h);
    triangles_checked("sphere", sphere_triangles(pieces), bytes_max)?;
    let mut build = Builder::default();
    let label = build.label("sphere");
    let mut spheres = Spheres::default();
    spheres.push(&mut build, &Ball::unturned(radius), h, false, label);
    Ok(build.finish())
}

/// Pieces of each edge of the icosahedron: arcs of about `h`, or shorter if the curvature requires it.
pub(super) fn sphere_pieces(radius: f64, h: f64) -> f64 {
    (ICOSAHEDRON_ARC * radius / h + 0.5).floor().max(PIECES_MIN)
}

/// Triangles of a sphere with that many pieces.
pub(super) fn sphere_triangles(pieces: f64) -> f64 {
    20.0 * pieces * pieces
}

/// The place and turn of a sphere or an ellipsoid.
pub(super) struct Ball {
    pub center: Point,
    /// Longest semi-axis.
    pub radius: f64,
    /// Semi-axes in units of the radius.
    pub axes: Point,
    /// Columns of a rotation.
    pub turn: [Point; 3],
}

impl Ball {
    /// Around the origin, not turned.
    pub fn unturned(radius: f64) -> Self {
        Self { center: Point::ZERO, radius, axes: Point::ONE, turn: [Point::X, Point::Y, Point::Z] }
    }

    /// Turned at random, so that many balls do not share directions.
    pub fn turned(center: Point, radius: f64, axes: Point, random: &mut Random) -> Self {
        let turn = random.rotation();
        Self { center, radius, axes, turn }
    }
}

/// Unit spheres built so far, by number of pieces.
#[derive(Default)]
pub(super) struct Spheres {
    made: BTreeMap<u32, (Vec<Point>, Vec<[u32; 3]>)>,
}

impl Spheres {
    /// Adds the surface of `ball` with edges of about `h`.
    pub fn push(&mut self, build: &mut Builder, ball: &Ball, h: f64, inward: bool, label: u32) {
        let pieces = sphere_pieces(ball.radius, h) as u32;
        let (points, triangles) = self.made.entry(pieces).or_insert_with(|| unit_sphere(pieces));
        let [x, y, z] = ball.turn;
        let ids: Vec<u32> = points
            .iter()
            .map(|&p| p * ball.axes)
            .map(|p| build.point(ball.center + (x * p.x + y * p.y + z * p.z) * ball.radius))
            .collect();
        for t in triangles {
            build.triangle(t.map(|v| ids[v as usize]), inward, label);
        }
    }
}

/// Points and outward triangles of the unit sphere.
fn unit_sphere(n: u32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let corners = icosahedron_corners();
    let mut points = corners.to_vec();
    let mut triangles = Vec::new();
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for face in icosahedron_faces(&corners) {
        for (a, b) in [(0, 1), (1, 2), (0, 2)] {
            let (low, high) = sorted(face[a], face[b]);
            edges.entry((low, high)).or_insert_with(|| {
                let first = points.len() as u32;
                points.extend((1..n).map(|i| between(&corners, [low, high, high], [n - i, i, 0])));
                first
            });
        }
        let rows = face_rows(face, n, &corners, &edges, &mut points);
        for (upper, lower) in rows.iter().zip(&rows[1..]) {
            for i in 0..upper.len() {
                triangles.push([upper[i], lower[i], lower[i + 1]]);
                if i + 1 < upper.len() {
                    triangles.push([upper[i], lower[i + 1], upper[i + 1]]);
                }
            }
        }
    }
    (points, triangles)
}

/// Point ids of a face, row by row from its first corner; inner points are added here.
fn face_rows(
    face: [u32; 3],
    n: u32,
    corners: &[Point; 12],
    edges: &HashMap<(u32, u32), u32>,
    points: &mut Vec<Point>,
) -> Vec<Vec<u32>> {
    let on_edge = |a: u32, b: u32, steps_from_a: u32| {
        let (low, high) = sorted(a, b);
        let from_low = if a == low { steps_from_a } else { n - steps_from_a };
        match from_low {
            0 => low,
            s if s == n => high,
            s => edges[&(low, high)] + s - 1,
        }
    };
    let [a, b, c] = face;
    (0..=n)
        .map(|row| {
            (0..=row)
                .map(|k| match (row, k) {
                    (row, 0) => on_edge(a, b, row),
                    (row, k) if k == row => on_edge(a, c, row),
                    (row, k) if row == n => on_edge(b, c, k),
                    (row, k) => {
                        points.push(between(corners, face, [n - row, row - k, k]));
                        (points.len() - 1) as u32
                    }
                })
                .collect()
        })
        .collect()
}

fn sorted(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// The weighted mean of three corners, moved out to the unit sphere.
fn between(corners: &[Point; 12], face: [u32; 3], weights: [u32; 3]) -> Point {
    let term = |i: usize| corners[face[i] as usize] * f64::from(weights[i]);
    let p = term(0) + term(1) + term(2);
    p / p.length()
}

fn icosahedron_corners() -> [Point; 12] {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let norm = (1.0 + golden * golden).sqrt();
    let (s, l) = (1.0 / norm, golden / norm);
    std::array::from_fn(|i| {
        let s = if i & 1 == 0 { s } else { -s };
        let l = if i & 2 == 0 { l } else { -l };
        match i / 4 {
            0 => Point::new(0.0, s, l),
            1 => Point::new(s, l, 0.0),
            _ => Point::new(l, 0.0, s),
        }
    })
}

/// The 20 faces, outward: all triples of corners pairwise at the distance of an edge.
fn icosahedron_faces(corners: &[Point; 12]) -> Vec<[u32; 3]> {
    // Squared distances between corners are 1.11, 2.89 and 4.
    let near = |a: usize, b: usize| corners[a].distance_squared(corners[b]) < 2.0;
    let mut faces = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outward = corners[a].dot(corners[b].cross(corners[c])) > 0.0;
                    let (b, c) = if outward { (b, c) } else { (c, b) };
                    faces.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    faces
}
