//! Points that tetrahedra want: one for each that is too large or badly shaped.
//!
//! Sizes are read off circumspheres: a tetrahedron is good if its radius is below [`RADIUS`] wanted lengths. Only tetrahedra beside a good one
//! or beside a required face want a point, so that good layers grow from the boundary inwards as in an advancing front: over the face
//! whose circle is smallest, at the height that makes edges of the wanted length. Where the circumcenter is nearer it is that.
//!
//! Source: S. Rebay, "Efficient unstructured mesh generation by means of Delaunay triangulation and Bowyer–Watson algorithm" (1993).

use super::field::Field;
use super::flat::FlatMesh;
use super::region::{OUTSIDE, Region};
use super::side_by_side::volume_and_center;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{FACES, MARK};
use crate::mesh::{End, Tet};
use tetdb_base::geom::{HilbertFrame, Point, orient};

/// Least distance to a vertex, in units of the mean of both wanted lengths.
const FILTER: f64 = 0.75;
/// Largest circumradius of a good tetrahedron in wanted lengths.
const RADIUS: f64 = 0.75;
/// The wanted length of edges to a new point: below 1, since some neighbors come late.
const EDGE: f64 = 0.93;
/// Least height over a face in units of the wanted length of its edges.
const HEIGHT_MIN: f64 = 0.6;
/// A larger circumcenter than this is no place for a point, even if it lies inside.
const CENTER_MAX: f64 = 1.3;
/// Farthest place of a point from the nearest corner of its tetrahedron, in the greater of the lengths wanted at both. Circumcenters of flat
/// tetrahedra lie anywhere; where all is divided they are beyond a required face or too near to others, and looking for them leads out of
/// every region. Where lengths grow from tiny ones, farther points by the corner's length alone are needed: without them walls of needles keep
/// worse tetrahedra.
const FAR: f64 = 6.0;
/// Mark of good tetrahedra.
pub(super) const GOOD: usize = crate::mesh::anatomy::mark::RESCUED;

/// A point that a tetrahedron wants.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub point: Point,
    pub h: f32,
    pub tet: u32,
}

impl Candidate {
    /// Whether a vertex of size `h` is too near at the square root of a distance.
    #[inline(always)]
    pub fn refuses(&self, square: f64, h: f32) -> bool {
        let least = FILTER * 0.5 * (f64::from(h) + f64::from(self.h));
        square < least * least
    }
}

/// Finds candidates.
#[derive(Default)]
pub(super) struct Spawner {
    bad: Vec<Bad>,
    /// Candidates, each with its place along the curve.
    pub found: Vec<(u64, Candidate)>,
    /// Tetrahedra with no good neighbor yet.
    pub waiting: Vec<u32>,
}

/// A tetrahedron that is not good.
struct Bad {
    tet: u32,
    /// Mean of the lengths wanted at its corners.
    h: f64,
    /// The circumcenter, seen from its first corner.
    center: Point,
}

impl Spawner {
    /// Examines tetrahedra; `front` tells whether only those beside good ones want points.
    pub fn examine(
        &mut self,
        region: &mut Region,
        is_due: &dyn Fn(&Region, &Tet) -> bool,
        tets: &[u32],
        field: &Field,
        order: &HilbertFrame,
        front: bool,
    ) {
        self.find_bad(region, is_due, tets, field);
        self.found.clear();
        for bad in std::mem::take(&mut self.bad) {
            let faces = if front { front_of(&region.mesh, bad.tet) } else { 0b1111 };
            if faces == 0 {
                self.waiting.push(bad.tet);
                continue;
            }
            region.mesh.set_mark(bad.tet, EXAMINED);
            if let Some(point) = apex(&region.mesh, &bad, faces) {
                self.add(&region.mesh, bad.tet, point, field, order);
            }
        }
    }

    /// Adds a candidate of a tetrahedron unless one of its corners is too near, or all are too far.
    pub fn add(
        &mut self,
        mesh: &FlatMesh,
        tet: u32,
        point: Point,
        field: &Field,
        order: &HilbertFrame,
    ) {
        let h = (field.h)(point);
        let candidate = Candidate { point, h: h as f32, tet };
        let corners = mesh.corners(mesh.tet(tet));
        let squares = corners.map(|v| (v.point - point).length_squared());
        let is_near = (0..4).any(|i| candidate.refuses(squares[i], corners[i].h()));
        let is_far = (0..4).all(|i| squares[i].sqrt() > FAR * h.max(f64::from(corners[i].h())));
        if !is_near && !is_far && field.place.admits(point, h) {
            self.found.push((order.index(point), candidate));
        }
    }

    fn find_bad(
        &mut self,
        region: &mut Region,
        is_due: &dyn Fn(&Region, &Tet) -> bool,
        tets: &[u32],
        field: &Field,
    ) {
        self.bad.clear();
        for &t in tets {
            let tet = *region.mesh.tet(t);
            let is_good = tet.node[GOOD] & MARK != 0;
            if !tet.is_live() || is_good || region.mesh.is_held(t) || !is_due(region, &tet) {
                continue;
            }
            let corners = region.mesh.corners(&tet);
            if field.place.is_partial() {
                let end = |i: usize| End {
                    point: corners[i].point,
                    h: corners[i].h(),
                    fixed: corners[i].is_fixed(),
                };
                if !field.reaches(&[end(0), end(1), end(2), end(3)]) {
                    region.mesh.set_mark(t, EXAMINED);
                    continue;
                }
            }
            let size = |i: usize| f64::from(corners[i].h());
            let mut h = 0.25 * ((size(0) + size(1)) + (size(2) + size(3)));
            let points = [corners[0].point, corners[1].point, corners[2].point, corners[3].point];
            if corners.iter().all(|v| v.is_fixed()) {
                // The corners only know the surface; the middle may want less.
                h = h.min((field.h)((points[0] + points[1] + points[2] + points[3]) * 0.25));
            }
            match center(points) {
                Some(center) if center.length_squared() >= RADIUS * RADIUS * h * h => {
                    self.bad.push(Bad { tet: t, h, center });
                }
                Some(_) => {
                    region.mesh.set_mark(t, GOOD);
                    region.mesh.set_mark(t, EXAMINED);
                }
                None => region.mesh.set_mark(t, EXAMINED),
            }
        }
    }
}

/// The circumcenter seen from the first corner; `None` if doubles know no volume.
pub(super) fn center([a, b, c, d]: [Point; 4]) -> Option<Point> {
    let (det, center) = volume_and_center([b - a, c - a, d - a]);
    let center = center * (0.5 / det);
    (det > 0.0 && center.is_finite()).then_some(center)
}

/// The faces that are required or beside a good tetrahedron, as bits.
#[inline(always)]
fn front_of(mesh: &FlatMesh, t: u32) -> u32 {
    let tet = mesh.tet(t);
    let is_front = |i: usize| {
        let across = tet.neighbor[i];
        tet.is_required(i) || !across.exists() || mesh.is_marked(across.tet(), GOOD)
    };
    (0..4).fold(0, |faces, i| faces | u32::from(is_front(i)) << i)
}

/// The point over the face of smallest circle among `faces`, or the center if that is nearer.
fn apex(mesh: &FlatMesh, bad: &Bad, faces: u32) -> Option<Point> {
    let tet = mesh.tet(bad.tet);
    let corners = mesh.corners(tet);
    let p = mesh.points(tet);
    let center = p[0] + bad.center;
    let is_inside = || {
        (0..4).all(|i| {
            let [a, b, c] = FACES[i];
            orient(center, p[a], p[b], p[c]) >= 0.0
        })
    };
    if bad.center.length_squared() <= CENTER_MAX * CENTER_MAX * bad.h * bad.h && is_inside() {
        return Some(center);
    }
    let circle = |i: usize| {
        let [a, b, c] = FACES[i].map(|k| p[k]);
        let (u, v) = (b - a, c - a);
        let normal = u.cross(v);
        let to_center = (u * v.length_squared() - v * u.length_squared()).cross(normal)
            * (-0.5 / normal.length_squared());
        // Seen from outside the face turns counter-clockwise: inwards is against the normal.
        (to_center.length_squared(), a + to_center, -normal.normalize())
    };
    let circles = (0..4).filter(|i| faces >> i & 1 != 0).map(|i| (i, circle(i)));
    let finite = circles.filter(|(_, c)| c.0.is_finite() && c.2.is_finite());
    let (face, (square, middle, inwards)) = finite.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let h = FACES[face].iter().map(|&k| f64::from(corners[k].h())).sum::<f64>() / 3.0;
    let edge = EDGE * EDGE * h * h;
    let height = (edge - square).max(HEIGHT_MIN * HEIGHT_MIN * edge).sqrt();
    let of_center = (center - middle).dot(inwards);
    Some(if of_center > height { middle + inwards * height } else { center })
}

/// Whether the region has the tetrahedron's brick, and that is one of `bricks`.
pub(super) fn is_in(region: &Region, tet: &Tet, bricks: &[bool]) -> bool {
    let home = region.home(tet);
    home != OUTSIDE && bricks[home as usize]
}
