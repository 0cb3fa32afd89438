//! Marks the facets that are faces already as required, and lists the others.

use std::ops::Range;

use super::complex::{PagedComplex, TetComplex, edge_key, sorted};
use super::find::{SearchResult, find_face};
use super::walk::find_edge;
use crate::mesh::{FaceRef, Mesh, MeshFacet, Scan, scan_parts};
use tetdb_base::geom::IdSet;
use tetdb_base::storage::Pages;

/// Segments and facets that the mesh lacks.
///
/// Held in memory: a few dozen bytes per missing facet. Order: that of the facets.
#[derive(Debug, Default)]
pub(super) struct MissingFacets {
    pub facets: Vec<u32>,
    pub segments: Vec<(u32, u32)>,
    /// Segments of missing facets that exist: no required face protects them yet.
    pub protected: IdSet<u64>,
}

/// Facets looked for as one part, and parts before the facets found are marked.
const PART: usize = 1024;
const PARTS: usize = 32;

/// The faces of some facets, where they are faces.
struct FacesOfFacets;

impl Scan for FacesOfFacets {
    type Part = Range<u32>;
    type Output = Vec<Option<FaceRef>>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, facets: &Range<u32>) -> Vec<Option<FaceRef>> {
        let none = IdSet::default();
        let face = |n| {
            let f = mesh.facet(n).vertices;
            match find_face(&mut PagedComplex(mesh, &none), f) {
                SearchResult::Face(face) => Some(face),
                _ => None,
            }
        };
        facets.clone().map(face).collect()
    }
}

/// Marks the facets that are faces as required, with the face in place of their first region ([`face_at`]), and lists the rest. One short
/// walk per facet.
pub(super) fn map<P: Pages>(mesh: &mut Mesh<P>) -> MissingFacets {
    let mut missing = MissingFacets::default();
    let mut known: IdSet<u64> = IdSet::default();
    let none = IdSet::default();
    let end = mesh.n_facets();
    let part = |n: u32| n..end.min(n + PART as u32);
    let parts: Vec<Range<u32>> = (0..end).step_by(PART).map(part).collect();
    for parts in parts.chunks(PARTS) {
        let found = scan_parts(mesh, parts, &FacesOfFacets).into_iter().flatten();
        for (n, face) in (parts[0].start..).zip(found) {
            let mut facet = mesh.facet(n);
            let f = facet.vertices;
            let mut s = PagedComplex(mesh, &none);
            if let Some(face) = face {
                s.require(face);
                // Regions are not set yet: the field stores the face, for the next search of the facet.
                facet.regions[0] = face.0;
                mesh.set_facet(n, facet);
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
    }
    missing
}

/// The face of a facet that [`map`] has found, where flips have left it.
pub(super) fn face_at<P: Pages>(mesh: &mut Mesh<P>, facet: &MeshFacet) -> Option<FaceRef> {
    let face = FaceRef(facet.regions[0]);
    let tet = mesh.tet(face.tet());
    let is_there = tet.is_live()
        && tet.is_required(face.face())
        && sorted(tet.face(face.face())) == sorted(facet.vertices);
    is_there.then_some(face)
}
