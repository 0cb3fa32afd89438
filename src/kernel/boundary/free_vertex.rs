//! Removes a vertex that is on no facet.

use super::complex::TetComplex;
use super::walk::{ball, swapped};
use crate::mesh::anatomy::EDGES;
use tetdb_base::geom::IdSet;

/// Takes free vertex `x` away if one of its neighbors can stand for it: the best one does.
///
/// No tetrahedron may become flatter than `least`, and none flat.
pub(super) fn remove_free<S: TetComplex>(s: &mut S, x: u32, least: f64) -> bool {
    let ball = ball(s, x);
    let link: IdSet<u32> =
        ball.iter().flat_map(|&t| s.tet(t).vertices()).filter(|&v| v != x).collect();
    let mut link: Vec<u32> = link.into_iter().collect();
    link.sort_unstable();
    let mut best: Option<(f64, Vec<[u32; 4]>)> = None;
    let mut blocking = 0;
    for u in link {
        let Some(quads) = moved(s, x, u, &ball, &mut blocking) else {
            continue;
        };
        let worst = quads.iter().map(|&q| flatness(s, q)).fold(f64::INFINITY, f64::min);
        if best.as_ref().is_none_or(|b| worst > b.0) {
            best = Some((worst, quads));
        }
    }
    match best {
        Some((worst, quads)) if worst > 0.0 && worst >= least => {
            s.replace(&ball, &quads);
            true
        }
        _ => false,
    }
}

/// The ball with `x` moved to its neighbor `u`, if all volumes stay positive.
///
/// `blocking` is a position in the ball and is tested first: the tetrahedron that ruled one neighbor out often rules
/// out the next.
pub(super) fn moved<S: TetComplex>(
    s: &mut S,
    x: u32,
    u: u32,
    ball: &[u32],
    blocking: &mut usize,
) -> Option<Vec<[u32; 4]>> {
    let at = |s: &mut S, k: usize| {
        let tet = s.tet(ball[k]);
        if tet.local(u).is_some() {
            return Some(None);
        }
        let q = swapped(&tet, tet.local(x)?, u);
        (s.orient(q) > 0.0).then_some(Some(q))
    };
    if !ball.is_empty() {
        at(s, *blocking)?;
    }
    let mut quads = Vec::new();
    for k in 0..ball.len() {
        let Some(q) = at(s, k) else {
            *blocking = k;
            return None;
        };
        quads.extend(q);
    }
    Some(quads)
}

/// The least flatness of a tetrahedron of `x`.
pub(super) fn ball_flatness<S: TetComplex>(s: &mut S, x: u32) -> f64 {
    let quads: Vec<[u32; 4]> = ball(s, x).iter().map(|&t| s.tet(t).vertices()).collect();
    let all = quads.into_iter().map(|q| flatness(s, q));
    all.fold(f64::INFINITY, f64::min)
}

/// Volume over cubed longest edge.
fn flatness<S: TetComplex>(s: &mut S, q: [u32; 4]) -> f64 {
    let volume = s.orient(q);
    let p = q.map(|v| s.position(v));
    let longest = EDGES.iter().map(|&[i, j]| p[i].distance(p[j])).fold(0.0, f64::max);
    volume / (longest * longest * longest)
}
