//! Edge removal: the shell of an edge replaced by two layers over a triangulation of its ring.
//!
//! Covers the flips 3-2 and 4-4 and all n to 2 (n − 2).

use super::attribute::Inherited;
use super::{RingTriangulation, Shell};
use crate::mesh::anatomy::REQUIRED;
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::storage::Pages;

/// Replaces the closed `shell` by the tetrahedra of `triangulation`, listed in `new_tets`: first those with b, then those with a.
///
/// Requires the current shell of the mesh, no required face in it, and triangles whose cones are exactly positive.
/// Effects: ids of the shell are used again in its order, one is freed for a ring of three; the module's docs list the
/// invariants.
pub fn remove_edge<P: Pages>(
    mesh: &mut Mesh<P>,
    shell: &Shell,
    triangulation: &RingTriangulation,
    new_tets: &mut Vec<u32>,
) {
    let n = shell.n_ring();
    let triangles = &triangulation.triangles;
    assert!(
        shell.closed && !shell.required && triangles.len() + 2 == n,
        "edge {} {}",
        shell.a,
        shell.b
    );
    let old = shell.tets.iter().copied();
    let inherited = Inherited::read(mesh, old.zip(shell.records.iter().map(Tet::vertices)));
    let n_new = triangles.len();
    new_tets.clear();
    new_tets.extend(shell.tets.iter().copied().take(2 * n_new));
    while new_tets.len() < 2 * n_new {
        new_tets.push(mesh.take_tet());
    }
    for &t in shell.tets.iter().skip(2 * n_new) {
        mesh.free_tet(t);
    }
    for (k, triangle) in triangles.iter().enumerate() {
        let (up, low) = (new_tets[k], new_tets[n_new + k]);
        let [i, j, l] = triangle.map(usize::from);
        let [ri, rj, rl] = [i, j, l].map(|p| shell.ring[p]);
        // Edges of the triangle: j l, l i, i j; the faces of the upper tetrahedron (i j l b) in that order.
        let edges = [(j, l), (l, i), (i, j)].map(|(x, y)| side(shell, triangles, x, y));
        let mut upper = Tet { node: [ri, rj, rl, shell.b], neighbor: [FaceRef::NONE; 4] };
        let mut lower = Tet { node: [ri, rl, rj, shell.a], neighbor: [FaceRef::NONE; 4] };
        upper.neighbor[3] = FaceRef::new(low, 3);
        lower.neighbor[3] = FaceRef::new(up, 3);
        for (face, edge) in edges.into_iter().enumerate() {
            // The lower tetrahedron (i l j a) has the faces of l i and i j the other way around.
            let face_low = (3 - face) % 3;
            match edge {
                RingSide::Triangle(other, other_face) => {
                    upper.neighbor[face] = FaceRef::new(new_tets[other], other_face);
                    let other_low = (3 - other_face) % 3;
                    lower.neighbor[face_low] = FaceRef::new(new_tets[n_new + other], other_low);
                }
                RingSide::Outer(m) => {
                    let (record, [a, b, ..]) = (&shell.records[m], shell.locals[m]);
                    outer(mesh, record, a.into(), &mut upper, face, up);
                    outer(mesh, record, b.into(), &mut lower, face_low, low);
                }
            }
        }
        for (t, tet) in [(up, upper), (low, lower)] {
            mesh.set_tet(t, tet);
            inherited.write(mesh, t, tet.vertices());
        }
        for v in [ri, rj, rl] {
            mesh.set_tet_of(v, up);
        }
    }
    mesh.set_tet_of(shell.b, new_tets[0]);
    mesh.set_tet_of(shell.a, new_tets[n_new]);
}

/// The other side of a directed edge of a ring triangle.
enum RingSide {
    /// Tetrahedron of the shell whose outer faces these are.
    Outer(usize),
    /// Another triangle, and the number of its upper face there.
    Triangle(usize, usize),
}

fn side(shell: &Shell, triangles: &[[u8; 3]], x: usize, y: usize) -> RingSide {
    if (x + 1) % shell.n_ring() == y {
        return RingSide::Outer(x);
    }
    let found = triangles.iter().enumerate().find_map(|(k, t)| {
        let [i, j, l] = t.map(usize::from);
        let edges = [(j, l), (l, i), (i, j)];
        Some((k, edges.iter().position(|&e| e == (y, x))?))
    });
    let (k, face) =
        found.unwrap_or_else(|| panic!("ring of {:?}: chord {x} {y} has one triangle", shell.ring));
    RingSide::Triangle(k, face)
}

/// Puts the outer face `old` of a shell tetrahedron on face `face` of the new one.
fn outer<P: Pages>(
    mesh: &mut Mesh<P>,
    record: &Tet,
    old: usize,
    new: &mut Tet,
    face: usize,
    t: u32,
) {
    new.node[face] |= record.node[old] & REQUIRED;
    new.neighbor[face] = record.neighbor[old];
    if record.neighbor[old].exists() {
        mesh.set_neighbor(record.neighbor[old], FaceRef::new(t, face));
    }
}
