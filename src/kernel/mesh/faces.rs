//! Faces the mesh must keep: triangles of the input, and faces on interfaces.

use tetdb_schema::page::u32_le;
use tetdb_schema::tree::IdCounts;

use super::cursor::Mesh;
use super::sparse;
use tetdb_base::storage::{Pages, kind};

/// A triangle of the input (or of an interface) and the regions on its two sides.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MeshFacet {
    /// Vertex ids; their order gives the normal.
    pub vertices: [u32; 3],
    /// Label of the triangle in the input.
    pub label: u32,
    /// Number of the triangle in the input.
    pub input: u64,
    /// Region on the side the normal points to, then on the other; 0 is outside or empty. A sheet has the same region
    /// on both sides.
    ///
    /// Before regions are colored the second is [`SHEET`] for a triangle of a sheet, else 0.
    pub regions: [u32; 2],
}

/// Second region of a facet of a sheet before regions are colored.
pub const SHEET: u32 = 1;

/// A face on an interface, and of which cut.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MeshInterfaceFace {
    /// Counter-clockwise seen from outside the sub-domain.
    pub vertices: [u32; 3],
    /// Number of the cut, 1.., and of the face in it.
    pub cut: u32,
    /// Number of the face within its cut.
    pub index: u32,
    /// Side of the cut with the sub-domain: 0 low, 1 high.
    pub side: u32,
}

impl<P: Pages> Mesh<P> {
    // ----- facets -----------------------------------------------------------------------------

    /// Facets, numbered densely through [`sparse`].
    pub fn n_facets(&self) -> u32 {
        self.state.facets.n_live
    }

    /// Facet `n`, counted from 0.
    pub fn facet(&mut self, n: u32) -> MeshFacet {
        let slot = self.pages.read::<{ kind::FACETS }>(sparse(n));
        let w = |i: usize| slot[i].to_native();
        MeshFacet {
            vertices: [w(0), w(1), w(2)],
            label: w(3),
            input: u64::from(w(4)) | u64::from(w(5)) << 32,
            regions: [w(6), w(7)],
        }
    }

    /// Replaces facet `n`.
    pub fn set_facet(&mut self, n: u32, f: MeshFacet) {
        let [a, b, c] = f.vertices;
        let input = f.input as u32;
        let words = [a, b, c, f.label, input, (f.input >> 32) as u32, f.regions[0], f.regions[1]];
        let slot = self.pages.write::<{ kind::FACETS }>(sparse(n));
        for (to, word) in slot.iter_mut().zip(words) {
            *to = word.into();
        }
    }

    /// Adds a facet after the others.
    pub fn add_facet(&mut self, f: MeshFacet) -> u32 {
        let n = self.state.facets.n_live;
        Self::take_id::<{ kind::FACETS }>(&mut self.pages, &mut self.state.facets, "facets");
        self.set_facet(n, f);
        n
    }

    /// Forgets the facets from number `n` on.
    pub fn truncate_facets(&mut self, n: u32) {
        self.state.facets = IdCounts::without_gaps(n.min(self.n_facets()));
    }

    // ----- interface faces --------------------------------------------------------------------

    /// Interface faces, numbered densely through [`sparse`].
    pub fn n_interface_faces(&self) -> u32 {
        self.state.interface_faces.n_live
    }

    /// Interface face `n`, counted from 0.
    pub fn interface_face(&mut self, n: u32) -> MeshInterfaceFace {
        let w = self.pages.read::<{ kind::INTERFACE_FACES }>(sparse(n)).map(u32_le::to_native);
        MeshInterfaceFace { vertices: [w[0], w[1], w[2]], cut: w[3], index: w[4], side: w[5] }
    }

    /// Replaces interface face `n`.
    pub fn set_interface_face(&mut self, n: u32, f: MeshInterfaceFace) {
        let [a, b, c] = f.vertices;
        let words = [a, b, c, f.cut, f.index, f.side, 0, 0];
        *self.pages.write::<{ kind::INTERFACE_FACES }>(sparse(n)) = words.map(u32_le::from_native);
    }

    /// Adds an interface face after the others.
    pub fn add_interface_face(&mut self, f: MeshInterfaceFace) -> u32 {
        let n = self.state.interface_faces.n_live;
        Self::take_id::<{ kind::INTERFACE_FACES }>(
            &mut self.pages,
            &mut self.state.interface_faces,
            "interface faces",
        );
        self.set_interface_face(n, f);
        n
    }
}
