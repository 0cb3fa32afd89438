//! Edges of a flat part of the surface, turned in their plane.
//!
//! ```text
//!        c                 c        The Delaunay mesh triangulates a flat part of the surface in its own way. It becomes the
//!      / | \             /   \      surface's way by turning one edge after the other: c d becomes x y where c x d y is convex.
//!     x  |  y    ->     x-----y     In space the tetrahedra above c d all have it as their edge, so that a point a little above
//!      \ | /             \   /      the crossing sees all their other faces, and both new triangles. A vertex of the ring may do
//!        d                 d        as well; where none does, one is put there. The same below.
//! ```
//! A segment in the plane is reached by turning each edge it crosses, those that cannot turn yet after the others.
//!
//! Source: S. W. Sloan, "A fast algorithm for generating constrained Delaunay triangulations", Computers & Structures 47
//! (1993), for the plane; the vertices above and below are our own.

use std::collections::VecDeque;

use super::free_vertex::remove_free;
use super::kernel::{HalfSpace, center, room};
use super::map::MissingFacets;
use super::report::RecoveryReport;
use super::space::{PagedSpace, Space, edge_key};
use super::suppress::half_space;
use super::tidy::rise;
use super::walk::{EdgeRing, Exit, crossings, edge_at, shell};
use crate::geom::{Point, orient};
use crate::mesh::Mesh;
use crate::storage::Pages;

/// A segment that crosses more edges is left to others.
const CROSSINGS_MAX: usize = 2000;

/// Turns a segment may take for each edge it crosses: in the mean it takes one or two.
const TURNS_MAX: usize = 20;

/// Times a place half as far from the crossing is tried.
const HALVES_MAX: i32 = 50;

/// A place with less room than this, in units of the tetrahedra around it, is second choice.
const ROOM_MIN: f64 = 1e-4;

/// Turns edges until the segment `a b` is there, and protects it; takes away again what was added and is not needed.
///
/// `false` when it does not run within one plane, or an edge cannot turn.
pub(super) fn turn_segment<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    report: &mut RecoveryReport,
    a: u32,
    b: u32,
) -> bool {
    let mut s = PagedSpace(mesh, &missing.protected);
    let mut turner = Turner {
        s: &mut s,
        added: Vec::new(),
        balance: 0,
        turns: 0,
    };
    let recovered = turner.recover(a, b);
    turner.clear();
    report.flips += turner.turns;
    report.steiner = report.steiner.saturating_add_signed(turner.balance);
    if recovered {
        missing.protected.insert(edge_key(a, b));
    }
    recovered
}

/// Turns edges for one segment after the other.
struct Turner<'s, 'm, P: Pages> {
    s: &'s mut PagedSpace<'m, P>,
    /// Vertices added and still there.
    added: Vec<u32>,
    /// Vertices added less those taken away, which others may have added.
    balance: i32,
    /// Edges turned.
    turns: u64,
}

/// An edge, by its ends and a tetrahedron that had it.
type Crossed = (u32, u32, u32);

/// The edge after the turn, and whether the segment crosses it too.
type Turned = (Crossed, bool);

/// Tetrahedra, and the vertex added for them.
type Half = (Vec<[u32; 4]>, Option<u32>);

/// An edge `c d` with its tetrahedra, as it turns to `x y`.
struct Turn {
    around: EdgeRing,
    c: u32,
    d: u32,
    /// Place of `x` in the ring.
    at_x: usize,
    /// Place of `y` in the ring, counted from `x`.
    to_y: usize,
    /// Whether the segment crosses `x y` as well.
    crosses: bool,
}

impl<P: Pages> Turner<'_, '_, P> {
    /// Turns edges until `a b` is there; `false` when it does not run within one plane of faces or an edge cannot turn.
    fn recover(&mut self, a: u32, b: u32) -> bool {
        let Ok(met) = crossings(self.s, a, b, CROSSINGS_MAX) else {
            return false;
        };
        let mut queue: VecDeque<Crossed> = VecDeque::new();
        for exit in met {
            let Exit::Edge { tet, c, d } = exit else {
                return false;
            };
            let first = queue.front().map_or(c, |f| f.1);
            if self.s.orient([a, b, first, c]) != 0.0 {
                return false;
            }
            queue.push_back((tet, c, d));
        }
        let mut turns_left = TURNS_MAX * queue.len();
        let mut in_vain = 0;
        while let Some(edge) = queue.pop_front() {
            if turns_left == 0 {
                return false;
            }
            let Some((new, crosses)) = self.turn(edge, a, b) else {
                in_vain += 1;
                queue.push_back(edge);
                if in_vain == queue.len() {
                    return false;
                }
                continue;
            };
            turns_left -= 1;
            in_vain = 0;
            if crosses {
                queue.push_back(new);
            }
        }
        true
    }

    /// Takes away the added vertices that nothing needs.
    fn clear(&mut self) {
        for v in self.added.clone() {
            self.remove(v);
        }
    }

    /// Turns `c d`, which the segment `a b` crosses, if that makes a new edge in the plane.
    ///
    /// Added vertices lie the nearer to the plane the more of them there are: where they leave little room, those around the edge
    /// go or rise first.
    fn turn(&mut self, edge: Crossed, a: u32, b: u32) -> Option<Turned> {
        let turn = self.plan(edge, a, b)?;
        if let Some(turned) = self.carry_out(&turn, false) {
            return Some(turned);
        }
        let mut free = turn.around.ring;
        free.retain(|&v| self.s.is_steiner(v));
        for v in free {
            if !self.remove(v) {
                rise(self.s, v);
            }
        }
        let turn = self.plan(edge, a, b)?;
        self.carry_out(&turn, true)
    }

    /// Takes away a vertex that nothing needs.
    fn remove(&mut self, v: u32) -> bool {
        let removed = remove_free(self.s, v, 0.0);
        if removed {
            self.s.drop_steiner(v);
            self.balance -= 1;
            self.added.retain(|&a| a != v);
        }
        removed
    }

    /// Which edge `c d` becomes; `None` where it has to stay, or the four corners are not convex.
    fn plan(&mut self, (t, c, d): Crossed, a: u32, b: u32) -> Option<Turn> {
        if self.s.protects(c, d) {
            return None;
        }
        let t = edge_at(self.s, t, c, d)?;
        let around = shell(self.s, t, c, d)?;
        if around.required {
            return None;
        }
        let n = around.ring.len();
        let in_plane: Vec<usize> = (0..n)
            .filter(|&i| self.s.orient([a, b, c, around.ring[i]]) == 0.0)
            .collect();
        let &[at_x, at_y] = in_plane.as_slice() else {
            return None;
        };
        let (x, y) = (around.ring[at_x], around.ring[at_y]);
        // No tetrahedron is flat: the next of the ring is off the plane.
        let above = around.ring[(at_x + 1) % n];
        let opposite = |s: &mut PagedSpace<'_, P>, [p, q]: [u32; 2], [u, v]: [u32; 2]| {
            let (at_u, at_v) = (s.orient([p, q, u, above]), s.orient([p, q, v, above]));
            (at_u > 0.0 && at_v < 0.0) || (at_u < 0.0 && at_v > 0.0)
        };
        if !opposite(self.s, [x, y], [c, d]) {
            return None;
        }
        let crosses = opposite(self.s, [a, b], [x, y]);
        Some(Turn {
            around,
            c,
            d,
            at_x,
            to_y: at_y - at_x,
            crosses,
        })
    }

    /// Replaces the tetrahedra around the edge; `None`, and nothing changed, where there is no room.
    fn carry_out(&mut self, turn: &Turn, may_crowd: bool) -> Option<Turned> {
        let (mut new, over) = self.half(turn, true, may_crowd)?;
        let Some((mut below, under)) = self.half(turn, false, may_crowd) else {
            if let Some(p) = over {
                self.s.drop_steiner(p);
            }
            return None;
        };
        for p in over.into_iter().chain(under) {
            self.added.push(p);
            self.balance += 1;
        }
        new.append(&mut below);
        let ids = self.s.replace(&turn.around.tets, &new);
        self.turns += 1;
        let ring = &turn.around.ring;
        let (x, y) = (ring[turn.at_x], ring[turn.at_x + turn.to_y]);
        let at = new.iter().position(|q| q.contains(&x) && q.contains(&y))?;
        Some(((ids[at], x, y), turn.crosses))
    }

    /// The tetrahedra on one side after the turn, and the vertex added for them.
    fn half(&mut self, turn: &Turn, above: bool, may_crowd: bool) -> Option<Half> {
        let n = turn.around.ring.len();
        let (from, len) = match above {
            true => (turn.at_x, turn.to_y),
            false => (turn.at_x + turn.to_y, n - turn.to_y),
        };
        let ring: Vec<u32> = (0..=len)
            .map(|k| turn.around.ring[(from + k) % n])
            .collect();
        let mut best: Option<(f64, Vec<[u32; 4]>)> = None;
        for &p in &ring[1..len] {
            let quads = joined(&ring, turn.c, turn.d, p);
            let least = self.least_volume(&quads);
            if least > best.as_ref().map_or(0.0, |b| b.0) {
                best = Some((least, quads));
            }
        }
        if let Some((_, quads)) = best {
            return Some((quads, None));
        }
        self.join_to_new(&ring, turn.c, turn.d, may_crowd)
    }

    /// The ring and the new triangles joined to a new vertex near the crossing.
    fn join_to_new(&mut self, ring: &[u32], c: u32, d: u32, may_crowd: bool) -> Option<Half> {
        let (x, y) = (ring[0], ring[ring.len() - 1]);
        let [pc, pd, px, py] = [c, d, x, y].map(|v| self.s.position(v));
        let origin = crossing([pc, pd], [px, py]);
        let mut reach = 0.0f64;
        let mut planes: Vec<HalfSpace> = Vec::new();
        let mut plane = |s: &mut PagedSpace<'_, P>, corners: [u32; 3]| {
            let corners = corners.map(|v| s.position(v) - origin);
            reach = corners.iter().map(|c| c.length()).fold(reach, f64::max);
            planes.extend(half_space(corners));
        };
        for pair in ring.windows(2) {
            plane(self.s, [d, pair[0], pair[1]]);
            plane(self.s, [c, pair[1], pair[0]]);
        }
        plane(self.s, [y, c, x]);
        plane(self.s, [d, y, x]);
        // Where all is seen best, or straight up from the crossing where that is too near for doubles to find.
        let up = (py - px).cross(pd - pc).normalize_or_zero() * reach;
        let up = if orient(pc, py, px, origin + up) > 0.0 {
            up
        } else {
            -up
        };
        let best = center(&planes, reach);
        let is_roomy = best.is_some_and(|way| room(&planes, way) > ROOM_MIN * reach);
        if !is_roomy && !may_crowd {
            return None;
        }
        let p = self.s.add_steiner(origin);
        let quads = joined(ring, c, d, p);
        for way in best.into_iter().chain([up]) {
            for k in 0..HALVES_MAX {
                self.s.0.set_point(p, origin + way * 0.5f64.powi(k));
                if self.least_volume(&quads) > 0.0 {
                    return Some((quads, Some(p)));
                }
            }
        }
        self.s.drop_steiner(p);
        None
    }

    /// The least volume, 0 when one is not positive.
    fn least_volume(&mut self, quads: &[[u32; 4]]) -> f64 {
        let mut least = f64::INFINITY;
        for &q in quads {
            let volume = self.s.orient(q);
            if volume <= 0.0 {
                return 0.0;
            }
            least = least.min(volume);
        }
        least
    }
}

/// The faces of the tetrahedra `c d ring[i] ring[i + 1]` that lack `c` or `d`, and the two triangles at the edge from the first to the last
/// of the ring, joined to `p`.
fn joined(ring: &[u32], c: u32, d: u32, p: u32) -> Vec<[u32; 4]> {
    let (x, y) = (ring[0], ring[ring.len() - 1]);
    let mut quads = vec![[c, y, x, p], [y, d, x, p]];
    for pair in ring.windows(2).filter(|pair| !pair.contains(&p)) {
        quads.push([p, d, pair[0], pair[1]]);
        quads.push([c, p, pair[0], pair[1]]);
    }
    quads
}

/// Where the line through two points passes the line through two others, nearly.
fn crossing([c, d]: [Point; 2], [x, y]: [Point; 2]) -> Point {
    let normal = (d - c).cross(y - x);
    let across = normal.cross(y - x);
    let share = across.dot(x - c) / across.dot(d - c);
    c + (d - c) * share.clamp(0.0, 1.0)
}
