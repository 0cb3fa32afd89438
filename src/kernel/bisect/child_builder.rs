//! Builds a child: numbers its vertices and tetrahedra, then writes them.

use super::core::{SHARED, copy_attribute, is_held, placement, tet_ids};
use super::interface_faces::for_each_interface_face;
use super::open_cut::OpenCut;
use super::surface::CuttingSurface;
use crate::mesh::anatomy::{FROZEN, REQUIRED};
use crate::mesh::{FaceRef, Mesh, MeshInterfaceFace, Workspace, dense, sparse};
use tetdb_base::geom::HilbertFrame;
use tetdb_base::storage::{Pages, Sorter, StorageError, check_cancelled, sort_record};
use tetdb_schema::page::NONE;

/// A child under construction.
pub(super) struct ChildBuilder<'a, P: Pages, Q: Pages, R: Pages> {
    pub host: &'a mut Mesh<P>,
    pub core: &'a mut Mesh<Q>,
    pub child: &'a mut Mesh<R>,
    pub open_cut: &'a OpenCut,
    pub high: bool,
    /// Begin of the map of tetrahedra in each scratch map, after that of vertices.
    pub host_base: u32,
    pub core_base: u32,
    /// Tetrahedra out of the core with a required face whose vertices may all be in it.
    pub tets_at_core: Vec<u32>,
}

impl<P: Pages, Q: Pages, R: Pages> ChildBuilder<'_, P, Q, R> {
    /// Bits of the fate of a tetrahedron that goes to this child.
    fn side_bits(&self) -> u32 {
        if self.high { placement::HIGH } else { 0 }
    }

    /// Returns whether a vertex of the host that the core does not have is on this side.
    pub fn is_on_side(&mut self, v: u32) -> bool {
        let p = self.host.point(v);
        (self.open_cut.zone.surface.distance(p) >= 0.0) == self.high
    }

    /// Adds all vertices of the child's tetrahedra. Afterwards both scratch maps have their numbers.
    pub fn add_vertices(
        &mut self,
        order: &HilbertFrame,
        space: &Workspace,
    ) -> Result<(), StorageError> {
        self.meet_core_vertices();
        let mut sorter = Sorter::new(space.dir, space.memory);
        for n in 0..self.core_base {
            let (v, met) = (sparse(n), self.core.scratch(n));
            if met != NONE && !is_held(self.core, v) {
                let key = order.index(self.core.point(v));
                sorter.push(ChildVertex { key, met, source: v })?;
            }
        }
        for n in 0..self.host_base {
            let (v, met) = (sparse(n), self.host.scratch(n));
            if met == NONE {
                continue;
            }
            if met & SHARED == 0 {
                if self.is_on_side(v) {
                    let key = order.index(self.host.point(v));
                    let met = IN_HOST | met;
                    let source = IN_HOST | v;
                    sorter.push(ChildVertex { key, met, source })?;
                }
                continue;
            }
            // Vertices of the core boundary have in the core no tag of their own.
            let (copy, met) = (met & !SHARED, self.core.scratch(dense(met & !SHARED)));
            if met != NONE && is_held(self.core, copy) {
                let key = order.index(self.host.point(v));
                let source = IN_HOST | v;
                sorter.push(ChildVertex { key, met, source })?;
            }
        }
        for vertex in sorter.finish()? {
            let source = vertex?.source;
            if source & IN_HOST == 0 {
                self.add_core_vertex(source);
                continue;
            }
            let v = source & !IN_HOST;
            let number = self.add_host_vertex(v);
            let word = self.host.scratch(dense(v));
            if word & SHARED == 0 {
                self.host.set_scratch(dense(v), number);
            } else {
                self.core.set_scratch(dense(word & !SHARED), number);
            }
        }
        Ok(())
    }

    /// Numbers the core's vertices as they are met in tetrahedra of this side; in its scratch map others have [`NONE`].
    fn meet_core_vertices(&mut self) {
        self.core.reset_scratch(self.core_base, NONE);
        let mut met = 0;
        for t in tet_ids(self.core) {
            let tet = self.core.tet(t);
            let ours = tet.is_live() && self.open_cut.labels.is_high(t) == self.high;
            self.core.set_scratch(self.core_base + dense(t), if ours { 0 } else { NONE });
            if !ours {
                continue;
            }
            for v in tet.vertices() {
                if self.core.scratch(dense(v)) == NONE {
                    self.core.set_scratch(dense(v), met);
                    met += 1;
                }
            }
        }
    }

    fn add_core_vertex(&mut self, v: u32) -> u32 {
        let (p, h) = self.core.point_and_size(v);
        let number = self.child.add_vertex(p, h);
        copy_attribute(self.core, v, self.child, number);
        self.core.set_scratch(dense(v), number);
        number
    }

    /// Adds a vertex of the host; the scratch maps are as before.
    pub fn add_host_vertex(&mut self, v: u32) -> u32 {
        let (p, h) = self.host.point_and_size(v);
        let number = self.child.add_vertex(p, h);
        copy_attribute(self.host, v, self.child, number);
        number
    }

    /// The child's number of a vertex of one of the host's tetrahedra of this side.
    #[inline]
    fn host_vertex(&mut self, v: u32) -> u32 {
        let word = self.host.scratch(dense(v));
        if word & SHARED == 0 {
            return word;
        }
        let copy = word & !SHARED;
        let number = self.core.scratch(dense(copy));
        if number != NONE {
            return number;
        }
        // None of its tetrahedra in the core is on this side: the mesh is pinched there.
        let number = self.add_host_vertex(v);
        self.core.set_scratch(dense(copy), number);
        self.child.set_scratch(dense(number), 0);
        number
    }

    /// Returns whether the host's tetrahedron at position `n` goes to this child; then the number in the scratch map.
    #[inline]
    fn child_tet_of_host(&mut self, n: u32) -> Option<u32> {
        let word = self.host.scratch(self.host_base + n);
        (word & placement::BITS == self.side_bits()).then_some(word & !placement::BITS)
    }

    /// Puts into the scratch maps the child's number of each of its tetrahedra.
    pub fn number_tets(&mut self) {
        let side = self.side_bits();
        self.child.reset_scratch(dense(self.child.vertex_ids_end()), 0);
        // First the smallest number of a vertex, which is counted in the child's scratch map.
        for t in tet_ids(self.core) {
            let place = self.core_base + dense(t);
            if self.core.scratch(place) == NONE {
                continue;
            }
            let numbers = (self.core.tet(t).vertices()).map(|v| self.core.scratch(dense(v)));
            let least = least(numbers);
            self.core.set_scratch(place, least);
            self.count(least);
        }
        for n in 0..dense(self.host.tet_ids_end()) {
            if n & 1023 == 0 {
                check_cancelled();
            }
            if self.child_tet_of_host(n).is_some() {
                let [a, b, c, d] = self.host.tet(sparse(n)).vertices();
                let numbers = [
                    self.host_vertex(a),
                    self.host_vertex(b),
                    self.host_vertex(c),
                    self.host_vertex(d),
                ];
                let least = least(numbers);
                self.host.set_scratch(self.host_base + n, side | least);
                self.count(least);
            }
        }
        let mut sum = 0;
        for n in 0..dense(self.child.vertex_ids_end()) {
            let count = self.child.scratch(n);
            self.child.set_scratch(n, sum);
            sum += count;
        }
        // Then the place among those with the same.
        for t in tet_ids(self.core) {
            let place = self.core_base + dense(t);
            let least = self.core.scratch(place);
            if least != NONE {
                let number = self.next_number_at(least);
                self.core.set_scratch(place, number);
            }
        }
        for n in 0..dense(self.host.tet_ids_end()) {
            if let Some(least) = self.child_tet_of_host(n) {
                let number = self.next_number_at(least);
                self.host.set_scratch(self.host_base + n, side | number);
            }
        }
        self.child.clear_scratch();
        self.child.take_tets(sum);
    }

    /// Counts a tetrahedron at its first vertex.
    #[inline]
    fn count(&mut self, first: u32) {
        let n = self.child.scratch(dense(first));
        self.child.set_scratch(dense(first), n + 1);
    }

    /// The next number of a tetrahedron with that first vertex.
    #[inline]
    fn next_number_at(&mut self, first: u32) -> u32 {
        let n = self.child.scratch(dense(first));
        self.child.set_scratch(dense(first), n + 1);
        sparse(n)
    }

    pub fn write_host(&mut self) {
        for n in 0..dense(self.host.tet_ids_end()) {
            if n & 1023 == 0 {
                check_cancelled();
            }
            let Some(number) = self.child_tet_of_host(n) else {
                continue;
            };
            let tet = self.host.tet(sparse(n));
            let mut copy = tet;
            let (mut required, mut shared) = (0, 0);
            for i in 0..4 {
                required |= tet.node[i] & REQUIRED;
                shared += self.host.scratch(dense(tet.vertex(i))) >> SHARED.trailing_zeros();
                copy.node[i] = self.host_vertex(tet.vertex(i)) | tet.node[i] & REQUIRED;
                let across = tet.neighbor[i];
                if across.exists() {
                    // Those across the core boundary are linked from the core.
                    let other = self.child_tet_of_host(dense(across.tet()));
                    copy.neighbor[i] =
                        other.map_or(FaceRef::NONE, |t| FaceRef::new(t, across.face()));
                }
            }
            if required != 0 && shared > 2 {
                self.tets_at_core.push(number);
            }
            let (region, flags) = self.host.tet_attribute(sparse(n));
            self.child.place_tet(number, copy);
            (self.child).set_tet_attribute(number, region, flags & FROZEN);
        }
    }

    pub fn write_core(&mut self) {
        for t in tet_ids(self.core) {
            let number = self.core.scratch(self.core_base + dense(t));
            if number == NONE {
                continue;
            }
            let tet = self.core.tet(t);
            let mut copy = tet;
            let mut flags = 0;
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                let here = FaceRef::new(number, i);
                let mut node = self.core.scratch(dense(tet.vertex(i))) | tet.node[i] & REQUIRED;
                if across.exists() {
                    let other = self.core.scratch(self.core_base + dense(across.tet()));
                    if other == NONE {
                        copy.neighbor[i] = FaceRef::NONE;
                        node |= REQUIRED;
                        flags = FROZEN;
                    } else {
                        copy.neighbor[i] = FaceRef::new(other, across.face());
                    }
                } else if let Some(beyond) = self.open_cut.core_boundary.find(tet.face(i)) {
                    let there = self.host.tet(beyond.tet());
                    let other = self.child_tet_of_host(dense(beyond.tet()));
                    let other =
                        other.expect("the core boundary is not free: both sides of it go together");
                    let other = FaceRef::new(other, beyond.face());
                    copy.neighbor[i] = other;
                    self.child.set_neighbor(other, here);
                    node &= !REQUIRED;
                    node |= there.node[beyond.face()] & REQUIRED;
                }
                copy.node[i] = node;
            }
            let (region, _) = self.core.tet_attribute(t);
            self.child.place_tet(number, copy);
            self.child.set_tet_attribute(number, region, flags);
        }
    }

    pub fn new_interface(&mut self) {
        let (child, high, cut) = (&mut *self.child, self.high, self.open_cut.zone.cut);
        let mut index = 0;
        for_each_interface_face(self.core, &self.open_cut.labels, |core, tet, i| {
            let mut vertices = tet.face(i).map(|v| core.scratch(dense(v)));
            if high {
                vertices.swap(1, 2);
            }
            child.add_interface_face(MeshInterfaceFace {
                vertices,
                cut,
                index,
                side: u32::from(high),
            });
            index += 1;
        });
    }
}

sort_record! {
    /// A vertex of the child.
    struct ChildVertex {
        /// Its place along the curve.
        key: u64,
        /// Order of the first visit, with [`IN_HOST`] for a vertex in the host alone.
        met: u32,
        /// Id of the source, with [`IN_HOST`] for one of the host.
        source: u32,
    }
}

/// Bit of `met` for a vertex met in the host alone: such vertices come after those of the core. Bit of `source` for an
/// id of the host.
const IN_HOST: u32 = 1 << 31;

#[inline]
fn least([a, b, c, d]: [u32; 4]) -> u32 {
    a.min(b).min(c.min(d))
}
