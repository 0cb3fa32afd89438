//! Operations that change the number of vertices, for the worst tetrahedra only.

use super::collapse::Collapser;
use super::goals::OperationCounts;
use super::insertion::{Better, Inserter};
use super::objective::Worst;
use crate::mesh::{Mesh, Tet};
use tetdb_base::storage::Pages;

/// Scratch of collapse and insertion.
#[derive(Default)]
pub(super) struct VertexOperations {
    collapser: Collapser<Worst>,
    inserter: Inserter,
}

impl VertexOperations {
    /// Collapses an edge of `t` or puts a vertex into its cavity, whichever first makes the worst better.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn attack<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        good: f64,
        enough: f64,
        counts: &mut OperationCounts,
        changed: &mut Vec<u32>,
    ) -> bool {
        if self.collapser.collapse_best_edge(mesh, t, tet, good) {
            counts.edges_collapsed += 1;
            changed.extend_from_slice(self.collapser.new_tets());
            return true;
        }
        if self.inserter.insert(mesh, t, tet, Better::Worst { enough }) {
            counts.vertices_inserted += 1;
            changed.extend_from_slice(self.inserter.new_tets());
            return true;
        }
        false
    }
}
