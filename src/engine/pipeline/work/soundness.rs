//! Checks that the mesh a job starts from is valid.
//!
//! The check runs when the job panics. A forged file can have changed pages with correct checksums, and such a mesh may make a
//! job panic.

use std::collections::{BTreeMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{DiskPath, Pages, StorageError, attempt};
use tetdb_kernel::mesh::{FaceRef, Mesh};
use tetdb_schema::page::{RECORDS, SLOT_MASK};
use tetdb_schema::topology::FacesAcross;
use tetdb_store::sealed::SealedError;

/// Runs `work`, which starts from the mesh that `open` opens.
///
/// Errors: those of `work`; damage, if `work` panics and the mesh it started from is not valid. Other panics are bugs and
/// continue to unwind.
pub fn panic_is_damage_of<T>(
    (base, part): (&DiskPath, u32),
    open: impl Fn() -> Result<Mesh, PipelineError>,
    work: impl FnOnce() -> Result<T, PipelineError>,
) -> Result<T, PipelineError> {
    let panic = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(done) => return done,
        Err(panic) => panic,
    };
    // A raised storage error is an error already.
    if panic.is::<StorageError>() {
        resume_unwind(panic);
    }
    match attempt(|| open().map(|mut mesh| is_sound(&mut mesh)))?? {
        true => resume_unwind(panic),
        false => Err(damaged((base, part), "tetrahedra of its working mesh do not fit together")),
    }
}

fn damaged((base, part): (&DiskPath, u32), what: &str) -> PipelineError {
    PipelineError::from(SealedError::Content {
        path: base.path().to_owned(),
        subdomain: part,
        what: what.to_owned(),
    })
}

/// Checks the interface faces of a sub-domain before work begins. Errors: damage, if an interface face has no owner on its other
/// side.
pub fn check_owners<P: Pages>(
    mesh: &mut Mesh<P>,
    owners: &BTreeMap<u32, FacesAcross>,
    place: (&DiskPath, u32),
) -> Result<(), PipelineError> {
    let all = (0..mesh.n_interface_faces()).map(|n| mesh.interface_face(n));
    let mut beyond = all.map(|face| owners.get(&face.cut)?.other(face.index));
    match beyond.all(|other| other.is_some()) {
        true => Ok(()),
        false => Err(damaged(place, "a face between sub-domains that none has beyond")),
    }
}

/// Returns true if the mesh is valid. Unwinds on storage errors.
///
/// Every tetrahedron and facet must have vertices of the mesh, and every neighbor the same face. Every interface face must have a
/// tetrahedron behind it that marks this face as required.
fn is_sound<P: Pages>(mesh: &mut Mesh<P>) -> bool {
    let (tets, vertices) = (mesh.tet_ids_end(), mesh.vertex_ids_end());
    let is_id = |id: u32, end: u32| id < end && ((id & SLOT_MASK) as usize) < RECORDS;
    let sorted = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    // Rotates a face so that its least vertex comes first; its orientation stays.
    let turned = |[a, b, c]: [u32; 3]| match a.min(b).min(c) {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    };
    let between = (0..mesh.n_interface_faces()).map(|n| turned(mesh.interface_face(n).vertices));
    let mut alone: HashSet<[u32; 3]> = between.collect();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let [a, b, c, d] = tet.vertices();
        let is_distinct = a != b && a != c && a != d && b != c && b != d && c != d;
        if !is_distinct || ![a, b, c, d].iter().all(|&v| is_id(v, vertices)) {
            return false;
        }
        for face in 0..4 {
            if tet.is_required(face) {
                alone.remove(&turned(tet.face(face)));
            }
            let across = tet.neighbor[face];
            if !across.exists() {
                continue;
            }
            if !is_id(across.tet(), tets) {
                return false;
            }
            let other = mesh.tet(across.tet());
            let is_same = sorted(other.face(across.face())) == sorted(tet.face(face));
            let is_mutual = other.neighbor[across.face()] == FaceRef::new(t, face);
            if !other.is_live() || !is_mutual || !is_same {
                return false;
            }
        }
    }
    alone.is_empty()
        && (0..mesh.n_facets()).all(|n| mesh.facet(n).vertices.iter().all(|&v| is_id(v, vertices)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::{Aabb, Point};
    use tetdb_base::storage::FlatPages;
    use tetdb_kernel::delaunay::enclose;
    use tetdb_kernel::mesh::MeshInterfaceFace;

    fn face(vertices: [u32; 3]) -> MeshInterfaceFace {
        MeshInterfaceFace { vertices, cut: 2, index: 43, side: 0 }
    }

    #[test]
    fn a_face_between_sub_domains_belongs_to_the_mesh_and_to_a_neighbor() {
        let mut mesh = Mesh::new(FlatPages::default());
        let t = enclose(&mut mesh, &Aabb::around([Point::ZERO, Point::ONE]));
        assert!(is_sound(&mut mesh));
        let tet = mesh.tet(t);
        mesh.set_required(FaceRef::new(t, 1), true);
        mesh.add_interface_face(face(tet.face(1)));
        assert!(is_sound(&mut mesh));
        let path = DiskPath::from(std::path::Path::new("part"));
        let error = check_owners(&mut mesh, &BTreeMap::new(), (&path, 1)).expect_err("no owner");
        assert!(error.to_string().contains("none has beyond"), "{error}");
        // Three of the eight corners that are not a face.
        let mut tets = Vec::new();
        while let Some((t, tet)) = mesh.next_tet(tets.last().map_or(0, |&(t, _)| t + 1)) {
            tets.push((t, tet));
        }
        let corners: Vec<u32> = mesh.vertex_ids().collect();
        let triples = corners.windows(3).map(|v| [v[0], v[1], v[2]]);
        let is_face =
            |v: &[u32; 3]| (tets.iter()).any(|(_, tet)| v.iter().all(|&v| tet.local(v).is_some()));
        let none = triples.into_iter().find(|v| !is_face(v));
        let [a, b, c] = tet.face(1);
        let with = |vertices| {
            let mut mesh = mesh.clone();
            mesh.add_interface_face(face(vertices));
            is_sound(&mut mesh)
        };
        assert!(with([b, c, a]));
        // Reversed, the face lies in front of its tetrahedron; another face is not required.
        assert!(!with([a, c, b]) && !with(tet.face(0)));
        assert!(!with(none.expect("three that are no face")));
    }
}
