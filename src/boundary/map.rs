//! Which facets are faces already: those become required, the others are listed.

use std::collections::HashSet;

use super::find::{Found, find_face};
use super::space::{Paged, Space, edge_key};
use super::walk::find_edge;
use crate::mesh::Mesh;
use crate::store::{Pages, stop_if_requested};

/// What the mesh lacks.
///
/// Held in memory: a few dozen bytes per missing facet. Order: that of the facets.
#[derive(Debug, Default)]
pub(super) struct Missing {
    pub facets: Vec<u32>,
    pub segments: Vec<(u32, u32)>,
    /// Segments of missing facets that exist: no required face protects them yet.
    pub protected: HashSet<u64>,
}

/// Marks the facets that are faces as required and lists the rest. One short walk per facet.
pub(super) fn map<P: Pages>(mesh: &mut Mesh<P>) -> Missing {
    let mut missing = Missing::default();
    let mut known: HashSet<u64> = HashSet::new();
    let none = HashSet::new();
    for n in 0..mesh.n_facets() {
        if n & 1023 == 0 {
            stop_if_requested();
        }
        let f = mesh.facet(n).vertices;
        let mut s = Paged(mesh, &none);
        if let Found::Face(face) = find_face(&mut s, f) {
            s.require(face);
            continue;
        }
        missing.facets.push(n);
        for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
            if !known.insert(edge_key(a, b)) {
                continue;
            }
            if find_edge(&mut s, a, b).is_some() {
                missing.protected.insert(edge_key(a, b));
            } else {
                missing.segments.push((a, b));
            }
        }
    }
    missing
}
