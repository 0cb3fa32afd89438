//! A cavity that grows until a given point sees all its outer faces.
//!
//! Flat tetrahedra between nearly coplanar input points leave a point no clearance in doubles. If the point is behind a
//! face, the tetrahedron across that face joins the cavity, until all faces are seen. This is the opposite of shrinking
//! a cavity, and like it bounded by required faces.

use super::complex::{TetComplex, edge_key};
use super::walk::swapped;
use crate::mesh::anatomy::EDGES;
use tetdb_base::geom::IdSet;

/// Larger cavities are not tried.
const CAVITY_MAX: usize = 300;

/// A cavity and the tetrahedra that join its outer faces to the point.
pub(super) struct GrownCavity {
    pub cavity: Vec<u32>,
    pub quads: Vec<[u32; 4]>,
    /// Vertices that no tetrahedron has any more.
    pub lost: Vec<u32>,
}

/// The obstacle to a growing cavity.
#[derive(Clone, Copy, Debug)]
pub(super) enum Obstacle {
    /// The point is behind this required face, seen from the cavity.
    Required([u32; 3]),
    Other,
}

impl GrownCavity {
    /// The cavity, unless it would lose a vertex.
    pub fn without_lost_vertices(self) -> Result<Self, Obstacle> {
        match self.lost.is_empty() {
            true => Ok(self),
            false => Err(Obstacle::Other),
        }
    }
}

/// Grows the cavity `seed` for vertex `x`, which is in no tetrahedron yet.
///
/// Faces with vertex `open` are left to the caller, which closes the cavity there with the triangles `walls`. Errors:
/// [`Obstacle`], if a required face, a kept edge or one of the `taken` tetrahedra would be swallowed.
pub(super) fn grow<S: TetComplex>(
    s: &mut S,
    seed: &[u32],
    x: u32,
    open: Option<u32>,
    walls: &[[u32; 3]],
    taken: &IdSet<u32>,
) -> Result<GrownCavity, Obstacle> {
    let mut cavity = seed.to_vec();
    let mut inside: IdSet<u32> = seed.iter().copied().collect();
    let mut next = 0;
    while next < cavity.len() {
        let t = cavity[next];
        next += 1;
        let tet = s.tet(t);
        for i in 0..4 {
            let at_open = (0..4).any(|j| j != i && Some(tet.vertex(j)) == open);
            if at_open || inside.contains(&tet.neighbor[i].tet()) {
                continue;
            }
            if s.orient(swapped(&tet, i, x)) > 0.0 {
                continue;
            }
            if tet.is_required(i) {
                return Err(Obstacle::Required(tet.face(i)));
            }
            let across = s.across(t, i);
            if !across.exists() || taken.contains(&across.tet()) {
                return Err(Obstacle::Other);
            }
            if inside.insert(across.tet()) {
                cavity.push(across.tet());
            }
        }
        if cavity.len() > CAVITY_MAX {
            return Err(Obstacle::Other);
        }
    }
    let mut quads = Vec::new();
    let mut outline_edges: IdSet<u64> = IdSet::default();
    let mut outline: IdSet<u32> = IdSet::default();
    let mut note = |face: [u32; 3]| {
        outline.extend(face);
        for k in 0..3 {
            outline_edges.insert(edge_key(face[k], face[(k + 1) % 3]));
        }
    };
    walls.iter().for_each(|&w| note(w));
    for &t in &cavity {
        let tet = s.tet(t);
        for i in 0..4 {
            if (0..4).any(|j| j != i && Some(tet.vertex(j)) == open) {
                continue;
            }
            if inside.contains(&tet.neighbor[i].tet()) {
                if tet.is_required(i) {
                    return Err(Obstacle::Other);
                }
            } else {
                note(tet.face(i));
                quads.push(swapped(&tet, i, x));
            }
        }
    }
    let mut lost: Vec<u32> = Vec::new();
    for &t in &cavity {
        let v = s.tet(t).vertices();
        lost.extend(v.into_iter().filter(|&v| !outline.contains(&v) && Some(v) != open));
        for [i, j] in EDGES {
            let (a, b) = (v[i], v[j]);
            let is_lost =
                Some(a) != open && Some(b) != open && !outline_edges.contains(&edge_key(a, b));
            if is_lost && s.protects(a, b) {
                return Err(Obstacle::Other);
            }
        }
    }
    // The last growth may have turned a face that was seen before: all must be seen at the end.
    if quads.iter().any(|&q| s.orient(q) <= 0.0) {
        return Err(Obstacle::Other);
    }
    lost.sort_unstable();
    lost.dedup();
    Ok(GrownCavity { cavity, quads, lost })
}
