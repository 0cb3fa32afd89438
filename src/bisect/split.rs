//! Write a child: the host's tetrahedra of one side, those of the core with that label, joined at the rim.

use super::Opened;
use super::core::{SHARED, copy_attribute, is_held, is_in_core, place, tet_ids};
use super::labels::{interface_faces, is_high};
use crate::geom::{Aabb, HilbertFrame, Point};
use crate::mesh::anatomy::{FROZEN, REQUIRED};
use crate::mesh::{FaceRef, InterfaceFace, Mesh, Tet, Workspace, dense, renumber};
use crate::store::{Pages, Sorted, Sorter, StoreError, stop_if_requested};
use tetdb_schema::page::NONE;

/// A required face of the child: its vertices ascending, and where it is.
type FaceRecord = [u8; 16];
/// A facet or interface face of the host: its vertices in the child ascending, its kind, its number.
type ClaimRecord = [u8; 17];

const FACET: u8 = 0;
const INTERFACE: u8 = 1;

/// Gives the vertices of the cut's interface their numbers, in the order of its faces; returns how many they are.
pub(super) fn number_interface<P: Pages>(core: &mut Mesh<P>, cut: u32) -> u32 {
    let mut vertices = 0;
    for_each_interface_face(core, |core, tet, i| {
        for v in tet.face(i) {
            if !core.is_fixed(v) || is_held(core, v) {
                core.set_interface_vertex(v, cut, vertices);
                vertices += 1;
            }
        }
    });
    vertices
}

/// The interface faces by their points, in id order.
pub(super) fn interface_points<P: Pages>(core: &mut Mesh<P>) -> Vec<[Point; 3]> {
    let mut points = Vec::new();
    for_each_interface_face(core, |core, tet, i| {
        points.push(tet.face(i).map(|v| core.point(v)));
    });
    points
}

/// Calls `visit` with every interface face, seen from its tetrahedron on the low side, in id order.
fn for_each_interface_face<P: Pages>(
    core: &mut Mesh<P>,
    mut visit: impl FnMut(&mut Mesh<P>, &Tet, usize),
) {
    for t in tet_ids(core) {
        let tet = core.tet(t);
        if !tet.is_live() || is_high(core, t) {
            continue;
        }
        for i in interface_faces(core, t, &tet) {
            visit(core, &tet, i);
        }
    }
}

/// Writes one side into the empty `child` and numbers it along the curve. Errors: the disk, while sorting.
pub fn write_child<P: Pages, Q: Pages, R: Pages>(
    host: &mut Mesh<P>,
    core: &mut Mesh<Q>,
    child: &mut Mesh<R>,
    opened: &Opened,
    high: bool,
    bounds: &Aabb,
    space: &Workspace,
) -> Result<(), StoreError> {
    let mut split = Split {
        host_base: dense(host.vertex_ids_end()),
        core_base: dense(core.vertex_ids_end()),
        host,
        core,
        child,
        opened,
        high,
    };
    split.begin();
    split.copy_core();
    split.copy_host();
    split.link_host();
    split.link_core();
    split.tag_rim_vertices();
    split.new_interface();
    split.inherit(space)?;
    renumber(child, &HilbertFrame::new(bounds), space)
}

struct Split<'a, P: Pages, Q: Pages, R: Pages> {
    host: &'a mut Mesh<P>,
    core: &'a mut Mesh<Q>,
    child: &'a mut Mesh<R>,
    opened: &'a Opened,
    high: bool,
    /// Where the map of tetrahedra begins in each scratch map, behind that of vertices.
    host_base: u32,
    core_base: u32,
}

impl<P: Pages, Q: Pages, R: Pages> Split<'_, P, Q, R> {
    fn begin(&mut self) {
        for n in 0..self.host_base {
            let word = self.host.scratch(n);
            if word & SHARED == 0 {
                self.host.set_scratch(n, NONE);
            }
        }
        self.core.clear_scratch();
        for n in 0..self.core_base {
            self.core.set_scratch(n, NONE);
        }
    }

    /// The child's number of a vertex of the core.
    fn core_vertex(&mut self, v: u32) -> u32 {
        let known = self.core.scratch(dense(v));
        if known != NONE {
            return known;
        }
        let (p, h) = self.core.point_and_size(v);
        let copy = self.child.add_vertex(p, h);
        if !is_held(self.core, v) {
            copy_attribute(self.core, v, self.child, copy);
        }
        self.core.set_scratch(dense(v), copy);
        copy
    }

    /// The child's number of a vertex of the host.
    fn host_vertex(&mut self, v: u32) -> u32 {
        let known = self.host.scratch(dense(v));
        if known == NONE {
            let (p, h) = self.host.point_and_size(v);
            let copy = self.child.add_vertex(p, h);
            copy_attribute(self.host, v, self.child, copy);
            self.host.set_scratch(dense(v), copy);
            copy
        } else if known & SHARED != 0 {
            self.core_vertex(known & !SHARED)
        } else {
            known
        }
    }

    /// The child's number of a vertex of the host that it already has.
    fn known_vertex(&mut self, v: u32) -> Option<u32> {
        let mut known = self.host.scratch(dense(v));
        if known != NONE && known & SHARED != 0 {
            known = self.core.scratch(dense(known & !SHARED));
        }
        (known != NONE).then_some(known)
    }

    fn add(&mut self, nodes: [u32; 4], region: u32) -> u32 {
        let t = self.child.take_tet();
        let tet = Tet {
            node: nodes,
            neighbor: [FaceRef::NONE; 4],
        };
        self.child.set_tet(t, tet);
        self.child.set_tet_attribute(t, region, 0);
        t
    }

    fn copy_core(&mut self) {
        for t in tet_ids(self.core) {
            let tet = self.core.tet(t);
            if !tet.is_live() || is_high(self.core, t) != self.high {
                continue;
            }
            let nodes =
                std::array::from_fn(|i| self.core_vertex(tet.vertex(i)) | tet.node[i] & REQUIRED);
            let (region, _) = self.core.tet_attribute(t);
            let copy = self.add(nodes, region);
            self.core.set_scratch(self.core_base + dense(t), copy);
        }
    }

    /// Whether a tetrahedron of the host, outside the core, belongs to the child.
    fn is_ours(&mut self, tet: &Tet) -> bool {
        if !tet.is_live() || is_in_core(tet) {
            return false;
        }
        let (sides, _) = place(self.host, tet, &self.opened.zone.surface);
        debug_assert!(!sides.crosses());
        sides.high == self.high
    }

    fn copy_host(&mut self) {
        for t in tet_ids(self.host) {
            let tet = self.host.tet(t);
            if !self.is_ours(&tet) {
                continue;
            }
            let nodes =
                std::array::from_fn(|i| self.host_vertex(tet.vertex(i)) | tet.node[i] & REQUIRED);
            let (region, flags) = self.host.tet_attribute(t);
            let copy = self.add(nodes, region);
            if flags & FROZEN != 0 {
                self.child.set_tet_attribute(copy, region, FROZEN);
            }
            self.host.set_scratch(self.host_base + dense(t), copy);
            if t & 1023 == 0 {
                stop_if_requested();
            }
        }
    }

    fn link_host(&mut self) {
        for t in tet_ids(self.host) {
            let tet = self.host.tet(t);
            if !self.is_ours(&tet) {
                continue;
            }
            let copy = self.host.scratch(self.host_base + dense(t));
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                // Those across the rim are linked from the core.
                if across.exists() && !is_in_core(&self.host.tet(across.tet())) {
                    let other = self.host.scratch(self.host_base + dense(across.tet()));
                    let other = FaceRef::new(other, across.face());
                    self.child.set_neighbor(FaceRef::new(copy, i), other);
                }
            }
        }
    }

    fn link_core(&mut self) {
        for t in tet_ids(self.core) {
            let tet = self.core.tet(t);
            if !tet.is_live() || is_high(self.core, t) != self.high {
                continue;
            }
            let copy = self.core.scratch(self.core_base + dense(t));
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                let here = FaceRef::new(copy, i);
                if across.exists() {
                    if is_high(self.core, across.tet()) == self.high {
                        let other = self.core.scratch(self.core_base + dense(across.tet()));
                        let other = FaceRef::new(other, across.face());
                        self.child.set_neighbor(here, other);
                    } else {
                        self.freeze(here);
                    }
                } else if let Some(beyond) = self.opened.rim.find(tet.face(i)) {
                    let required = self.host.tet(beyond.tet()).is_required(beyond.face());
                    let other = self.host.scratch(self.host_base + dense(beyond.tet()));
                    let other = FaceRef::new(other, beyond.face());
                    self.child.link(here, other);
                    self.child.set_required(here, required);
                }
            }
        }
    }

    /// Makes a face of the child an interface face.
    fn freeze(&mut self, face: FaceRef) {
        self.child.set_required(face, true);
        let (region, _) = self.child.tet_attribute(face.tet());
        self.child.set_tet_attribute(face.tet(), region, FROZEN);
    }

    /// Vertices of the rim have in the core no tag of their own.
    fn tag_rim_vertices(&mut self) {
        for v in self.host.vertex_ids() {
            let known = self.host.scratch(dense(v));
            if known == NONE || known & SHARED == 0 {
                continue;
            }
            let copy = known & !SHARED;
            let to = self.core.scratch(dense(copy));
            if to != NONE && is_held(self.core, copy) {
                copy_attribute(self.host, v, self.child, to);
            }
        }
    }

    fn new_interface(&mut self) {
        let (child, high, cut) = (&mut *self.child, self.high, self.opened.zone.cut);
        let mut index = 0;
        for_each_interface_face(self.core, |core, tet, i| {
            let mut vertices = tet.face(i).map(|v| core.scratch(dense(v)));
            if high {
                vertices.swap(1, 2);
            }
            child.add_interface_face(InterfaceFace {
                vertices,
                cut,
                index,
                side: u32::from(high),
            });
            index += 1;
        });
    }

    /// The host's facets and interface faces that have a tetrahedron in the child, and facets that have none anywhere.
    fn inherit(&mut self, space: &Workspace) -> Result<(), StoreError> {
        let mut claims = Sorter::<17>::new(space.dir, space.memory / 3);
        for n in 0..self.host.n_facets() {
            let facet = self.host.facet(n);
            if facet.regions == [0, 0] {
                // Between two empty regions: kept on the low side.
                if !self.high {
                    let mut copy = facet;
                    copy.vertices = facet.vertices.map(|v| self.host_vertex(v));
                    self.child.add_facet(copy);
                }
                continue;
            }
            self.claim(&mut claims, facet.vertices, FACET, n)?;
        }
        for n in 0..self.host.n_interface_faces() {
            let face = self.host.interface_face(n);
            self.claim(&mut claims, face.vertices, INTERFACE, n)?;
        }
        let mut faces = self.required_faces(space)?.peekable();
        for claim in claims.finish()? {
            let claim = claim?;
            while let Some(face) =
                faces.next_if(|f| f.as_ref().map_or(true, |f| f[..12] < claim[..12]))
            {
                face?;
            }
            let Some(Ok(face)) = faces.peek() else {
                continue;
            };
            if face[..12] == claim[..12] {
                let face = FaceRef(word(face, 12));
                self.keep(claim[12], word(&claim, 13), face);
            }
        }
        Ok(())
    }

    fn claim(
        &mut self,
        claims: &mut Sorter<17>,
        vertices: [u32; 3],
        kind: u8,
        number: u32,
    ) -> Result<(), StoreError> {
        let [a, b, c] = vertices.map(|v| self.known_vertex(v));
        let (Some(a), Some(b), Some(c)) = (a, b, c) else {
            return Ok(());
        };
        let mut record: ClaimRecord = [0; 17];
        put_sorted(&mut record, [a, b, c]);
        record[12] = kind;
        record[13..].copy_from_slice(&number.to_be_bytes());
        claims.push(record)
    }

    fn required_faces(&mut self, space: &Workspace) -> Result<Sorted<16>, StoreError> {
        let mut faces = Sorter::<16>::new(space.dir, space.memory / 3);
        let mut from = 0;
        while let Some((t, tet)) = self.child.next_tet(from) {
            from = t + 1;
            for i in (0..4).filter(|&i| tet.is_required(i)) {
                let mut record: FaceRecord = [0; 16];
                put_sorted(&mut record, tet.face(i));
                record[12..].copy_from_slice(&FaceRef::new(t, i).0.to_be_bytes());
                faces.push(record)?;
            }
        }
        faces.finish()
    }

    fn keep(&mut self, kind: u8, number: u32, face: FaceRef) {
        if kind == FACET {
            let mut facet = self.host.facet(number);
            for v in &mut facet.vertices {
                *v = self.known_vertex(*v).expect("claimed with its vertices");
            }
            self.child.add_facet(facet);
        } else {
            let mut kept = self.host.interface_face(number);
            for v in &mut kept.vertices {
                *v = self.known_vertex(*v).expect("claimed with its vertices");
            }
            self.child.add_interface_face(kept);
            self.freeze(face);
        }
    }
}

fn put_sorted(record: &mut [u8], mut vertices: [u32; 3]) {
    vertices.sort_unstable();
    for (bytes, v) in record.chunks_exact_mut(4).zip(vertices) {
        bytes.copy_from_slice(&v.to_be_bytes());
    }
}

fn word(record: &[u8], at: usize) -> u32 {
    u32::from_be_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
}
