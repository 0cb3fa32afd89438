//! Shapes of the triangles: every input triangle stays, and a needle forces bad tetrahedra.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::Surface;
use super::edges::{Closedness, Groups};
use crate::storage::parallel;

/// Angles below this many degrees count as small.
const SMALL_ANGLE_DEGREES: f64 = 5.0;
/// Quality from which a tetrahedron counts as forced: the first bin of the quality table ends here.
const FORCED_QUALITY: f64 = 2.0;
/// √6/12, the inradius of the regular tetrahedron of edge length 1.
const ALPHA: f64 = 0.204_124_145_231_931_5;
/// Shapes of the triangles, and their consequences for the tetrahedra on them.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Fitness {
    /// Triangles with an angle below 5 degrees; those without area are among them.
    pub small_angles: u64,
    /// Their share of all triangles.
    pub small_angle_share: f64,
    /// The least angle, in degrees.
    pub angle_least_degrees: f64,
    /// Shortest, median and longest edge of a triangle, in input units.
    pub edge_min: f64,
    /// Median length of an edge.
    pub edge_median: f64,
    /// Length of the longest edge.
    pub edge_max: f64,
    /// Triangles on which every tetrahedron has quality 2 or worse.
    pub forcing_triangles: u64,
    /// Triangles on which every tetrahedron has quality 10 or worse.
    pub hopeless_triangles: u64,
    /// The triangle with the smallest inscribed circle for its longest edge, the first of equal ones: it allows the worst quality.
    pub worst_triangle: u32,
    /// Area of the surface, in squared input units.
    pub area: f64,
    /// Enclosed volume, each part counted positive; `None` if the surface is open.
    pub volume: Option<f64>,
}

/// Sums over triangles.
#[derive(Clone, Copy)]
struct ShapeSums {
    n_small: u64,
    angle: f64,
    low: f64,
    high: f64,
    n_forcing: u64,
    n_hopeless: u64,
    worst: (f64, u32),
}

/// Measures the shapes of all triangles.
///
/// The plane through the center of a tetrahedron's inscribed ball that is parallel to a face cuts out a smaller copy of the face
/// around a circle of the ball's radius. So the inradius is below that of each face, and quality is above
/// α · longest edge / inradius of any face.
pub fn fitness(surface: &Surface, closedness: &Closedness) -> Fitness {
    let n = surface.n_triangles();
    if n == 0 {
        return Fitness::default();
    }
    let none = ShapeSums {
        n_small: 0,
        angle: f64::INFINITY,
        low: f64::INFINITY,
        high: 0.0,
        n_forcing: 0,
        n_hopeless: 0,
        worst: (0.0, 0),
    };
    // Least and sum are free of the order of triangles, so the answer is the same for any number of threads.
    let all =
        parallel(|| (0..n as u32).into_par_iter().map(|t| shape(surface, t)).reduce(|| none, join));
    let mut lengths: Vec<f64> = parallel(|| {
        (0..n as u32).into_par_iter().flat_map_iter(|t| edge_lengths(surface, t)).collect()
    });
    let middle = lengths.len() / 2;
    let (_, median, _) = lengths.select_nth_unstable_by(middle, f64::total_cmp);
    Fitness {
        small_angles: all.n_small,
        small_angle_share: all.n_small as f64 / n as f64,
        angle_least_degrees: all.angle.to_degrees(),
        edge_min: all.low,
        edge_median: *median,
        edge_max: all.high,
        forcing_triangles: all.n_forcing,
        hopeless_triangles: all.n_hopeless,
        worst_triangle: all.worst.1,
        area: (0..n as u32).map(|t| area(surface, t)).sum(),
        volume: closedness.is_closed().then(|| volume(surface)),
    }
}

fn join(a: ShapeSums, b: ShapeSums) -> ShapeSums {
    ShapeSums {
        n_small: a.n_small + b.n_small,
        angle: a.angle.min(b.angle),
        low: a.low.min(b.low),
        high: a.high.max(b.high),
        n_forcing: a.n_forcing + b.n_forcing,
        n_hopeless: a.n_hopeless + b.n_hopeless,
        worst: match a.worst.0.total_cmp(&b.worst.0) {
            Ordering::Less => b.worst,
            Ordering::Equal if b.worst.1 < a.worst.1 => b.worst,
            _ => a.worst,
        },
    }
}

fn edge_lengths(surface: &Surface, t: u32) -> [f64; 3] {
    let [a, b, c] = surface.corners(t);
    [a.distance(b), b.distance(c), c.distance(a)]
}

fn area(surface: &Surface, t: u32) -> f64 {
    let [a, b, c] = surface.corners(t);
    0.5 * (b - a).cross(c - a).length()
}

fn shape(surface: &Surface, t: u32) -> ShapeSums {
    let lengths = edge_lengths(surface, t);
    let corners = surface.corners(t);
    let angles = [0, 1, 2].map(|i| {
        let [a, b, c] = [corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]];
        let (u, v) = (b - a, c - a);
        u.cross(v).length().atan2(u.dot(v))
    });
    let angle = angles.into_iter().fold(f64::INFINITY, f64::min);
    let high = lengths.into_iter().fold(0.0, f64::max);
    let inradius = 2.0 * area(surface, t) / lengths.iter().sum::<f64>();
    // A collapsed triangle has inradius 0, or none at all; then the quality is without bound.
    let quality = ALPHA * high / inradius;
    let is_worse = |bound: f64| u64::from(quality.is_nan() || quality >= bound);
    ShapeSums {
        n_small: u64::from(angle < SMALL_ANGLE_DEGREES.to_radians()),
        angle,
        low: lengths.into_iter().fold(f64::INFINITY, f64::min),
        high,
        n_forcing: is_worse(FORCED_QUALITY),
        n_hopeless: is_worse(10.0),
        worst: (if quality.is_nan() { f64::INFINITY } else { quality }, t),
    }
}

/// Volume enclosed, each part counted positive.
fn volume(surface: &Surface) -> f64 {
    let mut parts = Groups::new(surface.n_vertices());
    let of_shells = |t: &u32| !surface.is_sheet(*t);
    for t in (0..surface.n_triangles() as u32).filter(of_shells) {
        let [a, b, c] = &surface.triangles[t as usize];
        parts.join(*a, *b);
        parts.join(*b, *c);
    }
    let origin = surface.bounds().low;
    let mut volumes = vec![0.0f64; surface.n_vertices()];
    for t in (0..surface.n_triangles() as u32).filter(of_shells) {
        let triangle = surface.triangles[t as usize];
        let [a, b, c] = surface.corners(t).map(|p| p - origin);
        volumes[parts.root(triangle[0]) as usize] += a.dot(b.cross(c)) / 6.0;
    }
    volumes.iter().map(|v| v.abs()).sum()
}
