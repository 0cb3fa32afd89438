//! A decoded chunk of tetrahedra with the vertices it needs, free of everything else.

use super::hit::Hit;
use super::tree::OctalBoxTree;
use crate::sealed::{Chunk, Corner, Subdomain};
use crate::store::StoreError;
use tetdb_base::geom::{Aabb, IdMap, Point};
use tetdb_schema::ids::{SubdomainId, TetId};
use tetdb_schema::record::SealedTet;

/// A tetrahedron of a frame.
#[derive(Clone, Copy)]
pub(crate) struct FrameTet {
    /// Number of the tetrahedron in the sub-domain.
    pub local: u32,
    pub region: u32,
    /// Places of its vertices in the frame.
    pub nodes: [u32; 4],
}

/// Shape: `tets` ascending by number; `points[v]`, `ids[v]`, `locals[v]` = position, lasting id and number of vertex `v` of the frame.
pub(crate) struct DecodedChunk {
    part: SubdomainId,
    pub tets: Vec<FrameTet>,
    points: Vec<Point>,
    ids: Vec<u64>,
    /// Numbers of the vertices in the sub-domain.
    locals: Vec<u32>,
}

/// A frame of a whole chunk, and a tree to find points in it.
pub(crate) struct Searched {
    pub frame: DecodedChunk,
    pub tree: OctalBoxTree,
}

impl DecodedChunk {
    /// Decodes the tetrahedra of a chunk that `keep` accepts, with their vertices.
    ///
    /// Errors: damage.
    pub fn new(
        part: &mut Subdomain,
        chunk: &Chunk<SealedTet>,
        mut keep: impl FnMut(&Subdomain, u32, &SealedTet) -> bool,
    ) -> Result<Self, StoreError> {
        let mut places: IdMap<u32, u32> = IdMap::default();
        let (tets, points, ids, locals) = Default::default();
        let mut frame = Self { part: part.id(), tets, points, ids, locals };
        for (local, tet) in (chunk.first..).zip(&chunk.records) {
            if !keep(part, local, tet) {
                continue;
            }
            let nodes = tet.nodes.map(|v| {
                *places.entry(v).or_insert_with(|| {
                    frame.locals.push(v);
                    frame.locals.len() as u32 - 1
                })
            });
            frame.tets.push(FrameTet { local, region: tet.region, nodes });
        }
        // In order, so that each chunk of vertices is wanted once.
        let mut order: Vec<(u32, u32)> = frame.locals.iter().copied().zip(0..).collect();
        order.sort_unstable();
        frame.points.resize(order.len(), Point::ZERO);
        frame.ids.resize(order.len(), 0);
        for (v, place) in order {
            let Corner { point, id, .. } = part.corner(v)?;
            frame.points[place as usize] = point;
            frame.ids[place as usize] = id;
        }
        Ok(frame)
    }

    #[inline]
    pub fn corners(&self, tet: &FrameTet) -> [Point; 4] {
        // Not `map`, which stays a call: it took a sixth of the time of overlaps.
        let [a, b, c, d] = tet.nodes;
        let at = |v: u32| self.points[v as usize];
        [at(a), at(b), at(c), at(d)]
    }

    pub fn ids(&self, tet: &FrameTet) -> [u64; 4] {
        tet.nodes.map(|v| self.ids[v as usize])
    }

    /// Numbers of the vertices in the sub-domain.
    pub fn locals(&self, tet: &FrameTet) -> [u32; 4] {
        tet.nodes.map(|v| self.locals[v as usize])
    }

    /// Lasting id of a tetrahedron.
    pub fn id(&self, tet: &FrameTet) -> TetId {
        let id = TetId::new(self.part, tet.local);
        id.expect("the reader counted the tetrahedra of the sub-domain")
    }

    /// A tetrahedron as an answer.
    pub fn hit(&self, tet: &FrameTet) -> Hit {
        Hit::new(self.id(tet), tet.region, self.ids(tet), self.corners(tet))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.tets.capacity() * size_of::<FrameTet>()
            + self.points.capacity() * size_of::<Point>()
            + self.ids.capacity() * 8
            + self.locals.capacity() * 4
    }
}

impl Searched {
    pub fn new(frame: DecodedChunk) -> Self {
        let around = |i: usize| Aabb::around(frame.corners(&frame.tets[i]));
        let tree = OctalBoxTree::new(frame.tets.len(), around);
        Self { frame, tree }
    }

    pub fn bytes(&self) -> usize {
        self.frame.bytes() + self.tree.bytes()
    }
}
