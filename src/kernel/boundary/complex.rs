//! One trait for the two complexes that recovery changes: the paged mesh, and a patch in memory.

use crate::mesh::anatomy::{FACES, REQUIRED};
use crate::mesh::{FaceRef, Mesh, Tet, VertexTag};
use tetdb_base::geom::{IdSet, Point, orient};
use tetdb_base::storage::Pages;

/// A tetrahedral complex whose parts can be replaced.
///
/// Invariant kept by [`TetComplex::replace`]: neighbors are mutual, and outer required faces stay required.
/// The caller answers for the volumes.
pub(super) trait TetComplex {
    /// The record of `t`.
    fn tet(&mut self, t: u32) -> Tet;
    /// The face across face `i` of `t`; loads it if need be.
    fn across(&mut self, t: u32, i: usize) -> FaceRef;
    /// A tetrahedron that has `v`.
    fn tet_of(&mut self, v: u32) -> u32;
    /// Six times the signed volume of four vertices; the sign is exact.
    fn orient(&mut self, v: [u32; 4]) -> f64;
    /// Position of `v`, rounded.
    fn position(&mut self, v: u32) -> Point;
    fn take_tet(&mut self) -> u32;
    fn free_tet(&mut self, t: u32);
    fn set_tet(&mut self, t: u32, tet: Tet);
    /// Sets the neighbor of `face`.
    fn set_across(&mut self, face: FaceRef, to: FaceRef);
    fn set_tet_of(&mut self, v: u32, t: u32);
    /// Returns whether the edge `a b` must stay although no required face may have it yet.
    fn protects(&self, a: u32, b: u32) -> bool;

    /// Replaces the tetrahedra `old` by tetrahedra with the vertices `new`, which fill the same volume.
    ///
    /// Returns the ids of the new tetrahedra, parallel to `new`. Effects: ids of `old` are used again first, in order,
    /// and the remaining ones are freed last to first, so that replacing back restores the same ids. Required faces
    /// stay required if they are faces of the new tetrahedra.
    fn replace(&mut self, old: &[u32], new: &[[u32; 4]]) -> Vec<u32> {
        let mut sides: Vec<CavityFace> = Vec::with_capacity(4 * new.len() + 2 * old.len() + 4);
        // Required faces inside that are faces again afterwards stay required.
        let mut inner: Vec<[u32; 3]> = Vec::new();
        for &t in old {
            let tet = self.tet(t);
            for i in 0..4 {
                let across = tet.neighbor[i];
                if across.exists() && old.contains(&across.tet()) {
                    if tet.is_required(i) {
                        inner.push(sorted(tet.face(i)));
                    }
                } else {
                    sides.push(CavityFace {
                        key: sorted(tet.face(i)),
                        shapes: u32::MAX,
                        outside: across,
                        required: tet.is_required(i),
                    });
                }
            }
        }
        let mut ids: Vec<u32> = old.iter().copied().take(new.len()).collect();
        while ids.len() < new.len() {
            let t = self.take_tet();
            ids.push(t);
        }
        for (k, quad) in new.iter().enumerate() {
            for (i, f) in FACES.iter().enumerate() {
                sides.push(CavityFace {
                    key: sorted(f.map(|j| quad[j])),
                    shapes: (k * 4 + i) as u32,
                    outside: FaceRef::NONE,
                    required: false,
                });
            }
        }
        sides.sort_unstable_by_key(|s| (s.key, s.shapes));
        let mut records: Vec<Tet> =
            new.iter().map(|&node| Tet { node, neighbor: [FaceRef::NONE; 4] }).collect();
        let place = |shapes: u32| (shapes as usize / 4, shapes as usize % 4);
        let name = |shapes: u32| FaceRef::new(ids[shapes as usize / 4], shapes as usize % 4);
        for pair in sides.chunks(2) {
            let [a, b] = pair else {
                panic!("face {:?} of a replaced cavity has one side", pair[0].key)
            };
            assert!(
                a.key == b.key && a.shapes != u32::MAX,
                "a replaced cavity does not fill its room: {:?} {:?}",
                a.key,
                b.key
            );
            let (k, i) = place(a.shapes);
            if b.shapes == u32::MAX {
                records[k].neighbor[i] = b.outside;
                if b.required {
                    records[k].node[i] |= REQUIRED;
                }
                if b.outside.exists() {
                    self.set_across(b.outside, name(a.shapes));
                }
            } else {
                let (l, j) = place(b.shapes);
                records[k].neighbor[i] = name(b.shapes);
                records[l].neighbor[j] = name(a.shapes);
                if inner.contains(&a.key) {
                    records[k].node[i] |= REQUIRED;
                    records[l].node[j] |= REQUIRED;
                }
            }
        }
        for (record, &t) in records.iter().zip(&ids) {
            self.set_tet(t, *record);
            for v in record.vertices() {
                self.set_tet_of(v, t);
            }
        }
        for &t in old.iter().skip(new.len()).rev() {
            self.free_tet(t);
        }
        ids
    }

    /// Marks a face as required on this side no more.
    fn release(&mut self, face: FaceRef) {
        let mut tet = self.tet(face.tet());
        tet.node[face.face()] &= !REQUIRED;
        self.set_tet(face.tet(), tet);
    }

    /// Marks a face as required on both sides.
    fn require(&mut self, face: FaceRef) {
        let other = self.across(face.tet(), face.face());
        for f in [face, other] {
            if f.exists() {
                let mut tet = self.tet(f.tet());
                tet.node[f.face()] |= REQUIRED;
                self.set_tet(f.tet(), tet);
            }
        }
    }
}

/// A face of a replaced cavity, seen from outside (`shapes == MAX`) or from a new tetrahedron.
struct CavityFace {
    key: [u32; 3],
    shapes: u32,
    outside: FaceRef,
    required: bool,
}

/// The three vertices, ascending.
#[inline]
pub(super) fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Key of an edge in either direction.
#[inline]
pub(super) fn edge_key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// The paged mesh as a complex; all vertices are at their coordinates.
pub(super) struct PagedComplex<'m, P: Pages>(
    pub &'m mut Mesh<P>,
    /// Edges that must stay.
    pub &'m IdSet<u64>,
);

impl<P: Pages> PagedComplex<'_, P> {
    /// Adds a vertex in no tetrahedron, tagged as a Steiner point.
    pub fn add_steiner(&mut self, point: Point) -> u32 {
        let v = self.0.add_vertex(point, 0.0);
        self.0.set_vertex_attribute(v, VertexTag::Steiner, 0);
        v
    }

    /// The face and its other side are required no longer.
    pub fn release(&mut self, face: FaceRef) {
        for f in [face, self.0.tet(face.tet()).neighbor[face.face()]] {
            if f.exists() {
                let mut tet = self.0.tet(f.tet());
                tet.node[f.face()] &= !REQUIRED;
                self.0.set_tet(f.tet(), tet);
            }
        }
    }

    /// Returns whether `v` is not from the input.
    pub fn is_steiner(&mut self, v: u32) -> bool {
        self.0.vertex_attribute(v).0 == VertexTag::Steiner
    }

    /// Takes back a vertex no tetrahedron has any more.
    pub fn drop_steiner(&mut self, v: u32) {
        self.0.free_vertex(v);
        self.0.set_vertex_attribute(v, VertexTag::Free, 0);
    }
}

impl<P: Pages> TetComplex for PagedComplex<'_, P> {
    #[inline]
    fn tet(&mut self, t: u32) -> Tet {
        self.0.tet(t)
    }
    #[inline]
    fn across(&mut self, t: u32, i: usize) -> FaceRef {
        self.0.tet(t).neighbor[i]
    }
    #[inline]
    fn tet_of(&mut self, v: u32) -> u32 {
        self.0.tet_of(v)
    }
    #[inline]
    fn orient(&mut self, v: [u32; 4]) -> f64 {
        let [a, b, c, d] = v.map(|v| self.0.point(v));
        orient(a, b, c, d)
    }
    fn position(&mut self, v: u32) -> Point {
        self.0.point(v)
    }
    fn take_tet(&mut self) -> u32 {
        self.0.take_tet()
    }
    fn free_tet(&mut self, t: u32) {
        self.0.free_tet(t);
    }
    fn set_tet(&mut self, t: u32, tet: Tet) {
        self.0.set_tet(t, tet);
    }
    fn set_across(&mut self, face: FaceRef, to: FaceRef) {
        self.0.set_neighbor(face, to);
    }
    fn set_tet_of(&mut self, v: u32, t: u32) {
        self.0.set_tet_of(v, t);
    }
    fn protects(&self, a: u32, b: u32) -> bool {
        self.1.contains(&edge_key(a, b))
    }
}
