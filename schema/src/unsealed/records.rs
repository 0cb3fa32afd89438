//! Records of a finished sub-domain as slots of working pages.

use crate::chunk::ChunkRecord;
use crate::ids::{Owner, SubdomainId, VertexId};
use crate::page::{NONE, PageKind, Slot, dense, sparse, u32_le};
use crate::record::{
    InterfaceFace, SealedFacet, SealedTet, SealedVertex, WorkingFacet, WorkingTet, WorkingVertex,
    tag,
};

const VERTEX_MASK: u32 = (1 << 30) - 1;
const REQUIRED: u32 = 1 << 31;
const FIXED: u32 = 1 << 31;
const TAG_BITS: u32 = 3;

/// The links and flags of a working tetrahedron, which a sealed one lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TetLinks {
    /// For each face, the face on its other side as 4 · tetrahedron + face, or [`NONE`].
    pub neighbors: [u32; 4],
    /// Bit i: face i is required.
    pub required: u8,
    /// Flags of the attribute.
    pub flags: u32,
}

/// A record as words of working pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkingWords {
    /// The slot of the main page.
    pub slot: Slot,
    /// Its words in the page of extra words.
    pub extra: [u32; 2],
}

/// A record that can be kept in working pages.
pub trait PageRecord: ChunkRecord {
    /// The kind of its pages.
    const PAGE: PageKind;
    /// The kind of the pages with its extra words, if it has any.
    const EXTRA: Option<PageKind>;

    /// Record `n` of sub-domain `rank`; `None` for words that no writer writes.
    fn from_working(working: &WorkingWords, rank: u32, n: u32) -> Option<Self>;
}

impl SealedTet {
    /// The record as a working tetrahedron.
    pub fn to_working(self, place: &TetLinks) -> WorkingWords {
        let required = |i: usize| {
            if place.required >> i & 1 == 1 { REQUIRED } else { 0 }
        };
        let neighbor = place.neighbors.map(|face| match face {
            NONE => NONE,
            face => sparse(face >> 2) << 2 | face & 3,
        });
        let node = std::array::from_fn(|i| sparse(self.nodes[i]) | required(i));
        WorkingWords {
            slot: WorkingTet { node, neighbor }.to_slot(),
            extra: [self.region, place.flags],
        }
    }
}

impl PageRecord for SealedTet {
    const PAGE: PageKind = PageKind::Tets;
    const EXTRA: Option<PageKind> = Some(PageKind::TetAttributes);

    fn from_working(working: &WorkingWords, _rank: u32, _n: u32) -> Option<Self> {
        let tet = WorkingTet::from_slot(&working.slot);
        (tet.node[0] != NONE).then(|| Self {
            nodes: tet.node.map(|node| dense(node & VERTEX_MASK)),
            region: working.extra[0],
        })
    }
}

impl SealedVertex {
    /// The record as a working vertex of sub-domain `rank`: fixed unless the mesher added it, and without a tetrahedron.
    pub fn to_working(self, rank: u32) -> WorkingWords {
        let id = VertexId::from_number(self.id);
        let (cut, index) = match id.map(|id| (id.owner, id.index)) {
            Some((Owner::Cut(cut), index)) => (cut, index),
            Some((Owner::Surface, index)) => (0, index),
            Some((Owner::Subdomain(owner), _)) => {
                debug_assert_eq!(owner.rank(), rank);
                (0, 0)
            }
            None => (0, 0),
        };
        let fixed = match self.tag {
            tag::FREE | tag::STEINER => 0,
            _ => FIXED,
        };
        let vertex = WorkingVertex {
            point: self.point,
            h: f32::from_bits(self.h.to_bits() | fixed),
            v2t: NONE,
        };
        WorkingWords { slot: vertex.to_slot(), extra: [self.tag | cut << TAG_BITS, index] }
    }
}

impl PageRecord for SealedVertex {
    const PAGE: PageKind = PageKind::Vertices;
    const EXTRA: Option<PageKind> = Some(PageKind::VertexAttributes);

    fn from_working(working: &WorkingWords, rank: u32, n: u32) -> Option<Self> {
        let vertex = WorkingVertex::from_slot(&working.slot);
        let [word, index] = working.extra;
        let (tag, cut) = (word & ((1 << TAG_BITS) - 1), word >> TAG_BITS);
        let owner = match tag {
            tag::SURFACE => Owner::Surface,
            tag::INTERFACE => Owner::Cut(cut),
            _ => Owner::Subdomain(SubdomainId::new(rank)?),
        };
        let index = match owner {
            Owner::Subdomain(_) => n,
            _ => index,
        };
        Some(Self {
            point: vertex.point,
            h: f32::from_bits(vertex.h.to_bits() & !FIXED),
            tag,
            id: VertexId { owner, index }.number(),
        })
    }
}

/// A tetrahedron's number as an id; [`NONE`] stays.
fn tet_id(n: u32) -> u32 {
    if n == NONE { NONE } else { sparse(n) }
}

fn tet_number(id: u32) -> u32 {
    if id == NONE { NONE } else { dense(id) }
}

impl SealedFacet {
    /// The record as a working facet.
    pub fn to_working(self) -> WorkingWords {
        let facet = WorkingFacet {
            vertices: self.vertices.map(sparse),
            label: self.label,
            triangle: self.triangle,
            regions: self.regions,
        };
        WorkingWords { slot: facet.to_slot(), extra: self.tets.map(tet_id) }
    }
}

impl PageRecord for SealedFacet {
    const PAGE: PageKind = PageKind::Facets;
    const EXTRA: Option<PageKind> = Some(PageKind::FacetTets);

    fn from_working(working: &WorkingWords, _rank: u32, _n: u32) -> Option<Self> {
        let facet = WorkingFacet::from_slot(&working.slot);
        Some(Self {
            vertices: facet.vertices.map(dense),
            label: facet.label,
            triangle: facet.triangle,
            regions: facet.regions,
            tets: working.extra.map(tet_number),
        })
    }
}

impl InterfaceFace {
    /// The record as a working interface face of sub-domain `rank`. Lower ranks are on the low side of a cut.
    pub fn to_working(self, rank: u32) -> WorkingWords {
        let [a, b, c] = self.vertices.map(sparse);
        let side = u32::from(rank > self.other);
        let words = [a, b, c, self.cut, self.index, side, self.other, tet_id(self.tet)];
        WorkingWords { slot: words.map(u32_le::from_native), extra: [0; 2] }
    }
}

impl PageRecord for InterfaceFace {
    const PAGE: PageKind = PageKind::InterfaceFaces;
    const EXTRA: Option<PageKind> = None;

    fn from_working(working: &WorkingWords, _rank: u32, _n: u32) -> Option<Self> {
        let [a, b, c, cut, index, _side, other, tet] = working.slot.map(u32_le::to_native);
        Some(Self { vertices: [a, b, c].map(dense), cut, index, other, tet: tet_number(tet) })
    }
}
