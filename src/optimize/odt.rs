//! One sweep of smoothing towards an optimal Delaunay triangulation.
//!
//! Each free vertex moves to the mean of the circumcenters of its tetrahedra, weighted by volume / h³.
//! Seen from the vertex, volume times circumcenter is a polynomial, so slivers (no volume, circumcenter far away)
//! do no harm. After the sweep the caller restores local Delaunay by flips.
//!
//! Source: L. Chen and M. Holst, "Efficient mesh optimization schemes based on optimal Delaunay triangulations" (2011).

use super::smooth::{Star, is_free};
use crate::geom::{Point, orient};
use crate::mesh::Mesh;
use crate::store::{Pages, stop_if_requested};

/// Longest move in units of h. Longer ones overshoot on fresh meshes (whole layers cross), shorter ones need more sweeps.
const MOVE_MAX: f64 = 0.3;
/// Largest ball that is moved.
const BALL_MAX: usize = 256;

/// Moves done in one sweep, and vertices that stayed because a tetrahedron would not stay positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Moves {
    pub(super) moved: u64,
    pub(super) held: u64,
}

/// Moves every free vertex once, each at the tetrahedron [`Mesh::tet_of`] names, in id order of those.
pub(super) fn sweep<P: Pages>(mesh: &mut Mesh<P>, star: &mut Star) -> Moves {
    let mut moves = Moves::default();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        if t & 1023 == 0 {
            stop_if_requested();
        }
        for v in tet.vertices() {
            if mesh.tet_of(v) == t && is_free(mesh, v) && star.gather(mesh, v, t, BALL_MAX) {
                step(mesh, star, &mut moves);
            }
        }
    }
    moves
}

fn step<P: Pages>(mesh: &mut Mesh<P>, star: &Star, moves: &mut Moves) {
    let (at, h) = (star.at, f64::from(star.h));
    let mut sum = Point::ZERO;
    let mut volume = 0.0;
    let mut edges = 0.0;
    for (face, &face_h) in star.faces.iter().zip(&star.face_sizes) {
        let [u, v, w] = face.map(|p| p - at);
        let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
        let (uu, vv, ww) = (u.dot(u), v.dot(v), w.dot(w));
        let mean = h + face_h;
        let weight = if mean > 0.0 {
            1.0 / (mean * mean * mean)
        } else {
            1.0
        };
        sum += (vw * uu + wu * vv + uv * ww) * weight;
        volume += u.dot(vw) * weight;
        edges += uu.sqrt();
    }
    let mut shift = sum / (2.0 * volume);
    if !shift.is_finite() {
        return;
    }
    let h = if h > 0.0 {
        h
    } else {
        edges / star.faces.len() as f64
    };
    let length = shift.length();
    if length > MOVE_MAX * h {
        shift *= MOVE_MAX * h / length;
    }
    for _ in 0..3 {
        let p = at + shift;
        if star.faces.iter().all(|&[a, b, c]| orient(p, a, b, c) > 0.0) {
            mesh.set_point(star.v, p);
            moves.moved += 1;
            return;
        }
        shift *= 0.5;
    }
    moves.held += 1;
}
