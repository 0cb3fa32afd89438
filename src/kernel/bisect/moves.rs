//! Moves tetrahedra from one side of the interface to the other, as long as that lowers its cost.

use super::core::CoreBoundary;
use super::side_labels::{SideLabels, face_cost, is_constrained};
use super::surface::CuttingSurface;
use crate::mesh::{Mesh, Tet, dense};
use crate::reconnect::Ball;
use tetdb_base::storage::{Pages, check_cancelled};

/// Costs added to those of faces: a tetrahedron with two constrained faces, one with three, a side in two parts around a vertex.
const TWO: f64 = 2.0;
const THREE: f64 = 6.0;
const PINCH: f64 = 60.0;
/// Least gain of a move: more than rounding of a sum of some hundred costs.
const GAIN_MIN: f64 = 1e-6;
/// Passes over the interface.
const PASSES_MAX: u32 = 10;
/// Balls with more tetrahedra are not moved.
const BALL_MAX: usize = 400;

/// Notes about a vertex: moving its ball to the low or the high side gains nothing; a side has several parts around it.
const NO_GAIN: [u8; 2] = [1, 2];
const PINCHED: u8 = 4;
/// Notes about a tetrahedron: moving it alone gains nothing; it is being moved.
const TET_NO_GAIN: u8 = 1;
const MOVED: u8 = 2;

/// Scratch of the moves. Memory: one byte for each vertex of the core, three for each tetrahedron.
pub(super) struct Moves<'a, S> {
    /// The current sides.
    pub labels: SideLabels,
    surface: &'a S,
    boundary: &'a CoreBoundary,
    ball: Ball,
    around: Ball,
    /// Tetrahedra being moved, and their neighbors.
    moved: Vec<u32>,
    adjacent: Vec<u32>,
    vertices: Vec<u32>,
    part_of: Vec<u8>,
    stack: Vec<usize>,
    /// Notes by dense number. A move without gain is tried again only after a side nearby has changed.
    notes_of_vertices: Vec<u8>,
    notes_of_tets: Vec<u8>,
    /// Position of a tetrahedron in the ball `around`; of other tetrahedra, a position in an earlier ball.
    at: Vec<u16>,
}

impl<'a, S: CuttingSurface> Moves<'a, S> {
    /// `core` must not change while this value is in use; only sides may.
    pub fn new<P: Pages>(
        core: &Mesh<P>,
        labels: SideLabels,
        surface: &'a S,
        boundary: &'a CoreBoundary,
    ) -> Self {
        Self {
            labels,
            surface,
            boundary,
            ball: Ball::default(),
            around: Ball::default(),
            moved: Vec::new(),
            adjacent: Vec::new(),
            vertices: Vec::new(),
            part_of: Vec::new(),
            stack: Vec::new(),
            notes_of_vertices: vec![0; dense(core.vertex_ids_end()) as usize],
            notes_of_tets: vec![0; dense(core.tet_ids_end()) as usize],
            at: vec![0; dense(core.tet_ids_end()) as usize],
        }
    }

    /// Bytes of the notes.
    pub fn bytes(&self) -> u64 {
        (self.notes_of_vertices.len() + 3 * self.notes_of_tets.len()) as u64
    }

    /// Moves tetrahedra until no move gains; returns the number of moves.
    pub fn run<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32]) -> u64 {
        let mut total = 0;
        for _ in 0..PASSES_MAX {
            let moves = self.move_balls(core, free) + self.move_tets(core, free);
            total += moves;
            if moves == 0 {
                break;
            }
        }
        total
    }

    /// Tries to move the balls of the interface's vertices to either side; returns the number of moves.
    fn move_balls<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32]) -> u64 {
        let mut moves = 0;
        for v in self.interface_vertices(core, free) {
            for (high, no_gain) in [false, true].into_iter().zip(NO_GAIN) {
                if *self.vertex_notes(v) & no_gain != 0 {
                    continue;
                }
                if self.move_ball(core, v, high) {
                    moves += 1;
                } else {
                    *self.vertex_notes(v) |= no_gain;
                }
            }
        }
        moves
    }

    /// Tries to move single tetrahedra at the interface to their other side; returns the number of moves.
    fn move_tets<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32]) -> u64 {
        let mut moves = 0;
        for &t in free {
            if *self.tet_notes(t) & TET_NO_GAIN != 0 {
                continue;
            }
            let tet = core.tet(t);
            if self.labels.interface_faces(t, &tet).next().is_none() {
                continue;
            }
            self.moved.clear();
            self.moved.push(t);
            let high = !self.labels.is_high(t);
            if self.try_move(core, high) {
                moves += 1;
            } else {
                *self.tet_notes(t) |= TET_NO_GAIN;
            }
        }
        moves
    }

    #[inline]
    fn vertex_notes(&mut self, v: u32) -> &mut u8 {
        &mut self.notes_of_vertices[dense(v) as usize]
    }

    #[inline]
    fn tet_notes(&mut self, t: u32) -> &mut u8 {
        &mut self.notes_of_tets[dense(t) as usize]
    }

    /// Puts all free tetrahedra around `v` on one side, if that gains.
    fn move_ball<P: Pages>(&mut self, core: &mut Mesh<P>, v: u32, high: bool) -> bool {
        check_cancelled();
        if !self.ball.gather_of(core, v, BALL_MAX) {
            return false;
        }
        self.moved.clear();
        for k in 0..self.ball.tets.len() {
            let t = self.ball.tets[k];
            if self.labels.is_high(t) != high && self.labels.is_free(t) {
                self.moved.push(t);
            }
        }
        !self.moved.is_empty() && self.try_move(core, high)
    }

    /// Puts `moved`, all on the other side, on side `high`, or leaves them when that does not gain.
    fn try_move<P: Pages>(&mut self, core: &mut Mesh<P>, high: bool) -> bool {
        self.gather_adjacent(core);
        let [before, after] = self.costs(core, high);
        for k in 0..self.moved.len() {
            *self.tet_notes(self.moved[k]) &= !MOVED;
        }
        let gain = before - after;
        // Without a pinched vertex a move gains only by faces, and their costs are known without the balls.
        let is_pinched = |&v: &u32| self.notes_of_vertices[dense(v) as usize] & PINCHED != 0;
        let may_unpinch = self.vertices.iter().any(is_pinched);
        if gain < if may_unpinch { -PINCH } else { GAIN_MIN } {
            return false;
        }
        self.put(high);
        let after = self.pinches(core);
        self.put(!high);
        let pinches = self.pinches(core);
        if after > pinches || gain + PINCH * f64::from(pinches - after) < GAIN_MIN {
            return false;
        }
        self.put(high);
        self.clear_no_gain(core);
        if after > 0 || pinches > 0 {
            self.note_pinched(core);
        }
        true
    }

    /// Notes which vertices of `moved` are pinched now.
    fn note_pinched<P: Pages>(&mut self, core: &mut Mesh<P>) {
        for k in 0..self.vertices.len() {
            let v = self.vertices[k];
            let is_pinched = self.parts_around(core, v) > 0;
            let closed = self.around.closed;
            let note = self.vertex_notes(v);
            if is_pinched != (*note & PINCHED != 0) {
                *note ^= PINCHED;
                if !closed {
                    // Some of its tetrahedra may not be reachable from here through faces.
                    self.notes_of_vertices.iter_mut().for_each(|n| *n &= PINCHED);
                    self.notes_of_tets.fill(0);
                }
            }
        }
    }

    /// Clears the notes on moves that depend on the sides of `moved`: those of tetrahedra and vertices in the balls of its vertices.
    fn clear_no_gain<P: Pages>(&mut self, core: &mut Mesh<P>) {
        for k in 0..self.vertices.len() {
            let v = self.vertices[k];
            self.around.tets.clear();
            for m in 0..self.moved.len() {
                let t = self.moved[m];
                if self.around.tets.contains(&t) || core.tet(t).local(v).is_none() {
                    continue;
                }
                self.around.gather(core, v, t, usize::MAX);
                for &t in &self.around.tets {
                    self.notes_of_tets[dense(t) as usize] &= !TET_NO_GAIN;
                }
                for v in self.around.records.iter().flat_map(Tet::vertices) {
                    self.notes_of_vertices[dense(v) as usize] &= PINCHED;
                }
            }
        }
    }

    fn put(&mut self, high: bool) {
        for &t in &self.moved {
            self.labels.set_high(t, high);
        }
    }

    /// Gathers the neighbors and the vertices of `moved`, and marks `moved` as being moved.
    fn gather_adjacent<P: Pages>(&mut self, core: &mut Mesh<P>) {
        self.adjacent.clear();
        self.vertices.clear();
        for k in 0..self.moved.len() {
            *self.tet_notes(self.moved[k]) |= MOVED;
        }
        for &t in &self.moved {
            let tet = core.tet(t);
            self.vertices.extend(tet.vertices());
            for across in tet.neighbor {
                if across.exists() && self.notes_of_tets[dense(across.tet()) as usize] & MOVED == 0
                {
                    self.adjacent.push(across.tet());
                }
            }
        }
        for list in [&mut self.adjacent, &mut self.vertices] {
            list.sort_unstable();
            list.dedup();
        }
    }

    /// Cost of the faces of `moved`, and of `moved` and `adjacent` as over-constrained: now, and with `moved` on side `high`.
    fn costs<P: Pages>(&self, core: &mut Mesh<P>, high: bool) -> [f64; 2] {
        let is_moved = |t: u32| self.notes_of_tets[dense(t) as usize] & MOVED != 0;
        let mut sums = [0.0; 2];
        for &t in &self.moved {
            let tet = core.tet(t);
            let mut cut = [0; 2];
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                // A face between two moved tetrahedra is not on the interface, before or after.
                if !across.exists() || is_moved(across.tet()) {
                    continue;
                }
                let when = usize::from(self.labels.is_high(across.tet()) != high);
                sums[when] += face_cost(tet.face(i).map(|v| core.point(v)), self.surface);
                cut[when] += u32::from(!tet.is_required(i));
            }
            self.add_crowding(&mut sums, &tet, cut);
        }
        for &t in &self.adjacent {
            let tet = core.tet(t);
            let side = self.labels.is_high(t);
            let mut cut = [0; 2];
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if !across.exists() || tet.is_required(i) {
                    continue;
                }
                if is_moved(across.tet()) {
                    cut[usize::from(high != side)] += 1;
                } else if self.labels.is_high(across.tet()) != side {
                    cut = cut.map(|n| n + 1);
                }
            }
            self.add_crowding(&mut sums, &tet, cut);
        }
        sums
    }

    /// Adds the cost of a tetrahedron with several constrained faces; `cut` is its number of interface faces that are not required, before and after.
    fn add_crowding(&self, sums: &mut [f64; 2], tet: &Tet, cut: [u32; 2]) {
        if cut == [0; 2] {
            return;
        }
        let constrained = (0..4).filter(|&i| is_constrained(tet, i, self.boundary));
        let constrained = constrained.count() as u32;
        for (sum, n) in sums.iter_mut().zip(cut).filter(|(_, n)| *n > 0) {
            *sum += match n + constrained {
                1 => 0.0,
                2 => TWO,
                _ => TWO + THREE,
            };
        }
    }

    /// Sum of [`Self::excess_parts`] over the vertices of `moved`.
    fn pinches<P: Pages>(&mut self, core: &mut Mesh<P>) -> i32 {
        let mut sum = 0;
        for k in 0..self.vertices.len() {
            let v = self.vertices[k];
            sum += self.parts_around(core, v);
        }
        sum
    }

    /// Excess parts around a vertex of `moved`, in the ball of the first moved tetrahedron that has the vertex: a vertex of
    /// the surface may have several balls.
    fn parts_around<P: Pages>(&mut self, core: &mut Mesh<P>, v: u32) -> i32 {
        let mut moved = self.moved.iter().copied();
        let start = moved.find(|&t| core.tet(t).local(v).is_some());
        self.excess_parts(core, v, start.expect("a vertex of a moved tetrahedron"))
    }

    /// Parts of the ball of `v` beyond one for each side; 0 for a ball of more than [`BALL_MAX`] tetrahedra.
    fn excess_parts<P: Pages>(&mut self, core: &mut Mesh<P>, v: u32, start: u32) -> i32 {
        if !self.around.gather(core, v, start, BALL_MAX) {
            return 0;
        }
        let n = self.around.tets.len();
        self.part_of.clear();
        for k in 0..n {
            let high = self.labels.is_high(self.around.tets[k]);
            self.part_of.push(u8::from(high));
        }
        if self.part_of.iter().all(|&p| p == self.part_of[0]) {
            return 0;
        }
        for (k, &t) in self.around.tets.iter().enumerate() {
            self.at[dense(t) as usize] = k as u16;
        }
        // 0 and 1: not yet reached, low and high; 2: reached.
        let mut parts = [0; 2];
        for k in 0..n {
            let side = self.part_of[k];
            if side > 1 {
                continue;
            }
            parts[usize::from(side)] += 1;
            self.part_of[k] = 2;
            self.stack.push(k);
            while let Some(at) = self.stack.pop() {
                let record = self.around.records[at];
                let local = usize::from(self.around.locals[at]);
                for i in (0..4).filter(|&i| i != local) {
                    let across = record.neighbor[i];
                    if !across.exists() {
                        continue;
                    }
                    // A face at the vertex leads to another tetrahedron of its ball.
                    let other = usize::from(self.at[dense(across.tet()) as usize]);
                    if self.part_of[other] == side {
                        self.part_of[other] = 2;
                        self.stack.push(other);
                    }
                }
            }
        }
        parts[0] + parts[1] - 2
    }

    /// Notes and counts the vertices around which a side has several parts.
    pub fn count_pinched<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32]) -> u64 {
        self.notes_of_vertices.iter_mut().for_each(|n| *n &= !PINCHED);
        let mut pinched = 0;
        for v in self.interface_vertices(core, free) {
            let start = core.tet_of(v);
            if self.excess_parts(core, v, start) > 0 {
                *self.vertex_notes(v) |= PINCHED;
                pinched += 1;
            }
        }
        pinched
    }

    /// Vertices of interface faces, ascending. An interface face has a free tetrahedron on one of its sides.
    fn interface_vertices<P: Pages>(&self, core: &mut Mesh<P>, free: &[u32]) -> Vec<u32> {
        let mut vertices = Vec::new();
        for &t in free {
            let tet = core.tet(t);
            for i in self.labels.interface_faces(t, &tet) {
                vertices.extend(tet.face(i));
            }
        }
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }
}
