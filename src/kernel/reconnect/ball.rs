//! All tetrahedra around a vertex.

use crate::mesh::{Mesh, Tet};
use tetdb_base::storage::Pages;

/// Places of the table at first, most of which stay empty.
const PLACES: usize = 256;

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
    /// True if no face at `v` is on the hull.
    pub closed: bool,
    /// True if some face at `v` is required.
    pub required: bool,
    /// Open addressing over tetrahedra: the turn in the high half, the tetrahedron in the low one; places of other turns are empty.
    table: Vec<u64>,
    turn: u32,
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
        self.begin_turn();
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

    /// Empties the table.
    fn begin_turn(&mut self) {
        match self.turn.checked_add(1) {
            Some(turn) if !self.table.is_empty() => self.turn = turn,
            _ => {
                self.table.clear();
                self.table.resize(PLACES, 0);
                self.turn = 1;
            }
        }
    }

    #[inline]
    fn push(&mut self, t: u32, record: Tet, local: usize) {
        self.tets.push(t);
        self.records.push(record);
        self.locals.push(local as u8);
        if 2 * self.tets.len() <= self.table.len() {
            self.enter(t);
        } else {
            let size = 2 * self.table.len();
            self.table.clear();
            self.table.resize(size, 0);
            for k in 0..self.tets.len() {
                self.enter(self.tets[k]);
            }
        }
    }

    fn enter(&mut self, t: u32) {
        let at = self.place(t);
        self.table[at] = self.entry(t);
    }

    fn entry(&self, t: u32) -> u64 {
        u64::from(self.turn) << 32 | u64::from(t)
    }

    /// Slot of `t` in the table, used or empty.
    #[inline]
    fn place(&self, t: u32) -> usize {
        let (mask, entry) = (self.table.len() - 1, self.entry(t));
        let mut at = (t.wrapping_mul(0x9E37_79B1) >> 7) as usize & mask;
        while self.table[at] != entry && (self.table[at] >> 32) as u32 == self.turn {
            at = (at + 1) & mask;
        }
        at
    }

    #[inline]
    fn has(&self, t: u32) -> bool {
        self.table[self.place(t)] == self.entry(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::FaceRef;

    #[test]
    fn the_table_forgets_and_grows() {
        let record = Tet { node: [0; 4], neighbor: [FaceRef::NONE; 4] };
        let mut ball = Ball::default();
        for turn in [1, 2, u32::MAX, 1, 2] {
            ball.begin_turn();
            assert_eq!(ball.turn, turn);
            ball.tets.clear();
            // Ids that share places, and more of them than there are places at first.
            for k in 0..3 * PLACES as u32 {
                assert!(!ball.has(k << 20), "turn {turn}");
                ball.push(k << 20, record, 0);
                assert!(ball.has(k << 20) && ball.has(0) && !ball.has(k << 20 | 1));
            }
            assert!((0..3 * PLACES as u32).all(|k| ball.has(k << 20)));
            if turn == 2 {
                ball.turn = u32::MAX - 1;
            }
        }
    }
}
