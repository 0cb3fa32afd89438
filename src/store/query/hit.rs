//! A tetrahedron as an answer, and its named values.

use tetdb_schema::field::Scalar;
use tetdb_schema::ids::TetId;

use crate::sealed::Shape;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::shape::excess;
use tetdb_schema::chunk::TetSummary;

/// Names in expressions, and values by which answers may be ordered. Lengths and volumes are in the units of the input, `x y z` are those
/// of the centroid, angles are dihedral ones in degrees; `excess` is the
/// quality over the least that the tetrahedron's faces on the surface allow.
pub const VARIABLES: [&str; 12] = [
    "quality",
    "region",
    "subdomain",
    "volume",
    "x",
    "y",
    "z",
    "edge_min",
    "edge_max",
    "angle_min",
    "angle_max",
    "excess",
];

/// Most numbers of fields in one answer.
pub const EXTRA_MAX: usize = 9;

/// Places of `edge_min` and `angle_min` among the [`VARIABLES`]; each is followed by its greatest.
const EDGE_MIN: usize = 7;
const ANGLE_MIN: usize = 9;
const _: () = assert!(matches!(VARIABLES[EDGE_MIN].as_bytes(), b"edge_min"));
const _: () = assert!(matches!(VARIABLES[ANGLE_MIN].as_bytes(), b"angle_min"));

/// The place of `excess` among the [`VARIABLES`]: the one that needs the surface.
pub(super) const EXCESS: usize = VARIABLES.len() - 1;

/// The variables that may be no number: of a tetrahedron so flat that a face has no area in doubles, or so large that a product overflows.
pub(super) const NAN_AT: [bool; VARIABLES.len()] =
    [false, false, false, true, false, false, false, false, false, true, true, true];

/// A tetrahedron in an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Id of the tetrahedron.
    pub id: TetId,
    /// Number of its region.
    pub region: u32,
    /// Lasting ids of its vertices, as numbers; positive volume in this order.
    pub vertices: [u64; 4],
    /// Positions of its vertices, parallel to `vertices`.
    pub corners: [Point; 4],
    /// Quality, volume, edges and angles.
    pub shape: Shape,
    /// True for the faces that are input triangles, each opposite the vertex of its place; known for questions about excess.
    pub on_surface: Option<[bool; 4]>,
    /// Values of the variables of [`Selection::extra`](super::Selection::extra); zeros behind them.
    pub extra: [Scalar; EXTRA_MAX],
}

impl Hit {
    /// A hit with its shape measured.
    pub fn new(id: TetId, region: u32, vertices: [u64; 4], corners: [Point; 4]) -> Self {
        Self {
            id,
            region,
            vertices,
            corners,
            shape: Shape::new(corners),
            on_surface: None,
            extra: [Scalar::Float(0.0); EXTRA_MAX],
        }
    }

    /// The mean of its corners.
    pub fn centroid(&self) -> Point {
        let [a, b, c, d] = self.corners;
        (a + b + c + d) * 0.25
    }

    /// Least and greatest edge length.
    pub fn edges(&self) -> [f64; 2] {
        let [a, b, c, d] = self.corners;
        let lengths = [b - a, c - a, d - a, c - b, d - b, d - c].map(Point::length);
        lengths
            .into_iter()
            .fold([f64::INFINITY, 0.0], |[least, most], l| [l.min(least), l.max(most)])
    }

    /// Least and greatest dihedral angle in degrees.
    pub fn angles(&self) -> [f64; 2] {
        let [least, greatest] = self.shape.cosines;
        let degrees = |cosine: f64| cosine.clamp(-1.0, 1.0).acos().to_degrees();
        [degrees(greatest), degrees(least)]
    }

    /// Quality over the least that the faces on the surface allow any tetrahedron; NaN where these are not known.
    pub fn excess(&self) -> f64 {
        (self.on_surface).map_or(f64::NAN, |faces| excess(self.corners, faces))
    }

    /// A value of [`VARIABLES`], or of `extra` behind them.
    pub fn value(&self, variable: usize) -> f64 {
        match variable.checked_sub(VARIABLES.len()) {
            Some(i) => self.extra[i].to_f64(),
            None => self.values()[variable],
        }
    }

    /// The values of [`VARIABLES`].
    pub fn values(&self) -> [f64; VARIABLES.len()] {
        self.values_of(|_| true)
    }

    /// The values of [`VARIABLES`] that are `wanted`; of the others that take time, NaN.
    pub(super) fn values_of(&self, wanted: impl Fn(usize) -> bool) -> [f64; VARIABLES.len()] {
        let pair =
            |first: usize, pair: fn(&Self) -> [f64; 2]| match wanted(first) || wanted(first + 1) {
                true => pair(self),
                false => [f64::NAN; 2],
            };
        let [x, y, z] = self.centroid().to_array();
        let [edge_min, edge_max] = pair(EDGE_MIN, Self::edges);
        let [angle_min, angle_max] = pair(ANGLE_MIN, Self::angles);
        [
            self.shape.quality,
            f64::from(self.region),
            f64::from(self.id.subdomain().rank()),
            self.shape.volume,
            x,
            y,
            z,
            edge_min,
            edge_max,
            angle_min,
            angle_max,
            if wanted(EXCESS) { self.excess() } else { f64::NAN },
        ]
    }
}

/// Ranges of the values of [`VARIABLES`] in a chunk's tetrahedra.
pub(super) fn ranges(summary: &TetSummary, rank: u32) -> [[f64; 2]; VARIABLES.len()] {
    let [low, high] = summary.bounds.map(Point::from_array);
    // Rounding may carry a mean of four out of their box.
    let slack = 1e-14 * low.abs().max(high.abs());
    let (low, high) = (low - slack, high + slack);
    let diagonal = Aabb { low, high }.diagonal() * (1.0 + 1e-14);
    let [q0, q1] = summary.quality;
    [
        // Summaries round to the nearest.
        [f64::from(q0.next_down()), f64::from(q1.next_up())],
        summary.regions.map(f64::from),
        [f64::from(rank); 2],
        [f64::NEG_INFINITY, f64::INFINITY],
        [low.x, high.x],
        [low.y, high.y],
        [low.z, high.z],
        [0.0, diagonal],
        [0.0, diagonal],
        [0.0, 180.0],
        [0.0, 180.0],
        // No bound is below 1 or above the quality; a triangle without area in doubles forces all.
        [1.0 - 1e-12, f64::from(q1.next_up())],
    ]
}
