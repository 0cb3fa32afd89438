//! Scans many pages of an unchanging mesh, on all free threads if the mesh is in memory.

use rayon::prelude::*;
use tetdb_schema::page::SLOT_BITS;

use super::{Mesh, Tet};
use tetdb_base::storage::{Pages, check_cancelled, parallel, spare_threads};

/// A question to parts of a mesh, each answered for itself.
pub trait Scan: Sync {
    /// A part: a page of tetrahedra, a range of edges.
    type Part: Sync;
    /// Result for a part.
    type Output: Send;
    /// Looks at a part. Is not to change the mesh.
    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, part: &Self::Part) -> Self::Output;
}

/// Scans parts; results come in the order of the parts.
///
/// Memory: the results of all parts; pass few parts at a time if results are large.
pub fn scan_parts<P: Pages, S: Scan>(
    mesh: &mut Mesh<P>,
    parts: &[S::Part],
    scan: &S,
) -> Vec<S::Output> {
    if parts.len() > 1
        && spare_threads() > 1
        && let Some(shared) = mesh.shared()
    {
        let found = |part| {
            check_cancelled();
            scan.scan(&mut shared.clone(), part)
        };
        return parallel(|| parts.par_iter().map(found).collect());
    }
    let found = |part| {
        check_cancelled();
        scan.scan(mesh, part)
    };
    parts.iter().map(found).collect()
}

/// The tetrahedra in use of a page, in id order.
pub fn tets_of_page<P: Pages>(
    mesh: &mut Mesh<P>,
    page: u32,
    mut each: impl FnMut(&mut Mesh<P>, u32, Tet),
) {
    let end = (page + 1) << SLOT_BITS;
    let mut from = page << SLOT_BITS;
    while let Some((t, tet)) = mesh.next_tet(from) {
        if t >= end {
            break;
        }
        from = t + 1;
        each(mesh, t, tet);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::storage::{CancelToken, FlatPages, RunContext, StorageError, attempt};

    struct Count;

    impl Scan for Count {
        type Part = u32;
        type Output = u32;

        fn scan<P: Pages>(&self, _: &mut Mesh<P>, &part: &u32) -> u32 {
            part + 1
        }
    }

    #[test]
    fn a_scan_ends_with_its_run_whoever_does_it() {
        for threads in [1, 2] {
            let token = CancelToken::new();
            let run = RunContext::new(threads, token.clone());
            let mut mesh = Mesh::new(FlatPages::default());
            let mut found = || run.enter(|| attempt(|| scan_parts(&mut mesh, &[0, 1], &Count)));
            assert_eq!(found().expect("it goes on"), [1, 2]);
            token.cancel();
            assert!(matches!(found(), Err(StorageError::Cancelled)));
        }
    }
}
