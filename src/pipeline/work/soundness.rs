//! Whether a mesh that a job began with is one: asked when the job panics, for whoever knows the format can change pages and make their
//! sums right again.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crate::mesh::{FaceRef, Mesh};
use crate::pipeline::error::PipelineError;
use crate::sealed::SealedError;
use crate::storage::{DiskPath, Pages, StorageError, attempt};
use tetdb_schema::page::{RECORDS, SLOT_MASK};

/// Does `work`. Errors: its own; damage, when it panics and what `open` opens, which it began with, is no mesh. Other panics are bugs and
/// go on unwinding.
pub(super) fn panic_is_damage_of<T>(
    (base, part): (&DiskPath, u32),
    open: impl Fn() -> Result<Mesh, PipelineError>,
    work: impl FnOnce() -> Result<T, PipelineError>,
) -> Result<T, PipelineError> {
    let panic = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(done) => return done,
        Err(panic) => panic,
    };
    // What is raised is an error already.
    if panic.is::<StorageError>() {
        resume_unwind(panic);
    }
    match attempt(|| open().map(|mut mesh| is_sound(&mut mesh)))?? {
        true => resume_unwind(panic),
        false => Err(PipelineError::from(SealedError::Content {
            path: base.path().to_owned(),
            subdomain: part,
            what: "tetrahedra of its working mesh do not fit together".to_owned(),
        })),
    }
}

/// Whether every tetrahedron and face has vertices of the mesh, and every neighbor the same face. Unwinds on errors.
fn is_sound<P: Pages>(mesh: &mut Mesh<P>) -> bool {
    let (tets, vertices) = (mesh.tet_ids_end(), mesh.vertex_ids_end());
    let is_id = |id: u32, end: u32| id < end && ((id & SLOT_MASK) as usize) < RECORDS;
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let [a, b, c, d] = tet.vertices();
        let is_distinct = a != b && a != c && a != d && b != c && b != d && c != d;
        if !is_distinct || ![a, b, c, d].iter().all(|&v| is_id(v, vertices)) {
            return false;
        }
        for face in 0..4 {
            let across = tet.neighbor[face];
            if !across.exists() {
                continue;
            }
            if !is_id(across.tet(), tets) {
                return false;
            }
            let other = mesh.tet(across.tet());
            let sorted = |mut face: [u32; 3]| {
                face.sort_unstable();
                face
            };
            let is_same = sorted(other.face(across.face())) == sorted(tet.face(face));
            let is_mutual = other.neighbor[across.face()] == FaceRef::new(t, face);
            if !other.is_live() || !is_mutual || !is_same {
                return false;
            }
        }
    }
    (0..mesh.n_facets()).all(|n| mesh.facet(n).vertices.iter().all(|&v| is_id(v, vertices)))
        && (0..mesh.n_interface_faces())
            .all(|n| (mesh.interface_face(n).vertices.iter()).all(|&v| is_id(v, vertices)))
}
