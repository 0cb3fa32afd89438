//! Which faces of a sub-domain's tetrahedra are input triangles: what their excess depends on.

use std::sync::Arc;

use tetdb_schema::record::{NO_TET, SealedTet};

use super::{QueryError, QuerySession};
use crate::storage::{Lease, check_cancelled};

/// The faces of one sub-domain that are input triangles.
pub(super) struct SurfaceFaces {
    rank: u32,
    /// A tetrahedron and the vertices of one of its faces, sorted.
    faces: Vec<(u32, [u32; 3])>,
    _lease: Lease,
}

impl SurfaceFaces {
    /// Whether each face of a tetrahedron, number `local`, is an input triangle.
    pub fn of(&self, local: u32, tet: &SealedTet) -> [bool; 4] {
        let mut on_surface = [false; 4];
        let first = self.faces.partition_point(|face| face.0 < local);
        for (_, face) in self.faces[first..].iter().take_while(|f| f.0 == local) {
            for (on_surface, v) in on_surface.iter_mut().zip(tet.nodes) {
                // The face opposite the vertex it lacks.
                *on_surface |= !face.contains(&v);
            }
        }
        on_surface
    }
}

impl QuerySession {
    /// Those of a sub-domain, kept until another's are wanted. Errors: as [`QuerySession::read_surface`].
    pub(super) fn surface_of(&mut self, rank: u32) -> Result<Arc<SurfaceFaces>, QueryError> {
        if let Some(known) = self.surface.as_ref().filter(|s| s.rank == rank) {
            return Ok(known.clone());
        }
        self.surface = None;
        let read = Arc::new(self.read_surface(rank)?);
        Ok(self.surface.insert(read).clone())
    }

    /// Errors: damage; a budget without 16 bytes for each side of an input triangle.
    fn read_surface(&mut self, rank: u32) -> Result<SurfaceFaces, QueryError> {
        let row = self.part(rank)?.subdomain.row();
        let (chunks, sides) = (row.chunks[2], 2 * row.facets);
        let lease = (self.budget).lease(sides * 16, "the sides of the input triangles")?;
        let mut faces = Vec::new();
        for chunk in 0..chunks {
            check_cancelled();
            self.count_faces();
            for facet in self.part(rank)?.subdomain.facet_chunk(chunk)?.records {
                let tets = facet.tets.into_iter().filter(|&t| t != NO_TET);
                faces.extend(tets.map(|t| (t, facet.vertices)));
            }
        }
        faces.sort_unstable();
        Ok(SurfaceFaces {
            rank,
            faces,
            _lease: lease,
        })
    }
}
