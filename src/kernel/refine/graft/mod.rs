//! Pieces of the pattern set in whole, before edges are divided.
//!
//! Where a grain has room, the tetrahedra of its places are known beforehand: those of the pattern. Of such a piece only the places at its
//! outer faces are inserted one by one. Then its outer faces are faces of the mesh, for a Delaunay tetrahedron stays one when points
//! outside its sphere are left out; what the mesh has between them is replaced by the piece. That is checked, face by face; a piece that does not
//! fit is left to the division of edges, and so is all that lies between pieces and around them.

mod claims;
mod parts;
mod piece;
mod set_in;
mod tets;

use std::iter::Peekable;

use super::field::Field;
use super::report::RefineReport;
use super::worker::Worker;
use crate::mesh::{Mesh, Workspace};
use tetdb_base::storage::{Pages, StorageError, in_place_scope, spare_threads};

use claims::Claim;
use piece::Piece;
use set_in::Setter;

/// Bytes held while the tetrahedra of the pattern are found, and after.
pub const PATTERN_BYTES: u64 = 8 << 20;

/// Finds the tetrahedra of the pattern, once for the process: whoever sets in the first piece would wait for them.
pub fn find_pattern() {
    tets::PatternTets::get();
}

/// A grain with more in its way is left alone: what concerns it would not fit small leases.
const CLAIMS_MAX: usize = 1 << 17;

/// Sets in all pieces there is room for, and inserts what other places there are in their grains.
///
/// Sizes must be set at all vertices. Effects: ids of tetrahedra are used again. Errors: the disk, while sorting.
pub(super) fn set_in<P: Pages>(
    worker: &mut Worker,
    mesh: &mut Mesh<P>,
    field: &Field,
    space: &Workspace,
    report: &mut RefineReport,
    progress: &mut dyn FnMut(u64),
) -> Result<(), StorageError> {
    let Some(sorted) = claims::gather(mesh, field, space, &mut worker.active)? else {
        return Ok(());
    };
    let mut setter = Setter::default();
    let mut grains = Grains { sorted: sorted.peekable() };
    let with_piece = |claims: Vec<Claim>| (Piece::of(&claims, field), claims);
    let mut at_hand = grains.next().transpose()?.map(with_piece);
    while let Some((piece, claims)) = at_hand.take().filter(|_| !setter.gives_up()) {
        let following = grains.next().transpose()?;
        // The next piece needs nothing of the mesh. Two of them at once where memory holds the whole mesh.
        let ahead = piece.is_some() && spare_threads() > 1 && mesh.shared().is_some();
        let set_in = || {
            if let Some(mut piece) = piece {
                setter.set_in(worker, mesh, &mut piece, &claims, report);
                setter.insert_rest(worker, mesh, field, &piece, &claims, report);
                progress(report.inserted);
            }
        };
        if ahead {
            in_place_scope(|scope| {
                scope.spawn(|_| at_hand = following.map(with_piece));
                set_in();
            });
        } else {
            set_in();
            at_hand = following.map(with_piece);
        }
    }
    Ok(())
}

/// What concerns each grain, one after the other; grains that have too much are left out.
struct Grains<I: Iterator<Item = Result<Claim, StorageError>>> {
    sorted: Peekable<I>,
}

impl<I: Iterator<Item = Result<Claim, StorageError>>> Iterator for Grains<I> {
    type Item = Result<Vec<Claim>, StorageError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let first = match self.sorted.next()? {
                Ok(claim) => claim,
                Err(e) => return Some(Err(e)),
            };
            let (mut claims, mut n) = (vec![first], 1);
            let is_same = |claim: &Result<Claim, _>| {
                claim.as_ref().map_or(true, |c: &Claim| c.grain == first.grain)
            };
            while let Some(claim) = self.sorted.next_if(is_same) {
                let claim = match claim {
                    Ok(claim) => claim,
                    Err(e) => return Some(Err(e)),
                };
                n += 1;
                if n <= CLAIMS_MAX {
                    claims.push(claim);
                }
            }
            if n <= CLAIMS_MAX {
                return Some(Ok(claims));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use tetdb_schema::page::NONE;

    use super::*;
    use crate::delaunay::{Kernel, enclose};
    use crate::refine::activity::Activity;
    use crate::refine::candidate::Candidates;
    use crate::refine::edge_cache::EdgeCache;
    use crate::refine::recent::Recent;
    use crate::refine::tests::wall_in;
    use crate::refine::{Everywhere, Lengths};
    use tetdb_base::geom::{Aabb, HilbertFrame, Point};
    use tetdb_base::storage::Pager;

    /// Vertices inside of pieces set into a cube with one vertex in its middle, which is known to be in the way or not.
    fn set_in_around_a_vertex(known: bool) -> u64 {
        let mut mesh = Mesh::new(Pager::new(1 << 28, None));
        let bounds = Aabb::around([Point::ZERO, Point::ONE]);
        let start = enclose(&mut mesh, &bounds);
        wall_in(&mut mesh);
        let field = Field { lengths: Lengths::Field, h: &|_| 0.3, place: &Everywhere, bounds };
        let mut worker = Worker {
            kernel: Kernel::default(),
            order: HilbertFrame::new(&bounds),
            edges: Vec::new(),
            candidates: Candidates::default(),
            recent: Recent::new(),
            active: Activity::all(&mesh),
            settled: EdgeCache::new(8),
            last: start,
            placing: true,
            examined_too: false,
        };
        let middle = Point::splat(0.5);
        let v = mesh.add_vertex(middle, 0.3);
        let inserted = worker.kernel.insert(&mut mesh, v, middle, start);
        worker.last = inserted.expect("it is inside");
        for v in mesh.vertex_ids() {
            mesh.set_size(v, 0.3);
        }
        let dir = tempfile::tempdir().expect("a temporary directory");
        let space = Workspace { dir: &dir.path().into(), memory: 1 << 20 };
        let gathered =
            claims::gather(&mut mesh, &field, &space, &mut worker.active).expect("room for runs");
        let claims = gathered.expect("there is room in the cube");
        let mut claims: Vec<Claim> = claims.map(|claim| claim.expect("in memory")).collect();
        if !known {
            claims.retain(|claim| claim.tet != NONE || claim.point() != middle);
        }
        let (mut setter, mut report) = (Setter::default(), RefineReport::default());
        for claims in claims.chunk_by(|a, b| a.grain == b.grain) {
            if let Some(mut piece) = Piece::of(claims, &field) {
                setter.set_in(&mut worker, &mut mesh, &mut piece, claims, &mut report);
            }
        }
        let mut from = 0;
        let mut found = false;
        while let Some((t, tet)) = mesh.next_tet(from) {
            from = t + 1;
            found |= tet.local(v).is_some();
        }
        assert!(found, "the vertex is still in the mesh");
        report.set_in
    }

    #[test]
    fn a_piece_with_something_inside_is_left_alone() {
        let (known, unknown) = (set_in_around_a_vertex(true), set_in_around_a_vertex(false));
        assert!(known > 100, "{known}");
        assert!(unknown < known, "{unknown} of {known}");
    }
}
