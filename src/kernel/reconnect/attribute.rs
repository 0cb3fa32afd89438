//! Regions and flags carried from old tetrahedra to new ones.

use crate::mesh::Mesh;
use crate::mesh::anatomy::EDGES;
use tetdb_base::storage::Pages;

/// Flag bits that belong to the six edges.
pub(super) const EDGE_FLAGS: u32 = 0x3F;

/// Required edges of the old tetrahedra, and their common region and flags.
#[derive(Default)]
pub struct Inherited {
    region: u32,
    /// Flags other than those of edges.
    flags: u32,
    /// Required edges, smaller vertex first. Nearly always empty.
    edges: Vec<[u32; 2]>,
}

impl Inherited {
    /// Reads the attributes of the old tetrahedra, given with their vertices; region and flags are those of the first.
    pub fn read<P: Pages>(mesh: &mut Mesh<P>, old: impl Iterator<Item = (u32, [u32; 4])>) -> Self {
        let mut found = Self::default();
        for (n, (t, vertices)) in old.enumerate() {
            let (region, flags) = mesh.tet_attribute(t);
            if n == 0 {
                (found.region, found.flags) = (region, flags & !EDGE_FLAGS);
            } else {
                debug_assert_eq!(found.region, region, "tetrahedron {t} {vertices:?}");
            }
            let mut edges = flags & EDGE_FLAGS;
            while edges != 0 {
                let [i, j] = EDGES[edges.trailing_zeros() as usize];
                edges &= edges - 1;
                let edge = sorted(vertices[i], vertices[j]);
                if !found.edges.contains(&edge) {
                    found.edges.push(edge);
                }
            }
        }
        found
    }

    /// Writes the attribute of a new tetrahedron if it differs from the present one.
    pub fn write<P: Pages>(&self, mesh: &mut Mesh<P>, t: u32, vertices: [u32; 4]) {
        let mut flags = self.flags;
        if !self.edges.is_empty() {
            for (e, [i, j]) in EDGES.into_iter().enumerate() {
                if self.edges.contains(&sorted(vertices[i], vertices[j])) {
                    flags |= 1 << e;
                }
            }
        }
        if mesh.tet_attribute(t) != (self.region, flags) {
            mesh.set_tet_attribute(t, self.region, flags);
        }
    }
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
