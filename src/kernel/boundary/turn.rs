//! Turns edges of a flat part of the surface in its plane.
//!
//! ```text
//!        c                 c        The Delaunay mesh triangulates a flat part of the surface in its own way. It becomes the
//!      / | \             /   \      surface's way by turning one edge after the other: c d becomes x y where c x d y is convex.
//!     x  |  y    ->     x-----y     In space the tetrahedra above c d all have it as their edge, so that a point a little above
//!      \ | /             \   /      the crossing sees all their other faces, and both new triangles. A vertex of the ring may do
//!        d                 d        as well; where none does, one is put there. The same below.
//! ```
//! A segment in the plane is recovered by turning each edge it crosses; edges that cannot turn yet are tried again
//! later. New vertices crowd the plane. Where they leave too little clearance, the tetrahedra above the edge grow to a
//! cavity that swallows earlier ones.
//!
//! Source: S. W. Sloan, "A fast algorithm for generating constrained Delaunay triangulations", Computers & Structures
//! 47 (1993), for the plane. The vertices above and below are not from it.

use std::collections::VecDeque;

use super::complex::{PagedComplex, TetComplex, edge_key};
use super::free_vertex::remove_free;
use super::grow::grow;
use super::inscribed_ball::{HalfSpace, ball_center, clearance};
use super::map::MissingFacets;
use super::report::RecoveryReport;
use super::suppress::half_space;
use super::tidy::gain_clearance;
use super::walk::{EdgeRing, Exit, crossings, edge_at, shell};
use crate::mesh::Mesh;
use tetdb_base::geom::{IdMap, IdSet, Point, orient};
use tetdb_base::storage::Pages;

/// A segment that crosses more edges is left to others.
const CROSSINGS_MAX: usize = 2000;

/// Turns a segment may take for each edge it crosses: in the mean it takes one or two.
const TURNS_MAX: usize = 20;

/// Times a place half as far from the crossing is tried.
const HALVES_MAX: i32 = 50;

/// Times a place half as far from the crossing is tried for a cavity that grows.
const GROWN_MAX: i32 = 24;

/// A place with less clearance than this, in units of the tetrahedra around it, is second choice.
const CLEARANCE_MIN: f64 = 1e-4;

/// The segments, each from the end where more of them meet.
///
/// Turned from that end, edges that cross one segment become edges of the end and are out of the way of all other
/// segments. In a fan each edge is turned once or twice; starting from its outline, a hundred times.
pub(super) fn from_hubs(segments: &[(u32, u32)]) -> Vec<(u32, u32)> {
    let mut meeting: IdMap<u32, u32> = IdMap::default();
    for v in segments.iter().flat_map(|&(a, b)| [a, b]) {
        *meeting.entry(v).or_default() += 1;
    }
    let from_hub = |&(a, b): &(u32, u32)| match meeting[&a] < meeting[&b] {
        true => (b, a),
        false => (a, b),
    };
    segments.iter().map(from_hub).collect()
}

/// Turns edges until the segment `a b` is there, and protects it; removes unneeded added vertices again.
///
/// `false` when it does not run within one plane, or an edge cannot turn.
pub(super) fn turn_segment<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    report: &mut RecoveryReport,
    a: u32,
    b: u32,
) -> bool {
    let mut s = PagedComplex(mesh, &missing.protected);
    let mut turner = Turner { s: &mut s, added: Vec::new(), balance: 0, turns: 0 };
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
    s: &'s mut PagedComplex<'m, P>,
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

/// One side of the plane at an edge that turns.
struct PlaneSide {
    /// From one new corner to the other.
    ring: Vec<u32>,
    tets: Vec<u32>,
    /// Tetrahedra of the other side, which are not to be taken.
    others: IdSet<u32>,
}

/// The changes on one side of the plane.
struct Half {
    old: Vec<u32>,
    new: Vec<[u32; 4]>,
    /// The vertex added, and those no tetrahedron has any more.
    added: Option<u32>,
    lost: Vec<u32>,
}

/// Means of a turn to find a place for a new vertex.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Reach {
    /// At a place with enough clearance.
    Roomy,
    /// In a cavity that grows until it is seen, and swallows added vertices.
    Grown,
    /// As near to the plane as it takes.
    Crowded,
}

/// An edge `c d` with its tetrahedra, as it turns to `x y`.
struct EdgeTurn {
    around: EdgeRing,
    c: u32,
    d: u32,
    /// Place of `x` in the ring.
    at_x: usize,
    /// Place of `y` in the ring, counted from `x`.
    to_y: usize,
    /// True if the segment crosses `x y` as well.
    crosses: bool,
}

impl EdgeTurn {
    /// The sides above and below the plane.
    fn sides(&self) -> [PlaneSide; 2] {
        let n = self.around.ring.len();
        let from_to = [(self.at_x, self.to_y), (self.at_x + self.to_y, n - self.to_y)];
        let tets = from_to.map(|(from, len)| -> Vec<u32> {
            (0..len).map(|k| self.around.tets[(from + k) % n]).collect()
        });
        [0, 1].map(|i| PlaneSide {
            ring: (0..=from_to[i].1).map(|k| self.around.ring[(from_to[i].0 + k) % n]).collect(),
            tets: tets[i].clone(),
            others: tets[1 - i].iter().copied().collect(),
        })
    }
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
        let mut n_failed = 0;
        while let Some(edge) = queue.pop_front() {
            if turns_left == 0 {
                return false;
            }
            let Some((new, crosses)) = self.turn(edge, a, b) else {
                n_failed += 1;
                queue.push_back(edge);
                if n_failed == queue.len() {
                    return false;
                }
                continue;
            };
            turns_left -= 1;
            n_failed = 0;
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
    /// The more added vertices there are, the nearer they lie to the plane. Where they leave little clearance, one new
    /// vertex replaces them, or the vertices around the edge are removed or raised first.
    fn turn(&mut self, edge: Crossed, a: u32, b: u32) -> Option<Turned> {
        let turn = self.plan(edge, a, b)?;
        if let Some(turned) = self.carry_out(&turn, Reach::Roomy) {
            return Some(turned);
        }
        let mut free = turn.around.ring;
        free.retain(|&v| self.s.is_steiner(v));
        for v in free {
            if !self.remove(v) {
                gain_clearance(self.s, v);
            }
        }
        let turn = self.plan(edge, a, b)?;
        self.carry_out(&turn, Reach::Grown).or_else(|| self.carry_out(&turn, Reach::Crowded))
    }

    /// Takes away a vertex that nothing needs.
    fn remove(&mut self, v: u32) -> bool {
        let removed = remove_free(self.s, v, 0.0);
        if removed {
            self.forget(v);
        }
        removed
    }

    /// Gives back an added vertex that no tetrahedron has any more.
    fn forget(&mut self, v: u32) {
        self.s.drop_steiner(v);
        self.balance -= 1;
        self.added.retain(|&a| a != v);
    }

    /// The new edge of `c d`; `None` if the edge is fixed, or the four corners are not convex.
    fn plan(&mut self, (t, c, d): Crossed, a: u32, b: u32) -> Option<EdgeTurn> {
        if self.s.protects(c, d) {
            return None;
        }
        let t = edge_at(self.s, t, c, d)?;
        let around = shell(self.s, t, c, d)?;
        if around.required {
            return None;
        }
        let n = around.ring.len();
        let in_plane: Vec<usize> =
            (0..n).filter(|&i| self.s.orient([a, b, c, around.ring[i]]) == 0.0).collect();
        let &[at_x, at_y] = in_plane.as_slice() else {
            return None;
        };
        let (x, y) = (around.ring[at_x], around.ring[at_y]);
        // No tetrahedron is flat: the next of the ring is off the plane.
        let above = around.ring[(at_x + 1) % n];
        let opposite = |s: &mut PagedComplex<'_, P>, [p, q]: [u32; 2], [u, v]: [u32; 2]| {
            let (at_u, at_v) = (s.orient([p, q, u, above]), s.orient([p, q, v, above]));
            (at_u > 0.0 && at_v < 0.0) || (at_u < 0.0 && at_v > 0.0)
        };
        if !opposite(self.s, [x, y], [c, d]) {
            return None;
        }
        let crosses = opposite(self.s, [a, b], [x, y]);
        Some(EdgeTurn { around, c, d, at_x, to_y: at_y - at_x, crosses })
    }

    /// Replaces the tetrahedra around the edge; `None`, with nothing changed, if there is no clearance.
    fn carry_out(&mut self, turn: &EdgeTurn, reach: Reach) -> Option<Turned> {
        let [above, mut below] = turn.sides();
        let over = self.half(turn, &above, reach)?;
        below.others.extend(&over.old);
        let Some(under) = self.half(turn, &below, reach) else {
            if let Some(p) = over.added {
                self.s.drop_steiner(p);
            }
            return None;
        };
        let old = [over.old, under.old].concat();
        let new = [over.new, under.new].concat();
        let ids = self.s.replace(&old, &new);
        self.turns += 1;
        for p in over.added.into_iter().chain(under.added) {
            self.added.push(p);
            self.balance += 1;
        }
        for v in over.lost.into_iter().chain(under.lost) {
            self.forget(v);
        }
        let (x, y) = (above.ring[0], below.ring[0]);
        let at = new.iter().position(|q| q.contains(&x) && q.contains(&y))?;
        Some(((ids[at], x, y), turn.crosses))
    }

    /// The changes on one side.
    fn half(&mut self, turn: &EdgeTurn, side: &PlaneSide, reach: Reach) -> Option<Half> {
        let ring = &side.ring;
        let mut best: Option<(f64, Vec<[u32; 4]>)> = None;
        for &p in &ring[1..ring.len() - 1] {
            let quads = joined(ring, turn.c, turn.d, p);
            let least = self.least_volume(&quads);
            if least > best.as_ref().map_or(0.0, |b| b.0) {
                best = Some((least, quads));
            }
        }
        let Some((_, new)) = best else {
            return self.join_to_new(turn, side, reach);
        };
        Some(Half { old: side.tets.clone(), new, added: None, lost: Vec::new() })
    }

    /// The ring and the new triangles joined to a new vertex near the crossing.
    fn join_to_new(&mut self, turn: &EdgeTurn, side: &PlaneSide, reach: Reach) -> Option<Half> {
        let (ring, c, d) = (&side.ring, turn.c, turn.d);
        let (x, y) = (ring[0], ring[ring.len() - 1]);
        let [pc, pd, px, py] = [c, d, x, y].map(|v| self.s.position(v));
        let origin = crossing([pc, pd], [px, py]);
        let mut size = 0.0f64;
        let mut planes: Vec<HalfSpace> = Vec::new();
        let mut plane = |s: &mut PagedComplex<'_, P>, corners: [u32; 3]| {
            let corners = corners.map(|v| s.position(v) - origin);
            size = corners.iter().map(|c| c.length()).fold(size, f64::max);
            planes.extend(half_space(corners));
        };
        for pair in ring.windows(2) {
            plane(self.s, [d, pair[0], pair[1]]);
            plane(self.s, [c, pair[1], pair[0]]);
        }
        plane(self.s, [y, c, x]);
        plane(self.s, [d, y, x]);
        // The place of largest clearance, or straight up from the crossing if that is too near for doubles.
        let up = (py - px).cross(pd - pc).normalize_or_zero() * size;
        let up = if orient(pc, py, px, origin + up) > 0.0 { up } else { -up };
        let best = ball_center(&planes, size);
        let is_roomy = best.is_some_and(|way| clearance(&planes, way) > CLEARANCE_MIN * size);
        let p = self.s.add_steiner(origin);
        let mut found = None;
        if is_roomy || reach == Reach::Crowded {
            let quads = joined(ring, c, d, p);
            let mut places = (best.into_iter().chain([up]))
                .flat_map(|way| (0..HALVES_MAX).map(move |k| origin + way * 0.5f64.powi(k)));
            let is_seen = |place: Point| {
                self.s.0.set_point(p, place);
                self.least_volume(&quads) > 0.0
            };
            found = places.any(is_seen).then(|| Half {
                old: side.tets.clone(),
                new: quads,
                added: Some(p),
                lost: Vec::new(),
            });
        }
        if found.is_none() && reach == Reach::Grown {
            let nearest = [pc, pd, px, py].map(|q| q.distance(origin));
            let nearest = nearest.into_iter().fold(size, f64::min);
            found = self.join_grown(turn, side, p, [origin, up * (nearest / size)]);
        }
        if found.is_none() {
            self.s.drop_steiner(p);
        }
        found
    }

    /// A cavity around the edge joined to `p`, which comes from `origin + up` nearer and nearer to `origin` until it sees all; added
    /// vertices inside it go.
    fn join_grown(
        &mut self,
        turn: &EdgeTurn,
        side: &PlaneSide,
        p: u32,
        [origin, up]: [Point; 2],
    ) -> Option<Half> {
        let (ring, c, d) = (&side.ring, turn.c, turn.d);
        let (x, y) = (ring[0], ring[ring.len() - 1]);
        for k in 0..GROWN_MAX {
            self.s.0.set_point(p, origin + up * 0.5f64.powi(k));
            let walls = [[c, y, x, p], [y, d, x, p]];
            if walls.iter().any(|&q| self.s.orient(q) <= 0.0) {
                continue;
            }
            let Ok(grown) = grow(self.s, &side.tets, p, None, &[], &side.others) else {
                continue;
            };
            // Around the outline of a flat part the cavity could reach its other side.
            let is_beside = |&t: &u32| {
                let corners = self.s.tet(t).vertices();
                corners.iter().all(|&v| self.s.orient([c, y, x, v]) >= 0.0)
            };
            if !grown.cavity.iter().all(is_beside)
                || !grown.lost.iter().all(|&v| self.s.is_steiner(v))
            {
                continue;
            }
            let mut new = grown.quads;
            // The two triangles that turn: no other outer face has the edge.
            new.retain(|q| !(q.contains(&c) && q.contains(&d)));
            new.extend(walls);
            return Some(Half { old: grown.cavity, new, added: Some(p), lost: grown.lost });
        }
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

/// Nearest point of the line through two points to the line through two others, nearly.
fn crossing([c, d]: [Point; 2], [x, y]: [Point; 2]) -> Point {
    let normal = (d - c).cross(y - x);
    let across = normal.cross(y - x);
    let share = across.dot(x - c) / across.dot(d - c);
    c + (d - c) * share.clamp(0.0, 1.0)
}
