//! What comes of the next tries: found out on all threads before their turn.

use std::collections::{HashMap, HashSet};

use super::operator::{Attacks, Operator, Outcome};
use crate::mesh::{Evaluated, Mesh, evaluate_speculatively};
use tetdb_base::storage::{Pages, spare_threads};

/// Tried ahead for each thread at once. One in twenty has to be tried again, for something changed beside it; with sixteen one in seven.
const EACH: usize = 4;
/// Fewer are not worth waking threads for.
const LEAST: usize = 2;

/// What is foreseen of some tetrahedra, and the vertices around which something has changed since.
///
/// It never decides what is done, only whether it is looked for once more: meshes do not depend on it, nor on the number of threads.
#[derive(Default)]
pub(super) struct Window {
    /// Of those whose turn has not come yet; nothing where it is not known.
    foreseen: HashMap<u32, Option<Evaluated<Outcome>>>,
    changed: HashSet<u32>,
}

impl Window {
    /// How many to try ahead now; none while the turn of some is still to come, or where there is one thread: what is tried ahead for nothing costs others theirs.
    pub(super) fn room(&self) -> usize {
        match spare_threads() {
            n if n > 1 && self.foreseen.is_empty() => EACH * n,
            _ => 0,
        }
    }

    /// Tries them ahead.
    pub(super) fn look<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        tets: &[u32],
        operators: &mut Vec<Operator>,
        attacks: &Attacks,
    ) {
        self.clear();
        if tets.len() < LEAST {
            return;
        }
        operators.resize_with(spare_threads(), Operator::ahead);
        let foreseen = evaluate_speculatively(mesh, tets, operators, attacks);
        (self.foreseen).extend(tets.iter().copied().zip(foreseen));
    }

    /// What comes of trying a tetrahedron whose turn it is, if that is known.
    pub(super) fn take(&mut self, t: u32) -> Option<Outcome> {
        let foreseen = self.foreseen.remove(&t)??;
        let has_changed = foreseen.vertices.iter().any(|v| self.changed.contains(v));
        (!has_changed).then_some(foreseen.found)
    }

    /// Tells that these tetrahedra are new or moved.
    pub(super) fn tell<P: Pages>(&mut self, mesh: &mut Mesh<P>, tets: &[u32]) {
        if !self.foreseen.is_empty() {
            for &t in tets {
                self.changed.extend(mesh.tet(t).vertices());
            }
        }
    }

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.foreseen.clear();
        self.changed.clear();
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::Mesh;
    use crate::optimize::tests::{checked, delaunay, live, random};
    use crate::optimize::{MendCounts, Mode, run};
    use tetdb_base::geom::Point;
    use tetdb_base::storage::{CancelToken, Pager, RunContext};

    /// A flat cloud, of whose tetrahedra many are slivers, mended by so many threads: what was done, and all that came of it.
    fn mended(seed: u64, threads: usize) -> (MendCounts, Vec<u64>) {
        let mut next = random(seed);
        let points: Vec<Point> =
            (0..500).map(|_| Point::new(next(), next(), 0.02 * next())).collect();
        let pager = Pager::new(1 << 24, None);
        let mut mesh = delaunay(Mesh::new(pager), &points, 250, 0.1);
        let context = RunContext::new(threads, CancelToken::new());
        let report = context.enter(|| run(&mut mesh, Mode::Full, &|_| ()));
        checked(&mut mesh);
        let mut all = Vec::new();
        for (t, tet) in live(&mut mesh) {
            all.push(t.into());
            all.extend(tet.neighbor.map(|across| u64::from(across.0)));
            for v in tet.vertices() {
                all.push(v.into());
                all.extend(mesh.point(v).to_array().map(f64::to_bits));
            }
        }
        (report.mended, all)
    }

    #[test]
    fn what_is_foreseen_is_what_comes() {
        let (mut n_tried, mut n_changed) = (0, 0);
        for seed in 0..4 {
            let (counts, one) = mended(seed, 1);
            for threads in [2, 5] {
                let (others, several) = mended(seed, threads);
                assert_eq!(counts, others, "seed {seed}, {threads} threads");
                assert_eq!(one, several, "seed {seed}, {threads} threads");
            }
            n_tried += counts.tried;
            n_changed += counts.changes();
        }
        assert!(n_tried > 500 && n_changed > 100, "{n_tried}, {n_changed} changes");
    }
}
