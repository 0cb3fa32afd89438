//! The working mesh of one sub-domain, read and changed record by record through its pages.

use tetdb_schema::page::{NONE, RECORDS, SLOT_BITS, SLOT_MASK, SLOTS, Slot, u32_le};

use super::anatomy::mark::IN_CAVITY;
use super::anatomy::{FaceRef, MARK, REQUIRED, Tet, VERTEX_MASK};
use crate::geom::Point;
use crate::store::{Pager, Pages, StoreError, fail, kind};

/// Where a vertex comes from; the numbers are stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u32)]
pub enum VertexTag {
    Free = 0,
    Surface = 1,
    Interface = 2,
    Steiner = 3,
    EnclosingBox = 4,
}

/// A vertex as the end of an edge.
#[derive(Clone, Copy, Debug)]
pub struct End {
    pub point: Point,
    /// Wanted edge length.
    pub h: f32,
    /// Whether it may never move; see [`Mesh::is_fixed`].
    pub fixed: bool,
}

/// Records of one kind: ids handed out in order, freed slots used again, last freed first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arena {
    /// The next id never used.
    fresh: u32,
    free_head: u32,
    pub(super) n_live: u32,
}

impl Default for Arena {
    fn default() -> Self {
        Self {
            fresh: 0,
            free_head: NONE,
            n_live: 0,
        }
    }
}

/// Numbers of a [`MeshState`].
pub const MESH_STATE_WORDS: usize = 12;

/// Counts that, with the pages, are the whole state of a working mesh.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshState {
    tets: Arena,
    vertices: Arena,
    pub(super) facets: Arena,
    pub(super) interface_faces: Arena,
}

impl MeshState {
    /// Counts of records numbered without gaps.
    pub(super) fn dense(
        n_tets: u32,
        n_vertices: u32,
        n_facets: u32,
        n_interface_faces: u32,
    ) -> Self {
        let arena = |n: u32| Arena {
            fresh: sparse(n),
            free_head: NONE,
            n_live: n,
        };
        Self {
            tets: arena(n_tets),
            vertices: arena(n_vertices),
            facets: arena(n_facets),
            interface_faces: arena(n_interface_faces),
        }
    }

    /// Tetrahedra in use.
    pub fn n_tets(&self) -> u32 {
        self.tets.n_live
    }

    /// The counts as numbers, for storing beside the pages.
    pub fn to_words(self) -> [u32; MESH_STATE_WORDS] {
        let [t, v, f, i] = [self.tets, self.vertices, self.facets, self.interface_faces];
        [
            t.fresh,
            t.free_head,
            t.n_live,
            v.fresh,
            v.free_head,
            v.n_live,
            f.fresh,
            f.free_head,
            f.n_live,
            i.fresh,
            i.free_head,
            i.n_live,
        ]
    }

    /// The inverse of [`MeshState::to_words`].
    pub fn from_words(w: [u32; MESH_STATE_WORDS]) -> Self {
        let arena = |i: usize| Arena {
            fresh: w[i],
            free_head: w[i + 1],
            n_live: w[i + 2],
        };
        Self {
            tets: arena(0),
            vertices: arena(3),
            facets: arena(6),
            interface_faces: arena(9),
        }
    }
}

/// Cursor over one sub-domain's paged arrays: tetrahedra, vertices, their attributes, facets.
///
/// Every access may load a page and evict another; records are copied out, so nothing dangles.
/// Ids depend only on the order of calls, never on which pages are resident.
pub struct Mesh<P: Pages = Pager> {
    pub(super) pages: P,
    pub(super) state: MeshState,
}

/// The id after `id` within pages whose last two slots hold no record.
#[inline]
fn next_id(id: u32) -> u32 {
    if (id & SLOT_MASK) as usize == RECORDS - 1 {
        id + 3
    } else {
        id + 1
    }
}

/// Position of record `id` when the unused slots are left out.
#[inline]
pub fn dense(id: u32) -> u32 {
    (id >> SLOT_BITS) * RECORDS as u32 + (id & SLOT_MASK)
}

/// The id at position `n`; inverse of [`dense`].
#[inline]
pub fn sparse(n: u32) -> u32 {
    ((n / RECORDS as u32) << SLOT_BITS) | (n % RECORDS as u32)
}

/// Record and word pair of the attribute of `id`: four to a record.
#[inline]
fn attribute_place(id: u32) -> (u32, usize) {
    let n = dense(id);
    (sparse(n >> 2), (n as usize & 3) * 2)
}

/// The sign bit of a vertex's size: the vertex never moves.
const FIXED: u32 = 1 << 31;
/// Bits of a vertex's tag; those above hold the cut of an interface vertex.
const TAG_BITS: u32 = 3;
const TAG_MASK: u32 = (1 << TAG_BITS) - 1;
const WORD_ZERO: u32_le = u32_le::from_native(0);

#[inline(always)]
fn end(slot: &Slot) -> End {
    let size = slot[6].to_native();
    End {
        point: position(slot),
        h: f32::from_bits(size & !FIXED),
        fixed: size & FIXED != 0,
    }
}

/// The coordinates in a vertex record.
#[inline(always)]
fn position(w: &Slot) -> Point {
    let f = |i: usize| {
        let (low, high) = (w[i].to_native(), w[i + 1].to_native());
        f64::from_bits(u64::from(low) | u64::from(high) << 32)
    };
    Point::new(f(0), f(2), f(4))
}

impl<P: Pages> Mesh<P> {
    /// An empty mesh over `pages`, which must hold none.
    pub fn new(pages: P) -> Self {
        Self {
            pages,
            state: MeshState::default(),
        }
    }

    /// Continues a mesh whose pages were stored with `state`.
    pub fn with_state(pages: P, state: MeshState) -> Self {
        Self { pages, state }
    }

    /// The counts to keep beside the pages.
    pub fn state(&self) -> MeshState {
        self.state
    }

    /// Replaces the counts, after all records were numbered anew.
    pub(super) fn set_state(&mut self, state: MeshState) {
        self.state = state;
    }

    /// Copies a record to an id that may lie in the next page not yet there.
    pub(super) fn copy_record<const K: usize>(&mut self, from: u32, to: u32) {
        let record = *self.pages.read::<K>(from);
        if to >> SLOT_BITS == self.pages.n_pages::<K>() {
            self.pages.append_page::<K>();
        }
        *self.pages.write::<K>(to) = record;
    }

    /// Copies the attribute of id `from` to that of id `to` of an array that begins at page `first`.
    pub(super) fn copy_attribute<const K: usize>(&mut self, from: u32, to: u32, first: u32) {
        if attribute_place(from).0 >> SLOT_BITS >= first {
            // Never set: what is there by now belongs to the new array.
            return;
        }
        let (a, b) = self.attribute::<K>(from);
        if a | b == 0 {
            return;
        }
        let (record, word) = attribute_place(to);
        let record = record + (first << SLOT_BITS);
        while record >> SLOT_BITS >= self.pages.n_pages::<K>() {
            self.pages.append_page::<K>();
        }
        let slot = self.pages.write::<K>(record);
        slot[word] = u32_le::from_native(a);
        slot[word + 1] = u32_le::from_native(b);
    }

    /// The pages themselves.
    pub fn pages(&self) -> &P {
        &self.pages
    }

    /// The pages themselves, for what is not tetrahedra, vertices or facets.
    pub fn pages_mut(&mut self) -> &mut P {
        &mut self.pages
    }

    /// Ends the cursor.
    pub fn into_pages(self) -> P {
        self.pages
    }

    #[inline]
    pub(super) fn take<const K: usize>(
        pages: &mut P,
        arena: &mut Arena,
        what: &'static str,
    ) -> u32 {
        arena.n_live += 1;
        if arena.free_head != NONE {
            let id = arena.free_head;
            arena.free_head = pages.read::<K>(id)[1].to_native();
            return id;
        }
        let id = arena.fresh;
        if id >= VERTEX_MASK - SLOTS as u32 {
            fail(StoreError::TooMany { what });
        }
        if id >> SLOT_BITS == pages.n_pages::<K>() {
            pages.append_page::<K>();
        }
        arena.fresh = next_id(id);
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
        self.pages.write::<{ kind::TETS }>(t)[i] = u32_le::from_native(node);
    }

    /// Replaces one neighbor.
    #[inline(always)]
    pub fn set_neighbor(&mut self, face: FaceRef, to: FaceRef) {
        self.pages.write::<{ kind::TETS }>(face.tet())[4 + face.face()] = u32_le::from_native(to.0);
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
                *word = u32_le::from_native(if required {
                    bits | REQUIRED
                } else {
                    bits & !REQUIRED
                });
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

    /// An unused tetrahedron id; its record is whatever was there, its attribute too.
    #[inline]
    pub fn take_tet(&mut self) -> u32 {
        Self::take::<{ kind::TETS }>(&mut self.pages, &mut self.state.tets, "tetrahedra")
    }

    /// Gives the id of `t` back. Effects: references to `t` dangle until relinked.
    pub fn free_tet(&mut self, t: u32) {
        let slot = self.pages.write::<{ kind::TETS }>(t);
        *slot = [WORD_ZERO; 8];
        slot[0] = u32_le::from_native(NONE);
        slot[1] = u32_le::from_native(self.state.tets.free_head);
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

    fn attribute<const K: usize>(&mut self, id: u32) -> (u32, u32) {
        let (record, word) = attribute_place(id);
        if record >> SLOT_BITS >= self.pages.n_pages::<K>() {
            return (0, 0);
        }
        let slot = self.pages.read::<K>(record);
        (slot[word].to_native(), slot[word + 1].to_native())
    }

    fn set_attribute<const K: usize>(&mut self, id: u32, first: u32, second: u32) {
        let (record, word) = attribute_place(id);
        while record >> SLOT_BITS >= self.pages.n_pages::<K>() {
            self.pages.append_page::<K>();
        }
        let slot = self.pages.write::<K>(record);
        slot[word] = u32_le::from_native(first);
        slot[word + 1] = u32_le::from_native(second);
    }

    // ----- vertices ---------------------------------------------------------------------------

    /// Vertices in use.
    pub fn n_vertices(&self) -> u32 {
        self.state.vertices.n_live
    }

    /// Every vertex id in use is below this.
    pub fn vertex_ids_end(&self) -> u32 {
        self.state.vertices.fresh
    }

    /// Position of `v`.
    #[inline(always)]
    pub fn point(&mut self, v: u32) -> Point {
        position(self.pages.read::<{ kind::VERTICES }>(v))
    }

    /// Position and wanted edge length of `v` in one access.
    #[inline(always)]
    pub fn point_and_size(&mut self, v: u32) -> (Point, f32) {
        let p = self.point(v);
        (p, self.size(v))
    }

    /// Positions of the four vertices of `tet`.
    #[inline(always)]
    pub fn points(&mut self, tet: &Tet) -> [Point; 4] {
        let ids = [tet.vertex(0), tet.vertex(1), tet.vertex(2), tet.vertex(3)];
        let [a, b, c, d] = self.pages.read_four::<{ kind::VERTICES }>(ids);
        [position(a), position(b), position(c), position(d)]
    }

    /// The corners of a tetrahedron with all that decides about edges between them.
    #[inline(always)]
    pub fn ends(&mut self, tet: &Tet) -> [End; 4] {
        let ids = [tet.vertex(0), tet.vertex(1), tet.vertex(2), tet.vertex(3)];
        // Spelled out: `map` on arrays is not always inlined, which cost 5 % of a whole run.
        let [a, b, c, d] = self.pages.read_four::<{ kind::VERTICES }>(ids);
        [end(a), end(b), end(c), end(d)]
    }

    /// Moves `v`.
    #[inline]
    pub fn set_point(&mut self, v: u32, p: Point) {
        let w = self.pages.write::<{ kind::VERTICES }>(v);
        for (i, c) in p.to_array().into_iter().enumerate() {
            let bits = c.to_bits();
            w[2 * i] = u32_le::from_native(bits as u32);
            w[2 * i + 1] = u32_le::from_native((bits >> 32) as u32);
        }
    }

    /// Wanted edge length at `v`; 0 when it was never set.
    #[inline(always)]
    pub fn size(&mut self, v: u32) -> f32 {
        let bits = self.pages.read::<{ kind::VERTICES }>(v)[6].to_native();
        f32::from_bits(bits & !FIXED)
    }

    /// Sets the wanted edge length at `v`; whether it is fixed stays.
    #[inline]
    pub fn set_size(&mut self, v: u32, h: f32) {
        let word = &mut self.pages.write::<{ kind::VERTICES }>(v)[6];
        *word = u32_le::from_native(word.to_native() & FIXED | h.to_bits() & !FIXED);
    }

    /// Whether `v` may never move: it belongs to a facet, an interface or the enclosing box.
    #[inline(always)]
    pub fn is_fixed(&mut self, v: u32) -> bool {
        self.pages.read::<{ kind::VERTICES }>(v)[6].to_native() & FIXED != 0
    }

    /// A tetrahedron that has `v`, as last told; see [`Mesh::set_tet_of`].
    #[inline]
    pub fn tet_of(&mut self, v: u32) -> u32 {
        self.pages.read::<{ kind::VERTICES }>(v)[7].to_native()
    }

    /// Tells a tetrahedron that has `v`. Insertion does not keep this up; flips do.
    #[inline]
    pub fn set_tet_of(&mut self, v: u32, t: u32) {
        self.pages.write::<{ kind::VERTICES }>(v)[7] = u32_le::from_native(t);
    }

    /// Adds a vertex.
    pub fn add_vertex(&mut self, p: Point, h: f32) -> u32 {
        let v =
            Self::take::<{ kind::VERTICES }>(&mut self.pages, &mut self.state.vertices, "vertices");
        self.set_point(v, p);
        self.set_size(v, h);
        self.set_tet_of(v, NONE);
        v
    }

    /// Takes back a vertex no tetrahedron has.
    pub fn free_vertex(&mut self, v: u32) {
        let slot = self.pages.write::<{ kind::VERTICES }>(v);
        *slot = [WORD_ZERO; 8];
        slot[0] = u32_le::from_native(NONE);
        slot[1] = u32_le::from_native(self.state.vertices.free_head);
        slot[7] = u32_le::from_native(NONE);
        self.state.vertices.free_head = v;
        self.state.vertices.n_live -= 1;
    }

    /// Tag and owner index of `v`; free vertices need none.
    pub fn vertex_attribute(&mut self, v: u32) -> (VertexTag, u32) {
        let (tag, owner) = self.attribute::<{ kind::VERTEX_ATTRIBUTES }>(v);
        let tag = match tag & TAG_MASK {
            1 => VertexTag::Surface,
            2 => VertexTag::Interface,
            3 => VertexTag::Steiner,
            4 => VertexTag::EnclosingBox,
            _ => VertexTag::Free,
        };
        (tag, owner)
    }

    /// Sets tag and owner index of `v`; any tag but free and Steiner fixes it.
    pub fn set_vertex_attribute(&mut self, v: u32, tag: VertexTag, owner: u32) {
        let fixed = !matches!(tag, VertexTag::Free | VertexTag::Steiner);
        self.set_fixed(v, fixed);
        self.set_attribute::<{ kind::VERTEX_ATTRIBUTES }>(v, tag as u32, owner);
    }

    fn set_fixed(&mut self, v: u32, fixed: bool) {
        let word = &mut self.pages.write::<{ kind::VERTICES }>(v)[6];
        let size = word.to_native() & !FIXED;
        *word = u32_le::from_native(size | if fixed { FIXED } else { 0 });
    }

    /// Makes `v` number `index` of the vertices of a cut, which fixes it; cut 0 only holds it for a while.
    pub fn set_interface_vertex(&mut self, v: u32, cut: u32, index: u32) {
        self.set_fixed(v, true);
        let tag = VertexTag::Interface as u32 | cut << TAG_BITS;
        self.set_attribute::<{ kind::VERTEX_ATTRIBUTES }>(v, tag, index);
    }

    /// Cut and number of an interface vertex, as set by [`Mesh::set_interface_vertex`].
    pub fn interface_vertex(&mut self, v: u32) -> (u32, u32) {
        let (tag, index) = self.attribute::<{ kind::VERTEX_ATTRIBUTES }>(v);
        (tag >> TAG_BITS, index)
    }

    /// The words of the attribute of `v` as they are stored.
    pub(super) fn vertex_words(&mut self, v: u32) -> (u32, u32) {
        self.attribute::<{ kind::VERTEX_ATTRIBUTES }>(v)
    }

    /// Sets the words of the attribute of `v`; the tag in them says whether it is fixed.
    pub(super) fn set_vertex_words(&mut self, v: u32, tag: u32, owner: u32) {
        let free = [VertexTag::Free, VertexTag::Steiner].map(|tag| tag as u32);
        self.set_fixed(v, !free.contains(&(tag & TAG_MASK)));
        self.set_attribute::<{ kind::VERTEX_ATTRIBUTES }>(v, tag, owner);
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

    /// Every vertex id that was ever given out, in id order; freed ones among them.
    pub fn vertex_ids(&self) -> impl Iterator<Item = u32> + use<P> {
        (0..dense(self.state.vertices.fresh)).map(sparse)
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
        while slot >> SLOT_BITS >= self.pages.n_pages::<{ kind::SCRATCH }>() {
            self.pages.append_page::<{ kind::SCRATCH }>();
        }
        self.pages.write::<{ kind::SCRATCH }>(slot)[n as usize & 7] = u32_le::from_native(word);
    }

    /// Forgets the scratch map.
    pub fn clear_scratch(&mut self) {
        self.pages.clear::<{ kind::SCRATCH }>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unused_slots_are_never_ids() {
        for n in [0, 1, 2045, 2046, 4091, 4092, 100_000] {
            assert_eq!(dense(sparse(n)), n);
            assert!((sparse(n) & SLOT_MASK) < RECORDS as u32);
        }
        let mut id = 0;
        for n in 0..10_000 {
            assert_eq!(id, sparse(n));
            id = next_id(id);
        }
    }
}
