//! The tetrahedron of the old mesh that holds a point, or is nearest to it, and the shares of its corners.

use std::cell::Cell;

use super::old_mesh::OldMesh;
use crate::query::{QueryError, Vector, bounds_of, chunk_bounds, holds, shares};
use tetdb_base::geom::{Aabb, Dyadic, Point};

/// Distance from the old mesh, as a share of its diagonal, up to which a point counts as inside: rounding moves points of flat faces so far.
const OUTSIDE: f64 = 1e-12;
/// Distance between a point and the sum of its shares, as a share of the tetrahedron, above which shares are computed without rounding.
const RESIDUE: f64 = 1e-14;

/// Where a point lies in the old mesh.
#[derive(Clone, Copy)]
pub struct Place {
    pub rank: u32,
    /// Number of the tetrahedron in its chunk, and the chunk.
    pub tet: usize,
    pub chunk: u32,
    /// Numbers of its vertices.
    pub nodes: [u32; 4],
    /// Of each corner, of sum 1 but for rounding; a vertex that is the point has 1, the others 0.
    pub shares: [f64; 4],
    /// The corner nearest to the point.
    pub nearest: usize,
    pub is_outside: bool,
}

impl OldMesh {
    /// Finds points; of several tetrahedra that hold one, the first. Shape: parallel to `points`. Errors: damage.
    pub fn places(&mut self, points: &[Point]) -> Result<Vec<Place>, QueryError> {
        let mut places = vec![None; points.len()];
        let around = Aabb::around(points.iter().copied());
        for (rank, chunk, bounds) in self.chunks_meeting(&around)? {
            let is_open = |&i: &usize| places[i].is_none() && holds(&bounds, points[i]);
            let open: Vec<usize> = (0..points.len()).filter(is_open).collect();
            if open.is_empty() {
                continue;
            }
            let old = self.session.searched(rank, chunk)?;
            for i in open {
                let p = points[i];
                old.tree.visit(&|b| holds(b, p), &mut |tet| {
                    if places[i].is_some() {
                        return;
                    }
                    let corners = old.frame.corners(&old.frame.tets[tet]);
                    if let Some(shares) = shares(&corners, p) {
                        let shares = precise(&corners, p, shares);
                        let nodes = old.frame.locals(&old.frame.tets[tet]);
                        let nearest = nearest_corner(&corners, p);
                        let is_outside = false;
                        let place = Place { rank, tet, chunk, nodes, shares, nearest, is_outside };
                        places[i] = Some(place);
                    }
                });
            }
        }
        let found = places.into_iter().zip(points);
        found.map(|(place, &p)| place.map_or_else(|| self.nearest(p), Ok)).collect()
    }

    /// The nearest point of the mesh, for one that no tetrahedron holds.
    fn nearest(&mut self, p: Point) -> Result<Place, QueryError> {
        let limit = OUTSIDE * self.session.bounds().diagonal();
        let mut best = None;
        let least = Cell::new(f64::INFINITY);
        let rows = self.session.rows.iter();
        let mut ranks: Vec<_> = rows.map(|row| (distance(&bounds_of(row), p), row.rank)).collect();
        ranks.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (far, rank) in ranks {
            if far > least.get() {
                break;
            }
            let part = &self.session.part(rank)?.subdomain;
            let of = |chunk: usize| (distance(&chunk_bounds(part, chunk), p), chunk as u32);
            let mut chunks: Vec<_> = (0..part.tet_summaries().len()).map(of).collect();
            chunks.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (_, chunk) in chunks.into_iter().take_while(|(far, _)| *far <= least.get()) {
                let old = self.session.searched(rank, chunk)?;
                old.tree.visit(&|b| distance(b, p) <= least.get(), &mut |tet| {
                    let corners = old.frame.corners(&old.frame.tets[tet]);
                    let (far, shares) = nearest_in(&corners, p);
                    if far < least.get() {
                        least.set(far);
                        let nodes = old.frame.locals(&old.frame.tets[tet]);
                        let nearest = nearest_corner(&corners, p);
                        let is_outside = far > limit;
                        best = Some(Place { rank, tet, chunk, nodes, shares, nearest, is_outside });
                    }
                });
            }
        }
        match (best, self.session.rows.first().map(|row| row.rank)) {
            (Some(place), _) => Ok(place),
            (None, rank) => {
                let part = &self.session.part(rank.unwrap_or(0))?.subdomain;
                Err(part.damaged("it has no tetrahedron").into())
            }
        }
    }
}

/// Shares of sum 1 from six times the volumes; without rounding where the tetrahedron is so flat that they miss the point.
fn precise(corners: &[Point; 4], p: Point, volumes: [f64; 4]) -> [f64; 4] {
    let scaled = |volumes: [f64; 4]| volumes.map(|v| v / volumes.iter().sum::<f64>());
    let shares = scaled(volumes);
    let (mut missed, mut size) = (Point::ZERO, 0.0f64);
    for (corner, share) in corners.iter().zip(shares) {
        missed += (*corner - p) * share;
        size = size.max((*corner - p).abs().max_element());
    }
    // Also true for what is not a number.
    let is_close = missed.abs().max_element() <= RESIDUE * size;
    if is_close {
        return shares;
    }
    scaled([0, 1, 2, 3].map(|i| {
        let mut with = *corners;
        with[i] = p;
        let [u, v, w] = [1, 2, 3].map(|j| Vector::<Dyadic>::between(with[0], with[j]));
        u.dot(&v.cross(&w)).estimate()
    }))
}

fn nearest_corner(corners: &[Point; 4], p: Point) -> usize {
    let far = |&i: &usize| corners[i].distance_squared(p);
    (0..4).min_by(|a, b| far(a).total_cmp(&far(b))).expect("there are four")
}

/// Distance of a point from a box.
fn distance(bounds: &Aabb, p: Point) -> f64 {
    (p - p.clamp(bounds.low, bounds.high)).length()
}

/// Distance of a point outside from a tetrahedron, and the shares of the corners in the nearest point, which is on a face.
fn nearest_in(corners: &[Point; 4], p: Point) -> (f64, [f64; 4]) {
    let mut best = (f64::INFINITY, [0.0; 4]);
    for without in 0..4 {
        let face = [1, 2, 3].map(|i| (without + i) % 4);
        let on_face = nearest_on_face(face.map(|i| corners[i]), p);
        let mut shares = [0.0; 4];
        face.into_iter().zip(on_face).for_each(|(i, share)| shares[i] = share);
        let at = (0..4).fold(Point::ZERO, |sum, i| sum + corners[i] * shares[i]);
        if at.distance(p) < best.0 {
            best = (at.distance(p), shares);
        }
    }
    best
}

/// Shares of the corners of a triangle in its point nearest to `p`: below `p`, or on an edge.
fn nearest_on_face(face: [Point; 3], p: Point) -> [f64; 3] {
    let [a, b, c] = face;
    let (u, v, w) = (b - a, c - a, p - a);
    let normal = u.cross(v);
    let square = normal.length_squared();
    let (to_b, to_c) = (w.cross(v).dot(normal) / square, u.cross(w).dot(normal) / square);
    if to_b >= 0.0 && to_c >= 0.0 && to_b + to_c <= 1.0 {
        return [1.0 - to_b - to_c, to_b, to_c];
    }
    let mut best = (f64::INFINITY, [1.0, 0.0, 0.0]);
    for [i, j] in [[0, 1], [1, 2], [2, 0]] {
        let along = face[j] - face[i];
        let t = ((p - face[i]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let far = (face[i] + along * t).distance(p);
        if far < best.0 {
            let mut shares = [0.0; 3];
            (shares[i], shares[j]) = (1.0 - t, t);
            best = (far, shares);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_meet_the_point_in_flat_tetrahedra_too() {
        let corners = [[0.1, 0.2, 0.3], [1.1, 0.25, 0.3], [0.3, 1.2, 0.3], [0.6, 0.7, 0.3]];
        for height in [1.0, 1e-8, 1e-15] {
            let mut corners = corners.map(Point::from_array);
            corners[3].z += height;
            let p = corners.iter().fold(Point::ZERO, |sum, c| sum + *c * 0.25);
            let Some(volumes) = shares(&corners, p) else { continue };
            let shares = precise(&corners, p, volumes);
            let at = (0..4).fold(Point::ZERO, |sum, i| sum + corners[i] * shares[i]);
            assert!(at.distance(p) < 1e-15, "{height}: {}", at.distance(p));
        }
    }

    #[test]
    fn the_nearest_point_is_on_a_face_an_edge_or_a_corner() {
        let corners = [Point::ZERO, Point::X, Point::Y, Point::Z];
        for (p, far, shares) in [
            ([0.25, 0.25, -2.0], 2.0, [0.5, 0.25, 0.25, 0.0]),
            ([0.5, -3.0, -4.0], 5.0, [0.5, 0.5, 0.0, 0.0]),
            ([4.0, -1.0, -1.0], 11f64.sqrt(), [0.0, 1.0, 0.0, 0.0]),
        ] {
            assert_eq!(nearest_in(&corners, Point::from_array(p)), (far, shares));
        }
    }
}
