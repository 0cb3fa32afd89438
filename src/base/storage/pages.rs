//! Records by kind and id, on any storage of their pages.

use tetdb_schema::page::{SLOT_BITS, Slot};

use super::page_table::PageTable;

/// Kinds of working pages an accessor may name, as positions in a page table.
pub mod kind {
    use tetdb_schema::page::PageKind;

    /// Nodes and neighbors of tetrahedra.
    pub const TETS: usize = 0;
    /// Region and flags of tetrahedra.
    pub const TET_ATTRIBUTES: usize = 1;
    /// Positions, lengths and a tetrahedron of each vertex.
    pub const VERTICES: usize = 2;
    /// Tag and owner of vertices.
    pub const VERTEX_ATTRIBUTES: usize = 3;
    /// Input triangles.
    pub const FACETS: usize = 4;
    /// Faces shared with other sub-domains.
    pub const INTERFACE_FACES: usize = 5;
    /// A scratch map of one step; it is never stored in a result.
    pub const SCRATCH: usize = 6;
    /// The page kinds in that order.
    pub const ALL: [PageKind; 7] = [
        PageKind::Tets,
        PageKind::TetAttributes,
        PageKind::Vertices,
        PageKind::VertexAttributes,
        PageKind::Facets,
        PageKind::InterfaceFaces,
        PageKind::Scratch,
    ];
}

/// Random access to records by id.
///
/// The borrow ends before the next access: no reference into a page survives it.
pub trait Pages {
    /// Reads record `id` of kind `K` (one of [`kind`]).
    fn read<const K: usize>(&mut self, id: u32) -> &Slot;
    /// Reads four records of kind `K` at once, which is cheaper than one after another.
    fn read_four<const K: usize>(&mut self, ids: [u32; 4]) -> [&Slot; 4];
    /// Opens record `id` of kind `K` for change; its page is dirty from then on.
    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot;
    /// Number of pages of kind `K`.
    fn n_pages<const K: usize>(&self) -> u32;
    /// Appends a zeroed page of kind `K` and returns its number.
    fn append_page<const K: usize>(&mut self) -> u32;
    /// Appends zeroed pages of kind `K` until one has record `id`.
    #[inline(always)]
    fn append_up_to<const K: usize>(&mut self, id: u32) {
        while id >> SLOT_BITS >= self.n_pages::<K>() {
            self.append_page::<K>();
        }
    }
    /// Forgets the first `n` pages of kind `K`; the others move up to take their numbers.
    fn drop_front<const K: usize>(&mut self, n: u32);
    /// Forgets all pages of kind `K`, as if there had never been one.
    fn clear<const K: usize>(&mut self);
    /// Bytes of memory that the pages use, and that they may use. `None` if there is no limit.
    fn bytes_used(&self) -> Option<[u64; 2]> {
        None
    }
    /// Limits the memory to `bytes` of what it was at first, until the next call. Pages leave memory if they must.
    fn use_at_most(&mut self, _bytes: u64) {}
    /// A view for several threads, when all pages are in memory.
    fn shared(&mut self) -> Option<SharedPages<'_>> {
        None
    }
}

/// A view of pages that are all in memory. Is not: a way to change them; those methods panic.
#[derive(Clone, Copy)]
pub struct SharedPages<'a> {
    frames: &'a [Slot],
    tables: [&'a PageTable; kind::ALL.len()],
}

impl<'a> SharedPages<'a> {
    /// Every page of the tables must be readable at once.
    pub(super) fn new(frames: &'a [Slot], tables: &'a [PageTable; kind::ALL.len()]) -> Self {
        Self { frames, tables: tables.each_ref() }
    }

    /// Record `id` of a kind.
    #[inline(always)]
    pub(super) fn read_of(&self, kind: usize, id: u32) -> &'a Slot {
        &self.frames[self.tables[kind].to_read(id)]
    }

    /// Four records of a kind.
    #[inline(always)]
    pub(super) fn read_four_of(&self, kind: usize, [a, b, c, d]: [u32; 4]) -> [&'a Slot; 4] {
        let (frames, table) = (self.frames, self.tables[kind]);
        [
            &frames[table.to_read(a)],
            &frames[table.to_read(b)],
            &frames[table.to_read(c)],
            &frames[table.to_read(d)],
        ]
    }

    /// Number of pages of a kind.
    #[inline(always)]
    pub(super) fn n_pages_of(&self, kind: usize) -> u32 {
        self.tables[kind].len() as u32
    }
}

impl Pages for SharedPages<'_> {
    #[inline(always)]
    fn read<const K: usize>(&mut self, id: u32) -> &Slot {
        self.read_of(K, id)
    }

    #[inline(always)]
    fn read_four<const K: usize>(&mut self, ids: [u32; 4]) -> [&Slot; 4] {
        self.read_four_of(K, ids)
    }

    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot {
        unreachable!("record {id} is shared")
    }

    fn n_pages<const K: usize>(&self) -> u32 {
        self.tables[K].len() as u32
    }

    fn append_page<const K: usize>(&mut self) -> u32 {
        unreachable!("pages are shared")
    }

    fn drop_front<const K: usize>(&mut self, _: u32) {
        unreachable!("pages are shared")
    }

    fn clear<const K: usize>(&mut self) {
        unreachable!("pages are shared")
    }
}
