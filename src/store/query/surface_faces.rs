//! Required faces of a sub-domain's tetrahedra, on which their excess depends: input triangles, and support triangles of embedded edges.

use tetdb_schema::record::{NO_TET, SealedTet};

use crate::sealed::{Subdomain, face_of};
use crate::store::StoreError;
use tetdb_base::storage::{Lease, check_cancelled};

/// The required faces of one sub-domain.
pub struct SurfaceFaces {
    pub rank: u32,
    /// A tetrahedron and the vertices of one of its faces, sorted.
    faces: Vec<(u32, [u32; 3])>,
    _lease: Lease,
}

impl SurfaceFaces {
    /// Bytes of the faces of a sub-domain.
    pub fn bytes(part: &Subdomain) -> u64 {
        2 * part.row().facets * size_of::<(u32, [u32; 3])>() as u64
    }

    /// Reads the faces of a sub-domain; `lease` is for [`SurfaceFaces::bytes`]. Errors: damage.
    pub fn read(part: &mut Subdomain, lease: Lease) -> Result<Self, StoreError> {
        let mut faces = Vec::with_capacity(2 * part.row().facets as usize);
        for chunk in 0..part.row().chunks[2] {
            check_cancelled();
            for facet in part.facet_chunk(chunk)?.records {
                let tets = facet.tets.into_iter().filter(|&t| t != NO_TET);
                faces.extend(tets.map(|t| (t, facet.vertices)));
            }
        }
        faces.sort_unstable();
        Ok(Self { rank: part.id().rank(), faces, _lease: lease })
    }

    /// Marks the required faces of a tetrahedron, number `local`.
    pub fn of(&self, local: u32, tet: &SealedTet) -> [bool; 4] {
        let mut on_surface = [false; 4];
        let first = self.faces.partition_point(|face| face.0 < local);
        for (_, face) in self.faces[first..].iter().take_while(|f| f.0 == local) {
            let own = face_of(*face, tet.nodes);
            on_surface = [0, 1, 2, 3].map(|i| on_surface[i] || own[i]);
        }
        on_surface
    }
}
