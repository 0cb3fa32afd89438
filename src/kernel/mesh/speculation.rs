//! Speculative evaluation: threads evaluate the next operations on a mesh before their turn.
//!
//! Each evaluation has a private draft of the mesh. Its outcome holds as long as nothing changes at the vertices of the
//! tetrahedra that it has read.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use tetdb_schema::page::SLOT_BITS;

use super::Mesh;
use super::anatomy::VERTEX_MASK;
use tetdb_base::storage::{DraftPages, Pages, check_cancelled, kind, parallel};

/// Something to be tried on many items.
pub trait Speculation: Sync {
    /// An item to evaluate.
    type Item: Sync;
    /// Scratch of one thread; it must not influence outcomes.
    type Scratch: Send;
    /// Outcome of an evaluation.
    type Outcome: Send;

    /// Evaluates an item on a draft, which may stay changed.
    fn attempt<P: Pages>(
        &self,
        scratch: &mut Self::Scratch,
        mesh: &mut Mesh<P>,
        item: &Self::Item,
    ) -> Option<(Self::Outcome, DraftState)>;
}

/// State of the draft after an evaluation.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum DraftState {
    /// The draft must equal the mesh; else the outcome does not count.
    Unchanged,
    /// It may be anything.
    Used,
}

/// An outcome, and the vertices it depends on.
pub struct Evaluated<F> {
    /// The outcome.
    pub found: F,
    /// Vertices of all tetrahedra read, in ascending order. Where nothing has changed at them, the same comes of it still.
    pub vertices: Vec<u32>,
}

/// Tries all items, each on the mesh as it is, which stays so: one thread for each scratch. In the order of the items; nothing where not all of the mesh is in memory.
pub fn evaluate_speculatively<P: Pages, T: Speculation>(
    mesh: &mut Mesh<P>,
    items: &[T::Item],
    scratch: &mut [T::Scratch],
    trial: &T,
) -> Vec<Option<Evaluated<T::Outcome>>> {
    let mut all = Vec::new();
    all.resize_with(items.len(), || None);
    let Some(shared) = mesh.shared() else {
        return all;
    };
    let (state, base) = (shared.state(), shared.into_pages());
    let next = AtomicUsize::new(0);
    let work = |scratch: &mut T::Scratch| {
        let mut done = Vec::new();
        let mut draft = Mesh::with_state(DraftPages::new(base), state);
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else {
                return done;
            };
            check_cancelled();
            draft.pages.restart();
            draft.state = state;
            let Some((found, left)) = trial.attempt(scratch, &mut draft, item) else {
                continue;
            };
            // Taking a number and giving it back may change which number is next.
            let is_unchanged = || draft.state == state && draft.pages.is_unchanged();
            if left == DraftState::Used || is_unchanged() {
                let vertices = vertices_met(&draft.pages);
                done.push((at, Evaluated { found, vertices }));
            }
        }
    };
    let done: Vec<_> = parallel(|| scratch.par_iter_mut().map(work).collect());
    for (at, foreseen) in done.into_iter().flatten() {
        all[at] = Some(foreseen);
    }
    all
}

fn vertices_met(pages: &DraftPages) -> Vec<u32> {
    let (mut base, mut vertices) = (pages.base(), Vec::new());
    let end = base.n_pages::<{ kind::TETS }>() << SLOT_BITS;
    // Tetrahedra beyond were added in the draft.
    for &t in pages.tets_met().iter().filter(|&&t| t < end) {
        let slot = base.read::<{ kind::TETS }>(t);
        vertices.extend(slot[..4].iter().map(|node| node.to_native() & VERTEX_MASK));
    }
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}
