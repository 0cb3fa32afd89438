//! Preparations of the merged mesh: boundary faces and required faces of its sub-domains.

use std::path::Path;

use super::error::Result;
use super::faces::{FaceSorter, FaceSource};
use super::scope::FaceSet;
use tetdb_base::storage::check_cancelled;
use tetdb_schema::record::NO_TET;
use tetdb_store::sealed::{FaceJoin, FaceJoinSorter, SealedError, Subdomain};

/// Gathers the faces of a sub-domain's tetrahedra that are required: input triangles, and support triangles of embedded edges. Errors: damage, the disk.
pub(super) fn required_faces(part: &mut Subdomain, dir: &Path, memory: u64) -> Result<FaceJoin> {
    let mut sorter = FaceJoinSorter::new(dir, memory);
    for facet in part.facets() {
        check_cancelled();
        let facet = facet?;
        for tet in facet.tets.into_iter().filter(|&tet| tet != NO_TET) {
            sorter.push(tet, facet.vertices, false, 0)?;
        }
    }
    Ok(sorter.finish()?)
}

pub(super) fn misplaced(part: &Subdomain, found: u32, expected: u32) -> SealedError {
    part.damaged(format!("tetrahedron {found} stands where {expected} was expected"))
}

/// Adds the faces of a sub-domain that its scope lists to `sorter`. Interface faces are labelled by the sub-domain behind
/// them, from `first_label` on. Facets from `support_first` on are no triangles of the input.
pub(super) fn collect_faces(
    from: &mut Subdomain,
    part: &FaceSource,
    [first_label, support_first]: [u64; 2],
    sorter: &mut FaceSorter,
) -> Result<()> {
    if part.scope.faces != FaceSet::Interfaces {
        for facet in from.facets() {
            let facet = facet?;
            if facet.triangle < support_first {
                sorter.push(&facet, part)?;
            }
        }
    }
    for face in from.interfaces() {
        let face = face?;
        if part.scope.lists(part.rank, face.other) {
            sorter.push_interface(&face, first_label as u32 + face.other, part)?;
        }
    }
    Ok(())
}
