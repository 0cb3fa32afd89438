//! All tetrahedra around a vertex.

use crate::mesh::{Mesh, Tet};
use crate::storage::Pages;

/// Up to this many tetrahedra are found again by looking through the list.
const LISTED_MAX: usize = 48;

/// The ball of a vertex, copied out of the mesh; its buffers are meant to be used again.
#[derive(Clone, Debug, Default)]
pub struct Ball {
    /// Id of the vertex.
    pub v: u32,
    /// Indices of the tetrahedra around it.
    pub tets: Vec<u32>,
    /// Parallel to `tets`.
    pub records: Vec<Tet>,
    /// Parallel to `tets`: local number of `v`.
    pub locals: Vec<u8>,
    /// Whether no face at `v` is on the hull.
    pub closed: bool,
    /// Whether some face at `v` is required.
    pub required: bool,
    /// Open addressing over tetrahedra, used by large balls; `u32::MAX` is an empty place.
    table: Vec<u32>,
}

impl Ball {
    /// Gathers the tetrahedra around `v` reached through its faces, required ones too, from `start`, which must have `v`.
    ///
    /// `false` when `start` does not have `v` or there are more than `tets_max` (nothing usable is left then). Where the
    /// mesh is pinched at `v`, only the part of `start` is found.
    pub fn gather<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        v: u32,
        start: u32,
        tets_max: usize,
    ) -> bool {
        self.v = v;
        self.tets.clear();
        self.records.clear();
        self.locals.clear();
        self.table.clear();
        (self.closed, self.required) = (true, false);
        if start >= mesh.tet_ids_end() {
            return false;
        }
        let record = mesh.tet(start);
        let Some(local) = record.local(v).filter(|_| record.is_live()) else {
            return false;
        };
        self.push(start, record, local);
        let mut next = 0;
        while next < self.tets.len() {
            let (record, local) = (self.records[next], usize::from(self.locals[next]));
            next += 1;
            for i in 0..4 {
                if i == local {
                    continue;
                }
                self.required |= record.is_required(i);
                let across = record.neighbor[i];
                if !across.exists() {
                    self.closed = false;
                } else if !self.has(across.tet()) {
                    if self.tets.len() == tets_max {
                        return false;
                    }
                    let other = mesh.tet(across.tet());
                    let local = other.local(v).unwrap_or_else(|| {
                        panic!("tetrahedron {} misses vertex {v}", across.tet())
                    });
                    self.push(across.tet(), other, local);
                }
            }
        }
        true
    }

    /// The ball from [`Mesh::tet_of`].
    pub fn gather_of<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32, tets_max: usize) -> bool {
        let start = mesh.tet_of(v);
        self.gather(mesh, v, start, tets_max)
    }

    #[inline]
    fn push(&mut self, t: u32, record: Tet, local: usize) {
        self.tets.push(t);
        self.records.push(record);
        self.locals.push(local as u8);
        let n = self.tets.len();
        if n > LISTED_MAX {
            if 2 * n > self.table.len() {
                let size = (4 * n).next_power_of_two();
                self.table.clear();
                self.table.resize(size, u32::MAX);
                for k in 0..n {
                    self.enter(self.tets[k]);
                }
            } else {
                self.enter(t);
            }
        }
    }

    fn enter(&mut self, t: u32) {
        let at = self.place(t);
        self.table[at] = t;
    }

    /// Where `t` is in the table, or would be.
    fn place(&self, t: u32) -> usize {
        let mask = self.table.len() - 1;
        let mut at = (t.wrapping_mul(0x9E37_79B1) >> 7) as usize & mask;
        while self.table[at] != u32::MAX && self.table[at] != t {
            at = (at + 1) & mask;
        }
        at
    }

    #[inline]
    fn has(&self, t: u32) -> bool {
        if self.tets.len() <= LISTED_MAX {
            self.tets.contains(&t)
        } else {
            self.table[self.place(t)] == t
        }
    }
}
