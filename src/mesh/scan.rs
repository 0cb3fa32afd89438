//! Looking at many pages of a mesh that nobody changes meanwhile: on all threads of the run when it is in memory.

use rayon::prelude::*;

use super::Mesh;
use crate::storage::{Pages, check_cancelled, n_threads, parallel};

/// A question to parts of a mesh, each answered for itself.
pub trait Scan: Sync {
    /// A part: a page of tetrahedra, a range of edges.
    type Part: Sync;
    /// What is found in a part.
    type Output: Send;
    /// Looks at a part. Is not to change the mesh.
    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, part: &Self::Part) -> Self::Output;
}

/// Scans parts and passes what is found to `take`, part by part in their order, whoever scanned them.
///
/// Memory: what is found in all parts, or in one where the mesh is not in memory; `take` may change the mesh, so parts must
/// not depend on what it does: give few at a time where that matters.
pub fn scan_parts<P: Pages, S: Scan>(
    mesh: &mut Mesh<P>,
    parts: &[S::Part],
    scan: &S,
) -> Vec<S::Output> {
    if parts.len() > 1
        && n_threads() > 1
        && let Some(shared) = mesh.shared()
    {
        let found = |part| {
            check_cancelled();
            scan.scan(&mut shared.clone(), part)
        };
        return parallel(|| parts.par_iter().map(found).collect());
    }
    let found = |part| scan.scan(mesh, part);
    parts.iter().map(found).collect()
}
