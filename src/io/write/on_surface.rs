//! Which faces of tetrahedra are required, beside a pass over them: input triangles, and what holds embedded edges.

use std::iter::Peekable;
use std::path::Path;

use tetdb_schema::record::NO_TET;

use super::error::Result;
use super::stream::here;
use tetdb_base::storage::{Sorted, Sorter, check_cancelled, sort_record};
use tetdb_store::sealed::{Subdomain, face_of};

sort_record! {
    /// A face of a tetrahedron.
    struct TetFace {
        tet: u32,
        vertices: [u32; 3],
    }
}

/// The faces of one sub-domain's tetrahedra that are required, asked for in ascending order of tetrahedra.
pub(super) struct OnSurface {
    faces: Peekable<Sorted<TetFace>>,
}

impl OnSurface {
    /// Sorts those of a sub-domain, in `memory` bytes with scratch in `dir`. Errors: damage, the disk.
    pub fn of_part(part: &mut Subdomain, dir: &Path, memory: u64) -> Result<Self> {
        let mut sorter = Sorter::new(dir, memory);
        for facet in part.facets() {
            check_cancelled();
            let facet = facet?;
            for tet in facet.tets.into_iter().filter(|&t| t != NO_TET) {
                let face = TetFace { tet, vertices: facet.vertices };
                sorter.push(face)?;
            }
        }
        let faces = sorter.finish()?.peekable();
        Ok(Self { faces })
    }

    /// Whether each face of tetrahedron `local` of these vertices, opposite the vertex of its place, is required. Errors: the disk.
    pub fn faces(&mut self, local: u32, nodes: [u32; 4]) -> Result<[bool; 4]> {
        let mut on_surface = [false; 4];
        while let Some(face) = self.faces.next_if(|face| here(face, |face| face.tet <= local)) {
            let face = face?;
            if face.tet == local {
                let own = face_of(face.vertices, nodes);
                on_surface = [0, 1, 2, 3].map(|i| on_surface[i] || own[i]);
            }
        }
        Ok(on_surface)
    }
}
