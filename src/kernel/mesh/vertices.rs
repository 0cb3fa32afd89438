//! The vertices of the working mesh.

use tetdb_schema::page::{NONE, Slot, u32_le};

use super::Tet;
use super::cursor::{Mesh, WORD_ZERO};
use super::{dense, sparse};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Pages, kind};

/// Origin of a vertex; the numbers are stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u32)]
pub enum VertexTag {
    /// Added inside a volume by refinement; may be moved.
    Free = 0,
    /// Vertex of the input.
    Surface = 1,
    /// On an interface.
    Interface = 2,
    /// Added by boundary recovery.
    Steiner = 3,
    /// Corner of the box around the input, dropped after coloring.
    EnclosingBox = 4,
}

/// A vertex as the end of an edge.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Its position.
    pub point: Point,
    /// Wanted edge length.
    pub h: f32,
    /// True if it may never move; see [`Mesh::is_fixed`].
    pub fixed: bool,
}

/// The sign bit of a vertex's size: the vertex never moves.
const FIXED: u32 = 1 << 31;
/// Bits of a vertex's tag; those above hold the cut of an interface vertex.
const TAG_BITS: u32 = 3;
const TAG_MASK: u32 = (1 << TAG_BITS) - 1;

#[inline(always)]
fn end(slot: &Slot) -> End {
    let size = slot[6].to_native();
    End { point: position(slot), h: f32::from_bits(size & !FIXED), fixed: size & FIXED != 0 }
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

    /// Returns whether `v` may never move: it belongs to a facet, an interface or the enclosing box.
    #[inline(always)]
    pub fn is_fixed(&mut self, v: u32) -> bool {
        self.pages.read::<{ kind::VERTICES }>(v)[6].to_native() & FIXED != 0
    }

    /// A tetrahedron that has `v`, as last set; see [`Mesh::set_tet_of`].
    #[inline]
    pub fn tet_of(&mut self, v: u32) -> u32 {
        self.pages.read::<{ kind::VERTICES }>(v)[7].to_native()
    }

    /// Sets a tetrahedron that has `v`. Insertion does not keep this up; flips do.
    #[inline]
    pub fn set_tet_of(&mut self, v: u32, t: u32) {
        self.pages.write::<{ kind::VERTICES }>(v)[7] = t.into();
    }

    /// Adds a vertex.
    pub fn add_vertex(&mut self, p: Point, h: f32) -> u32 {
        let v = Self::take_id::<{ kind::VERTICES }>(
            &mut self.pages,
            &mut self.state.vertices,
            "vertices",
        );
        self.set_point(v, p);
        self.set_size(v, h);
        self.set_tet_of(v, NONE);
        v
    }

    /// Adds a vertex behind all others, also where ids were given back.
    pub fn add_vertex_behind(&mut self, p: Point, h: f32) -> u32 {
        let free = std::mem::replace(&mut self.state.vertices.free_head, NONE);
        let v = self.add_vertex(p, h);
        self.state.vertices.free_head = free;
        v
    }

    /// Takes back a vertex no tetrahedron has.
    pub fn free_vertex(&mut self, v: u32) {
        let slot = self.pages.write::<{ kind::VERTICES }>(v);
        *slot = [WORD_ZERO; 8];
        slot[0] = NONE.into();
        slot[1] = self.state.vertices.free_head.into();
        slot[7] = NONE.into();
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

    /// Sets the words of the attribute of `v`; the tag in them decides whether it is fixed.
    pub(super) fn set_vertex_words(&mut self, v: u32, tag: u32, owner: u32) {
        let free = [VertexTag::Free, VertexTag::Steiner].map(|tag| tag as u32);
        self.set_fixed(v, !free.contains(&(tag & TAG_MASK)));
        self.set_attribute::<{ kind::VERTEX_ATTRIBUTES }>(v, tag, owner);
    }

    /// Every vertex id that was ever given out, in id order; freed ones among them.
    pub fn vertex_ids(&self) -> impl Iterator<Item = u32> + use<P> {
        (0..dense(self.state.vertices.fresh)).map(sparse)
    }
}
