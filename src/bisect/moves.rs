//! Moves of tetrahedra from one side of the interface to the other.

use std::collections::BTreeSet;

use super::core::Rim;
use super::interface::Steps;
use super::labels::{face_cost, interface_faces, is_constrained, is_free, is_high, set_high};
use super::surface::CuttingSurface;
use crate::mesh::{Mesh, Tet};
use crate::reconnect::Ball;
use crate::store::{Pages, stop_if_requested};

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

/// Scratch of the moves.
pub(super) struct Moves<'a, S> {
    surface: &'a S,
    rim: &'a Rim,
    ball: Ball,
    around: Ball,
    /// Tetrahedra being moved, then those beside them.
    moved: Vec<u32>,
    beside: Vec<u32>,
    vertices: Vec<u32>,
    part: Vec<u8>,
    stack: Vec<usize>,
    /// Vertices around which a side is in several parts.
    pinched: BTreeSet<u32>,
}

impl<'a, S: CuttingSurface> Moves<'a, S> {
    pub(super) fn new(surface: &'a S, rim: &'a Rim) -> Self {
        Self {
            surface,
            rim,
            ball: Ball::default(),
            around: Ball::default(),
            moved: Vec::new(),
            beside: Vec::new(),
            vertices: Vec::new(),
            part: Vec::new(),
            stack: Vec::new(),
            pinched: BTreeSet::new(),
        }
    }

    /// Moves until no move gains; returns how many were made.
    pub(super) fn run<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32], steps: Steps) -> u64 {
        let mut total = 0;
        for _ in 0..PASSES_MAX {
            let mut made = 0;
            if steps.vertex_moves {
                for v in interface_vertices(core, free) {
                    for high in [false, true] {
                        made += u64::from(self.move_ball(core, v, high));
                    }
                }
            }
            if steps.tet_moves {
                for &t in free {
                    let tet = core.tet(t);
                    if interface_faces(core, t, &tet).next().is_some() {
                        self.moved.clear();
                        self.moved.push(t);
                        let high = !is_high(core, t);
                        made += u64::from(self.try_move(core, high));
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

    /// Puts all free tetrahedra around `v` on one side, if that gains.
    fn move_ball<P: Pages>(&mut self, core: &mut Mesh<P>, v: u32, high: bool) -> bool {
        stop_if_requested();
        if !self.ball.gather_of(core, v, BALL_MAX) {
            return false;
        }
        self.moved.clear();
        for k in 0..self.ball.tets.len() {
            let t = self.ball.tets[k];
            if is_high(core, t) != high && is_free(core, t) {
                self.moved.push(t);
            }
        }
        !self.moved.is_empty() && self.try_move(core, high)
    }

    /// Puts `moved` on the other side, or leaves them when that does not gain.
    fn try_move<P: Pages>(&mut self, core: &mut Mesh<P>, high: bool) -> bool {
        self.list_beside(core);
        let before = self.cost(core);
        self.put(core, high);
        let gain = before - self.cost(core);
        // Without a pinched vertex there is nothing more to gain than faces, which is told without looking at balls.
        let may_mend = self.vertices.iter().any(|v| self.pinched.contains(v));
        if gain < if may_mend { -PINCH } else { GAIN_MIN } {
            self.put(core, !high);
            return false;
        }
        let after = self.pinches(core);
        self.put(core, !high);
        let pinches = self.pinches(core);
        if after > pinches || gain + PINCH * f64::from(pinches - after) < GAIN_MIN {
            return false;
        }
        self.put(core, high);
        if after > 0 || pinches > 0 {
            self.note_pinched(core);
        }
        true
    }

    /// Notes which vertices of `moved` are pinched now.
    fn note_pinched<P: Pages>(&mut self, core: &mut Mesh<P>) {
        for k in 0..self.vertices.len() {
            let v = self.vertices[k];
            if self.parts_around(core, v) > 0 {
                self.pinched.insert(v);
            } else {
                self.pinched.remove(&v);
            }
        }
    }

    fn put<P: Pages>(&self, core: &mut Mesh<P>, high: bool) {
        for &t in &self.moved {
            set_high(core, t, high);
        }
    }

    fn list_beside<P: Pages>(&mut self, core: &mut Mesh<P>) {
        self.beside.clear();
        self.vertices.clear();
        for &t in &self.moved {
            let tet = core.tet(t);
            self.vertices.extend(tet.vertices());
            for across in tet.neighbor {
                if across.exists() && !self.moved.contains(&across.tet()) {
                    self.beside.push(across.tet());
                }
            }
        }
        for list in [&mut self.beside, &mut self.vertices] {
            list.sort_unstable();
            list.dedup();
        }
    }

    /// Cost of the faces of `moved`, and of `moved` and `beside` as over-constrained.
    fn cost<P: Pages>(&self, core: &mut Mesh<P>) -> f64 {
        let mut sum = 0.0;
        for &t in &self.moved {
            let tet = core.tet(t);
            for i in interface_faces(core, t, &tet) {
                // A face between two of them would count twice, but both are on one side before and after.
                sum += face_cost(tet.face(i).map(|v| core.point(v)), self.surface);
            }
            sum += self.crowding(core, t, &tet);
        }
        for &t in &self.beside {
            let tet = core.tet(t);
            sum += self.crowding(core, t, &tet);
        }
        sum
    }

    fn crowding<P: Pages>(&self, core: &mut Mesh<P>, t: u32, tet: &Tet) -> f64 {
        let mut n = interface_faces(core, t, tet)
            .filter(|&i| !tet.is_required(i))
            .count();
        if n == 0 {
            return 0.0;
        }
        n += (0..4).filter(|&i| is_constrained(tet, i, self.rim)).count();
        match n {
            0 | 1 => 0.0,
            2 => TWO,
            _ => TWO + THREE,
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
            let high = is_high(core, self.around.tets[k]);
            self.part.push(u8::from(high));
        }
        if self.part.iter().all(|&p| p == self.part[0]) {
            return 0;
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
                    let other = self.around.tets.iter().position(|&t| t == across.tet());
                    if let Some(other) = other.filter(|&o| self.part[o] == side) {
                        self.part[other] = 2;
                        self.stack.push(other);
                    }
                }
            }
        }
        parts[0] + parts[1] - 2
    }

    /// Vertices around which a side is in several parts.
    pub(super) fn count_pinched<P: Pages>(&mut self, core: &mut Mesh<P>, free: &[u32]) -> u64 {
        self.pinched.clear();
        for v in interface_vertices(core, free) {
            let start = core.tet_of(v);
            if self.parts_too_many(core, v, start) > 0 {
                self.pinched.insert(v);
            }
        }
        self.pinched.len() as u64
    }
}

/// Vertices of interface faces, ascending. An interface face has a free tetrahedron on one of its sides.
fn interface_vertices<P: Pages>(core: &mut Mesh<P>, free: &[u32]) -> Vec<u32> {
    let mut vertices = Vec::new();
    for &t in free {
        let tet = core.tet(t);
        for i in interface_faces(core, t, &tet) {
            vertices.extend(tet.face(i));
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}
