//! The faces of a chosen interface, in the order that numbers them and their vertices.

use super::core::{is_held, tet_ids};
use super::side_labels::SideLabels;
use crate::mesh::{Mesh, Tet};
use tetdb_base::geom::Point;
use tetdb_base::storage::Pages;

/// Gives the vertices of the cut's interface their numbers, in the order of its faces; returns how many they are.
pub(super) fn number_interface<P: Pages>(core: &mut Mesh<P>, labels: &SideLabels, cut: u32) -> u32 {
    let mut vertices = 0;
    for_each_interface_face(core, labels, |core, tet, i| {
        for v in tet.face(i) {
            if !core.is_fixed(v) || is_held(core, v) {
                core.set_interface_vertex(v, cut, vertices);
                vertices += 1;
            }
        }
    });
    vertices
}

/// The interface faces by their points, in id order.
pub(super) fn interface_points<P: Pages>(
    core: &mut Mesh<P>,
    labels: &SideLabels,
) -> Vec<[Point; 3]> {
    let mut points = Vec::new();
    for_each_interface_face(core, labels, |core, tet, i| {
        points.push(tet.face(i).map(|v| core.point(v)));
    });
    points
}

/// Calls `visit` with every interface face, seen from its tetrahedron on the low side, in id order.
pub(super) fn for_each_interface_face<P: Pages>(
    core: &mut Mesh<P>,
    labels: &SideLabels,
    mut visit: impl FnMut(&mut Mesh<P>, &Tet, usize),
) {
    for t in tet_ids(core) {
        let tet = core.tet(t);
        if !tet.is_live() || labels.is_high(t) {
            continue;
        }
        for i in labels.interface_faces(t, &tet) {
            visit(core, &tet, i);
        }
    }
}
