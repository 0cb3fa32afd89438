//! The enclosing box: eight vertices around all points, so that no insertion meets the hull.

use crate::mesh::anatomy::FACES;
use crate::mesh::{FaceRef, Mesh, Tet, VertexTag};
use tetdb_base::geom::{Aabb, Point, in_sphere_perturbed, orient};
use tetdb_base::storage::Pages;

/// Half side of the box in units of the longest side of the enclosed bounds. Far enough that surface triangles are
/// hardly ever lost to the box vertices, near enough to keep sphere determinants small.
const MARGIN: f64 = 3.0;

/// Makes the Delaunay mesh of a cube around `bounds` and returns one of its tetrahedra.
///
/// The mesh must be empty. Vertices 0..8 are the box, tagged [`VertexTag::EnclosingBox`]. The cube's corners lie on
/// one sphere, so its tetrahedra are those the perturbation chooses: all quadruples whose sphere is empty.
pub fn enclose<P: Pages>(mesh: &mut Mesh<P>, bounds: &Aabb) -> u32 {
    assert_eq!(mesh.n_tets(), 0, "the enclosing box comes first");
    let center = (bounds.low + bounds.high) * 0.5;
    let half = (bounds.high - bounds.low).max_element().max(f64::MIN_POSITIVE) * MARGIN;
    let corners: Vec<Point> =
        (0..8).map(|i| center + Point::new(side(i), side(i >> 1), side(i >> 2)) * half).collect();
    let ids: Vec<u32> = corners
        .iter()
        .enumerate()
        .map(|(i, &p)| {
            let v = mesh.add_vertex(p, 0.0);
            mesh.set_vertex_attribute(v, VertexTag::EnclosingBox, i as u32);
            v
        })
        .collect();
    let cells = delaunay_of_few(&corners);
    let tets: Vec<u32> = cells.iter().map(|_| mesh.take_tet()).collect();
    for (cell, &t) in cells.iter().zip(&tets) {
        let neighbor = [0, 1, 2, 3].map(|i| {
            let face = sorted(FACES[i].map(|k| cell[k]));
            let other = cells.iter().zip(&tets).find_map(|(other, &u)| {
                let j = (0..4).find(|&j| u != t && sorted(FACES[j].map(|k| other[k])) == face)?;
                Some(FaceRef::new(u, j))
            });
            other.unwrap_or(FaceRef::NONE)
        });
        let node = cell.map(|i| ids[i]);
        mesh.set_tet(t, Tet { node, neighbor });
    }
    tets[0]
}

fn side(bit: u32) -> f64 {
    if bit & 1 == 0 { -1.0 } else { 1.0 }
}

fn sorted(mut face: [usize; 3]) -> [usize; 3] {
    face.sort_unstable();
    face
}

/// The perturbed Delaunay tetrahedra of a handful of points, by trying all quadruples.
fn delaunay_of_few(points: &[Point]) -> Vec<[usize; 4]> {
    let n = points.len();
    let mut cells = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            for c in b + 1..n {
                for d in c + 1..n {
                    let volume = orient(points[a], points[b], points[c], points[d]);
                    if volume == 0.0 {
                        continue;
                    }
                    let cell = if volume > 0.0 { [a, b, c, d] } else { [b, a, c, d] };
                    let [p, q, r, s] = cell.map(|i| points[i]);
                    let empty = (0..n)
                        .all(|e| cell.contains(&e) || !in_sphere_perturbed(p, q, r, s, points[e]));
                    if empty {
                        cells.push(cell);
                    }
                }
            }
        }
    }
    cells
}
