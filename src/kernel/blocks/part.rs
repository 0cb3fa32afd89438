//! The part of a mesh that one saturation changes, when points may be added in a part of space only.
//!
//! All other tetrahedra stay in their pages. Those that touch the part are its rim: bricks have copies of them, which never change.

use tetdb_schema::page::NONE;

use super::field::Field;
use crate::mesh::{Mesh, Scan, dense, scan_parts, sparse, tets_of_page};
use tetdb_base::storage::{Pages, check_cancelled, kind};

/// Pages scanned at once.
const BATCH: usize = 1_024;

/// Dense ids of tetrahedra, ascending.
#[derive(Debug, Default)]
pub(super) struct Part {
    /// Those that may change.
    pub inside: Vec<u32>,
    /// Those across a face from them.
    pub rim: Vec<u32>,
}

impl Part {
    /// The tetrahedra that the field's place reaches, with that many rings of neighbors around them.
    ///
    /// Effects: the scratch map is used up.
    pub fn around<P: Pages>(mesh: &mut Mesh<P>, field: &Field, rings: u32) -> Self {
        mesh.reset_scratch(dense(mesh.tet_ids_end()), NONE);
        let mut inside = Vec::new();
        let pages: Vec<u32> = (0..mesh.pages().n_pages::<{ kind::TETS }>()).collect();
        for batch in pages.chunks(BATCH) {
            inside.extend(scan_parts(mesh, batch, &Reached(field)).into_iter().flatten());
        }
        for &k in &inside {
            mesh.set_scratch(k, 0);
        }
        let mut from = 0;
        for _ in 0..rings {
            let ring = Self::ring(mesh, &inside[from..]);
            from = inside.len();
            inside.extend(ring);
        }
        let rim = Self::ring(mesh, &inside[from..]);
        inside.sort_unstable();
        Self { inside, rim }
    }

    /// Neighbors of tetrahedra that are not marked in the scratch map yet. Effects: they are.
    fn ring<P: Pages>(mesh: &mut Mesh<P>, last: &[u32]) -> Vec<u32> {
        check_cancelled();
        let mut next = Vec::new();
        for &k in last {
            for face in mesh.tet(sparse(k)).neighbor {
                if face.exists() && mesh.scratch(dense(face.tet())) == NONE {
                    mesh.set_scratch(dense(face.tet()), 0);
                    next.push(dense(face.tet()));
                }
            }
        }
        next.sort_unstable();
        next
    }
}

/// Scan that returns the tetrahedra of a page that the field's place reaches.
struct Reached<'a, 'b>(&'a Field<'b>);

impl Scan for Reached<'_, '_> {
    type Part = u32;
    type Output = Vec<u32>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Vec<u32> {
        let mut found = Vec::new();
        tets_of_page(mesh, page, |mesh, t, tet| {
            if self.0.reaches(&mesh.ends(&tet)) {
                found.push(dense(t));
            }
        });
        found
    }
}
