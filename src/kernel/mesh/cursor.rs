//! The working mesh of one sub-domain, read and changed record by record through its pages.

use tetdb_schema::page::{
    NONE, RECORDS, SLOT_BITS, SLOT_MASK, SLOTS, Slot, dense, next_id, sparse, u32_le,
};
use tetdb_schema::tree::{IdCounts, MeshState};

use super::anatomy::mark::IN_CAVITY;
use super::anatomy::{FaceRef, MARK, REQUIRED, Tet, VERTEX_MASK};
use tetdb_base::storage::{Pager, Pages, SharedPages, StorageError, kind, raise};

/// Cursor over one sub-domain's paged arrays: tetrahedra, vertices, their attributes, facets.
///
/// Every access may load a page and evict another; records are copied out, so nothing dangles.
/// Ids depend only on the order of calls, never on which pages are resident.
#[derive(Clone)]
pub struct Mesh<P: Pages = Pager> {
    pub(super) pages: P,
    pub(super) state: MeshState,
}

/// Record and word pair of the attribute of `id`: four to a record.
#[inline]
fn attribute_place(id: u32) -> (u32, usize) {
    let n = dense(id);
    (sparse(n >> 2), (n as usize & 3) * 2)
}

pub(super) const WORD_ZERO: u32_le = u32_le::from_native(0);

impl<P: Pages> Mesh<P> {
    /// An empty mesh over `pages`, which must hold none.
    pub fn new(pages: P) -> Self {
        Self { pages, state: MeshState::default() }
    }

    /// Continues a mesh whose pages were stored with `state`.
    pub fn with_state(pages: P, state: MeshState) -> Self {
        Self { pages, state }
    }

    /// The counts to store with the pages.
    pub fn state(&self) -> MeshState {
        self.state
    }

    /// Replaces the counts, after all records were numbered anew.
    pub(super) fn set_state(&mut self, state: MeshState) {
        self.state = state;
    }

    /// A record as it is.
    #[inline(always)]
    pub(super) fn record<const K: usize>(&mut self, id: u32) -> Slot {
        *self.pages.read::<K>(id)
    }

    /// Writes a record to an id that may lie in the next page not yet there.
    #[inline(always)]
    pub(super) fn place_record<const K: usize>(&mut self, to: u32, record: Slot) {
        self.pages.append_up_to::<K>(to);
        *self.pages.write::<K>(to) = record;
    }

    /// The attribute of an id in an array before page `first`.
    pub(super) fn attribute_before<const K: usize>(&mut self, id: u32, first: u32) -> (u32, u32) {
        match attribute_place(id).0 >> SLOT_BITS < first {
            true => self.attribute::<K>(id),
            // Never set: the page there belongs to the new array by now.
            false => (0, 0),
        }
    }

    /// Sets the attribute of an id in an array that begins at page `first`, where it has none yet.
    pub(super) fn place_attribute<const K: usize>(
        &mut self,
        to: u32,
        first: u32,
        (a, b): (u32, u32),
    ) {
        if a | b == 0 {
            return;
        }
        let (record, word) = attribute_place(to);
        let record = record + (first << SLOT_BITS);
        self.pages.append_up_to::<K>(record);
        let slot = self.pages.write::<K>(record);
        slot[word] = a.into();
        slot[word + 1] = b.into();
    }

    /// The mesh as several threads may read it, when all of it is in memory.
    pub fn shared(&mut self) -> Option<Mesh<SharedPages<'_>>> {
        let state = self.state;
        Some(Mesh { pages: self.pages.shared()?, state })
    }

    /// The pages themselves.
    pub fn pages(&self) -> &P {
        &self.pages
    }

    /// The pages themselves, for data other than tetrahedra, vertices or facets.
    pub fn pages_mut(&mut self) -> &mut P {
        &mut self.pages
    }

    /// Ends the cursor.
    pub fn into_pages(self) -> P {
        self.pages
    }

    #[inline]
    pub(super) fn take_id<const K: usize>(
        pages: &mut P,
        pool: &mut IdCounts,
        what: &'static str,
    ) -> u32 {
        pool.n_live += 1;
        if pool.free_head != NONE {
            let id = pool.free_head;
            pool.free_head = pages.read::<K>(id)[1].to_native();
            return id;
        }
        let id = pool.fresh;
        if id >= VERTEX_MASK - SLOTS as u32 {
            raise(StorageError::TooMany { what });
        }
        pages.append_up_to::<K>(id);
        pool.fresh = next_id(id);
        id
    }

    // ----- tetrahedra -------------------------------------------------------------------------

    /// Tetrahedra in use.
    pub fn n_tets(&self) -> u32 {
        self.state.tets.n_live
    }

    /// Every tetrahedron id in use is below this.
    pub fn tet_ids_end(&self) -> u32 {
        self.state.tets.fresh
    }

    /// The record of `t`, in use or not.
    #[inline(always)]
    pub fn tet(&mut self, t: u32) -> Tet {
        Tet::from_slot(self.pages.read::<{ kind::TETS }>(t))
    }

    /// The vertex opposite `face`, unless its tetrahedron is marked as in the cavity.
    #[inline(always)]
    pub fn apex_if_unmarked(&mut self, face: FaceRef) -> Option<u32> {
        let slot = self.pages.read::<{ kind::TETS }>(face.tet());
        if slot[IN_CAVITY].to_native() & MARK != 0 {
            return None;
        }
        Some(slot[face.face()].to_native() & VERTEX_MASK)
    }

    /// The vertex opposite `face`.
    #[inline(always)]
    pub fn apex(&mut self, face: FaceRef) -> u32 {
        self.pages.read::<{ kind::TETS }>(face.tet())[face.face()].to_native() & VERTEX_MASK
    }

    /// Replaces the record of `t`.
    #[inline(always)]
    pub fn set_tet(&mut self, t: u32, tet: Tet) {
        *self.pages.write::<{ kind::TETS }>(t) = tet.to_slot();
    }

    /// Replaces one node word, flags included.
    #[inline(always)]
    pub fn set_node(&mut self, t: u32, i: usize, node: u32) {
        self.pages.write::<{ kind::TETS }>(t)[i] = node.into();
    }

    /// Replaces one neighbor.
    #[inline(always)]
    pub fn set_neighbor(&mut self, face: FaceRef, to: FaceRef) {
        self.pages.write::<{ kind::TETS }>(face.tet())[4 + face.face()] = to.0.into();
    }

    /// Makes two faces neighbors of each other; either may be [`FaceRef::NONE`].
    #[inline]
    pub fn link(&mut self, a: FaceRef, b: FaceRef) {
        if a.exists() {
            self.set_neighbor(a, b);
        }
        if b.exists() {
            self.set_neighbor(b, a);
        }
    }

    /// Marks or unmarks a face as required, on both sides.
    pub fn set_required(&mut self, face: FaceRef, required: bool) {
        let other = self.tet(face.tet()).neighbor[face.face()];
        for f in [face, other] {
            if f.exists() {
                let word = &mut self.pages.write::<{ kind::TETS }>(f.tet())[f.face()];
                let bits = word.to_native();
                *word =
                    u32_le::from_native(if required { bits | REQUIRED } else { bits & !REQUIRED });
            }
        }
    }

    /// Sets or clears the mark bit of node `i`.
    #[inline]
    pub fn set_mark(&mut self, t: u32, i: usize, marked: bool) {
        let word = &mut self.pages.write::<{ kind::TETS }>(t)[i];
        let bits = word.to_native();
        *word = u32_le::from_native(if marked { bits | MARK } else { bits & !MARK });
    }

    /// An unused tetrahedron id; its record and attribute are arbitrary.
    #[inline]
    pub fn take_tet(&mut self) -> u32 {
        Self::take_id::<{ kind::TETS }>(&mut self.pages, &mut self.state.tets, "tetrahedra")
    }

    /// Forgets all tetrahedra and what was said of them.
    pub fn clear_tets(&mut self) {
        self.pages.clear::<{ kind::TETS }>();
        self.pages.clear::<{ kind::TET_ATTRIBUTES }>();
        self.state.tets = IdCounts::without_gaps(0);
    }

    /// Takes `n` ids of tetrahedra behind all others, and returns the dense id of the first; each is then to be placed once, in any order.
    pub fn take_tets(&mut self, n: u32) -> u32 {
        let tets = &mut self.state.tets;
        let first = dense(tets.fresh);
        if u64::from(first) + u64::from(n) > u64::from(dense(VERTEX_MASK - SLOTS as u32)) {
            raise(StorageError::TooMany { what: "tetrahedra" });
        }
        tets.fresh = sparse(first + n);
        tets.n_live += n;
        first
    }

    /// Writes a tetrahedron whose id was taken by [`Mesh::take_tets`], or is to lie behind all.
    #[inline]
    pub fn place_tet(&mut self, t: u32, tet: Tet) {
        self.pages.append_up_to::<{ kind::TETS }>(t);
        self.set_tet(t, tet);
    }

    /// Gives the id of `t` back. Effects: references to `t` dangle until relinked.
    pub fn free_tet(&mut self, t: u32) {
        let slot = self.pages.write::<{ kind::TETS }>(t);
        *slot = [WORD_ZERO; 8];
        slot[0] = NONE.into();
        slot[1] = self.state.tets.free_head.into();
        self.state.tets.free_head = t;
        self.state.tets.n_live -= 1;
    }

    /// The first tetrahedron in use with an id of at least `from`, in id (and page) order.
    #[inline(always)]
    pub fn next_tet(&mut self, mut from: u32) -> Option<(u32, Tet)> {
        if (from & SLOT_MASK) as usize >= RECORDS {
            from = ((from >> SLOT_BITS) + 1) << SLOT_BITS;
        }
        while from < self.state.tets.fresh {
            let tet = self.tet(from);
            if tet.is_live() {
                return Some((from, tet));
            }
            from = next_id(from);
        }
        None
    }

    /// Region and flags of `t`.
    pub fn tet_attribute(&mut self, t: u32) -> (u32, u32) {
        self.attribute::<{ kind::TET_ATTRIBUTES }>(t)
    }

    /// Sets region and flags of `t`.
    pub fn set_tet_attribute(&mut self, t: u32, region: u32, flags: u32) {
        self.set_attribute::<{ kind::TET_ATTRIBUTES }>(t, region, flags);
    }

    pub(super) fn attribute<const K: usize>(&mut self, id: u32) -> (u32, u32) {
        let (record, word) = attribute_place(id);
        if record >> SLOT_BITS >= self.pages.n_pages::<K>() {
            return (0, 0);
        }
        let slot = self.pages.read::<K>(record);
        (slot[word].to_native(), slot[word + 1].to_native())
    }

    pub(super) fn set_attribute<const K: usize>(&mut self, id: u32, first: u32, second: u32) {
        let (record, word) = attribute_place(id);
        self.pages.append_up_to::<K>(record);
        let slot = self.pages.write::<K>(record);
        slot[word] = first.into();
        slot[word + 1] = second.into();
    }

    /// Points `tet_of` of every vertex to its tetrahedron of smallest id: one pass in page order.
    pub fn refresh_tet_of(&mut self) {
        let mut from = self.state.tets.fresh;
        while from > 0 {
            from -= 1;
            if (from & SLOT_MASK) as usize >= RECORDS {
                continue;
            }
            let tet = self.tet(from);
            if tet.is_live() {
                for v in tet.vertices() {
                    self.set_tet_of(v, from);
                }
            }
        }
    }

    // ----- scratch ----------------------------------------------------------------------------

    /// Word `n` of the scratch map; it must have been set.
    #[inline]
    pub fn scratch(&mut self, n: u32) -> u32 {
        self.pages.read::<{ kind::SCRATCH }>(sparse(n >> 3))[n as usize & 7].to_native()
    }

    /// Sets word `n` of the scratch map, which grows as needed.
    #[inline]
    pub fn set_scratch(&mut self, n: u32, word: u32) {
        let slot = sparse(n >> 3);
        self.pages.append_up_to::<{ kind::SCRATCH }>(slot);
        self.pages.write::<{ kind::SCRATCH }>(slot)[n as usize & 7] = word.into();
    }

    /// Clears the scratch map and sets its first `n` words.
    pub fn reset_scratch(&mut self, n: u32, word: u32) {
        self.clear_scratch();
        (0..n).for_each(|k| self.set_scratch(k, word));
    }

    /// Clears the scratch map.
    pub fn clear_scratch(&mut self) {
        self.pages.clear::<{ kind::SCRATCH }>();
    }
}
