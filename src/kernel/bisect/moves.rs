//! Moves of tetrahedra from one side of the interface to the other.

use super::core::CoreBoundary;
use super::labels::{Labels, face_cost, is_constrained};
use super::surface::CuttingSurface;
use crate::mesh::{Mesh, Tet, dense};
use crate::reconnect::Ball;
use tetdb_base::storage::{Pages, check_cancelled};

/// Costs beside those of faces: a tetrahedron with two constrained faces, one with three, a side in two parts around a vertex.
const TWO: f64 = 2.0;
const THREE: f64 = 6.0;
const PINCH: f64 = 60.0;
/// What a move must gain at least: more than rounding of a sum of some hundred costs.
const GAIN_MIN: f64 = 1e-6;
/// Passes over the interface.
const PASSES_MAX: u32 = 10;
/// Largest ball that is looked at.
const BALL_MAX: usize = 400;

/// Notes about a vertex: no move of its ball to the low side gains, nor to the high side; a side is in several parts around it.
const SETTLED: [u8; 2] = [1, 2];
const PINCHED: u8 = 4;
/// Notes about a tetrahedron: moving it alone does not gain; it is being moved.
const SETTLED_TET: u8 = 1;
const MOVED: u8 = 2;

/// Scratch of the moves. Memory: one byte for each vertex of the core, three for each tetrahedron.
pub(super) struct Moves<'a, S> {
    /// The sides, as they are.
    pub(super) labels: Labels,
    surface: &'a S,
    rim: &'a CoreBoundary,
    ball: Ball,
    around: Ball,
    /// Tetrahedra being moved, then those beside them.
    moved: Vec<u32>,
    beside: Vec<u32>,
    vertices: Vec<u32>,
    part: Vec<u8>,
    stack: Vec<usize>,
    /// Notes by dense number. A move that did not gain is not tried again before a side changes that it was judged by.
    of_vertices: Vec<u8>,
    of_tets: Vec<u8>,
    /// Of a tetrahedron of the ball `around`: its position there. Of any other: what it was in an earlier ball.
    at: Vec<u16>,
}

impl<'a, S: CuttingSurface> Moves<'a, S> {
    /// Nothing of `core` but sides may change from now on.
    pub(super) fn new<P: Pages>(
        core: &Mesh<P>,
        labels: Labels,
        surface: &'a S,
        rim: &'a CoreBoundary,
    ) -> Self {
        Self {
            labels,
            surface,
            rim,
            ball: Ball::default(),
            around: Ball::default(),
            moved: Vec::new(),
            beside: Vec::new(),
            vertices: Vec::new(),
            part: Vec::new(),
            stack: Vec::new(),
            of_vertices: vec![0; dense(core.vertex_ids_end()) as usize],
            of_tets: vec![0; dense(core.tet_ids_end()) as usize],
            at: vec![0; dense(core.tet_ids_end()) as usize],
        }
    }

    /// Bytes of the notes.
    pub(super) fn bytes(&self) -> u64 {
        (self.of_vertices.len() + 3 * self.of_tets.len()) as u64
    }

    /// Moves until no move gains; returns how many moves there were.
    pub(super) fn run<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32], steps: Steps) -> u64 {
        let mut total = 0;
        for _ in 0..PASSES_MAX {
            let mut made = 0;
            if steps.vertex_moves {
                for v in self.interface_vertices(core, free) {
                    for (high, settled) in [false, true].into_iter().zip(SETTLED) {
                        if *self.of_vertex(v) & settled != 0 {
                            continue;
                        }
                        if self.move_ball(core, v, high) {
                            made += 1;
                        } else {
                            *self.of_vertex(v) |= settled;
                        }
                    }
                }
            }
            if steps.tet_moves {
                for &t in free {
                    if *self.of_tet(t) & SETTLED_TET != 0 {
                        continue;
                    }
                    let tet = core.tet(t);
                    if self.labels.interface_faces(t, &tet).next().is_some() {
                        self.moved.clear();
                        self.moved.push(t);
                        let high = !self.labels.is_high(t);
                        if self.try_move(core, high) {
                            made += 1;
                        } else {
                            *self.of_tet(t) |= SETTLED_TET;
                        }
                    }
                }
            }
            total += made;
            if made == 0 {
                break;
            }
        }
        total
    }

    #[inline]
    fn of_vertex(&mut self, v: u32) -> &mut u8 {
        &mut self.of_vertices[dense(v) as usize]
    }

    #[inline]
    fn of_tet(&mut self, t: u32) -> &mut u8 {
        &mut self.of_tets[dense(t) as usize]
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
        self.list_beside(core);
        let [before, after] = self.costs(core, high);
        for k in 0..self.moved.len() {
            *self.of_tet(self.moved[k]) &= !MOVED;
        }
        let gain = before - after;
        // Without a pinched vertex there is nothing more to gain than faces, which the counts say without looking at balls.
        let is_pinched = |&v: &u32| self.of_vertices[dense(v) as usize] & PINCHED != 0;
        let may_mend = self.vertices.iter().any(is_pinched);
        if gain < if may_mend { -PINCH } else { GAIN_MIN } {
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
        self.unsettle(core);
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
            let note = self.of_vertex(v);
            if is_pinched != (*note & PINCHED != 0) {
                *note ^= PINCHED;
                if !closed {
                    // It may have tetrahedra that are not reached from here through faces.
                    self.of_vertices.iter_mut().for_each(|n| *n &= PINCHED);
                    self.of_tets.fill(0);
                }
            }
        }
    }

    /// Forgets what was settled by the sides of `moved`: the moves of what shares a vertex with tetrahedra around their vertices.
    fn unsettle<P: Pages>(&mut self, core: &mut Mesh<P>) {
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
                    self.of_tets[dense(t) as usize] &= !SETTLED_TET;
                }
                for v in self.around.records.iter().flat_map(Tet::vertices) {
                    self.of_vertices[dense(v) as usize] &= PINCHED;
                }
            }
        }
    }

    fn put(&mut self, high: bool) {
        for &t in &self.moved {
            self.labels.set_high(t, high);
        }
    }

    /// Lists what is beside `moved` and its vertices, and marks it as being moved.
    fn list_beside<P: Pages>(&mut self, core: &mut Mesh<P>) {
        self.beside.clear();
        self.vertices.clear();
        for k in 0..self.moved.len() {
            *self.of_tet(self.moved[k]) |= MOVED;
        }
        for &t in &self.moved {
            let tet = core.tet(t);
            self.vertices.extend(tet.vertices());
            for across in tet.neighbor {
                if across.exists() && self.of_tets[dense(across.tet()) as usize] & MOVED == 0 {
                    self.beside.push(across.tet());
                }
            }
        }
        for list in [&mut self.beside, &mut self.vertices] {
            list.sort_unstable();
            list.dedup();
        }
    }

    /// Cost of the faces of `moved`, and of `moved` and `beside` as over-constrained: now, and with `moved` on side `high`.
    fn costs<P: Pages>(&self, core: &mut Mesh<P>, high: bool) -> [f64; 2] {
        let is_moved = |t: u32| self.of_tets[dense(t) as usize] & MOVED != 0;
        let mut sums = [0.0; 2];
        for &t in &self.moved {
            let tet = core.tet(t);
            let mut cut = [0; 2];
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                // A face between two of them is none of the interface, before and after.
                if !across.exists() || is_moved(across.tet()) {
                    continue;
                }
                let when = usize::from(self.labels.is_high(across.tet()) != high);
                sums[when] += face_cost(tet.face(i).map(|v| core.point(v)), self.surface);
                cut[when] += u32::from(!tet.is_required(i));
            }
            self.add_crowding(&mut sums, &tet, cut);
        }
        for &t in &self.beside {
            let tet = core.tet(t);
            let own = self.labels.is_high(t);
            let mut cut = [0; 2];
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if !across.exists() || tet.is_required(i) {
                    continue;
                }
                if is_moved(across.tet()) {
                    cut[usize::from(high != own)] += 1;
                } else if self.labels.is_high(across.tet()) != own {
                    cut = cut.map(|n| n + 1);
                }
            }
            self.add_crowding(&mut sums, &tet, cut);
        }
        sums
    }

    /// Adds what it costs that `tet` has so many faces on the interface that are not required, before and after.
    fn add_crowding(&self, sums: &mut [f64; 2], tet: &Tet, cut: [u32; 2]) {
        if cut == [0; 2] {
            return;
        }
        let constrained = (0..4).filter(|&i| is_constrained(tet, i, self.rim));
        let constrained = constrained.count() as u32;
        for (sum, n) in sums.iter_mut().zip(cut).filter(|(_, n)| *n > 0) {
            *sum += match n + constrained {
                1 => 0.0,
                2 => TWO,
                _ => TWO + THREE,
            };
        }
    }

    /// Parts too many around the vertices of `moved`.
    fn pinches<P: Pages>(&mut self, core: &mut Mesh<P>) -> i32 {
        let mut sum = 0;
        for k in 0..self.vertices.len() {
            let v = self.vertices[k];
            sum += self.parts_around(core, v);
        }
        sum
    }

    /// Parts too many around a vertex of `moved`, in the ball of the first of these that has it: around a vertex of the
    /// surface there may be several balls.
    fn parts_around<P: Pages>(&mut self, core: &mut Mesh<P>, v: u32) -> i32 {
        let mut moved = self.moved.iter().copied();
        let start = moved.find(|&t| core.tet(t).local(v).is_some());
        self.parts_too_many(core, v, start.expect("a vertex of what is moved"))
    }

    /// Parts of the ball of `v` beyond one a side; none where there are more than [`BALL_MAX`] tetrahedra.
    fn parts_too_many<P: Pages>(&mut self, core: &mut Mesh<P>, v: u32, start: u32) -> i32 {
        if !self.around.gather(core, v, start, BALL_MAX) {
            return 0;
        }
        let n = self.around.tets.len();
        self.part.clear();
        for k in 0..n {
            let high = self.labels.is_high(self.around.tets[k]);
            self.part.push(u8::from(high));
        }
        if self.part.iter().all(|&p| p == self.part[0]) {
            return 0;
        }
        for (k, &t) in self.around.tets.iter().enumerate() {
            self.at[dense(t) as usize] = k as u16;
        }
        // 0 and 1: not yet reached, low and high; 2: reached.
        let mut parts = [0; 2];
        for k in 0..n {
            let side = self.part[k];
            if side > 1 {
                continue;
            }
            parts[usize::from(side)] += 1;
            self.part[k] = 2;
            self.stack.push(k);
            while let Some(at) = self.stack.pop() {
                let record = self.around.records[at];
                let local = usize::from(self.around.locals[at]);
                for i in (0..4).filter(|&i| i != local) {
                    let across = record.neighbor[i];
                    if !across.exists() {
                        continue;
                    }
                    // Through a face at the vertex the way leads to another of its ball.
                    let other = usize::from(self.at[dense(across.tet()) as usize]);
                    if self.part[other] == side {
                        self.part[other] = 2;
                        self.stack.push(other);
                    }
                }
            }
        }
        parts[0] + parts[1] - 2
    }

    /// Notes and counts the vertices around which a side is in several parts.
    pub(super) fn count_pinched<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32]) -> u64 {
        self.of_vertices.iter_mut().for_each(|n| *n &= !PINCHED);
        let mut pinched = 0;
        for v in self.interface_vertices(core, free) {
            let start = core.tet_of(v);
            if self.parts_too_many(core, v, start) > 0 {
                *self.of_vertex(v) |= PINCHED;
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

/// Steps of the choice, for comparing what each brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// Whether the interface starts from a minimum cut.
    pub minimum_cut: bool,
    /// Whether it is improved by moving all tetrahedra around a vertex to the other side.
    pub vertex_moves: bool,
    /// Whether it is improved by moving single tetrahedra to the other side.
    pub tet_moves: bool,
}

impl Default for Steps {
    fn default() -> Self {
        Self { minimum_cut: true, vertex_moves: true, tet_moves: true }
    }
}
