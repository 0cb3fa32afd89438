//! Inserts an exact point into a small cavity, all of whose faces it sees.

use super::complex::TetComplex;
use super::exact::ExactPoint;
use super::grow::{GrownCavity, grow};
use super::patch::RecoveryPatch;
use super::walk::swapped;
use crate::mesh::Tet;
use tetdb_base::geom::IdSet;
use tetdb_base::storage::Pages;

/// An outer face of a cavity, as a tetrahedron of the cavity and the vertex opposite the face.
pub(super) type Outer = (Tet, usize);

impl<P: Pages> RecoveryPatch<'_, P> {
    /// The outer faces of a cavity.
    pub(super) fn outer_faces(&mut self, cavity: &[u32]) -> Vec<Outer> {
        let mut outer = Vec::new();
        for &t in cavity {
            let tet = self.tet(t);
            outer.extend(
                (0..4).filter(|&i| !cavity.contains(&tet.neighbor[i].tet())).map(|i| (tet, i)),
            );
        }
        outer
    }

    /// Replaces the cavity by the point joined to its outer faces, if the point sees them all from inside.
    ///
    /// `on` are the corners of the segment or facet with the point.
    pub(super) fn star(
        &mut self,
        cavity: &[u32],
        outer: &[Outer],
        on: [u32; 3],
        exact: ExactPoint,
    ) -> Option<u32> {
        let x = self.add_vertex_on(on, exact);
        let new: Vec<[u32; 4]> = outer.iter().map(|(tet, i)| swapped(tet, *i, x)).collect();
        if new.iter().any(|&q| self.orient(q) <= 0.0) {
            self.drop_vertex(x);
            return None;
        }
        self.replace(cavity, &new);
        Some(x)
    }

    /// Like [`Self::star`], but the cavity may grow until the point sees all of it.
    pub(super) fn star_grown(
        &mut self,
        seed: &[u32],
        on: [u32; 3],
        exact: ExactPoint,
    ) -> Option<u32> {
        let x = self.add_vertex_on(on, exact);
        let grown = grow(self, seed, x, None, &[], &IdSet::default());
        let Ok(grown) = grown.and_then(GrownCavity::without_lost_vertices) else {
            self.drop_vertex(x);
            return None;
        };
        self.replace(&grown.cavity, &grown.quads);
        Some(x)
    }
}
